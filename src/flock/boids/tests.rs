//! What a flock of boids promises: order, walls, limits, and the same numbers on any threads.

use super::measures::Order;
use super::*;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::flock::synthetic;
use crate::library::{Library, View};

/// Every frame's positions and velocities of `n_frames`, and the mean order of them.
fn swim(view: View, params: &Params, n_frames: usize) -> (Vec<Vec<Vec3>>, Vec<Vec<Vec3>>, Order) {
    let library = synthetic::library(view);
    let calibration = calibrated(&library, params);
    let tank = Tank::new(
        [0.5, 0.5, 0.0],
        [15.5, 11.5, if view == View::Side { 3.0 } else { 0.0 }],
    );
    let mut boids = Boids::new(params, &calibration, &tank, 30.0);
    let (mut positions, mut velocities) = (Vec::new(), Vec::new());
    let mut mean = Order::default();
    for _ in 0..n_frames {
        boids.advance();
        let now = boids.order();
        mean.polarization += now.polarization / n_frames as f64;
        mean.milling += now.milling / n_frames as f64;
        mean.nearest_bl += now.nearest_bl / n_frames as f64;
        positions.push(boids.positions.clone());
        velocities.push(boids.velocities.clone());
    }
    (positions, velocities, mean)
}

fn calibrated(library: &Library, params: &Params) -> Calibration {
    let lens = Lens::of(library, params);
    Calibration::of(library, &motion_of(library, &lens), lens.is_flat())
}

fn preset(name: &str) -> Params {
    Params::preset(name).expect("a known preset")
}

#[test]
fn a_school_is_polarized_and_a_swarm_is_not() {
    for view in [View::Top, View::Side] {
        let (_, _, school) = swim(view, &preset("school"), 600);
        assert!(school.polarization > 0.65, "{view:?} {school:?}");
        let (_, _, swarm) = swim(view, &preset("swarm"), 600);
        let swarms = swarm.polarization < 0.35 && swarm.milling < 0.35;
        assert!(swarms, "{view:?} {swarm:?}");
    }
}

#[test]
fn a_mill_turns_about_its_middle() {
    for view in [View::Top, View::Side] {
        let (_, _, mill) = swim(view, &preset("mill"), 600);
        let mills = mill.milling > 0.65 && mill.polarization < 0.35;
        assert!(mills, "{view:?} {mill:?}");
    }
}

#[test]
fn nobody_leaves_the_tank_or_swims_faster_than_the_animal() {
    for name in Params::PRESETS {
        let params = Params {
            count: 60,
            ..preset(name)
        };
        let (positions, velocities, _) = swim(View::Side, &params, 200);
        let tank = Tank::new([0.5, 0.5, 0.0], [15.5, 11.5, 3.0]);
        assert!(positions.iter().flatten().all(|&p| tank.holds(p)), "{name}");
        let fastest = velocities
            .iter()
            .flatten()
            .map(|&v| norm(v))
            .fold(0.0, f64::max);
        assert!(fastest <= 2.0 + 1e-9, "{name} {fastest}");
    }
}

#[test]
fn in_side_view_nobody_points_more_steeply_than_the_library_shows() {
    let library = synthetic::library(View::Side);
    let params = preset("swarm");
    let calibration = calibrated(&library, &params);
    let [up, down] = calibration.slopes.expect("side view has a reach");
    let (_, velocities, _) = swim(View::Side, &params, 300);
    for v in velocities.iter().flatten() {
        let level = v[0].hypot(v[2]);
        assert!(
            v[1] <= down * level + 1e-9 && -v[1] <= up * level + 1e-9,
            "{v:?}"
        );
    }
}

#[test]
fn any_number_of_threads_gives_the_same_numbers() {
    let params = Params {
        count: 300,
        ..preset("school")
    };
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap();
        pool.install(|| swim(View::Top, &params, 20))
    };
    let (one, four) = (with_threads(1), with_threads(4));
    assert_eq!(one.0, four.0);
    assert_eq!(one.1, four.1);
}

#[test]
fn another_seed_gives_another_flock() {
    let seeded = |seed| {
        swim(
            View::Top,
            &Params {
                seed,
                ..preset("school")
            },
            2,
        )
        .0
    };
    assert_ne!(seeded(1), seeded(2));
    assert_eq!(seeded(1), seeded(1));
}
