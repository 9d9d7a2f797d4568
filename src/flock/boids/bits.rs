//! Every preset swims as it always did, to the last bit: a change that is only to be faster keeps these numbers, on
//! any machine, with any vector instructions and threads.

use super::calibration::{Calibration, Slopes};
use super::tank::Tank;
use super::*;
use crate::flock::lens::Lens;

/// Of everybody's place and velocity after 40 frames: in the plane, and in a tank three body lengths deep, there of an
/// animal of any slope and of one whose slopes are limited.
const DIGESTS: [(&str, [u64; 3]); 6] = [
    (
        "school",
        [
            0xdfea_3783_0491_c69a,
            0x450f_c029_b7e6_539e,
            0x34cf_147d_02f9_6ff5,
        ],
    ),
    (
        "swarm",
        [
            0xe734_5c0f_c9b7_11c1,
            0x1940_b59a_6069_73d0,
            0xa55e_006e_fca6_6d8d,
        ],
    ),
    (
        "mill",
        [
            0x9819_68b8_66fc_93b4,
            0x7430_977b_0cab_69df,
            0x5723_ce03_26c9_2cb8,
        ],
    ),
    (
        "scatter",
        [
            0xd11d_096f_0764_abb1,
            0x1376_cb80_2ce7_8f89,
            0x7f52_4765_b857_8f39,
        ],
    ),
    (
        "zonal",
        [
            0x1c09_d152_c0cf_5923,
            0xd265_db4f_6c24_0514,
            0x0393_11ed_8d69_3514,
        ],
    ),
    (
        "papers",
        [
            0xcfba_75f2_c14b_8423,
            0x8ddc_ab51_7b57_b0ad,
            0xbf61_ea4e_276d_b5bb,
        ],
    ),
];

const SLOPES: Slopes = Slopes {
    limits: [0.5, 0.6],
    usual: 0.05,
    spread: 0.2,
    in_picture: 1e9,
};

fn digest(params: &Params, depth_bl: f64, slopes: Option<Slopes>) -> u64 {
    let calibration = Calibration {
        turn_rad_per_s: 3.0,
        wander_rad_per_s: 1.5,
        slopes,
        ..Calibration::default()
    };
    let (lens, tank) = (
        Lens::flat(40.0),
        Tank::new([0.0; 3], [20.0, 15.0, depth_bl]),
    );
    let mut boids = Boids::at_random(params, &calibration, (&lens, &tank), 30.0);
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
        let kinds = [(0.0, None), (3.0, None), (3.0, Some(SLOPES))];
        let found = kinds.map(|(depth_bl, slopes)| digest(&params, depth_bl, slopes));
        assert_eq!(found, expected, "{name}");
    }
}
