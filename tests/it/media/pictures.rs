//! Pictures as footage, in folders, zips and TIFF files: complete, in order, or refused with a reason.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use flockreel::media::{Limits, Notice, ReadOptions, Video};
use flockreel_core::code::Code;
use flockreel_core::footage::{FrameSource, spread_idx};
use image::{GrayImage, ImageFormat};
use tiff::encoder::colortype;

use super::{read_all, read_whole};
use crate::common::film::Films;
use crate::common::pictures::{SIZE, encoded, gray, stack, stack_of_grays, zip_of, zip_of_grays};

fn open(path: &Path, fps: Option<f64>) -> Video {
    let options = ReadOptions {
        fps,
        ..ReadOptions::default()
    };
    Video::open_with(path, &Limits::default(), &options)
        .unwrap_or_else(|error| panic!("{path:?}: {error}"))
}

fn folder_of(films: &Films, name: &str, files: &[(String, Vec<u8>)]) -> PathBuf {
    std::fs::create_dir(films.path(name)).expect("a folder");
    for (file, bytes) in files {
        films.write(&format!("{name}/{file}"), bytes);
    }
    films.path(name)
}

/// Returns twelve numbered pictures of one format, and two other files to be ignored.
fn files(format: ImageFormat, ending: &str) -> Vec<(String, Vec<u8>)> {
    let picture = |k: usize| (format!("{k}.{ending}"), encoded(&gray(k), format));
    let mut files: Vec<_> = (0..12).rev().map(picture).collect();
    for other in ["notes.txt", ".0.png"] {
        files.push((other.to_owned(), b"no picture".to_vec()));
    }
    files
}

#[test]
fn folders_zips_and_stacks_are_read_in_numeric_order() {
    let films = Films::new();
    let pngs = files(ImageFormat::Png, "png");
    let tiffs = (0..12).map(|k| {
        let page = stack::<colortype::Gray8>(1, |_| gray(k).into_raw());
        (format!("{k}.TIF"), page)
    });
    for path in [
        folder_of(&films, "shots", &pngs),
        folder_of(&films, "bitmaps", &files(ImageFormat::Bmp, "bmp")),
        folder_of(&films, "tiffs", &tiffs.collect::<Vec<_>>()),
        films.write("shots.zip", zip_of(&pngs)),
        films.write("video", zip_of_grays(12)),
        films.write("stack.tif", stack_of_grays(12)),
    ] {
        let video = open(&path, Some(50.0));
        let format = video.format();
        assert_eq!((format.fps, format.n_frames_hint), (50.0, 12), "{path:?}");
        assert_eq!(video.notices(), [], "{path:?}");
        let frames = read_all(&video).expect("frames");
        assert_eq!(frames.len(), 12, "{path:?}");
        for (k, (time_s, frame)) in frames.iter().enumerate() {
            assert!((time_s - k as f64 / 50.0).abs() < 1e-9);
            assert_eq!(frame.luma(), gray(k).as_raw(), "{path:?}: {k}");
            let (u, v) = frame.chroma();
            assert!(u.iter().chain(v).all(|&chroma| chroma == 128));
        }
        let mut spread = Vec::new();
        let mut visit = |frame: &flockreel_core::raster::Frame| {
            spread.push(frame.clone());
            ControlFlow::Continue(())
        };
        video.spread(5, &mut visit).expect("frames");
        let wanted = spread_idx(12, 5).into_iter().map(|k| frames[k].1.clone());
        assert!(spread == wanted.collect::<Vec<_>>(), "{path:?}");
    }
}

#[test]
fn pictures_have_an_assumed_rate_of_30_and_keep_colors() {
    let films = Films::new();
    std::fs::create_dir(films.path("shots")).expect("a folder");
    films.test_picture("64x48", 4, "-pix_fmt rgb24 shots/%03d.png");
    films.run("-i shots/001.png -pix_fmt rgb24 -f rawvideo first.rgb");
    let video = open(&films.path("shots"), None);
    assert_eq!(video.notices(), [Notice::RateAssumed { fps: 30.0 }]);
    let frames = read_all(&video).expect("frames");
    let wanted = std::fs::read(films.path("first.rgb")).expect("pixels");
    let luma =
        |p: &[u8]| 0.299 * f64::from(p[0]) + 0.587 * f64::from(p[1]) + 0.114 * f64::from(p[2]);
    for (at, pixel) in wanted.chunks_exact(3).enumerate() {
        let found = f64::from(frames[0].1.luma()[at]);
        assert!((found - luma(pixel)).abs() < 1.5, "{at}: {found}");
    }
    let pixels = stack::<colortype::RGB8>(2, |_| wanted.clone());
    let of_stack = read_whole(&films.write("colors.tif", pixels), &Limits::default());
    assert!(of_stack.expect("a good stack")[1].1 == frames[0].1);
}

#[test]
fn sixteen_bit_gray_is_stretched_and_pixels_become_square() {
    let films = Films::new();
    let page =
        |k: usize| (0..SIZE[0] * SIZE[1]).map(move |at| 1000 + 40 * (at % 64) as u16 + k as u16);
    let path = films.write(
        "deep.tif",
        stack::<colortype::Gray16>(3, |k| page(k).collect()),
    );
    let options = ReadOptions {
        fps: Some(10.0),
        pixel_aspect: Some(2.0),
        ..ReadOptions::default()
    };
    let video = open(&path, Some(10.0));
    let [
        Notice::GrayStretched {
            black,
            white,
            max: 65_535,
        },
    ] = *video.notices()
    else {
        panic!("{:?}", video.notices());
    };
    assert!((black, white) == (1000, 3522), "{black} to {white}");
    let row = &read_all(&video).expect("frames")[0].1.planes[..64];
    for (x, &luma) in row.iter().enumerate() {
        assert!(
            (f64::from(luma) - x as f64 * 255.0 / 63.0).abs() < 1.5,
            "{x}: {luma}"
        );
    }
    let wide = Video::open_with(&path, &Limits::default(), &options).expect("a good stack");
    assert_eq!((wide.format().width, wide.format().height), (128, 48));
    assert_eq!(read_all(&wide).expect("frames").len(), 3);
}

#[test]
fn invalid_pictures_are_refused_with_the_reason() {
    let films = Films::new();
    let png = |image: &GrayImage| encoded(image, ImageFormat::Png);
    let named = |pictures: Vec<Vec<u8>>| -> Vec<(String, Vec<u8>)> {
        let names = (0..).map(|k| format!("{k}.png"));
        names.zip(pictures).collect()
    };
    let bomb = zip_of(&named(vec![vec![0; 80 << 20]; 2]));
    let whole = zip_of_grays(12);
    let stacked = stack_of_grays(12);
    let differing = zip_of(&named(vec![png(&gray(0)), png(&GrayImage::new(48, 64))]));
    let broken = zip_of(&named(vec![png(&gray(0)), png(&gray(1))[..60].to_vec()]));
    let large = zip_of(&named(vec![png(&GrayImage::new(9000, 20)); 2]));
    let floats = stack::<colortype::Gray32Float>(2, |_| vec![0.5; 64 * 48]);
    for (name, bytes, code) in [
        ("one.tif", stack_of_grays(1), Code::TooFewFrames),
        ("floats.tif", floats, Code::NotAVideo),
        (
            "cut.tif",
            stacked[..stacked.len() / 2].to_vec(),
            Code::NotAVideo,
        ),
        (
            "cut.zip",
            whole[..whole.len() / 2].to_vec(),
            Code::NotAVideo,
        ),
        (
            "empty.zip",
            zip_of(&[("a.txt".into(), vec![1])]),
            Code::NotAVideo,
        ),
        ("large.zip", large, Code::TooManyPixels),
        ("bomb.zip", bomb, Code::TooLong),
        ("differing.zip", differing, Code::NotAVideo),
        ("broken.zip", broken, Code::NotAVideo),
    ] {
        let path = films.write(name, bytes);
        assert_eq!(
            read_whole(&path, &Limits::default()).err(),
            Some(code),
            "{name}"
        );
    }
}

#[test]
fn too_many_pictures_and_empty_folders_are_refused() {
    let films = Films::new();
    let few = Limits {
        max_frames: 11,
        ..Limits::default()
    };
    for (name, bytes) in [
        ("many.zip", zip_of_grays(12)),
        ("many.tif", stack_of_grays(12)),
    ] {
        let path = films.write(name, bytes);
        assert_eq!(
            read_whole(&path, &few).err(),
            Some(Code::TooManyFrames),
            "{name}"
        );
    }
    std::fs::create_dir(films.path("empty")).expect("a folder");
    let refused = Video::open(&films.path("empty"), &Limits::default()).expect_err("no picture");
    assert_eq!(refused.code(), Code::NotAVideo);
    assert!(
        refused.to_string().contains("contains no pictures"),
        "{refused}"
    );
}

#[test]
fn tiff_with_circular_pages_is_refused() {
    let films = Films::new();
    let mut bytes = stack_of_grays(2);
    let first = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]) as usize;
    let n_tags = usize::from(u16::from_le_bytes([bytes[first], bytes[first + 1]]));
    let second_at = first + 2 + 12 * n_tags;
    let link = u32::from_le_bytes(bytes[second_at..second_at + 4].try_into().expect("four"));
    let n_tags = usize::from(u16::from_le_bytes([
        bytes[link as usize],
        bytes[link as usize + 1],
    ]));
    let end_at = link as usize + 2 + 12 * n_tags;
    bytes[end_at..end_at + 4].copy_from_slice(&(first as u32).to_le_bytes());
    let refused = read_whole(&films.write("circle.tif", bytes), &Limits::default());
    assert_eq!(refused.err(), Some(Code::NotAVideo));
}
