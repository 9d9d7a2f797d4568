//! How the animal itself moved at every frame of the footage: what boids are calibrated by and plans
//! are matched with (ALGORITHMS.md 6 and 7).

use super::boids::vector::{Vec3, angle_between, unit};
use super::lens::{Lens, depths_bl};
use crate::geometry::wrap_rad;
use crate::library::{Library, Pose, View};

/// A speed in space is told where at least this share of the direction lies in the picture's plane.
const LEAST_LEVEL: f64 = 0.7;
/// Least share of the direction in the picture's plane with which a speed in the picture is divided. An animal seen head-on also
/// moves sideways, so the quotient would grow without bound. A free choice.
const LEAST_SEEN: f64 = 0.5;
/// Directions are compared over this time either way.
const TURN_SPAN_S: f64 = 0.1;

/// The animal at a frame of the footage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameMotion {
    /// Direction of the head, image axes.
    pub heading_rad: f64,
    /// How fast the heading changed.
    pub turn_rad_per_s: f64,
    /// Speed of the centroid in the image, body lengths a second.
    pub speed_bl_per_s: f64,
    /// Its velocity, image axes.
    pub velocity_bl_per_s: [f64; 2],
    /// Direction in space, a unit vector; away from the camera where the sign is not known.
    pub forward: Vec3,
    /// Distance from the camera, body lengths; 0 where the lens is flat.
    pub depth_bl: f64,
    /// Body lengths in space to one of `length_px` in the picture, at its depth.
    pub nearer: f64,
    /// Speed in space, body lengths a second, where enough of it is in the picture's plane.
    pub pace_bl_per_s: Option<f64>,
    /// How fast the direction in space changed, where it was found a tenth of a second before and after.
    pub swing_rad_per_s: Option<f64>,
}

impl FrameMotion {
    /// Speed in space, body lengths a second: the speed in the picture over the share of the direction in the picture's plane,
    /// at least `LEAST_SEEN`.
    pub fn speed_in_space(&self) -> f64 {
        let [x, y, _] = self.forward;
        let level = x.hypot(y);
        self.nearer * self.speed_bl_per_s / level.clamp(LEAST_SEEN, 1.0)
    }
}

/// The motion at every frame: central differences over two frames either way where the animal was
/// found; zero speed and turn where its neighbors in time were not.
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
                    (level > LEAST_LEVEL).then_some(moved.speed_bl_per_s * nearer / level)
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

/// What the picture tells of a frame, where the animal was found before and after.
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

/// The direction in space: as measured, or from the heading and how much of the length is seen.
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
