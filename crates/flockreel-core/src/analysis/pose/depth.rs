//! Position and direction in space from one frame (Nakajima et al., sections 5.3 and 6, corrected).
//!
//! The height of the silhouette gives the depth. The visible share of the known length at that depth gives
//! the angle to the image plane. The paper leaves open whether the animal swims away or toward the camera.
//! This module decides by the change of depth since the previous measured frame. Its values are raw;
//! `direction` has the best estimate. See docs/explanation/algorithms.md, "Corrections to the papers".

use crate::analysis::Params;
use crate::analysis::params::Eq7;
use crate::geometry::Camera;
use crate::library::{Animal, Poses, RawPose, View};

/// Writes the raw heading of every pose. In side view, with a camera and the animal's size, also the raw
/// position and direction. From above they are unknown, because the silhouette does not show the height.
pub(super) fn measure_raw(poses: &mut Poses, params: &Params) {
    let known = poses.camera.zip(poses.animal);
    let calibrated = known.filter(|_| poses.view == View::Side);
    let mut last_depth = None;
    for pose in &mut poses.frames {
        if !pose.detected() {
            continue;
        }
        let mut raw = RawPose {
            heading_rad: pose.heading_rad,
            ..RawPose::default()
        };
        let sizes = pose.length_px.zip(pose.height_px);
        // A silhouette cut by the border shows only a part of its height.
        let whole = sizes.filter(|&(_, height)| height > 0.0 && !pose.cut);
        if let (Some((camera, animal)), Some((length_px, height_px)), Some(centroid)) =
            (calibrated, whole, pose.centroid_px)
        {
            let (depth_m, cosine) =
                depth_and_cosine(&camera, &animal, length_px, height_px, params.eq7);
            raw.position_m = Some(camera.point_in_camera(centroid, depth_m));
            raw.gamma_rad = Some(libm::acos(cosine));
            let toward = last_depth.is_some_and(|last| depth_m < last);
            let sine = (1.0 - cosine * cosine).sqrt();
            raw.forward = pose.heading_rad.map(|heading| {
                let along = [libm::cos(heading), libm::sin(heading)];
                let away = if toward { -sine } else { sine };
                [cosine * along[0], cosine * along[1], away]
            });
            last_depth = Some(depth_m);
        }
        pose.raw = Some(raw);
    }
}

/// Returns the apparent depth (Nakajima et al., equation 7), metres, and the visible share of the length
/// (equation 8), 0..=1.
fn depth_and_cosine(
    camera: &Camera,
    animal: &Animal,
    length_px: f64,
    height_px: f64,
    eq7: Eq7,
) -> (f64, f64) {
    let depth_m = match eq7 {
        Eq7::Corrected => camera.apparent_depth_m(animal.height_m, height_px),
        Eq7::Printed => height_px / camera.pane_px_per_m / animal.height_m * camera.z_min_m,
    };
    let seen = length_px * animal.height_m / (height_px * animal.length_m);
    (depth_m, seen.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::Pose;

    const CAMERA: Camera = Camera {
        z_min_m: 0.7,
        pane_px_per_m: 1000.0,
        center_px: [320.0, 240.0],
        medium_index: 1.0,
    };
    const ANIMAL: Animal = Animal {
        length_m: 0.1,
        height_m: 0.05,
    };

    #[test]
    fn a_fish_at_double_distance_is_half_as_tall() {
        let near = depth_and_cosine(&CAMERA, &ANIMAL, 100.0, 50.0, Eq7::Corrected);
        let far = depth_and_cosine(&CAMERA, &ANIMAL, 50.0, 25.0, Eq7::Corrected);
        assert!((near.0 - 0.7).abs() < 1e-12 && (far.0 - 1.4).abs() < 1e-12);
        assert_eq!((near.1, far.1), (1.0, 1.0));
        let printed = depth_and_cosine(&CAMERA, &ANIMAL, 50.0, 25.0, Eq7::Printed);
        assert!(
            (printed.0 - 0.35).abs() < 1e-12,
            "as printed, it comes nearer"
        );
    }

    #[test]
    fn a_fish_seen_at_half_its_length_is_turned_by_sixty_degrees() {
        let (_, cosine) = depth_and_cosine(&CAMERA, &ANIMAL, 50.0, 50.0, Eq7::Corrected);
        assert!((libm::acos(cosine).to_degrees() - 60.0).abs() < 1e-9);
    }

    #[test]
    fn position_and_direction_in_space_are_measured_from_the_side_only() {
        let pose = Pose {
            centroid_px: Some([100.0, 80.0]),
            length_px: Some(50.0),
            height_px: Some(25.0),
            heading_rad: Some(0.5),
            ..Pose::default()
        };
        let measured = |view| {
            let mut poses = Poses {
                fps: 30.0,
                image_size_px: [640, 480],
                view,
                view_confidence: None,
                other_movers: Vec::new(),
                camera: Some(CAMERA),
                animal: Some(ANIMAL),
                frames: vec![pose.clone()],
                tail_beat: None,
            };
            measure_raw(&mut poses, &Params::default());
            poses.frames[0].raw.expect("a detected animal")
        };
        let from_side = measured(View::Side);
        assert!(from_side.position_m.is_some() && from_side.forward.is_some());
        let only_heading = RawPose {
            heading_rad: Some(0.5),
            ..RawPose::default()
        };
        assert_eq!(measured(View::Top), only_heading);
    }
}
