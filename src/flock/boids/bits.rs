//! Every preset swims as it always did, to the last bit: a change that is only to be faster keeps these numbers, on
//! any machine, with any vector instructions and threads.

use super::calibration::Calibration;
use super::tank::Tank;
use super::*;
use crate::flock::lens::Lens;

/// Of everybody's place and velocity after 40 frames: in the plane, and in a tank three body lengths deep.
const DIGESTS: [(&str, [u64; 2]); 6] = [
    ("school", [0xdfea_3783_0491_c69a, 0x450f_c029_b7e6_539e]),
    ("swarm", [0xe40c_f14c_cb83_6e9a, 0x76b6_bdc7_dfc6_4ec5]),
    ("mill", [0xae83_51aa_8055_2ee6, 0x136d_fec5_39fa_a72d]),
    ("scatter", [0x6264_4d79_e63d_a3a1, 0x874e_d9fb_9a3f_2bf0]),
    ("zonal", [0x1c09_d152_c0cf_5923, 0xd265_db4f_6c24_0514]),
    ("papers", [0xcfba_75f2_c14b_8423, 0x8ddc_ab51_7b57_b0ad]),
];

fn digest(params: &Params, depth_bl: f64) -> u64 {
    let calibration = Calibration {
        turn_rad_per_s: 3.0,
        wander_rad_per_s: 1.5,
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
        let found = [0.0, 3.0].map(|depth_bl| digest(&params, depth_bl));
        assert_eq!(found, expected, "{name}");
    }
}
