//! Motion of the filmed animal at each frame of the footage. Boids are calibrated by it and plans are matched
//! to it (docs/explanation/algorithms.md, "Boids" and "Planning").

use super::boids::vector::{Vec3, angle_between, unit};
use super::individual::MotionState;
use super::lens::{Lens, depths_bl};
use crate::geometry::wrap_rad;
use crate::library::{Library, Pose, View};
use crate::order::median;

/// Least share of the direction in the image plane for which a speed in space is given. Free choice.
const MIN_LEVEL_FOR_PACE: f64 = 0.7;
/// Least share of the direction in the image plane by which a speed in the image is divided. Free choice. An
/// animal seen head-on also moves sideways, so the quotient would otherwise grow without bound.
const MIN_LEVEL: f64 = 0.5;
/// Time before and after a frame over which directions are compared, seconds. Free choice.
const TURN_SPAN_S: f64 = 0.1;

/// Speed below which the animal rests, body lengths per second. Free choice.
pub(super) const REST_BL_PER_S: f64 = 0.1;
/// Speed below which the animal is slow, as a share of its usual speed. Free choice.
const SLOW_SHARE: f64 = 0.5;
/// Speed from which the animal darts, as a share of its usual speed. Free choice.
const DART_SHARE: f64 = 2.0;

/// Motion of the animal at one frame of the footage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameMotion {
    /// Heading in the image, radians.
    pub heading_rad: f64,
    /// Rate of change of the heading, radians per second.
    pub turn_rad_per_s: f64,
    /// Speed of the centroid in the image, body lengths per second.
    pub speed_bl_per_s: f64,
    /// Velocity of the centroid in the image, body lengths per second.
    pub velocity_bl_per_s: [f64; 2],
    /// Direction in space, a unit vector, or zeros if unknown. It points away from the camera if the sign is
    /// unknown.
    pub forward: Vec3,
    /// Distance from the camera, body lengths; 0 for a flat lens.
    pub depth_bl: f64,
    /// Body lengths in space per body length of `Lens::length_px` in the image, at the depth of the animal.
    pub nearer: f64,
    /// Speed in space, body lengths per second. `None` if it is unknown or too little of the direction lies
    /// in the image plane.
    pub pace_bl_per_s: Option<f64>,
    /// Rate of change of the direction in space, radians per second. `None` unless the direction is known
    /// 0.1 s before and after the frame.
    pub swing_rad_per_s: Option<f64>,
}

impl FrameMotion {
    /// Returns the speed in space, body lengths per second. It is the speed in the image over the share of
    /// the direction in the image plane, which counts as at least `MIN_LEVEL`.
    pub fn speed_in_space(&self) -> f64 {
        let [x, y, _] = self.forward;
        let level = x.hypot(y);
        self.nearer * self.speed_bl_per_s / level.clamp(MIN_LEVEL, 1.0)
    }
}

/// Returns the motion at each frame of the footage. Derivatives in the image are central differences over two
/// frames before and after, or over one. Speed and turn are 0 where the animal was not found on both sides.
pub fn motion_of(library: &Library, lens: &Lens) -> Vec<FrameMotion> {
    let forwards: Vec<Option<Vec3>> = (library.poses.frames.iter())
        .map(|pose| forward(pose, library.poses.view, lens.length_px))
        .collect();
    let reach = ((library.poses.fps * TURN_SPAN_S).round() as usize).max(1);
    let swing = |frame: usize| {
        let before = forwards[frame.checked_sub(reach)?]?;
        let after = (*forwards.get(frame + reach)?)?;
        Some(angle_between(before, after) * library.poses.fps / (2 * reach) as f64)
    };
    (depths_bl(library, lens).into_iter().enumerate())
        .map(|(frame, depth_bl)| {
            let moved = in_picture(library, lens.length_px, frame);
            let nearer = lens.length_px / lens.px_per_bl(depth_bl);
            FrameMotion {
                forward: forwards[frame].unwrap_or_default(),
                depth_bl,
                nearer,
                pace_bl_per_s: moved.and_then(|moved| {
                    let [x, y, _] = forwards[frame]?;
                    let level = x.hypot(y);
                    (level > MIN_LEVEL_FOR_PACE).then_some(moved.speed_bl_per_s * nearer / level)
                }),
                swing_rad_per_s: swing(frame),
                ..moved.unwrap_or_else(|| FrameMotion {
                    heading_rad: library.poses.frames[frame].heading_rad.unwrap_or(0.0),
                    ..FrameMotion::default()
                })
            }
        })
        .collect()
}

/// Returns the state of motion at every frame.
pub(super) fn states(library: &Library, motion: &[FrameMotion]) -> Vec<MotionState> {
    let playable = library.playback.component.iter();
    let speeds = playable.map(|&frame| motion[frame as usize].speed_bl_per_s);
    let usual = median(speeds.filter(|&speed| speed >= REST_BL_PER_S)).unwrap_or(1.0);
    let state = |moved: &FrameMotion| match moved.speed_bl_per_s {
        speed if speed < REST_BL_PER_S => MotionState::Rest,
        speed if speed < SLOW_SHARE * usual => MotionState::Slow,
        speed if speed < DART_SHARE * usual => MotionState::Go,
        _ => MotionState::Dart,
    };
    motion.iter().map(state).collect()
}

/// Returns the motion in the image, or `None` if the animal was not found before and after the frame.
fn in_picture(library: &Library, length_px: f64, frame: usize) -> Option<FrameMotion> {
    let poses = &library.poses;
    let at = |frame: usize| {
        let pose = poses.frames.get(frame)?;
        Some((pose.centroid_px?, pose.heading_rad?))
    };
    let (before, after, span_s) = (1..=2).rev().find_map(|reach| {
        let before = at(frame.checked_sub(reach)?)?;
        let after = at(frame + reach)?;
        Some((before, after, 2.0 * reach as f64 / poses.fps))
    })?;
    let (dx, dy) = (after.0[0] - before.0[0], after.0[1] - before.0[1]);
    Some(FrameMotion {
        heading_rad: at(frame).map_or(0.0, |pose| pose.1),
        turn_rad_per_s: wrap_rad(after.1 - before.1) / span_s,
        speed_bl_per_s: (dx * dx + dy * dy).sqrt() / length_px / span_s,
        velocity_bl_per_s: [dx, dy].map(|px| px / length_px / span_s),
        ..FrameMotion::default()
    })
}

/// Returns the direction in space: as measured, else from the heading and the visible share of the length.
/// Returns `None` if neither is known.
fn forward(pose: &Pose, view: View, length_px: f64) -> Option<Vec3> {
    let heading = pose.heading_rad?;
    let (cos, sin) = (libm::cos(heading), libm::sin(heading));
    if view == View::Top {
        return Some([cos, sin, 0.0]);
    }
    if let Some(forward) = pose.forward {
        return Some(unit(forward));
    }
    let seen = (pose.length_px? / length_px).clamp(0.0, 1.0);
    Some([seen * cos, seen * sin, (1.0 - seen * seen).sqrt()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::synthetic;

    #[test]
    fn states_rank_frames_by_speed() {
        let library = synthetic::library(View::Top);
        let at = |speed_bl_per_s| FrameMotion {
            speed_bl_per_s,
            ..FrameMotion::default()
        };
        // The usual speed is 1.
        let mut motion = vec![at(1.0); library.poses.frames.len()];
        for (moved, speed) in motion.iter_mut().zip([0.05, 0.3, 1.5, 2.5]) {
            *moved = at(speed);
        }
        let wanted = [
            MotionState::Rest,
            MotionState::Slow,
            MotionState::Go,
            MotionState::Dart,
        ];
        assert_eq!(states(&library, &motion)[..4], wanted);
    }
}
