//! Projection of the tank: from positions in body lengths to pixels of the image, and back to walls. Sources:
//! Nakajima et al., section 5.1; docs/explanation/algorithms.md, "Boids" and "Placement".
//!
//! In top view and in a flat tank the scale is the same everywhere. In side view the library's camera is
//! used. Without one, a default camera is assumed, and the size of the animal in the image gives its
//! distance.

use super::boids::tank::Wall;
use super::boids::vector::{Vec3, norm, unit};
use super::params::Params;
use crate::geometry::{Camera, rounded};
use crate::library::{Library, Poses, View};
use crate::order::median;

/// Focal length of the default camera, image widths: a field of view of 53 degrees across. Free choice.
const DEFAULT_FOCAL_WIDTHS: f64 = 1.0;
/// Span of the median over silhouette heights, seconds. The median removes the opening and closing of fins.
/// Free choice.
const HEIGHT_SPAN_S: f64 = 0.5;
/// Time over which motion across the image and in depth are compared, seconds. Free choice. Posture changes
/// within this time.
const MOTION_SPAN_S: f64 = 0.5;

/// Projection from the tank to the image. Positions are in body lengths. Their origin is the corner of the
/// image for a flat lens, else the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Body length (BL) of the flock in the image, pixels. A flat lens has this scale at every depth.
    pub length_px: f64,
    camera: Option<Pinhole>,
}

/// Pinhole camera with the body length as its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Point where the optical axis meets the image, pixels.
    pub center_px: [f64; 2],
    /// Distance from the camera to the front pane, behind which the medium begins, body lengths.
    pub pane_bl: f64,
    /// Refractive index of the medium. 1 = no refraction.
    pub medium_index: f64,
    /// Metres per body length. `None` if unknown.
    pub metres: Option<f64>,
}

impl Lens {
    /// Returns the lens of a library. It is flat in top view, and if `depth_bl` is 0.
    pub fn new(library: &Library, params: &Params) -> Lens {
        let poses = &library.poses;
        let length_px = rounded(library.stats.length_px.unwrap_or(1.0).max(1.0), 2);
        let flat = poses.view == View::Top || params.depth_bl == Some(0.0);
        let known = (poses.camera)
            .zip(poses.animal)
            .filter(|_| poses.frames.iter().any(|pose| pose.position_m.is_some()));
        let pinhole = || match known {
            Some((camera, animal)) => Pinhole::from_camera(&camera, animal.length_m),
            None => Pinhole::default_for(poses.image_size_px.map(f64::from)),
        };
        Lens {
            length_px,
            camera: (!flat).then(pinhole),
        }
    }

    /// Returns a flat lens. `length_px` is the size of a body length.
    pub fn flat(length_px: f64) -> Lens {
        Lens::with(length_px, None)
    }

    /// Returns a lens with a camera, or a flat lens for `None`.
    pub fn with(length_px: f64, camera: Option<Pinhole>) -> Lens {
        Lens { length_px, camera }
    }

    /// Returns the camera, or `None` for a flat lens.
    pub fn camera(&self) -> Option<&Pinhole> {
        self.camera.as_ref()
    }

    /// Returns the lens with numbers rounded as in files.
    pub(super) fn rounded(&self) -> Lens {
        let rounded_camera = |camera: Pinhole| Pinhole {
            focal_px: rounded(camera.focal_px, 3),
            center_px: camera.center_px.map(|px| rounded(px, 3)),
            pane_bl: rounded(camera.pane_bl, 5),
            medium_index: rounded(camera.medium_index, 5),
            metres: camera.metres.map(|metres| rounded(metres, 5)),
        };
        Lens::with(self.length_px, self.camera.map(rounded_camera))
    }

    /// Returns whether the scale is the same at every depth.
    pub fn is_flat(&self) -> bool {
        self.camera.is_none()
    }

    /// Projects a position to the image, pixels.
    pub fn picture_px(&self, place: Vec3) -> [f64; 2] {
        let px = self.px_per_bl(place[2]);
        let center = self.camera.map_or([0.0; 2], |camera| camera.center_px);
        [center[0] + px * place[0], center[1] + px * place[1]]
    }

    /// Returns the position at a given depth that is seen at a point of the image.
    pub fn place_bl(&self, point_px: [f64; 2], depth_bl: f64) -> Vec3 {
        let px = self.px_per_bl(depth_bl);
        let center = self.camera.map_or([0.0; 2], |camera| camera.center_px);
        let [x, y] = [0, 1].map(|axis| (point_px[axis] - center[axis]) / px);
        [x, y, depth_bl]
    }

    /// Returns the size of a body length at a given depth, pixels.
    pub fn px_per_bl(&self, depth_bl: f64) -> f64 {
        match &self.camera {
            None => self.length_px,
            Some(camera) => camera.focal_px / camera.apparent_bl(depth_bl),
        }
    }

    /// Projects the velocity of a boid at `place` to the image. The result is in body lengths of `length_px`
    /// per second.
    pub fn picture_velocity(&self, place: Vec3, velocity: Vec3) -> [f64; 2] {
        let Some(camera) = &self.camera else {
            return [velocity[0], velocity[1]];
        };
        let receding = camera.receding(place, velocity);
        let px = camera.focal_px / camera.apparent_bl(place[2]) / self.length_px;
        [0, 1].map(|axis| px * (velocity[axis] - place[axis] * receding))
    }

    /// Returns the direction of the line of sight at `place`, a unit vector away from the camera. Motion
    /// along it does not change the position in the image.
    pub fn sight(&self, place: Vec3) -> Vec3 {
        let receding = self.receding(place, [0.0, 0.0, 1.0]);
        unit([place[0] * receding, place[1] * receding, 1.0])
    }

    /// Returns two vertical speeds, positive downward, for a boid at `place` with the other components of
    /// `velocity`. At the first its motion in the image is horizontal. The first plus or minus the second
    /// gives motion at 45 degrees in the image.
    pub fn seen_level(&self, place: Vec3, velocity: Vec3) -> [f64; 2] {
        let receding = self.receding(place, velocity);
        let across = velocity[0] - place[0] * receding;
        [place[1] * receding, across.abs()]
    }

    /// Returns `Pinhole::receding`, or 0 for a flat lens.
    fn receding(&self, place: Vec3, velocity: Vec3) -> f64 {
        match &self.camera {
            Some(camera) => camera.receding(place, velocity),
            None => 0.0,
        }
    }

    /// Returns the distance from the camera at which a body length has `px_per_bl` pixels, body lengths.
    /// Returns 0 for a flat lens.
    pub fn depth_at_bl(&self, px_per_bl: f64) -> f64 {
        self.camera.map_or(0.0, |camera| {
            camera.pane_bl
                + camera.medium_index * (camera.focal_px / px_per_bl.max(1e-6) - camera.pane_bl)
        })
    }

    /// Converts body lengths to metres. Returns `None` if the scale is unknown.
    pub fn metres(&self, bl: f64) -> Option<f64> {
        Some(self.camera?.metres? * bl)
    }

    /// Returns the wall that is seen as the line `outward . p = offset_px`, moved into the tank by
    /// `margin_bl`. `outward` is a unit vector in the image.
    pub fn wall(&self, outward: [f64; 2], offset_px: f64, margin_bl: f64) -> Wall {
        let Some(camera) = &self.camera else {
            return Wall {
                outward: [outward[0], outward[1], 0.0],
                offset_bl: offset_px / self.length_px - margin_bl,
            };
        };
        // outward . (x, y) <= slope (pane + (z - pane) / n): a plane, in general not through the camera.
        let [cx, cy] = camera.center_px;
        let slope = (offset_px - outward[0] * cx - outward[1] * cy) / camera.focal_px;
        let normal = [outward[0], outward[1], -slope / camera.medium_index];
        let length = norm(normal);
        Wall {
            outward: normal.map(|part| part / length),
            offset_bl: slope * camera.pane_bl * (1.0 - 1.0 / camera.medium_index) / length
                - margin_bl,
        }
    }
}

impl Pinhole {
    fn from_camera(camera: &Camera, length_m: f64) -> Pinhole {
        Pinhole {
            focal_px: camera.focal_px(),
            center_px: camera.center_px,
            pane_bl: camera.z_min_m / length_m,
            medium_index: camera.medium_index,
            metres: Some(length_m),
        }
    }

    fn default_for(size_px: [f64; 2]) -> Pinhole {
        Pinhole {
            focal_px: DEFAULT_FOCAL_WIDTHS * size_px[0],
            center_px: size_px.map(|side| side / 2.0),
            pane_bl: 0.0,
            medium_index: 1.0,
            metres: None,
        }
    }

    /// Returns the distance at which a boid appears, refracted at the front pane, body lengths.
    fn apparent_bl(&self, depth_bl: f64) -> f64 {
        let beyond_bl = (depth_bl - self.pane_bl) / self.medium_index;
        (self.pane_bl + beyond_bl).max(0.05)
    }

    /// Returns the growth rate of the apparent depth of a boid at `place` with `velocity`, as a share per
    /// second.
    fn receding(&self, place: Vec3, velocity: Vec3) -> f64 {
        velocity[2] / self.medium_index / self.apparent_bl(place[2])
    }
}

/// Returns the depth of the animal in each frame, body lengths. It comes from the measured position if the
/// scale in metres is known, else from the height of the silhouette. It is 0 if neither is known, and for a
/// flat lens.
pub fn depths_bl(library: &Library, lens: &Lens) -> Vec<f64> {
    let frames = &library.poses.frames;
    if lens.is_flat() {
        return vec![0.0; frames.len()];
    }
    if let Some(length_m) = lens.camera.and_then(|camera| camera.metres) {
        let depth = |pose: &crate::library::Pose| pose.position_m.map_or(0.0, |p| p[2] / length_m);
        return frames.iter().map(depth).collect();
    }
    let heights: Vec<Option<f64>> = frames.iter().map(|pose| pose.height_px).collect();
    let usual_px = median(heights.iter().flatten().copied()).unwrap_or(1.0);
    let reach = (HEIGHT_SPAN_S * library.poses.fps / 2.0).round() as usize;
    let nearness = |frame: usize| {
        let around = frame.saturating_sub(reach)..(frame + reach + 1).min(frames.len());
        Some(median(heights[around].iter().flatten().copied())? / usual_px)
    };
    let nearness: Vec<Option<f64>> = (0..frames.len()).map(nearness).collect();
    let share = share_of_depth(&library.poses, &nearness, lens);
    let depth = |near: &Option<f64>| {
        near.map_or(0.0, |near| {
            lens.depth_at_bl(lens.length_px * libm::pow(near, share))
        })
    };
    nearness.iter().map(depth).collect()
}

/// Returns the share of the changes in silhouette height that comes from depth, 0..=1. `nearness` is the
/// height over its median, by frame.
///
/// The animal is assumed to move as much in depth as across the image. If the height changes by more, the
/// rest is posture, as in a bird that crouches and stretches on its perch.
fn share_of_depth(poses: &Poses, nearness: &[Option<f64>], lens: &Lens) -> f64 {
    let span = ((MOTION_SPAN_S * poses.fps).round() as usize).max(1);
    let depth_bl = lens.depth_at_bl(lens.length_px);
    let moved = |frame: usize| {
        let [from, to] = [frame, frame + span]
            .map(|frame| Some((poses.frames.get(frame)?.centroid_px?, nearness[frame]?)));
        let ((from_px, from_near), (to_px, to_near)) = (from?, to?);
        let across_bl = libm::hypot(to_px[0] - from_px[0], to_px[1] - from_px[1]) / lens.length_px;
        Some((across_bl, depth_bl * libm::log(to_near / from_near).abs()))
    };
    let (across_bl, deep_bl): (Vec<f64>, Vec<f64>) = (0..poses.frames.len().saturating_sub(span))
        .filter_map(moved)
        .unzip();
    match (median(across_bl.into_iter()), median(deep_bl.into_iter())) {
        (Some(across_bl), Some(deep_bl)) if across_bl < deep_bl => across_bl / deep_bl,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::boids::vector::dot;
    use proptest::prelude::*;

    fn lens(medium_index: f64) -> Lens {
        let camera = Camera {
            z_min_m: 0.7,
            pane_px_per_m: 1000.0,
            center_px: [320.0, 240.0],
            medium_index,
        };
        Lens {
            length_px: 90.0,
            camera: Some(Pinhole::from_camera(&camera, 0.1)),
        }
    }

    proptest! {
        #[test]
        fn places_inside_a_wall_are_seen_inside_its_line(
            x in -6.0..6.0f64, y in -6.0..6.0f64, z in 7.0..14.0f64,
            turn in 0.0..std::f64::consts::TAU, offset_px in 0.0..600.0f64, n in 1.0..1.5f64,
        ) {
            for lens in [lens(n), Lens::flat(90.0)] {
                let outward = [libm::cos(turn), libm::sin(turn)];
                let wall = lens.wall(outward, offset_px, 0.0);
                let [px, py] = lens.picture_px([x, y, z]);
                let beyond_px = outward[0] * px + outward[1] * py - offset_px;
                let beyond_bl = dot(wall.outward, [x, y, z]) - wall.offset_bl;
                prop_assert!(beyond_px.abs() < 1e-6 || (beyond_px > 0.0) == (beyond_bl > 0.0));
            }
        }

        #[test]
        fn image_velocity_is_the_rate_of_the_image_position(
            x in -4.0..4.0f64, y in -4.0..4.0f64, z in 7.0..14.0f64,
            v in prop::array::uniform3(-2.0..2.0f64), n in 1.0..1.5f64,
        ) {
            let (lens, dt) = (lens(n), 1e-6);
            let [from, to] = [0.0, dt].map(|t| {
                lens.picture_px([x + t * v[0], y + t * v[1], z + t * v[2]])
            });
            let velocity = lens.picture_velocity([x, y, z], v);
            for axis in 0..2 {
                let rate = (to[axis] - from[axis]) / dt / 90.0;
                prop_assert!((rate - velocity[axis]).abs() < 1e-3, "{rate} {velocity:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn vertical_speeds_give_level_or_diagonal_motion_in_the_image(
            x in -4.0..4.0f64, y in -4.0..4.0f64, z in 7.0..14.0f64,
            v in prop::array::uniform3(-2.0..2.0f64), n in 1.0..1.5f64,
        ) {
            for lens in [lens(n), Lens::flat(90.0)] {
                let [level, across] = lens.seen_level([x, y, z], v);
                let seen = |sinks| lens.picture_velocity([x, y, z], [v[0], sinks, v[2]]);
                prop_assert!(seen(level)[1].abs() < 1e-9);
                for sinks in [level - across, level + across] {
                    let [right, down] = seen(sinks).map(f64::abs);
                    prop_assert!((right - down).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn depth_of_a_size_has_that_size() {
        for lens in [lens(1.0), lens(4.0 / 3.0)] {
            let depth = lens.depth_at_bl(60.0);
            assert!((lens.px_per_bl(depth) - 60.0).abs() < 1e-9);
        }
    }

    #[test]
    fn animal_that_stretches_in_place_keeps_its_depth() {
        let mut library = crate::flock::synthetic::library(View::Side);
        let lens = Lens::new(&library, &Params::default());
        let fps = library.poses.fps;
        for (frame, pose) in library.poses.frames.iter_mut().enumerate() {
            let stretched = libm::sin(frame as f64 / fps);
            pose.height_px = Some(30.0 * (1.0 + 0.3 * stretched));
            pose.centroid_px = Some([100.0 + 2.0 * stretched, 80.0]);
        }
        let spread = |library: &Library| {
            let depths = depths_bl(library, &lens);
            let farthest = depths.iter().copied().fold(0.0, f64::max);
            farthest / depths.iter().copied().fold(f64::INFINITY, f64::min)
        };
        let standing = spread(&library);
        assert!(standing < 1.1, "{standing}");
        for (frame, pose) in library.poses.frames.iter_mut().enumerate() {
            pose.centroid_px = Some([100.0 + 300.0 * libm::sin(frame as f64 / fps), 80.0]);
        }
        let swimming = spread(&library);
        assert!(swimming > 1.5, "{swimming}");
    }
}
