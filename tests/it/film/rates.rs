//! Frame rates from 0.02 to 1000 frames/s, from time lapse to high-speed film, give a library and a flock.

use std::process::Command;

use flockreel::media::{VideoFormat, VideoWriter};
use flockreel_core::fish::sample::{SampleFilm, SampleParams};
use flockreel_core::footage::FrameSource;
use flockreel_core::raster::Frame;
use serde_json::Value;

use crate::common::film::Films;

/// Writes film.mp4: the virtual fish, 64 frames.
fn filmed(films: &Films) {
    let params = SampleParams {
        n_frames: 64,
        width: 320,
        height: 240,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).expect("in range");
    let format: VideoFormat = film.format().into();
    let mut writer = VideoWriter::create(&films.path("film.mp4"), &format).expect("an encoder");
    let (mut stream, mut frame) = (film.open().expect("a film"), Frame::default());
    while stream.next_frame(&mut frame).expect("a frame").is_some() {
        writer.write(&frame).expect("room");
    }
    writer.finish().expect("a film");
}

fn run(films: &Films, args: &str) {
    let done = Command::new(env!("CARGO_BIN_EXE_flockreel"))
        .args(args.split_whitespace())
        .current_dir(films.folder())
        .output()
        .expect("the program starts");
    let said = String::from_utf8_lossy(&done.stderr);
    let is_refusal = said.contains("(no_transitions)");
    assert!(done.status.success() || is_refusal, "{args}: {said}");
}

#[test]
fn films_of_any_rate_are_measured_at_their_rate() {
    let films = Films::new();
    filmed(&films);
    films.run("-i film.mp4 -an -vf setpts=N/TB -r 1 -c:v libx264 lapse.mp4");
    for (film, hint, fps) in [
        ("lapse.mp4", "", 1.0),
        ("film.mp4", "--fps 0.02", 0.02),
        ("film.mp4", "--fps 0.2", 0.2),
        ("film.mp4", "--fps 0.45", 0.45),
        ("film.mp4", "--fps 1.1", 1.1),
        ("film.mp4", "--fps 1000", 1000.0),
    ] {
        run(
            &films,
            &format!("analyze {film} -o library --view side {hint}"),
        );
        let poses = std::fs::read(films.path("library/poses.json")).expect("poses");
        let poses: Value = serde_json::from_slice(&poses).expect("JSON");
        assert_eq!(poses["fps"], fps, "{film} {hint}");
        assert_eq!(
            poses["frames"].as_array().map(Vec::len),
            Some(64),
            "{film} {hint}"
        );
        if fps < 4.0 {
            assert!(
                poses["tail_beat"].is_null(),
                "{fps}: {}",
                poses["tail_beat"]
            );
        }
        run(
            &films,
            "flock library -o flock.png --format poster --count 3 --frames 40",
        );
    }
}

#[test]
fn folder_of_pictures_is_measured_at_the_given_rate() {
    let films = Films::new();
    filmed(&films);
    std::fs::create_dir(films.path("shots")).expect("a folder");
    films.run("-i film.mp4 shots/%d.png");
    run(&films, "analyze shots -o library --view side --fps 50");
    let poses = std::fs::read(films.path("library/poses.json")).expect("poses");
    let poses: Value = serde_json::from_slice(&poses).expect("JSON");
    assert_eq!(poses["fps"], 50.0);
    assert_eq!(poses["frames"].as_array().map(Vec::len), Some(64));
}
