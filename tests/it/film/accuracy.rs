//! Compares an analysis and a flock with the known truth of a film of the virtual fish
//! (docs/explanation/algorithms.md, "Quality measures"). The film's pixels and truth share no code with the
//! analysis.

use std::sync::Arc;

use flockreel_core::analysis::analyze;
use flockreel_core::cpu::Level;
use flockreel_core::flock::{self, plan_flock};
use flockreel_core::formats::poses_json;
use flockreel_core::geometry::wrap_rad;
use flockreel_core::library::{Library, Pose};
use flockreel_core::progress::Silent;
use flockreel_core::scratch::{InMemory, Scratch};

use super::sample::{filmed, median};

/// Returns pairs of measured and true poses, for the frames in which the animal was detected.
fn pairs() -> Vec<(Pose, Pose)> {
    let (film, library, _) = filmed();
    let truth = film.truth().frames;
    let both = library.poses.frames.iter().cloned().zip(truth);
    both.filter(|(got, _)| got.detected()).collect()
}

#[test]
fn centroid_is_within_a_pixel_in_every_frame() {
    let (film, _, _) = filmed();
    let pairs = pairs();
    assert_eq!(pairs.len(), film.truth().frames.len());
    let gap = |(got, want): &(Pose, Pose)| {
        let (a, b) = (got.centroid_px.unwrap(), want.centroid_px.unwrap());
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let gap_px = median(pairs.iter().map(gap).collect());
    assert!(gap_px < 1.0, "{gap_px}");
}

#[test]
fn heading_is_right_in_frames_that_show_the_fish_at_length() {
    let at_length = |(_, want): &&(Pose, Pose)| want.gamma_rad.unwrap().cos() > 0.5;
    let gap = |(got, want): &(Pose, Pose)| {
        wrap_rad(got.heading_rad.unwrap() - want.heading_rad.unwrap()).abs()
    };
    let gaps: Vec<f64> = pairs().iter().filter(at_length).map(gap).collect();
    let right = gaps
        .iter()
        .filter(|gap| **gap < std::f64::consts::FRAC_PI_2)
        .count();
    assert!(100 * right > 99 * gaps.len(), "{right} of {}", gaps.len());
    assert!(median(gaps) < 0.07);
}

#[test]
fn depth_is_within_a_tenth_of_the_tank() {
    let gap = |(got, want): &(Pose, Pose)| {
        (got.position_m.unwrap()[2] - want.position_m.unwrap()[2]).abs()
    };
    let gap_m = median(
        pairs()
            .iter()
            .filter(|(got, _)| got.position_m.is_some())
            .map(gap)
            .collect(),
    );
    assert!(gap_m < 0.03, "{gap_m}");
}

#[test]
fn analysis_is_equal_for_any_number_of_threads() {
    let (film, library, params) = filmed();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    let analyze = || analyze(film, None, params, Level::detect(), &scratch, &Silent).unwrap();
    let on_one = pool.install(analyze);
    let bytes = |library: &Library| poses_json::write(&library.poses, None);
    assert!(bytes(&on_one) == bytes(library), "poses.json differs");
    assert!(on_one.sprites == library.sprites, "the sprites differ");
}

#[test]
fn flock_uses_only_transitions_of_the_library() {
    let (_, library, _) = filmed();
    let flock = plan_flock(library, &small_flock(), &Silent).unwrap();
    for individual in &flock.individuals {
        for k in 1..individual.source_frame.len() {
            let (from, to) = (individual.source_frame[k - 1], individual.source_frame[k]);
            let mirrored = individual.mirrored[k - 1] != individual.mirrored[k];
            assert!(
                may_follow(library, from, to, mirrored),
                "{from} -> {to}, {mirrored}"
            );
        }
    }
}

#[test]
fn flock_is_equal_for_any_number_of_threads() {
    let (_, library, _) = filmed();
    let made = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| plan_flock(library, &small_flock(), &Silent).unwrap())
    };
    assert_eq!(made(1), made(2));
}

fn small_flock() -> flock::Params {
    flock::Params {
        count: Some(9),
        frames: 90,
        ..flock::Params::default()
    }
}

fn may_follow(library: &Library, from: u32, to: u32, mirrored: bool) -> bool {
    let jumps = &library.playback.jumps;
    (to == from + 1 && !mirrored)
        || jumps
            .iter()
            .any(|j| (j.from, j.to, j.mirrored) == (from, to, mirrored))
}
