//! Pictures and films are shown as their files say: turned, mirrored, cropped, with the range and the weights of their
//! colors.

use flockreel::media::{Limits, Notice};
use flockreel_core::code::Code;
use flockreel_core::footage::FrameSource;
use image::codecs::{jpeg::JpegEncoder, png::PngEncoder, webp::WebPEncoder};
use image::{DynamicImage, ExtendedColorType, ImageEncoder};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

use super::{open, read_all, read_whole};
use crate::common::film::Films;
use crate::common::pictures::{SIZE, gray, zip_of};

/// Returns the stored place that is shown at `x`, `y`, by the definition of EXIF's Orientation.
fn stored_place(orientation: u8, x: u32, y: u32, [w, h]: [u32; 2]) -> (u32, u32) {
    match orientation {
        1 => (x, y),
        2 => (w - 1 - x, y),
        3 => (w - 1 - x, h - 1 - y),
        4 => (x, h - 1 - y),
        5 => (y, x),
        6 => (y, h - 1 - x),
        7 => (w - 1 - y, h - 1 - x),
        _ => (w - 1 - y, x),
    }
}

/// Asserts that `shown` has the levels of `stored` at their places, within `tolerance`.
fn assert_turned(
    orientation: u8,
    size: [u32; 2],
    stored: &[u8],
    shown: &flockreel_core::raster::Frame,
    tolerance: u8,
) {
    let [width, height] = size;
    let shown_size = if orientation > 4 {
        [height, width]
    } else {
        size
    };
    assert_eq!([shown.width, shown.height], shown_size, "{orientation}");
    for (at, &level) in (0..).zip(shown.luma()) {
        let (x, y) = stored_place(orientation, at % shown.width, at / shown.width, size);
        let gap = stored[(y * width + x) as usize].abs_diff(level);
        assert!(gap <= tolerance, "{orientation}: {gap} at {x},{y}");
    }
}

/// Returns EXIF data with an orientation.
fn exif(orientation: u8) -> Vec<u8> {
    let entry = [0x12, 1, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0];
    [b"II*\0\x08\0\0\0\x01\0".as_slice(), &entry, &[0; 4]].concat()
}

fn encoded(ending: &str, orientation: u8) -> Vec<u8> {
    let image = gray(0);
    let mut bytes = std::io::Cursor::new(Vec::new());
    match ending {
        "jpg" => write(JpegEncoder::new_with_quality(&mut bytes, 100), orientation),
        "png" => write(PngEncoder::new(&mut bytes), orientation),
        "webp" => write(WebPEncoder::new_lossless(&mut bytes), orientation),
        _ => {
            let mut tiff = TiffEncoder::new(&mut bytes).expect("in memory");
            let page = tiff.new_image::<colortype::Gray8>(SIZE[0], SIZE[1]);
            let mut page = page.expect("a page");
            let written = page
                .encoder()
                .write_tag(Tag::Orientation, u16::from(orientation));
            written.expect("a tag");
            page.write_data(image.as_raw()).expect("in memory");
        }
    }
    bytes.into_inner()
}

fn write(mut encoder: impl ImageEncoder, orientation: u8) {
    encoder
        .set_exif_metadata(exif(orientation))
        .expect("a format with EXIF");
    let rgb = DynamicImage::from(gray(0)).into_rgb8();
    let written = encoder.write_image(&rgb, SIZE[0], SIZE[1], ExtendedColorType::Rgb8);
    written.expect("in memory");
}

#[test]
fn pictures_are_turned_as_their_exif_data_say() {
    let films = Films::new();
    for (ending, tolerance) in [("jpg", 3), ("png", 0), ("webp", 0), ("tif", 0)] {
        for orientation in 1..=8 {
            let picture = encoded(ending, orientation);
            let files = [0, 1].map(|k| (format!("{k}.{ending}"), picture.clone()));
            let zip = films.write("shots.zip", zip_of(&files));
            let frames = read_whole(&zip, &Limits::default()).expect("good pictures");
            assert_turned(orientation, SIZE, gray(0).as_raw(), &frames[1].1, tolerance);
        }
    }
}

#[test]
fn background_is_turned_like_the_pictures() {
    let bytes = encoded("jpg", 6);
    let image = flockreel::media::decode_image(&bytes, &Limits::default()).expect("a JPEG");
    assert_eq!([image.width, image.height], [SIZE[1], SIZE[0]]);
}

#[test]
fn pictures_turned_to_differing_sizes_are_refused() {
    let films = Films::new();
    let files = [(1, 1), (2, 3), (3, 6)]
        .map(|(k, orientation)| (format!("{k}.jpg"), encoded("jpg", orientation)));
    let zip = films.write("shots.zip", zip_of(&files));
    let refusal = read_all(&open(&zip)).expect_err("pictures of two sizes");
    assert_eq!(refusal.code, Code::NotAVideo);
    let sentence = refusal.cause.to_string();
    assert!(
        sentence.contains("picture 3 is shown with 48x64 pixels, the first with 64x48"),
        "{sentence}"
    );
}

/// Returns the luma of all frames.
fn luma_of(film: &std::path::Path) -> Vec<u8> {
    let frames = read_whole(film, &Limits::default()).expect("a good film");
    frames
        .iter()
        .flat_map(|(_, frame)| frame.luma().to_vec())
        .collect()
}

#[test]
fn films_are_turned_and_mirrored_as_their_display_matrix_says() {
    let films = Films::new();
    let upright = films.test_picture("96x64", 3, "-c:v libx264 -pix_fmt yuv420p upright.mp4");
    let bytes = std::fs::read(&upright).expect("the film");
    let header = bytes
        .windows(4)
        .position(|name| name == b"tkhd")
        .expect("a track");
    let stored = read_whole(&upright, &Limits::default()).expect("a good film");
    // a, b, c, d of the matrix (ISO/IEC 14496-12, 6.2.2), in the order of EXIF's orientations.
    let matrices = [
        [1, 0, 0, 1],
        [-1, 0, 0, 1],
        [-1, 0, 0, -1],
        [1, 0, 0, -1],
        [0, 1, 1, 0],
        [0, 1, -1, 0],
        [0, -1, -1, 0],
        [0, -1, 1, 0],
    ];
    for (orientation, [a, b, c, d]) in (1..).zip(matrices) {
        let mut turned = bytes.clone();
        for (place, cell) in [(0, a), (1, b), (3, c), (4, d)] {
            let at = header + 44 + 4 * place;
            turned[at..at + 4].copy_from_slice(&(cell * 65536_i32).to_be_bytes());
        }
        let film = films.write("turned.mp4", turned);
        let frames = read_whole(&film, &Limits::default()).expect("a good film");
        assert_turned(orientation, [96, 64], stored[2].1.luma(), &frames[2].1, 0);
        // ffmpeg itself turns films, too.
        let reference = films.reference(&film, "-vf extractplanes=y -pix_fmt gray");
        assert!(
            luma_of(&film) == reference,
            "{orientation}: ffmpeg turns otherwise"
        );
    }
}

#[test]
fn turned_film_with_wide_pixels_is_stretched_along_its_stored_rows() {
    let films = Films::new();
    films.test_picture(
        "120x96",
        3,
        "-vf setsar=4/3 -c:v libx264 -pix_fmt yuv420p wide.mp4",
    );
    let turned = films.run("-i wide.mp4 -c copy -metadata:s:v rotate=90 turned.mp4");
    let format = open(&turned).format();
    assert_eq!((format.width, format.height), (96, 160));
    // Matroska stores the shown size instead.
    let shown = films.run("-i wide.mp4 -c copy shown.mkv");
    let format = open(&shown).format();
    assert_eq!((format.width, format.height), (160, 96));
}

#[test]
fn crop_of_the_codec_is_obeyed() {
    let films = Films::new();
    films.test_picture("96x64", 3, "-c:v libx264 -pix_fmt yuv420p whole.mp4");
    let crop = "crop_left=16:crop_right=8:crop_top=4:crop_bottom=2";
    let film = films.run(&format!(
        "-i whole.mp4 -c copy -bsf:v h264_metadata={crop} cropped.mp4"
    ));
    let format = open(&film).format();
    assert_eq!((format.width, format.height), (72, 58));
    let whole = std::path::Path::new("whole.mp4");
    let reference = films.reference(whole, "-vf crop=72:58:16:4,extractplanes=y -pix_fmt gray");
    assert!(luma_of(&film) == reference);
}

#[test]
fn colors_of_every_range_and_matrix_are_those_of_the_source() {
    let films = Films::new();
    let red = "-f lavfi -i color=0xC04020:size=64x48 -frames:v 3";
    for (tags, scaled) in [
        (
            "-color_range tv -colorspace smpte170m",
            "out_range=tv:out_color_matrix=bt601",
        ),
        (
            "-color_range pc -colorspace smpte170m",
            "out_range=pc:out_color_matrix=bt601",
        ),
        (
            "-color_range tv -colorspace bt709",
            "out_range=tv:out_color_matrix=bt709",
        ),
        (
            "-color_range pc -colorspace bt709",
            "out_range=pc:out_color_matrix=bt709",
        ),
        (
            "-color_range tv -colorspace bt2020nc",
            "out_range=tv:out_color_matrix=bt2020",
        ),
        (
            "-color_range tv -colorspace smpte240m",
            "out_range=tv:out_color_matrix=smpte240m",
        ),
        (
            "-color_range tv -colorspace fcc",
            "out_range=tv:out_color_matrix=fcc",
        ),
    ] {
        for ending in ["mp4", "mkv"] {
            let film = films.run(&format!(
                "{red} -vf scale={scaled},format=yuv444p -c:v libx264 -qp 4 {tags} film.{ending}"
            ));
            let frames = read_whole(&film, &Limits::default()).expect("a good film");
            let found = frames[1].1.to_rgb().pixel(30, 20);
            let gaps = [0, 1, 2].map(|k| found[k].abs_diff([0xc0, 0x40, 0x20][k]));
            assert!(
                gaps.iter().all(|&gap| gap <= 4),
                "{tags} {ending}: {found:?}"
            );
        }
    }
}

#[test]
fn hdr_films_are_measured_with_a_notice_whose_command_works() {
    let films = Films::new();
    for (transfer, name) in [("smpte2084", "PQ"), ("arib-std-b67", "HLG")] {
        let film = films.test_picture(
            "64x48",
            5,
            &format!(
                "-pix_fmt yuv420p10le -c:v libx264 -colorspace bt2020nc -color_primaries bt2020 \
                      -color_trc {transfer} hdr.mp4"
            ),
        );
        let notices = open(&film).notices().to_vec();
        assert_eq!(notices, [Notice::HighDynamicRange { transfer: name }]);
        let sentence = notices[0].to_string();
        let command = sentence.split('`').nth(1).expect("a command");
        let args = command
            .trim_start_matches("ffmpeg ")
            .replace("-i film ", "-i hdr.mp4 ");
        let made = films.run(&args);
        assert_eq!(open(&made).notices(), []);
        assert_eq!(read_all(&open(&made)).expect("frames").len(), 5);
    }
}
