//! The whole way from a library to a placed flock.

use super::*;
use crate::flock::params::TankExtent;
use crate::flock::synthetic::{self, LENGTH_PX};
use crate::library::View;
use crate::progress::Silent;

fn params(name: &str) -> Params {
    Params {
        count: 12,
        frames: 150,
        ..Params::preset(name).expect("a known preset")
    }
}

fn planned(view: View, name: &str) -> Flock {
    plan_flock(&synthetic::library(view), &params(name), &Silent).expect("a good library")
}

#[test]
fn a_school_follows_its_boids_without_clones() {
    let side = planned(View::Side, "school").stats;
    assert!(side.heading_error_median_rad < 0.15, "{side:?}");
    assert!(side.jumps_per_100_frames < 6.0, "{side:?}");
    assert!(side.path_deviation_p95_bl < 0.5, "{side:?}");
    assert!(side.clone_share < 0.05, "{side:?}");
    let top = planned(View::Top, "school").stats;
    assert!(top.heading_error_median_rad < 1e-9, "{top:?}");
    assert!(top.slip_median_rad < 0.1, "{top:?}");
}

#[test]
fn in_side_view_nobody_is_rotated_beyond_the_budget() {
    let flock = planned(View::Side, "swarm");
    let rho = flock.params.matching.rho_deg.to_radians();
    let rotations = flock.individuals.iter().flat_map(|i| &i.rotation_rad);
    assert!(rotations.into_iter().all(|r| r.abs() <= rho + 1e-4));
}

#[test]
fn everybody_stays_in_the_picture() {
    for (view, tank, margin_bl) in [
        (View::Side, TankExtent::Picture, 0.5),
        (View::Top, TankExtent::Picture, 0.5),
        (View::Top, TankExtent::Seen, 0.29),
    ] {
        let params = Params {
            tank,
            ..params("scatter")
        };
        let flock = plan_flock(&synthetic::library(view), &params, &Silent).unwrap();
        let [w, h] = flock.image_size_px.map(f64::from);
        let margin_px = margin_bl * LENGTH_PX;
        for [x, y] in flock.individuals.iter().flat_map(|i| &i.centroid_px) {
            assert!(*x > margin_px && *x < w - margin_px, "{x}");
            let margin_px = margin_px * if view == View::Side { 0.4 } else { 1.0 };
            assert!(*y > margin_px && *y < h - margin_px, "{y}");
        }
    }
}

#[test]
fn the_papers_mirror_nothing_rotate_nothing_and_fade_nothing() {
    for individual in planned(View::Side, "papers").individuals {
        assert!(individual.mirrored.iter().all(|&m| !m));
        assert!(individual.rotation_rad.iter().all(|&r| r == 0.0));
        assert!(individual.fades.is_empty());
    }
}

#[test]
fn the_same_seed_gives_the_same_flock_and_another_another() {
    let library = synthetic::library(View::Side);
    let with_seed = |seed| {
        let params = Params {
            seed,
            ..params("school")
        };
        plan_flock(&library, &params, &Silent).unwrap().individuals
    };
    assert_eq!(with_seed(1), with_seed(1));
    assert_ne!(with_seed(1), with_seed(2));
}

#[test]
fn a_library_without_jumps_is_refused_with_advice() {
    let mut library = synthetic::library(View::Side);
    library.playback.jumps.clear();
    let error = plan_flock(&library, &params("school"), &Silent).expect_err("playback would end");
    assert_eq!(error.code(), crate::code::Code::NoTransitions);
    assert!(error.to_string().contains("film longer"));
}

#[test]
fn an_animal_too_small_for_sprites_is_refused_with_advice() {
    let mut library = synthetic::library(View::Side);
    library.stats.animal_too_small = true;
    let error = plan_flock(&library, &params("school"), &Silent).expect_err("there are no sprites");
    assert_eq!(error.code(), crate::code::Code::AnimalTooSmall);
    assert!(error.to_string().contains("film it from nearer"));
}

#[test]
fn a_parameter_out_of_range_is_refused() {
    let none = Params {
        count: 0,
        ..Params::default()
    };
    let error = plan_flock(&synthetic::library(View::Top), &none, &Silent).expect_err("nobody");
    assert_eq!(error.code(), crate::code::Code::InvalidParams);
}
