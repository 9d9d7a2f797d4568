//! Tests of boids: walls, limits, and equal numbers for any number of threads. `presets` tests their order.

use std::convert::Infallible;

use super::calibration::Slopes;
use super::vector::{angle_between, norm, unit};
use super::*;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::flock::params::{Goal, Obstacle, Predator};
use crate::flock::synthetic;
use crate::library::{Library, View};
use crate::parameters::Parameters;

/// Returns the positions and velocities of `n_frames` frames.
fn swim(view: View, params: &Params, n_frames: usize) -> (Vec<Vec<Vec3>>, Vec<Vec<Vec3>>) {
    let library = synthetic::library(view);
    let calibration = calibrated(&library, params);
    let tank = Tank::new(
        [0.5, 0.5, 0.0],
        [15.5, 11.5, if view == View::Side { 3.0 } else { 0.0 }],
    );
    let lens = Lens::new(&library, params);
    let mut boids = Boids::new(params, &calibration, &lens, &tank, 30.0);
    let (mut positions, mut velocities) = (Vec::new(), Vec::new());
    for _ in 0..n_frames {
        boids.advance();
        positions.push(boids.positions().to_vec());
        velocities.push(boids.velocities().to_vec());
    }
    (positions, velocities)
}

fn calibrated(library: &Library, params: &Params) -> Calibration {
    let lens = Lens::new(library, params);
    Calibration::from_library(library, &motion_of(library, &lens), lens.is_flat())
}

fn preset(name: &str) -> Params {
    Params::preset(name).expect("a known preset")
}

#[test]
fn boids_stay_in_the_tank_within_the_greatest_speed() {
    for name in Params::PRESETS {
        let params = Params {
            count: Some(60),
            ..preset(name)
        };
        let (positions, velocities) = swim(View::Side, &params, 200);
        let tank = Tank::new([0.5, 0.5, 0.0], [15.5, 11.5, 3.0]);
        assert!(
            positions.iter().flatten().all(|&p| tank.contains(p)),
            "{name}"
        );
        let fastest = velocities
            .iter()
            .flatten()
            .map(|&v| norm(v))
            .fold(0.0, f64::max);
        assert!(fastest <= 2.0 + 1e-9, "{name} {fastest}");
    }
}

/// Returns how many boids of a preset's flock were outside, and how many pairs too near, in 200 frames.
fn violations(name: &str, count: u32, greatest: Vec3) -> (u32, u32) {
    let params = Params {
        count: Some(count),
        ..preset(name)
    };
    let library = synthetic::library(View::Side);
    let calibration = calibrated(&library, &params);
    let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], greatest));
    let mut boids = Boids::new(&params, &calibration, &lens, &tank, 30.0);
    (0..200).fold((0, 0), |(n_outside, n_overlaps), _| {
        boids.advance();
        let order = boids.order();
        (n_outside + order.n_outside, n_overlaps + order.n_overlaps)
    })
}

#[test]
fn boids_never_overlap_and_keep_half_a_length_in_large_tanks() {
    let tanks = [[15.0, 11.0, 0.0], [15.0, 11.0, 3.0], [4.0, 3.0, 0.0]];
    for name in Params::PRESETS {
        for tank in tanks {
            assert_eq!(violations(name, 40, tank), (0, 0), "{name} {tank:?}");
        }
    }
    let wide = Tank::new([0.0; 3], tanks[0]);
    assert_eq!(wide.overlap_bl(40), OVERLAP_BL);
}

#[test]
fn turn_rates_stay_within_the_limit_at_walls_and_in_full_tanks() {
    let (lens, fps) = (Lens::flat(40.0), 30.0);
    let calibration = Calibration {
        turn_rad_per_s: 1.6,
        ..Calibration::default()
    };
    for (name, tank) in Params::PRESETS
        .iter()
        .flat_map(|name| [[4.0, 3.0, 0.0], [9.0, 5.0, 3.0]].map(|tank| (name, tank)))
    {
        let params = Params {
            count: Some(30),
            ..preset(name)
        };
        let tank = Tank::new([0.0; 3], tank);
        let mut boids = Boids::at_random(&params, &calibration, &lens, &tank, fps);
        for t in 0..300 {
            let before = boids.velocities().to_vec();
            boids.advance();
            for (before, now) in before.iter().zip(boids.velocities()) {
                let turn_rad_per_s = angle_between(*before, *now) * fps;
                assert!(
                    turn_rad_per_s < 1.6 + 1e-6,
                    "{name} {tank:?} {t} {turn_rad_per_s}"
                );
            }
        }
    }
}

#[test]
fn slopes_in_space_stay_within_the_measured_limits() {
    let library = synthetic::library(View::Side);
    let params = preset("swarm");
    let calibration = calibrated(&library, &params);
    let [up, down] = calibration.slopes.expect("side view has a reach").limits;
    let (_, velocities) = swim(View::Side, &params, 300);
    for v in velocities.iter().flatten() {
        let level = v[0].hypot(v[2]);
        assert!(
            v[1] <= down * level + 1e-9 && -v[1] <= up * level + 1e-9,
            "{v:?}"
        );
    }
}

#[test]
fn slopes_in_the_image_stay_within_the_limits_where_those_in_space_allow_it() {
    let library = synthetic::library(View::Side);
    let params = preset("swarm");
    let (calibration, lens) = (calibrated(&library, &params), Lens::new(&library, &params));
    let slopes = calibration.slopes.expect("side view has a reach");
    let (positions, velocities) = swim(View::Side, &params, 300);
    for (&p, &v) in positions.iter().flatten().zip(velocities.iter().flatten()) {
        let [level, across] = lens.seen_level(p, v);
        let limits = slopes.limits.map(|limit| limit * norm([v[0], 0.0, v[2]]));
        let [up, down] = slopes.in_picture.map(|slope| slope * across);
        let highest = (level - up).clamp(-limits[0], limits[1]);
        let lowest = (level + down).clamp(-limits[0], limits[1]);
        // `p` is the position after the step.
        assert!(v[1] > highest - 0.02 && v[1] < lowest + 0.02, "{p:?} {v:?}");
    }
}

/// Returns one boid that swims at 1 BL/s and turns mostly by less than 1 rad/s.
fn single_boid(slopes: Option<Slopes>) -> (Params, Calibration) {
    let mut params = Params {
        count: Some(1),
        leaders: false,
        ..preset("school")
    };
    params.rules.circling = 0.0;
    let calibration = Calibration {
        speed_limits_bl_per_s: [0.1, 1.5],
        wander_rad_per_s: 0.7,
        slopes,
        ..Calibration::default()
    };
    (params, calibration)
}

#[test]
fn opposed_boids_form_longer_and_the_video_starts_at_the_same_time() {
    let (mut params, calibration) = single_boid(None);
    params.count = Some(2);
    let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], [30.0, 30.0, 0.0]));
    let formed = |courses: [f64; 2]| {
        let mut boids = Boids::at_random(&params, &calibration, &lens, &tank, 30.0);
        let places = vec![[14.0, 15.0, 0.0], [16.0, 15.0, 0.0]];
        boids.set_states(places, courses.map(|x| [x, 0.0, 0.0]).to_vec(), None);
        boids.n_warm_up_frames = 5;
        let mut n_frames = 0;
        let Ok(()) = boids.form(|| {
            n_frames += 1;
            Ok::<(), Infallible>(())
        });
        (n_frames, boids.time_s)
    };
    let (one_course, two_courses) = (formed([1.0, 1.0]), formed([1.0, -1.0]));
    assert_eq!([one_course.0, two_courses.0], [5, 10]);
    assert!((one_course.1 - two_courses.1).abs() < 1e-9);
}

/// At the edges of the image, lines of sight run along the walls.
#[test]
fn slow_school_is_polarized_in_perspective_too() {
    let library = synthetic::library(View::Side);
    let calibration = Calibration {
        cruise_bl_per_s: 0.2,
        speed_limits_bl_per_s: [0.05, 0.8],
        wander_rad_per_s: 1.2,
        ..calibrated(&library, &preset("school"))
    };
    let order = |seed: u64| {
        let params = Params {
            count: Some(20),
            seed,
            ..preset("school")
        };
        let lens = Lens::new(&library, &params);
        let tank = Tank::from_library(&library, &lens, &motion_of(&library, &lens), &params);
        let mut boids = Boids::new(&params, &calibration, &lens, &tank, 30.0);
        let orders = (0..400).map(|_| {
            boids.advance();
            boids.order().polarization
        });
        orders.sum::<f64>() / 400.0
    };
    let orders: Vec<f64> = (1..=8).map(order).collect();
    let mean = orders.iter().sum::<f64>() / 8.0;
    assert!(mean > 0.75, "{mean}: {orders:?}");
}

#[test]
fn boids_turn_at_walls_without_slowing_down() {
    let (params, calibration) = single_boid(None);
    let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], [12.0, 9.0, 0.0]));
    // Head-on, and obliquely from either side.
    for y_speed in [0.0, 0.5, -0.5] {
        let mut boids = Boids::new(&params, &calibration, &lens, &tank, 30.0);
        boids.set_states(vec![[9.0, 4.5, 0.0]], vec![unit([1.0, y_speed, 0.0])], None);
        let mut slowest = f64::INFINITY;
        for _ in 0..150 {
            boids.advance();
            slowest = slowest.min(norm(boids.velocities()[0]));
        }
        assert!(slowest > 0.8, "{y_speed}: slows down to {slowest} BL/s");
        let [outward, along, _] = boids.velocities()[0];
        assert!(
            outward < 0.5 * along.abs(),
            "{y_speed}: {:?}",
            boids.velocities()[0]
        );
    }
}

#[test]
fn boids_return_to_the_usual_slope() {
    let slopes = Slopes {
        limits: [1.5, 1.5],
        usual: -0.2,
        spread: 0.05,
        in_picture: [1e9; 2],
    };
    let (params, calibration) = single_boid(Some(slopes));
    let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], [60.0, 60.0, 60.0]));
    for steep in [1.4, -1.4, 0.0] {
        let mut boids = Boids::new(&params, &calibration, &lens, &tank, 30.0);
        boids.set_states(vec![[30.0; 3]], vec![unit([1.0, steep, 0.2])], None);
        (0..90).for_each(|_| boids.advance());
        let slope = |v: Vec3| v[1] / v[0].hypot(v[2]);
        let mut seen = Vec::new();
        for _ in 0..300 {
            boids.advance();
            seen.push(slope(boids.velocities()[0]));
        }
        let mean = seen.iter().sum::<f64>() / seen.len() as f64;
        assert!((mean - slopes.usual).abs() < 0.08, "from {steep}: {mean}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let params = Params {
        count: Some(300),
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
fn seeds_change_the_flock() {
    let seeded = |seed| {
        let school = preset("school");
        swim(View::Top, &Params { seed, ..school }, 2).0
    };
    assert_ne!(seeded(1), seeded(2));
    assert_eq!(seeded(1), seeded(1));
}

/// Returns the positions and the predator of `n_frames` frames, in a tank with a habitat.
fn with(params: &Params, n_frames: usize) -> (Vec<Vec<Vec3>>, Vec<Option<Vec3>>) {
    let library = synthetic::library(View::Top);
    let calibration = calibrated(&library, params);
    let (lens, tank) = (
        Lens::flat(40.0),
        Tank::new([0.5, 0.5, 0.0], [15.5, 11.5, 0.0]),
    );
    let mut boids = Boids::new(params, &calibration, &lens, &tank, 30.0);
    let frame = |_| {
        boids.advance();
        (boids.positions().to_vec(), boids.predator())
    };
    (0..n_frames).map(frame).unzip()
}

#[test]
fn boids_stay_out_of_obstacles() {
    let obstacles = vec![
        Obstacle::Circle {
            center_px: [200.0, 200.0],
            radius_px: 60.0,
        },
        Obstacle::Box {
            box_px: [400.0, 100.0, 60.0, 200.0],
        },
    ];
    let params = Params {
        obstacles,
        ..preset("swarm")
    };
    let (positions, _) = with(&params, 300);
    for p in positions.iter().flatten() {
        let from_disk = norm(vector::minus(*p, [5.0, 5.0, 0.0]));
        assert!(from_disk > 1.5 + 0.25, "{p:?}");
        let in_box = p[0] > 9.8 && p[0] < 11.7 && p[1] > 2.3 && p[1] < 7.7;
        assert!(!in_box, "{p:?}");
    }
}

#[test]
fn flock_reaches_its_goal_and_leaves_after_its_time() {
    let at = |at_px, from_s, until_s| Goal {
        at_px,
        depth_bl: None,
        from_s,
        until_s,
        weight: 2.0,
    };
    let params = Params {
        goals: vec![
            at([80.0, 80.0], 0.0, Some(10.0)),
            at([560.0, 400.0], 10.0, None),
        ],
        ..preset("school")
    };
    let (positions, _) = with(&params, 900);
    // A boid that cannot stop passes its goal again and again.
    let nearest = |frames: std::ops::Range<usize>, place: Vec3| {
        let off = |frame: usize| {
            let all = positions[frame]
                .iter()
                .map(|&p| norm(vector::minus(p, place)));
            all.sum::<f64>() / positions[frame].len() as f64
        };
        frames.map(off).fold(f64::INFINITY, f64::min)
    };
    let (first, second) = ([2.0, 2.0, 0.0], [14.0, 10.0, 0.0]);
    let came = [nearest(150..300, first), nearest(600..900, second)];
    assert!(came.iter().all(|&bl| bl < 2.5), "{came:?}");
    let stayed_away = [nearest(0..300, second), nearest(600..900, first)];
    assert!(stayed_away.iter().all(|&bl| bl > 5.0), "{stayed_away:?}");
}

#[test]
fn flock_keeps_away_from_a_predator() {
    let hunted = Params {
        predator: Some(Predator::default()),
        ..preset("school")
    };
    let (positions, predator) = with(&hunted, 400);
    let nearest = |frame: usize, place: Vec3| {
        let all = positions[frame]
            .iter()
            .map(|&p| norm(vector::minus(p, place)));
        all.fold(f64::INFINITY, f64::min)
    };
    let mean = (100..400)
        .map(|frame| nearest(frame, predator[frame].expect("it hunts")))
        .sum::<f64>()
        / 300.0;
    assert!(mean > 1.0, "{mean}");
    assert_eq!(with(&preset("school"), 1).1, [None]);
}
