//! Animated GIF, PNG and WebP: complete, once, at their times, or refused with a reason.

use std::path::{Path, PathBuf};

use flockreel::jobs::masks::Masks;
use flockreel::media::{Limits, ReadOptions};
use flockreel_core::code::Code;
use flockreel_core::footage::FrameSource;

use super::{open, read_all, read_whole};
use crate::common::film::Films;

/// Coding of each format: lossless, and repeated without end or ten times.
const CODINGS: [&str; 4] = [
    "-loop 0 film.gif",
    "-loop 10 film.gif",
    "-f apng -plays 0 film.png",
    "-c:v libwebp_anim -lossless 1 -loop 0 film.webp",
];

/// Gray pictures whose bars move, in ffmpeg's syntax.
const BARS: &str =
    "-f lavfi -i color=size=64x48:rate=25 -frames:v 12 -vf format=gray,geq=mod(3*X+Y+40*N\\,256)";

/// Encodes a film of [`BARS`].
fn film(films: &Films, filter: &str, coding: &str) -> PathBuf {
    films.run(&format!("{BARS},{filter} -fps_mode vfr {coding}"))
}

fn times_s(path: &Path) -> Vec<f64> {
    let frames = read_whole(path, &Limits::default()).expect("a good film");
    frames.iter().map(|(time_s, _)| *time_s).collect()
}

#[test]
fn animations_are_read_once_with_their_pictures() {
    let films = Films::new();
    for coding in CODINGS {
        let path = film(&films, "settb=1/20,setpts=N -r 20", coding);
        films.run(&format!("{BARS} -f rawvideo wanted.raw"));
        let wanted = std::fs::read(films.path("wanted.raw")).expect("frames");
        let video = open(&path);
        assert_eq!(video.notices(), [], "{coding}");
        assert!(
            (video.format().fps - 20.0).abs() < 1e-9,
            "{coding}: {}",
            video.format().fps
        );
        let frames = read_all(&video).expect("frames");
        assert_eq!(frames.len(), wanted.len() / (64 * 48), "{coding}");
        for (k, (time_s, frame)) in frames.iter().enumerate() {
            assert!(
                (time_s - k as f64 * 0.05).abs() < 1e-6,
                "{coding}: {time_s}"
            );
            let levels = frame.gray_levels();
            for (luma, level) in frame.luma().iter().zip(&wanted[k * 64 * 48..]) {
                let gap = levels[usize::from(*luma)].abs_diff(*level);
                assert!(gap <= 2, "{coding}: {k}: {gap}");
            }
        }
    }
}

#[test]
fn animations_of_varying_rate_keep_their_times() {
    let films = Films::new();
    for coding in CODINGS {
        let path = film(&films, "setpts=(N*4+gte(N\\,6)*8)*0.01/TB", coding);
        let video = open(&path);
        assert!(
            (video.format().fps - 25.0).abs() < 1e-9,
            "{coding}: {}",
            video.format().fps
        );
        let times_s = times_s(&path);
        assert_eq!(times_s.len(), 14, "{coding}: {times_s:?}");
        assert_eq!(times_s.len(), video.format().n_frames_hint, "{coding}");
        for (found, wanted) in [(times_s[5], 0.2), (times_s[8], 0.32), (times_s[13], 0.52)] {
            assert!((found - wanted).abs() < 1e-6, "{coding}: {times_s:?}");
        }
    }
}

#[test]
fn browsers_durations_stand_for_unset_ones() {
    let films = Films::new();
    let mut gif = std::fs::read(film(&films, "null", "film.gif")).expect("the film");
    // The extension before each picture: its length, flags, and the duration in 1/100 s.
    let extensions: Vec<usize> = (0..gif.len() - 8)
        .filter(|&at| gif[at..].starts_with(b"\x21\xf9\x04") && gif[at + 7] == 0)
        .collect();
    extensions.iter().for_each(|at| gif[at + 4..at + 6].fill(0));
    let path = films.write("unset.gif", gif);
    assert!((open(&path).format().fps - 10.0).abs() < 1e-9);
}

#[test]
fn transparent_pixels_are_masks() {
    let films = Films::new();
    // By default ffmpeg's GIFs are opaque.
    let gif = ",split[a][b];[a]palettegen=reserve_transparent=1[p];[b][p]paletteuse film.gif";
    for coding in [
        gif,
        " -f apng film.png",
        " -c:v libwebp_anim -lossless 1 film.webp",
    ] {
        let drawn = "trim=end_frame=12,format=rgba,geq=r=200:g=90:b=30:a='255*lt(hypot(X-20-2*N\\,Y-24)\\,9)'";
        let path = films.test_picture("64x48", 12, &format!("-vf {drawn}{coding}"));
        let (limits, options) = (Limits::default(), ReadOptions::default());
        let video = open(&path);
        let masks = Masks::open(&video, &path, None, &limits, &options).expect("a good film");
        let masked = masks.expect("transparent pixels");
        let n_frames = read_all(&masked.over(&video).expect("of one size"))
            .expect("frames")
            .len();
        assert_eq!(n_frames, 12, "{coding}");
    }
    let opaque = film(&films, "null", "film.gif");
    let (limits, options) = (Limits::default(), ReadOptions::default());
    let masks = Masks::open(&open(&opaque), &opaque, None, &limits, &options);
    assert!(masks.expect("a good film").is_none());
}

#[test]
fn cut_and_still_ones_are_refused() {
    let films = Films::new();
    for (coding, code) in [
        ("film.gif", Code::Truncated),
        ("-f apng film.png", Code::Truncated),
        ("-c:v libwebp_anim -lossless 1 film.webp", Code::NotAVideo),
    ] {
        let path = film(&films, "null", coding);
        for share in [0.3, 0.6, 0.9, 0.999] {
            let cut = films.cut(&path, share, "cut");
            assert_eq!(
                read_whole(&cut, &Limits::default()).err(),
                Some(code),
                "{coding} {share}"
            );
        }
    }
    let still = films.test_picture("64x48", 1, "still.gif");
    assert_eq!(
        read_whole(&still, &Limits::default()).err(),
        Some(Code::TooFewFrames)
    );
    for name in ["still.png", "-c:v libwebp still.webp"] {
        let still = films.test_picture("64x48", 1, name);
        assert_eq!(
            read_whole(&still, &Limits::default()).err(),
            Some(Code::NotAVideo),
            "{name}"
        );
    }
}

#[test]
fn animations_beyond_the_limits_are_refused() {
    let films = Films::new();
    for coding in CODINGS {
        let path = film(&films, "null", coding);
        let few = Limits {
            max_frames: 11,
            ..Limits::default()
        };
        assert_eq!(
            read_whole(&path, &few).err(),
            Some(Code::TooManyFrames),
            "{coding}"
        );
        let small = Limits {
            max_pixels: 3000,
            ..Limits::default()
        };
        assert_eq!(
            read_whole(&path, &small).err(),
            Some(Code::TooManyPixels),
            "{coding}"
        );
    }
}
