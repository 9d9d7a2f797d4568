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
            0xe40c_f14c_cb83_6e9a,
            0x76b6_bdc7_dfc6_4ec5,
            0xe366_4556_6975_b82f,
        ],
    ),
    (
        "mill",
        [
            0xae83_51aa_8055_2ee6,
            0x136d_fec5_39fa_a72d,
            0x7553_fc14_f539_c80a,
        ],
    ),
    (
        "scatter",
        [
            0x6264_4d79_e63d_a3a1,
            0x874e_d9fb_9a3f_2bf0,
            0x2b05_7e6a_a22d_932b,
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
