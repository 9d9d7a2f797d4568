//! Gray films of more than 8 bits: the used range is stretched to black and white, and a notice reports it.

use flockreel::media::{Limits, Notice, Video};
use flockreel_core::footage::FrameSource;

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
fn used_gray_range_is_stretched() {
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
        let [Notice::GrayStretched { black, white, max }] = video.notices() else {
            panic!("{args}: {:?}", video.notices());
        };
        let levels = [*black, *white, *max].map(i32::from);
        let off = levels
            .iter()
            .zip(wanted)
            .map(|(level, wanted)| (level - wanted).abs());
        assert!(off.max() <= Some(4), "{args}: {levels:?}");
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
fn eight_bit_gray_is_unchanged() {
    let films = Films::new();
    let video = ramp(&films, "X*256", "-c:v ffv1 -pix_fmt gray eight.mkv");
    assert_eq!(video.notices(), []);
    let frames = read_all(&video).expect("frames");
    assert!((39..=41).contains(&frames[0].1.luma()[40]));
}
