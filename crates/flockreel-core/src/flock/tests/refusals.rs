//! Tests of flocks that are refused.

use super::*;

#[test]
fn loop_with_position_papers_is_refused() {
    let params = Params {
        is_loop: true,
        ..params("papers")
    };
    let error = plan_flock(&synthetic::library(View::Side), &params, &Silent).expect_err("open");
    assert!(error.to_string().contains("never returns"), "{error}");
}

#[test]
fn a_library_without_jumps_is_refused_with_advice() {
    let mut library = synthetic::library(View::Side);
    library.playback.jumps.clear();
    let error = plan_flock(&library, &params("school"), &Silent).expect_err("playback would end");
    assert_eq!(error.code(), crate::code::Code::NoTransitions);
    assert!(error.to_string().contains("film for longer"));
}

#[test]
fn a_flock_of_an_animal_that_stays_in_place_is_refused() {
    let mut library = synthetic::library(View::Side);
    for (frame, pose) in library.poses.frames.iter_mut().enumerate() {
        let sway_px = 3.0 * libm::sin(frame as f64);
        pose.centroid_px = pose.centroid_px.map(|_| [90.0 + sway_px, 70.0]);
    }
    let plan = |count, position| {
        let params = Params {
            count,
            position,
            frames: 40,
            ..params("school")
        };
        plan_flock(&library, &params, &Silent)
    };
    for count in [None, Some(2)] {
        let error = plan(count, Position::Film).expect_err("all at one place");
        assert_eq!(error.code(), crate::code::Code::StaysInPlace);
    }
    plan(Some(1), Position::Film).expect("one");
    plan(Some(2), Position::Boid).expect("boids move them");
}

#[test]
fn an_animal_too_small_for_sprites_is_refused_with_advice() {
    let mut library = synthetic::library(View::Side);
    library.stats.animal_too_small = true;
    let error = plan_flock(&library, &params("school"), &Silent).expect_err("there are no sprites");
    assert_eq!(error.code(), crate::code::Code::AnimalTooSmall);
    assert!(error.to_string().contains("film from a shorter distance"));
}

#[test]
fn a_parameter_out_of_range_is_refused() {
    let none = Params {
        count: Some(0),
        ..Params::default()
    };
    let error =
        plan_flock(&synthetic::library(View::Top), &none, &Silent).expect_err("no individuals");
    assert_eq!(error.code(), crate::code::Code::InvalidParams);
}
