//! Tests of the presets: order in wide and narrow tanks, of fast and slow animals.

use std::convert::Infallible;

use super::calibration::Slopes;
use super::measures::Order;
use super::params::Zones;
use super::vector::{add_scaled, cross, minus, norm, unit};
use super::*;
use crate::flock::lens::Lens;
use crate::parameters::Parameters;

impl<'a> Boids<'a> {
    /// Returns boids that have formed a flock.
    pub(super) fn new(
        params: &'a Params,
        calibration: &'a Calibration,
        lens: &'a Lens,
        tank: &'a Tank,
        fps: f64,
    ) -> Self {
        let mut boids = Boids::at_random(params, calibration, lens, tank, fps);
        let Ok(()) = boids.form(|| Ok::<(), Infallible>(()));
        boids
    }
}

fn preset(name: &str) -> Params {
    Params::preset(name).expect("a known preset")
}

/// Cruising speed, and least and greatest speed, of a lively animal and of one that mostly rests, body
/// lengths per second.
const ANIMALS: [(f64, [f64; 2]); 2] = [(1.0, [0.5, 1.5]), (0.2, [0.05, 0.8])];

/// Sizes of tanks, body lengths: one in top view, and three in side view of decreasing size.
const TANKS: [[f64; 3]; 4] = [
    [12.0, 9.0, 0.0],
    [16.0, 6.0, 5.0],
    [12.0, 5.0, 4.0],
    [7.0, 4.0, 3.0],
];

/// Returns the mean order over 15 s.
fn order(
    (name, count, seed): (&str, u32, u64),
    (cruise_bl_per_s, speed_limits_bl_per_s): (f64, [f64; 2]),
    greatest: Vec3,
) -> Order {
    let calibration = Calibration {
        cruise_bl_per_s,
        speed_limits_bl_per_s,
        turn_rad_per_s: 3.0,
        wander_rad_per_s: 1.0,
        slopes: (greatest[2] > 0.0).then_some(Slopes {
            limits: [0.5, 0.5],
            usual: 0.0,
            spread: 0.2,
            in_picture: [0.5; 2],
        }),
    };
    let params = Params {
        count: Some(count),
        seed,
        ..preset(name)
    };
    let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], greatest));
    let mut boids = Boids::new(&params, &calibration, &lens, &tank, 30.0);
    let (mut mean, n_frames) = (Order::default(), 450);
    for _ in 0..n_frames {
        boids.advance();
        let now = boids.order();
        mean.polarization += now.polarization / f64::from(n_frames);
        mean.milling += now.milling / f64::from(n_frames);
    }
    mean
}

/// Returns the tanks, animals and seeds for which `holds` is false.
fn exceptions(name: &str, count: u32, holds: fn(&Order) -> bool) -> Vec<String> {
    exceptions_of(&ANIMALS, &TANKS, (name, count), holds)
}

fn exceptions_of(
    animals: &[(f64, [f64; 2])],
    tanks: &[Vec3],
    (name, count): (&str, u32),
    holds: fn(&Order) -> bool,
) -> Vec<String> {
    let mut all = Vec::new();
    for &tank in tanks {
        for &animal in animals {
            for seed in 1..=6 {
                let order = order((name, count, seed), animal, tank);
                if !holds(&order) {
                    all.push(format!("{tank:?} {animal:?} seed {seed}: {order:?}"));
                }
            }
        }
    }
    all
}

#[test]
fn school_is_polarized() {
    let is_polarized = |order: &Order| order.polarization > 0.65;
    let none = exceptions_of(&ANIMALS[..1], &TANKS, ("school", 20), is_polarized);
    assert!(none.is_empty(), "{none:#?}");
}

/// A slow school takes long to turn in a corner and points in all directions meanwhile, sometimes for all
/// 15 s.
#[test]
fn slow_school_is_polarized_on_average() {
    for tank in TANKS {
        let of_seed = |seed| order(("school", 20, seed), ANIMALS[1], tank).polarization;
        let orders: Vec<f64> = (1..=6).map(of_seed).collect();
        let mean = orders.iter().sum::<f64>() / 6.0;
        assert!(mean > 0.8, "{tank:?} {mean}: {orders:?}");
    }
}

#[test]
fn large_school_in_a_deep_tank_is_polarized() {
    let deep = [[12.0, 8.0, 12.0], [9.0, 7.0, 14.0]];
    let is_polarized = |order: &Order| order.polarization > 0.65;
    let none = exceptions_of(&ANIMALS, &deep, ("school", 200), is_polarized);
    assert!(none.is_empty(), "{none:#?}");
}

#[test]
fn swarm_is_neither_polarized_nor_milling() {
    let none = exceptions("swarm", 20, |order| {
        order.polarization < 0.35 && order.milling < 0.35
    });
    assert!(none.is_empty(), "{none:#?}");
}

#[test]
fn mill_circles_without_polarization() {
    let none = exceptions("mill", 12, |order| {
        order.polarization < 0.35 && order.milling > 0.65
    });
    assert!(none.is_empty(), "{none:#?}");
}

/// Boids in open water, with the parameters of Couzin et al.: 3 units per second, 40 degrees per second.
fn open_water(orientation_bl: f64) -> (Params, Calibration, Tank) {
    let mut params = Params {
        count: Some(100),
        ..preset("zonal")
    };
    params.leaders = false;
    params.rules.view_deg = 270.0;
    params.rules.zones = Some(Zones {
        orientation_bl,
        attraction_bl: 14.0,
        ..Zones::default()
    });
    let calibration = Calibration {
        cruise_bl_per_s: 3.0,
        speed_limits_bl_per_s: [3.0, 3.0],
        turn_rad_per_s: 40f64.to_radians(),
        wander_rad_per_s: 40f64.to_radians(),
        ..Calibration::default()
    };
    (params, calibration, Tank::new([-1e4; 3], [1e4; 3]))
}

/// Returns polarization and rotation about the axis of the group, mean over the second half of `n_frames`.
/// The boids start in a small cube.
fn group(orientation_bl: f64, n_frames: u32) -> (f64, f64) {
    let (params, calibration, tank) = open_water(orientation_bl);
    let lens = Lens::flat(40.0);
    let mut boids = Boids::new(&params, &calibration, &lens, &tank, 10.0);
    let cube = (0..u64::from(params.most_individuals())).map(|id| {
        let draw = |word| 2.0 * random::uniform(7, &[id, word]) - 1.0;
        let position = [0, 1, 2].map(|axis| 5.0 * draw(axis));
        (position, scaled(3.0, unit([3, 4, 5].map(draw))))
    });
    let (positions, velocities) = cube.unzip();
    boids.set_states(positions, velocities, None);
    let (mut polarization, mut rotation) = (0.0, 0.0);
    for frame in 0..n_frames {
        boids.advance();
        if frame >= n_frames / 2 {
            let n = boids.positions().len() as f64;
            let sum = |of: &dyn Fn(usize) -> Vec3| {
                (0..boids.positions().len()).fold([0.0; 3], |sum, id| add_scaled(sum, 1.0, of(id)))
            };
            let middle = scaled(1.0 / n, sum(&|id| boids.positions()[id]));
            let spin = |id: usize| {
                let out = minus(boids.positions()[id], middle);
                cross(unit(out), unit(boids.velocities()[id]))
            };
            polarization += norm(sum(&|id| unit(boids.velocities()[id]))) / n;
            rotation += norm(sum(&spin)) / n;
        }
    }
    let half = f64::from(n_frames - n_frames / 2);
    (polarization / half, rotation / half)
}

#[test]
fn wider_orientation_zones_give_swarm_torus_and_school() {
    let [swarm, torus, school] = [0.0, 2.0, 10.0].map(|width| group(width, 2000));
    assert!(swarm.0 < 0.35 && swarm.1 < 0.35, "{swarm:?}");
    assert!(torus.0 < 0.35 && torus.1 > 0.6, "{torus:?}");
    assert!(school.0 > 0.9 && school.1 < 0.35, "{school:?}");
}
