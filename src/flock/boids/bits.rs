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
            0x4288_e019_c1c8_b215,
            0x4b63_ab7b_d563_9c09,
            0xc9a3_159a_6759_41d3,
        ],
    ),
    (
        "swarm",
        [
            0xe0eb_121b_c5a5_16da,
            0x6689_1d40_2492_71f6,
            0x4c7f_2304_9f6f_cafa,
        ],
    ),
    (
        "mill",
        [
            0xb117_7420_fd2f_063a,
            0xda20_0e83_1106_b648,
            0xafed_8da0_60e0_1b89,
        ],
    ),
    (
        "scatter",
        [
            0xa891_5007_84a2_9afb,
            0xfa0c_8700_73d5_0d72,
            0x262b_42a3_cd38_9b9c,
        ],
    ),
    (
        "zonal",
        [
            0x6072_e428_6f0c_7ffa,
            0xe69a_f7c8_c964_2023,
            0x5a2d_1a3b_4b66_d8a9,
        ],
    ),
    (
        "papers",
        [
            0xcbe0_bcda_6075_9877,
            0x10b2_7df3_6188_fe2c,
            0xcd9f_119d_e73d_b22d,
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
const DIGEST_OF_A_FULL_TANK: u64 = 0x36e1_0330_42ca_e39a;

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
