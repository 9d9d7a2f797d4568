//! The advice of each error code works. Each command and option that `code.rs` suggests is run on a film with
//! this error, and all frames of the repaired film are read.

use std::path::{Path, PathBuf};

use flockreel::jobs::masks::Masks;
use flockreel::media::{Limits, ReadOptions, Video};
use flockreel_core::code::Code;

use super::{read_all, read_whole};
use crate::common::film::Films;

/// Returns the ffmpeg commands in the advice of a code.
fn commands(code: Code) -> Vec<&'static str> {
    let quoted = code.advice().split('`').skip(1).step_by(2);
    quoted.filter(|text| text.starts_with("ffmpeg ")).collect()
}

/// Returns the values of `--fps` in the advice of a code.
fn rates(code: Code) -> Vec<f64> {
    let quoted = code.advice().split('`').skip(1).step_by(2);
    let rates = quoted.filter_map(|text| text.strip_prefix("--fps "));
    rates.map(|fps| fps.parse().expect("a number")).collect()
}

/// Films that are refused: code, picture size, number of frames, ffmpeg arguments. Each code whose advice
/// contains a command has at least one film here or in [`refused`].
#[rustfmt::skip]
const REFUSED: [(Code, &str, usize, &str); 12] = [
    (Code::ContainerNotAllowed, "64x48", 40, "-c:v libvpx -f ivf film.ivf"),
    (Code::ContainerNotAllowed, "64x48", 40, "-pix_fmt yuv444p film.y4m"),
    (Code::ContainerNotAllowed, "64x48", 40, "-c:v mpeg2video bare.m2v"),
    (Code::ContainerNotAllowed, "64x48", 40, "-c:v mpeg2video film.mxf"),
    (Code::CodecNotAllowed, "64x48", 40, "-c:v magicyuv -pix_fmt gbrp magic.avi"),
    (Code::CodecNotAllowed, "64x48", 40, "-c:v qtrle animation.mov"),
    (Code::CodecNotAllowed, "64x48", 40, "-c:v utvideo -pix_fmt yuv422p ut.avi"),
    (Code::CodecNotAllowed, "64x48", 40, "-c:v cinepak cinepak.avi"),
    (Code::TooManyPixels, "4096x2176", 3, "-c:v mjpeg -q:v 30 large.avi"),
    (Code::TooFast, "64x48", 2100, "-vf settb=1/2000,setpts=N -r 2000 -c:v mpeg4 fast.mkv"),
    (Code::TooLong, "64x48", 80, "-vf setpts=N*50/TB -fps_mode vfr -c:v mpeg4 long.mkv"),
    (Code::DecoderCrashed, "64x48", 40, "-c:v mpeg4 any.avi"),
];

/// Creates the refused films and returns them with their codes.
fn refused(films: &Films) -> Vec<(Code, PathBuf)> {
    let make = |&(code, size, n, args): &(Code, &str, usize, &str)| {
        (code, films.test_picture(size, n, args))
    };
    let mut cases: Vec<_> = REFUSED.iter().map(make).collect();
    let many = format!("{} -c:v mpeg4 many.mkv", "-map 0:v ".repeat(40));
    cases.push((Code::TooManyStreams, films.test_picture("64x48", 5, &many)));
    for name in ["whole.mkv", "whole.avi", "whole.asf", "whole.flv"] {
        let film = films.test_picture("160x120", 100, &format!("-c:v {} {name}", codec_of(name)));
        let cut = films.cut(&film, 0.6, &format!("cut.{name}"));
        cases.push((Code::Truncated, cut));
    }
    cases
}

fn codec_of(name: &str) -> &'static str {
    match Path::new(name)
        .extension()
        .and_then(|ending| ending.to_str())
    {
        Some("asf") => "wmv2",
        Some("flv") => "flv",
        _ => "libx264 -pix_fmt yuv420p",
    }
}

#[test]
fn commands_of_advice_make_accepted_films() {
    let films = Films::new();
    let mut tried = Vec::new();
    for (code, film) in refused(&films) {
        let refusal = read_whole(&film, &Limits::default()).err();
        // A decoder crash cannot be provoked, so its advice is tried on a good film.
        let is_right = refusal == Some(code) || code == Code::DecoderCrashed;
        assert!(is_right, "{film:?}: {refusal:?}");
        let name = film
            .file_name()
            .and_then(|name| name.to_str())
            .expect("a name");
        let all = commands(code);
        assert!(!all.is_empty(), "the advice of {code} names no command");
        for command in all {
            let args = command
                .trim_start_matches("ffmpeg ")
                .replace("-i film ", &format!("-i {name} "));
            let made = films.run_though_damaged(&args);
            let n_frames = read_whole(&made, &Limits::default()).map(|frames| frames.len());
            assert!(
                n_frames.is_ok_and(|n| n >= 2),
                "{name}: {command}: {n_frames:?}"
            );
        }
        for fps in rates(code) {
            let options = ReadOptions {
                fps: Some(fps),
                ..ReadOptions::default()
            };
            let video = Video::open_with(&film, &Limits::default(), &options).expect("a good film");
            let n_frames = read_all(&video).expect("frames").len();
            assert!(n_frames >= 2, "{name}: {fps}: {n_frames}");
        }
        tried.push(code);
    }
    // A film of more frames than the default limit takes too long to make, so the limit is lowered.
    let film = films.test_picture("64x48", 60, "-c:v ffv1 endless.mkv");
    let limits = Limits {
        max_frames: 50,
        ..Limits::default()
    };
    assert_eq!(read_whole(&film, &limits).err(), Some(Code::TooManyFrames));
    let [command] = commands(Code::TooManyFrames)[..] else {
        panic!("one command");
    };
    let args = command
        .trim_start_matches("ffmpeg ")
        .replace("-i film ", "-i endless.mkv ");
    let made = films.run(&args.replace("20000", "50"));
    assert_eq!(
        read_whole(&made, &limits).map(|frames| frames.len()),
        Ok(50)
    );
    tried.push(Code::TooManyFrames);
    check_rates_for_masks(&films);
    tried.push(Code::MasksDiffer);
    for &code in Code::ALL {
        let is_told = !commands(code).is_empty() || !rates(code).is_empty();
        assert_eq!(tried.contains(&code), is_told, "{code}");
    }
}

/// Asserts that the suggested rates make masks match a film of variable frame rate.
fn check_rates_for_masks(films: &Films) {
    let slowing = "-vf setpts=N*N*0.01/TB -fps_mode vfr -c:v mpeg4 slowing.mkv";
    let film = films.test_picture("64x48", 40, slowing);
    let masks = films.test_picture("64x48", 40, "-c:v ffv1 masks.mkv");
    let masked = |fps| {
        let (limits, options) = (
            Limits::default(),
            ReadOptions {
                fps,
                ..ReadOptions::default()
            },
        );
        let video = Video::open_with(&film, &limits, &options).expect("a good film");
        let masks = Masks::open(&video, &film, Some(&masks), &limits, &options);
        let masks = masks.expect("they can be read").expect("they are given");
        let masked = masks.over(&video).expect("of one size");
        read_all(&masked).map(|frames| frames.len())
    };
    let refusal = masked(None).map_err(|error| error.code);
    assert_eq!(refusal, Err(Code::MasksDiffer));
    for fps in rates(Code::MasksDiffer) {
        assert_eq!(masked(Some(fps)).expect("they match"), 40);
    }
}
