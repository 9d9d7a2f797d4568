//! Tests parts of an animal that never leave their place (docs/explanation/algorithms.md, "Still parts").

use super::{Disc, HEIGHT, Picture, WIDTH, analyzed};
use crate::analysis::Params;
use crate::analysis::stats::advice;
use crate::library::Library;

/// Returns a fish that holds its place: a body of discs that never moves, and a tail that beats.
fn station_holder(frame_idx: usize) -> Vec<Disc> {
    let sway = libm::sin(0.7 * frame_idx as f64);
    let along = |at: usize| {
        let behind = at.saturating_sub(8) as f64;
        Disc {
            center_px: [50.0 + 4.0 * at as f64, 72.0 + 0.35 * behind * behind * sway],
            radius_px: 9.0 - 0.4 * at as f64,
        }
    };
    (0..17).map(along).collect()
}

/// Returns the number of pixels inside discs, and the mean of their centers.
fn covered(discs: &[Disc]) -> (f64, [f64; 2]) {
    let (mut n, mut sum) = (0.0, [0.0; 2]);
    for at in 0..WIDTH * HEIGHT {
        let [x, y] = [at % WIDTH, at / WIDTH].map(|v| f64::from(v) + 0.5);
        let inside = |d: &Disc| libm::hypot(x - d.center_px[0], y - d.center_px[1]) < d.radius_px;
        if discs.iter().any(inside) {
            n += 1.0;
            sum = [sum[0] + x, sum[1] + y];
        }
    }
    (n, sum.map(|v| v / n))
}

/// Returns a worm that crawls by half its length along a wavy path in 60 frames.
fn worm(frame_idx: usize) -> Vec<Disc> {
    let ring = |at: usize| {
        let along = 100.0 + 0.5 * frame_idx as f64 - 4.0 * at as f64;
        Disc {
            center_px: [along, 72.0 + 10.0 * libm::sin(along / 12.0)],
            radius_px: 5.0,
        }
    };
    (0..16).map(ring).collect()
}

/// Returns the library of 60 frames of an animal made of discs, after a check that every frame shows the whole animal.
fn seen_whole(animal: impl Fn(usize) -> Vec<Disc> + Send + Sync) -> Library {
    let picture = |k: usize| Picture::with_discs(animal(k));
    let library = analyzed(60, &Params::default(), picture).expect("a part of it moves");
    for (k, pose) in library.poses.frames.iter().enumerate() {
        let (area_px, [x, y]) = covered(&animal(k));
        let found = pose.centroid_px.expect("the animal is found");
        let off_px = libm::hypot(found[0] - x, found[1] - y);
        let share = pose.area_px.expect("it has an area") / area_px;
        assert!(
            off_px < 3.0 && (0.9..1.1).contains(&share),
            "frame {k}: {off_px} px, {share}"
        );
        assert!(
            pose.confidence < Some(0.9),
            "the floor under the body is invented"
        );
    }
    library
}

#[test]
fn animal_that_never_leaves_its_place_is_seen_whole() {
    let library = seen_whole(station_holder);
    let advice = advice(&library, &Params::default());
    assert!(advice.iter().any(|one| one.code() == "never_leaves"));
}

#[test]
fn worm_that_crawls_by_half_its_length_is_seen_whole() {
    seen_whole(worm);
}

#[test]
fn rock_of_the_animals_color_that_it_often_touches_is_no_part_of_it() {
    let rock = Disc {
        center_px: [96.0, 115.0],
        radius_px: 24.0,
    };
    let visitor = |k: usize| {
        let [aside, above] = [0.9, 0.2].map(|rate| libm::sin(rate * k as f64));
        Disc {
            center_px: [96.0 + 8.0 * aside, 87.0 - 60.0 * above * above],
            radius_px: 9.0,
        }
    };
    let library = analyzed(60, &Params::default(), |k| {
        Picture::with_discs(vec![visitor(k), rock])
    });
    let library = library.expect("one animal moves");
    assert_eq!(library.stats.still_px, 0);
}
