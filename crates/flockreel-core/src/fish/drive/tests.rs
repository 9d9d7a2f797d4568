//! Tests of `drive`: the fish has the position and direction of the animal, and is invisible where nothing
//! is known.

use std::f64::consts::PI;

use super::*;
use crate::fish::sample::{SampleFilm, SampleParams};

fn truth(n_frames: usize) -> (SampleFilm, Poses) {
    let params = SampleParams {
        n_frames,
        width: 320,
        height: 240,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).expect("in range");
    let poses = film.truth();
    (film, poses)
}

/// Returns the poses of a fish that crosses the image to the right, turns around and comes back. There is
/// no camera.
fn uncalibrated(view: View) -> Poses {
    let frames = (0..120).map(|k| {
        let t = f64::from(k);
        let (x, heading) = if k < 60 {
            (20.0 + t, 0.0)
        } else {
            (140.0 - t, PI)
        };
        Pose {
            centroid_px: Some([x, 50.0]),
            heading_rad: Some(heading),
            length_px: Some(40.0),
            ..Pose::default()
        }
    });
    Poses {
        tail_beat: None,
        fps: 30.0,
        image_size_px: [160, 100],
        view,
        view_confidence: None,
        other_movers: Vec::new(),
        camera: None,
        animal: None,
        frames: frames.collect(),
    }
}

#[test]
fn motion_from_true_poses_equals_the_sample_motion() {
    let (film, poses) = truth(150);
    let motion = drive(&poses, &Params::default(), None).expect("it was seen");
    for (k, (got, want)) in motion.frames.iter().zip(&film.motion().frames).enumerate() {
        assert!(got.visible);
        assert!(
            (got.position_m - want.position_m).length() < 0.004,
            "frame {k}"
        );
        assert!(
            got.forward().angle_between(want.forward()) < 0.12,
            "frame {k}"
        );
    }
}

#[test]
fn measured_values_are_unchanged_without_smoothing_and_roll() {
    let (_, poses) = truth(30);
    let motion = drive(&poses, &Params::papers(), None).expect("it was seen");
    for (got, pose) in motion.frames.iter().zip(&poses.frames) {
        let (position, forward) = (pose.position_m.expect("true"), pose.forward.expect("true"));
        assert!((got.position_m - DVec3::from(position)).length() < 1e-12);
        assert!((got.forward() - DVec3::from(forward)).length() < 1e-9);
        assert_eq!(got.joint_angles_rad, [0.0; N_JOINTS]);
    }
}

#[test]
fn successive_quaternions_keep_their_sign() {
    let (_, poses) = truth(600);
    let motion = drive(&poses, &Params::default(), None).expect("it was seen");
    for pair in motion.frames.windows(2) {
        assert!(pair[0].rotation.dot(pair[1].rotation) > 0.9);
        assert!((pair[1].rotation.length() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn short_gaps_are_filled_and_long_gaps_hide_the_fish() {
    let (film, mut poses) = truth(120);
    for k in (20..30).chain(60..90) {
        poses.frames[k] = Pose::default();
    }
    let motion = drive(&poses, &Params::default(), None).expect("it was seen");
    for (k, posture) in motion.frames.iter().enumerate() {
        assert_eq!(posture.visible, !(60..90).contains(&k), "frame {k}");
    }
    for k in 20..30 {
        let gap = motion.frames[k].position_m - film.motion().frames[k].position_m;
        assert!(gap.length() < 0.02, "frame {k}: {}", gap.length());
    }
}

#[test]
fn uncalibrated_fish_has_the_filmed_position_and_length() {
    let poses = uncalibrated(View::Side);
    let motion = drive(&poses, &Params::default(), None).expect("it was seen");
    for (posture, pose) in motion.frames.iter().zip(&poses.frames) {
        let [x, y] = motion
            .camera
            .image_from_camera(posture.position_m.to_array());
        let [cx, cy] = pose.centroid_px.expect("seen");
        assert!((x - cx).hypot(y - cy) < 1.5);
    }
    let length_px = motion.size.length_m * motion.camera.focal_px() / motion.frames[0].position_m.z;
    assert!((length_px - 40.0).abs() < 1e-9);
}

#[test]
fn uncalibrated_turns_pass_the_camera_upright() {
    let motion = drive(&uncalibrated(View::Side), &Params::default(), None).expect("it was seen");
    let facing_camera = motion.frames.iter().any(|p| p.forward().z < -0.8);
    assert!(facing_camera, "it does not flip from one side to the other");
    for pair in motion.frames.windows(2) {
        assert!(
            (pair[1].rotation * DVec3::Y).y > 0.9,
            "the belly stays below"
        );
        assert!(pair[0].forward().angle_between(pair[1].forward()) < 0.8);
    }
}

#[test]
fn top_view_shows_the_back() {
    let motion = drive(&uncalibrated(View::Top), &Params::default(), None).expect("it was seen");
    for posture in &motion.frames {
        assert!(
            (posture.rotation * DVec3::Y).z > 0.999,
            "the belly faces away"
        );
        assert!(posture.forward().x.abs() > 0.99 || posture.forward().z.abs() < 1e-6);
    }
}

#[test]
fn midline_bends_the_spine() {
    let mut poses = uncalibrated(View::Top);
    for pose in &mut poses.frames[..60] {
        let [x, y] = pose.centroid_px.expect("seen");
        let arc = (0..11).map(|k| f64::from(k) / 10.0);
        pose.midline_px = Some(
            arc.map(|s| [x + 20.0 - 40.0 * s, y - 10.0 * s * s])
                .collect(),
        );
    }
    let motion = drive(&poses, &Params::default(), None).expect("it was seen");
    assert!(
        motion.frames[30]
            .joint_angles_rad
            .iter()
            .skip(1)
            .all(|a| *a > 0.01)
    );
}

#[test]
fn undetected_animal_is_refused() {
    let mut poses = uncalibrated(View::Side);
    poses.frames.fill(Pose::default());
    let refused = drive(&poses, &Params::default(), None);
    assert_eq!(refused, Err(Error::NothingMoves { n_frames: 120 }));
}
