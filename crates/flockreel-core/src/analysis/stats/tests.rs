//! Tests: libraries with a deficiency get the right advice, good libraries get none.

use std::f64::consts::PI;

use super::*;
use crate::analysis::Params;
use crate::library::{Jump, Library, Playback, Pose, Sprites, View};
use crate::raster::RgbImage;

const FPS: f64 = 30.0;

/// Returns a library of 300 playable frames with 30 jumps. The animal moves at one body length per second
/// with the given headings.
fn library(view: View, heading_rad: impl Fn(usize) -> f64) -> Library {
    let pose = |frame: usize| Pose {
        time_s: frame as f64 / FPS,
        centroid_px: Some([40.0 * frame as f64 / FPS, 50.0]),
        heading_rad: Some(wrap_rad(heading_rad(frame))),
        ..Pose::default()
    };
    let poses = Poses {
        fps: FPS,
        image_size_px: [400, 100],
        view,
        view_confidence: None,
        other_movers: Vec::new(),
        camera: None,
        animal: None,
        frames: (0..300).map(pose).collect(),
        tail_beat: None,
    };
    let jump = |k: u32| Jump {
        from: 299 - k,
        to: k,
        cost: 5,
        mirrored: false,
    };
    let component: Vec<u32> = (0..300).collect();
    Library {
        stats: LibraryStats {
            n_frames: 300,
            n_detected: 300,
            n_transitions: 30,
            kappa_used: Some(Params::default().kappa),
            component_share: 1.0,
            heading_histogram: histogram(&poses, &component),
            length_px: Some(40.0),
            ..LibraryStats::default()
        },
        poses,
        background: RgbImage::new(400, 100),
        occluders: None,
        sprites: Sprites::missing(8, 8, 300),
        shadow: None,
        clip_frames: 8,
        epsilon: 10,
        natural_step: 5,
        transitions: Vec::new(),
        playback: Playback {
            jumps: (0..30).rev().map(jump).collect(),
            component,
        },
        patches: Vec::new(),
    }
}

/// Right, down, left and up, for a quarter of the frames each.
fn all_round(frame: usize) -> f64 {
    PI / 2.0 * (frame / 75) as f64
}

fn advice_texts(library: &Library, mirror: bool) -> Vec<(&'static str, String)> {
    let params = Params {
        mirror,
        ..Params::default()
    };
    let advice = advice(library, &params);
    advice.iter().map(|a| (a.code(), a.to_string())).collect()
}

fn codes(library: &Library, mirror: bool) -> Vec<&'static str> {
    advice_texts(library, mirror)
        .iter()
        .map(|(code, _)| *code)
        .collect()
}

#[test]
fn a_good_library_gets_no_advice() {
    assert_eq!(advice_texts(&library(View::Side, all_round), false), []);
    let winding = |frame: usize| 2.0 * libm::sin(frame as f64 / 40.0);
    assert_eq!(advice_texts(&library(View::Top, winding), false), []);
}

#[test]
fn in_side_view_a_missing_direction_is_named() {
    let never_up = |frame| all_round(frame).min(PI);
    let sentence = "the footage never shows the animal heading up: film for longer".to_owned();
    let library = library(View::Side, never_up);
    assert_eq!(advice_texts(&library, true), [("lacks_up", sentence)]);
}

#[test]
fn mirroring_replaces_a_missing_direction() {
    let never_left = |frame| match all_round(frame) {
        heading if heading == PI => 0.0,
        heading => heading,
    };
    let mut library = library(View::Side, never_left);
    assert_eq!(codes(&library, false), ["lacks_left"]);
    assert_eq!(codes(&library, true), [""; 0]);
    library.poses.view = View::Top;
    // Four constant headings with three sudden turns. In top view the heading does not matter.
    assert!(
        codes(&library, true)
            .iter()
            .all(|code| *code != "lacks_left")
    );
}

#[test]
fn advice_distinguishes_unplayable_from_never_filmed() {
    let mut library = library(View::Side, all_round);
    library.playback.component.truncate(225);
    library.stats.heading_histogram = histogram(&library.poses, &library.playback.component);
    library.stats.component_share = 0.75;
    let texts = advice_texts(&library, true);
    assert_eq!(texts.len(), 1);
    assert!(
        texts[0]
            .1
            .contains("heading up for 2.5 s, but in no part that playback can use")
    );
    library.playback.component.push(299);
    library.stats.heading_histogram = histogram(&library.poses, &library.playback.component);
    assert!(
        advice_texts(&library, true)[0]
            .1
            .ends_with("for only 0.1 s: film for longer")
    );
}

#[test]
fn in_top_view_a_missing_turn_is_named() {
    let rightward = |frame: usize| 0.03 * frame.saturating_sub(100) as f64;
    let circling = |frame: usize| -0.03 * frame as f64;
    assert_eq!(
        codes(&library(View::Top, rightward), false),
        ["lacks_left_turn"]
    );
    assert_eq!(codes(&library(View::Top, rightward), true), [""; 0]);
    assert_eq!(
        codes(&library(View::Top, circling), true),
        ["lacks_straight"]
    );
    assert_eq!(codes(&library(View::Top, |_| 1.0), true), ["lacks_turn"]);
}

#[test]
fn an_animal_that_mostly_rests_gets_advice() {
    let mut library = library(View::Side, all_round);
    for pose in &mut library.poses.frames[30..] {
        pose.centroid_px = Some([40.0, 50.0]);
    }
    let texts = advice_texts(&library, true);
    assert_eq!(texts.len(), 1);
    assert_eq!(texts[0].0, "mostly_rests");
    assert!(texts[0].1.contains("moves in only 10 %"), "{}", texts[0].1);
}

#[test]
fn advice_on_playback_states_its_numbers() {
    let mut library = library(View::Side, all_round);
    library.stats.component_share = 0.12;
    library.stats.kappa_used = Some(4.0);
    library.playback.jumps.truncate(5);
    let texts = advice_texts(&library, true);
    let sentences: Vec<&str> = texts
        .iter()
        .map(|(_, sentence)| sentence.as_str())
        .collect();
    assert!(sentences[0].contains("only 12 % of the footage (10.0 s)"));
    assert!(sentences[1].contains("at only 5 frames"));
    assert!(sentences[2].contains("4.0 times a natural step"));
    assert_eq!(texts.len(), 3);
    library.playback.jumps.clear();
    assert_eq!(codes(&library, true), ["no_transitions"]);
}

#[test]
fn advice_on_filming_comes_first() {
    let mut library = library(View::Side, all_round);
    library.stats.several_animals = true;
    library.stats.n_detected = 150;
    for pose in &mut library.poses.frames[..60] {
        pose.cut = true;
    }
    assert_eq!(
        codes(&library, true),
        ["several_animals", "seldom_found", "often_at_border"]
    );
    library.stats.animal_too_small = true;
    library.playback = Playback::default();
    assert_eq!(codes(&library, true)[0], "animal_too_small");
    assert!(!codes(&library, true).contains(&"no_transitions"));
}
