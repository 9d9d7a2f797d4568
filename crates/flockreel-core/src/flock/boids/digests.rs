//! Digests of simulations. A change that is meant only to be faster keeps them, on any machine and for any
//! number of threads.

use super::calibration::{Calibration, Slopes};
use super::params::{Goal, Obstacle, Predator};
use super::tank::Tank;
use super::*;
use crate::flock::lens::Lens;
use crate::parameters::Parameters;

/// Digests of each preset: in a flat tank, in a tank three body lengths deep, and there with limited slopes.
const DIGESTS: [(&str, [u64; 3]); 6] = [
    (
        "school",
        [
            0x3620_a364_8fb5_47d5,
            0x90a3_cdcf_47a4_352f,
            0xf246_1abd_0efc_9df5,
        ],
    ),
    (
        "swarm",
        [
            0x25e1_92f6_8836_f025,
            0xd176_d9a9_4cfe_ee1f,
            0x62e6_9b90_29f8_7624,
        ],
    ),
    (
        "mill",
        [
            0x80e8_cf01_082c_0cd0,
            0x5c1a_adf6_8c3c_36a4,
            0xb429_89d6_25fe_f63c,
        ],
    ),
    (
        "scatter",
        [
            0x2eb4_2824_15fe_4c5d,
            0x3770_571f_4e8b_831a,
            0x121a_deea_e73d_f7ab,
        ],
    ),
    (
        "zonal",
        [
            0x38f3_9e25_ee5e_23d3,
            0x500f_7a5c_fd72_896b,
            0xec1c_68c5_a16e_c5de,
        ],
    ),
    (
        "papers",
        [
            0x41f7_2fd7_c583_6ab3,
            0x2be5_e0e0_af53_767d,
            0xa101_d9f4_58cc_f784,
        ],
    ),
];

const SLOPES: Slopes = Slopes {
    limits: [0.5, 0.6],
    usual: 0.05,
    spread: 0.2,
    in_picture: [1e9; 2],
};

/// Digest of a school with goals, obstacles, a predator and target states.
const DIGEST_OF_ALL_FEATURES: u64 = 0xeecb_40e3_b462_3b35;

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

/// Returns the digest of all positions and velocities after 40 frames.
fn digest(mut boids: Boids) -> u64 {
    (0..40).for_each(|_| boids.advance());
    let numbers = boids.positions().iter().chain(boids.velocities()).flatten();
    numbers.fold(0, |digest, number| {
        random::bits(digest, &[number.to_bits()])
    })
}

#[test]
fn presets_keep_their_digests() {
    for (name, expected) in DIGESTS {
        let params = Params {
            count: Some(150),
            ..Params::preset(name).expect("a known preset")
        };
        let found = [(0.0, None), (3.0, None), (3.0, Some(SLOPES))].map(|(depth_bl, slopes)| {
            let (calibration, (lens, tank)) = (calibration(slopes), place(depth_bl));
            let boids = Boids::at_random(&params, &calibration, &lens, &tank, 30.0);
            digest(boids)
        });
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn tank_with_all_features_keeps_its_digest() {
    let (center_px, radius_px, box_px) = ([200.0, 300.0], 60.0, [500.0, 100.0, 80.0, 200.0]);
    let params = Params {
        count: Some(75),
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
    let mut boids = Boids::at_random(&params, &calibration, &lens, &tank, 30.0);
    boids.predator = boids.habitat.initial_predator();
    let positions = boids.positions.iter().rev().copied();
    boids.steer_toward(TargetStates {
        weight: 0.5,
        states: positions.zip(boids.velocities.clone()).collect(),
    });
    assert_eq!(digest(boids), DIGEST_OF_ALL_FEATURES);
}
