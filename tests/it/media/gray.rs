//! Gray films of more than 8 bits: the used range is stretched to black and white, and a note reports it.

use flockreel::footage::FrameSource;
use flockreel::media::{Limits, Note, Video};

use super::read_all;
use crate::common::film::Films;

/// Opens a film of a ramp of 64 levels from left to right. `lum` is its 16-bit value as an ffmpeg
/// expression of X, `args` are the encoder and the file name.
fn ramp(films: &Films, lum: &str, args: &str) -> Video {
    let film = films.run(&format!(
        "-f lavfi -i color=black:s=64x64:rate=25,format=gray16le,geq=lum='{lum}' -frames:v 5 {args}"
    ));
    Video::open(&film, &Limits::default()).expect("a good film")
}

#[test]
fn what_is_used_of_the_range_becomes_black_to_white() {
    let films = Films::new();
    for (lum, args, wanted) in [
        ("X*64", "-c:v ffv1 twelve-in-sixteen.mkv", [0, 4032, 65_535]),
        ("X*4+1000", "-c:v ffv1 narrow.avi", [1000, 1252, 65_535]),
        (
            "X*64",
            "-c:v png -pix_fmt gray16be pictures.mov",
            [0, 4032, 65_535],
        ),
        (
            "X*1024",
            "-c:v ffv1 -pix_fmt gray10le ten.mkv",
            [0, 1008, 1023],
        ),
        (
            "X*512",
            "-c:v ffv1 -pix_fmt gray12le twelve.mkv",
            [0, 2016, 4095],
        ),
    ] {
        let video = ramp(&films, lum, args);
        let [Note::GrayStretched { from, to, most }] = video.notes() else {
            panic!("{args}: {:?}", video.notes());
        };
        let told = [*from, *to, *most].map(i32::from);
        let off = told
            .iter()
            .zip(wanted)
            .map(|(told, wanted)| (told - wanted).abs());
        assert!(off.max() <= Some(4), "{args}: {told:?}");
        let frames = read_all(&video).expect("frames");
        assert_eq!(
            (frames.len(), video.format().n_frames_hint),
            (5, 5),
            "{args}"
        );
        let row = &frames[2].1.luma()[64 * 20..64 * 21];
        for (x, &luma) in row.iter().enumerate() {
            let wanted = 255.0 * x as f64 / 63.0;
            let off = (f64::from(luma) - wanted).abs();
            // At least 256 levels are mapped to the whole range, so the narrow ramp keeps its step.
            let is_narrow = args.contains("narrow");
            assert!(
                off < if is_narrow { 6.0 } else { 2.5 },
                "{args} {x}: {luma}"
            );
        }
    }
}

#[test]
fn eight_bits_of_gray_stay_as_they_are() {
    let films = Films::new();
    let video = ramp(&films, "X*256", "-c:v ffv1 -pix_fmt gray eight.mkv");
    assert_eq!(video.notes(), []);
    let frames = read_all(&video).expect("frames");
    assert!((39..=41).contains(&frames[0].1.luma()[40]));
}
