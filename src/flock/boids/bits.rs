//! Every preset swims as it always did, to the last bit: a change that is only to be faster keeps these numbers, on
//! any machine, with any vector instructions and threads.

use super::calibration::{Calibration, Slopes};
use super::params::{Goal, Obstacle, Predator};
use super::tank::Tank;
use super::*;
use crate::flock::lens::Lens;

/// Of everybody's place and velocity after 40 frames: in the plane, and in a tank three body lengths deep, there of an
/// animal of any slope and of one whose slopes are limited.
const DIGESTS: [(&str, [u64; 3]); 6] = [
    (
        "school",
        [
            0x5c88_6421_384c_4c03,
            0xd624_7330_d2e2_3211,
            0x2eaf_5adb_cf19_d51d,
        ],
    ),
    (
        "swarm",
        [
            0xb5b3_3357_c44b_4949,
            0xfd7d_33e3_4711_b465,
            0x2281_bddb_e2dc_29d7,
        ],
    ),
    (
        "mill",
        [
            0xdbd0_783f_79d2_7834,
            0x488f_1b06_09ed_9c6b,
            0x1e87_6894_b8f7_0262,
        ],
    ),
    (
        "scatter",
        [
            0xa635_058c_6bb6_50e9,
            0x36b9_a186_ae0d_b381,
            0xd61c_4f40_5f50_d6d3,
        ],
    ),
    (
        "zonal",
        [
            0xdce6_da66_3297_dab3,
            0xb190_c590_08b7_b24e,
            0xe126_fbf4_1ccd_05e0,
        ],
    ),
    (
        "papers",
        [
            0xc091_5c60_3874_3464,
            0x93e2_777e_a7cb_6679,
            0xae69_ce29_e673_fa9e,
        ],
    ),
];

const SLOPES: Slopes = Slopes {
    limits: [0.5, 0.6],
    usual: 0.05,
    spread: 0.2,
    in_picture: 1e9,
};

/// A school among goals and obstacles, before a predator, half of it drawn to where it meets.
const DIGEST_OF_A_FULL_TANK: u64 = 0xb7ce_ad04_5a4d_39b5;

fn calibration(slopes: Option<Slopes>) -> Calibration {
    Calibration {
        turn_rad_per_s: 3.0,
        wander_rad_per_s: 1.5,
        slopes,
        ..Calibration::default()
    }
}

fn place(depth_bl: f64) -> (Lens, Tank) {
    let corner = [20.0, 15.0, depth_bl];
    (Lens::flat(40.0), Tank::new([0.0; 3], corner))
}

/// Of their next 40 frames.
fn digest(mut boids: Boids, cpu: Level) -> u64 {
    boids.cpu = cpu;
    (0..40).for_each(|_| boids.advance());
    let numbers = boids.positions().iter().chain(boids.velocities()).flatten();
    numbers.fold(0, |digest, number| {
        random::bits(digest, &[number.to_bits()])
    })
}

#[test]
fn every_preset_swims_as_it_always_did_to_the_last_bit() {
    for (name, expected) in DIGESTS {
        let params = Params {
            count: 150,
            ..Params::preset(name).expect("a known preset")
        };
        for cpu in Level::available() {
            let kinds = [(0.0, None), (3.0, None), (3.0, Some(SLOPES))];
            let found = kinds.map(|(depth_bl, slopes)| {
                let (calibration, (lens, tank)) = (calibration(slopes), place(depth_bl));
                digest(
                    Boids::at_random(&params, &calibration, (&lens, &tank), 30.0),
                    cpu,
                )
            });
            assert_eq!(found, expected, "{name} with {}", cpu.name());
        }
    }
}

#[test]
fn whatever_else_is_in_the_tank_they_swim_as_they_always_did_to_the_last_bit() {
    let (center_px, radius_px, box_px) = ([200.0, 300.0], 60.0, [500.0, 100.0, 80.0, 200.0]);
    let params = Params {
        count: 75,
        goals: vec![Goal {
            at_px: [700.0, 500.0],
            depth_bl: None,
            from_s: -1e6,
            until_s: None,
            weight: 2.0,
        }],
        obstacles: vec![
            Obstacle::Circle {
                center_px,
                radius_px,
            },
            Obstacle::Box { box_px },
        ],
        predator: Some(Predator::default()),
        ..Params::default()
    };
    let (calibration, (lens, tank)) = (calibration(Some(SLOPES)), place(3.0));
    for cpu in Level::available() {
        let mut boids = Boids::at_random(&params, &calibration, (&lens, &tank), 30.0);
        boids.hunter = boids.habitat.hunter();
        let places = boids.positions.iter().rev().copied();
        boids.meet(Meeting {
            share: 0.5,
            places: places.zip(boids.velocities.clone()).collect(),
        });
        let found = digest(boids, cpu);
        assert_eq!(found, DIGEST_OF_A_FULL_TANK, "with {}", cpu.name());
    }
}
