//! Tests of flocks whose frames are chosen with their places.

use crate::flock::synthetic::{self, LENGTH_PX};
use crate::flock::{Flock, Params, plan_flock};
use crate::geometry::Rect;
use crate::library::{Library, View};
use crate::parameters::Parameters;
use crate::progress::Silent;

fn planned(library: &Library, params: &Params) -> Flock {
    plan_flock(library, params, &Silent).expect("a good library")
}

#[test]
fn animals_turn_before_walls() {
    for view in [View::Side, View::Top] {
        let params = Params {
            count: Some(12),
            frames: 150,
            ..Params::preset("school").expect("a known preset")
        };
        let stats = planned(&synthetic::library(view), &params).stats;
        assert!(stats.clipped_share < 0.03, "{view:?} {stats:?}");
    }
}

/// Returns the library of a bird that hops between two perches, which it also shows mirrored.
fn perching() -> Library {
    let mut library = synthetic::library(View::Side);
    for (frame, pose) in library.poses.frames.iter_mut().enumerate() {
        let (share, is_back) = ((frame % 120) as f64 / 30.0, frame % 240 >= 120);
        let along = (share - 3.0).clamp(0.0, 1.0);
        let along = if is_back { 1.0 - along } else { along };
        let bottom = 100.0 + 60.0 * along;
        pose.centroid_px = Some([80.0 + 120.0 * along, bottom - 10.0]);
        let y = (bottom - 20.0) as u32;
        pose.box_px = Some(Rect {
            x: 60,
            y,
            w: 40,
            h: bottom as u32 - y,
        });
    }
    library
}

#[test]
fn perching_animals_sit_on_perches_and_go_their_own_ways() {
    let library = perching();
    let params = Params {
        frames: 300,
        ..Params::default()
    };
    let flock = planned(&library, &params);
    assert_eq!(flock.params.rules.sociality, Some(0.0));
    assert_eq!(flock.stats.room_for as usize, flock.individuals.len());
    let (mut n_carried, mut n_on_perch) = (0, 0);
    for one in &flock.individuals {
        assert!(one.mirrored.iter().all(|&mirrored| !mirrored));
        for t in (0..300).filter(|&t| one.carried[t]) {
            let [x, y] = one.centroid_px[t];
            let foot = y + 10.0 * one.scale[t];
            let is_near = |[px, py]: [f64; 2]| (x - px).hypot(foot - py) < 0.3 * LENGTH_PX;
            n_carried += 1;
            n_on_perch += usize::from([[80.0, 100.0], [200.0, 160.0]].into_iter().any(is_near));
        }
    }
    assert!(n_carried > 300, "{n_carried}");
    assert!(
        100 * n_on_perch > 95 * n_carried,
        "{n_on_perch} of {n_carried}"
    );
}

#[test]
fn animals_from_above_live_alone_unless_a_school_is_asked_for() {
    let polarization = |name: Option<&str>| {
        let preset = name.map(|name| Params::preset(name).expect("a known preset"));
        let params = Params {
            count: Some(8),
            frames: 200,
            ..preset.unwrap_or_default()
        };
        let flock = planned(&synthetic::library(View::Top), &params);
        (flock.params.rules.sociality, flock.stats.polarization)
    };
    let (alone, school) = (polarization(None), polarization(Some("school")));
    assert_eq!((alone.0, school.0), (Some(0.0), Some(1.0)));
    assert!(alone.1 + 0.15 < school.1, "{alone:?} {school:?}");
}
