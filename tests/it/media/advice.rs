//! The advice of each error code works. Each command and option that an error suggests, or the page of failed films, is
//! run on a film with this error, and all frames of the repaired film are read.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use flockreel::jobs::masks::Masks;
use flockreel::media::{Limits, ReadOptions, Video};
use flockreel_core::code::Code;

use super::{read_all, read_whole};
use crate::common::film::Films;

/// The pages with commands for films that are refused.
const ERRORS: &str = include_str!("../../../docs/reference/errors.md");
const FAILED_FILMS: &str = include_str!("../../../docs/how-to/fix-a-failed-film.md");

/// Returns the ffmpeg commands in a text.
fn commands(text: &str) -> Vec<&str> {
    let quoted = text.split('`').skip(1).step_by(2);
    quoted.filter(|text| text.starts_with("ffmpeg ")).collect()
}

/// Returns the rows about a code on the page of failed films.
fn rows_about(code: Code) -> String {
    let name = format!("`{code}`");
    let is_about = |line: &&str| {
        line.split('|')
            .nth(1)
            .is_some_and(|cell| cell.contains(&name))
    };
    FAILED_FILMS.lines().filter(is_about).collect()
}

/// Returns the code with which a film is refused, and all that is said about it: sentence, advice, page.
fn refusal(film: &Path, limits: &Limits) -> Option<(Code, String)> {
    let (code, sentence) = match Video::open(film, limits) {
        Ok(video) => read_all(&video)
            .err()
            .map(|error| (error.code, error.cause.to_string()))?,
        Err(error) => (error.code(), error.to_string()),
    };
    Some((code, said(code, &sentence)))
}

fn said(code: Code, sentence: &str) -> String {
    format!("{sentence} {} {}", code.advice(), rows_about(code))
}

/// Returns the frame rates that the advice of a code proposes.
fn rates(code: Code) -> Vec<f64> {
    let proposed = code.advice().split("rate, such as ").skip(1);
    let digits = |text: &str| {
        text.split(|c: char| !c.is_ascii_digit())
            .next()
            .map(str::parse)
    };
    proposed
        .map(|text| digits(text).expect("a word").expect("a number"))
        .collect()
}

/// Films that are refused: code, picture size, number of frames, ffmpeg arguments. Each code whose advice
/// contains a command has at least one film here or in [`refused`].
#[rustfmt::skip]
const REFUSED: [(Code, &str, usize, &str); 13] = [
    (Code::NotAVideo, "64x48", 40, "-c:v mpeg4 film.nut"),
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
    for name in [
        "whole.mkv",
        "whole.avi",
        "whole.asf",
        "whole.flv",
        "whole.gif",
        "whole.apng",
    ] {
        let film = films.test_picture("160x120", 100, &format!("{} {name}", coding_of(name)));
        let cut = films.cut(&film, 0.6, &format!("cut.{name}"));
        cases.push((Code::Truncated, cut));
    }
    let coding = "-c:v libx264 -pix_fmt yuv420p -movflags +faststart";
    let film = films.test_picture("160x120", 100, &format!("{coding} whole.mp4"));
    cases.push((Code::Truncated, films.cut(&film, 0.6, "cut.whole.mp4")));
    cases
}

fn coding_of(name: &str) -> &'static str {
    match Path::new(name)
        .extension()
        .and_then(|ending| ending.to_str())
    {
        Some("asf") => "-c:v wmv2",
        Some("flv") => "-c:v flv",
        Some("gif" | "apng") => "",
        _ => "-c:v libx264 -pix_fmt yuv420p",
    }
}

#[test]
fn commands_of_advice_make_accepted_films() {
    let films = Films::new();
    let (mut tried, mut tried_commands) = (Vec::new(), BTreeSet::new());
    for (code, film) in refused(&films) {
        // A decoder crash cannot be provoked, so its advice is tried on a good film.
        let refusal = refusal(&film, &Limits::default());
        let refusal = refusal.or(Some((Code::DecoderCrashed, said(Code::DecoderCrashed, ""))));
        let (found, said) = refusal.expect("it is refused");
        assert_eq!(found, code, "{film:?}: {said}");
        let name = film
            .file_name()
            .and_then(|name| name.to_str())
            .expect("a name");
        let all = commands(&said);
        assert!(!all.is_empty(), "no command for {name}: {said}");
        for command in all {
            let made = films.run_though_damaged(&args_of(command, name));
            let n_frames = read_whole(&made, &Limits::default()).map(|frames| frames.len());
            assert!(
                n_frames.is_ok_and(|n| n >= 2),
                "{name}: {command}: {n_frames:?}"
            );
            tried_commands.insert(command.to_owned());
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
    tried_commands.extend(shorten_endless_film(&films));
    tried.push(Code::TooManyFrames);
    check_rates_for_masks(&films);
    tried.push(Code::MasksDiffer);
    for &code in Code::ALL {
        let is_told = !commands(&said(code, "")).is_empty() || !rates(code).is_empty();
        assert_eq!(tried.contains(&code), is_told, "{code}");
    }
    for command in commands(ERRORS).into_iter().chain(commands(FAILED_FILMS)) {
        assert!(tried_commands.contains(command), "{command} is not tried");
    }
}

/// Returns the arguments of a suggested command for a file in the folder of the films.
fn args_of(command: &str, name: &str) -> String {
    let args = command.trim_start_matches("ffmpeg ");
    args.replace("-i film ", &format!("-i {name} "))
}

/// Tries the commands for films of too many frames and returns them. A film of more frames than the default limit takes
/// too long to make, so the limit is lowered, and the commands with it.
fn shorten_endless_film(films: &Films) -> Vec<String> {
    let film = films.test_picture("64x48", 60, "-c:v ffv1 endless.mkv");
    let limits = Limits {
        max_frames: 50,
        ..Limits::default()
    };
    let (code, said) = refusal(&film, &limits).expect("it is refused");
    assert_eq!(code, Code::TooManyFrames);
    let all: Vec<String> = commands(&said).into_iter().map(str::to_owned).collect();
    for command in &all {
        let args = args_of(command, "endless.mkv");
        let made = films.run(&args.replace("20000", "50").replace("-t 600", "-t 2"));
        let n_frames = read_whole(&made, &limits).map(|frames| frames.len());
        assert_eq!(n_frames, Ok(50), "{command}");
    }
    all
}

#[test]
fn film_without_its_index_gets_no_command_because_none_works() {
    let films = Films::new();
    let film = films.test_picture("160x120", 100, "-c:v libx264 -pix_fmt yuv420p whole.mp4");
    let bytes = std::fs::read(&film).expect("the film");
    let index = bytes
        .windows(4)
        .rposition(|name| name == b"moov")
        .expect("an index");
    for (name, n_bytes) in [("none.mp4", index / 2), ("part.mp4", index + 300)] {
        let cut = films.write(name, &bytes[..n_bytes]);
        let (code, said) = refusal(&cut, &Limits::default()).expect("it is refused");
        assert_eq!(code, Code::Truncated, "{said}");
        let sentence = said
            .split(Code::Truncated.advice())
            .next()
            .expect("a sentence");
        assert!(sentence.contains("untrunc"), "{sentence}");
        assert_eq!(commands(sentence), [""; 0]);
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
