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
            0xfd14_c8c5_7e78_9832,
            0x93e4_f3b0_6c49_b751,
            0x3f07_4642_30cf_747b,
        ],
    ),
    (
        "swarm",
        [
            0xa0b2_afa5_b22b_a59e,
            0x22b0_0c10_2e48_8de2,
            0xf336_5f9d_6562_02f9,
        ],
    ),
    (
        "mill",
        [
            0x33f7_bd6c_3e3e_54cb,
            0xda27_0599_ab6c_a467,
            0x57ac_5fc7_5595_f1f6,
        ],
    ),
    (
        "scatter",
        [
            0x4548_4d38_6c4b_7d01,
            0x5151_3e7f_b2a9_dbc6,
            0x9a63_5fd8_116a_3781,
        ],
    ),
    (
        "zonal",
        [
            0xcd94_a349_1415_f2b1,
            0x4b79_0b85_38ff_af6d,
            0x31bb_defc_1791_be48,
        ],
    ),
    (
        "papers",
        [
            0x8931_5b8c_e146_598b,
            0x8cdd_41d8_9f6a_5d92,
            0x77b6_d78f_70d1_9e2e,
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
const DIGEST_OF_A_FULL_TANK: u64 = 0x9d24_a9e8_f1ec_4b94;

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
