//! Poses from sightings: length axis, heading and, with a calibrated camera, position and direction in space.
//!
//! The sources are Nakajima et al., sections 5 and 6, and Okabe et al., section 3.3, both corrected
//! (docs/explanation/algorithms.md, "Corrections to the papers"). The rest is described in
//! docs/explanation/algorithms.md, "Pose".

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

mod appearance;
mod depth;
pub mod direction;
mod heading;
pub mod midline;
pub mod moments;
mod smooth;
pub mod sprite;
#[cfg(test)]
mod synthetic;
mod view;

use super::Params;
use super::params::AxisAndHead;
use super::track::Tracked;
use super::track::sighting::Sighting;
use crate::footage::FootageFormat;
use crate::geometry::wrap_rad;
use crate::library::{Pose, Poses, View};
use appearance::HeadEvidence;
use direction::Measurement;
use heading::GivenHead;
use smooth::smoothed_rates;

/// Least lead of the other axis toward the horizontal for a change of the length axis in side view, radians.
/// From docs/explanation/algorithms.md, "Corrections to the papers".
const SWITCH_LEAD_RAD: f64 = 10.0 * PI / 180.0;

/// Length axis of one frame and measurements along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Angle in (-pi/2, pi/2]; `None` when the silhouette is round.
    pub axis_rad: Option<f64>,
    /// Extent along the axis, pixels.
    pub length_px: f64,
    /// Extent across the axis, pixels.
    pub height_px: f64,
    /// Third standardized moment along the axis, positive toward +axis.
    pub skew: f64,
}

impl Axes {
    /// Returns the unit vector of the axis; `None` without an axis.
    pub fn direction(&self) -> Option<[f64; 2]> {
        self.axis_rad
            .map(|angle| [libm::cos(angle), libm::sin(angle)])
    }
}

/// Returns the view: the given one, or a guess with the probability that it is right, 0.5..=1.
pub fn view(track: &[Tracked], params: &Params) -> (View, Option<f64>) {
    match params.view() {
        Some(view) => (view, None),
        None => {
            let (view, probability) = view::guess(track);
            (view, Some(probability))
        }
    }
}

/// Returns the poses of a track, one per frame.
pub fn measure(track: &[Tracked], view: View, format: &FootageFormat, params: &Params) -> Poses {
    let axes = length_axes(track, view, params.axis_and_head);
    let given_head = given_head(track, &axes, params);
    let centroids: Vec<_> = track.iter().map(centroid_px).collect();
    let velocity_px = velocity_px(&centroids, format.fps);
    let lengths_px = axes.iter().flatten().map(|axes| axes.length_px);
    let length_px = reference_length_px(lengths_px).unwrap_or(1.0);
    let speed_bl_s = heading::speed_along(&axes, &velocity_px, length_px);
    let appearance = HeadEvidence::estimate(track, &axes, &speed_bl_s, format.fps);
    let heads = match params.axis_and_head {
        AxisAndHead::Corrected => heading::decode(
            &axes,
            &speed_bl_s,
            &appearance.half_log_odds,
            given_head,
            format.fps,
        ),
        AxisAndHead::Printed => heading::least_turn(&axes),
    };
    let mut poses = Poses {
        tail_beat: None,
        fps: format.fps,
        image_size_px: [format.width, format.height],
        view,
        view_confidence: None,
        other_movers: Vec::new(),
        camera: params.camera(format.width, format.height),
        animal: params.animal(),
        frames: track.iter().map(detection).collect(),
    };
    for ((pose, axes), head) in poses.frames.iter_mut().zip(&axes).zip(&heads) {
        let Some(axes) = axes else { continue };
        pose.axis_rad = axes.axis_rad;
        pose.length_px = Some(axes.length_px);
        pose.height_px = Some(axes.height_px);
        pose.skew = Some(axes.skew);
        pose.head_confidence = head.map(|head| head.confidence);
        pose.heading_rad = head.zip(axes.axis_rad).map(|(head, axis)| {
            if head.forward {
                axis
            } else {
                wrap_rad(axis + PI)
            }
        });
    }
    depth::measure_raw(&mut poses, params);
    if view == View::Side && params.smooth {
        let measured = measurements(track, &axes, &appearance, params);
        set_directions(&mut poses, &measured);
    } else {
        poses.frames.iter_mut().for_each(use_raw);
    }
    if given_head.is_none() && params.axis_and_head == AxisAndHead::Corrected {
        let poses = poses.frames.iter_mut();
        for confidence in poses.filter_map(|pose| pose.head_confidence.as_mut()) {
            *confidence = appearance.tempered(*confidence);
        }
    }
    poses
}

fn centroid_px(tracked: &Tracked) -> Option<[f64; 2]> {
    let sighting = tracked.sighting.as_ref()?;
    Some(sighting.moments.centroid_px)
}

/// Returns the end of the axis at which the user put the head.
fn given_head(track: &[Tracked], axes: &[Option<Axes>], params: &Params) -> Option<GivenHead> {
    let head = params.head?;
    let frame_idx = head.frame as usize;
    let direction = axes.get(frame_idx)?.as_ref()?.direction()?;
    let centroid = centroid_px(&track[frame_idx])?;
    let along =
        (head.point[0] - centroid[0]) * direction[0] + (head.point[1] - centroid[1]) * direction[1];
    Some(GivenHead {
        frame_idx,
        forward: along >= 0.0,
    })
}

/// Takes position and direction from the raw values of the single frame.
fn use_raw(pose: &mut Pose) {
    let Some(raw) = pose.raw else { return };
    pose.position_m = raw.position_m;
    if let Some(forward) = raw.forward {
        set_direction(pose, forward);
    }
}

/// Returns the measurements from which directions are estimated.
fn measurements(
    track: &[Tracked],
    axes: &[Option<Axes>],
    appearance: &HeadEvidence,
    params: &Params,
) -> Vec<Option<Measurement>> {
    let measurement = |(k, tracked): (usize, &Tracked)| {
        let sighting = tracked.sighting.as_ref()?;
        let centroid_px = sighting.moments.centroid_px;
        let given_head = params.head.filter(|head| head.frame as usize == k);
        let direction = axes[k].as_ref().and_then(Axes::direction);
        Some(Measurement {
            centroid_px,
            covariance_px2: sighting.moments.covariance_px2,
            vertical_px: sighting.upright_px,
            cut: sighting.cut,
            given_head_px: given_head.map(|head| [0, 1].map(|c| head.point[c] - centroid_px[c])),
            head_evidence: (direction.zip(appearance.half_log_odds[k]))
                .map(|(direction, half_log_odds)| direction.map(|c| c * half_log_odds)),
        })
    };
    track.iter().enumerate().map(measurement).collect()
}

/// Writes position and direction as estimated from all frames together.
///
/// Without a camera or the animal's size, only the heading is written, computed with a typical camera.
fn set_directions(poses: &mut Poses, measured: &[Option<Measurement>]) {
    let known = poses.camera.zip(poses.animal);
    let (camera, animal) = known.unwrap_or_else(|| {
        let [width, height] = poses.image_size_px;
        let camera = direction::typical_camera(width, height);
        (camera, direction::typical_animal(measured))
    });
    let directions = direction::estimate(measured, &camera, &animal, poses.fps);
    for (pose, direction) in poses.frames.iter_mut().zip(directions) {
        let Some(direction) = direction else { continue };
        pose.head_confidence = Some(direction.head_confidence);
        if known.is_none() {
            let [x, y, _] = direction.forward;
            pose.heading_rad = Some(libm::atan2(y, x));
            continue;
        }
        let (centroid, depth) = (direction.centroid_px, direction.z_apparent_m);
        pose.position_m = Some(camera.point_in_camera(centroid, depth));
        pose.depth_sign_confidence = Some(direction.depth_sign_confidence);
        set_direction(pose, direction.forward);
    }
}

/// Writes a direction in space, and its heading, yaw, pitch and angle to the image plane.
fn set_direction(pose: &mut Pose, forward: [f64; 3]) {
    let [x, y, z] = forward;
    pose.forward = Some(forward);
    pose.heading_rad = Some(libm::atan2(y, x));
    pose.yaw_rad = Some(libm::atan2(z, x));
    pose.pitch_rad = Some(libm::asin(y.clamp(-1.0, 1.0)));
    pose.gamma_rad = Some(libm::atan2(z.abs(), libm::hypot(x, y)));
}

/// Returns the velocity of the smoothed centroid in each frame, pixels per second; `None` in long gaps.
pub(super) fn velocity_px(centroids_px: &[Option<[f64; 2]>], fps: f64) -> Vec<Option<[f64; 2]>> {
    let rate = |c: usize| {
        let coordinates: Vec<_> = centroids_px.iter().map(|p| p.map(|p| p[c])).collect();
        smoothed_rates(&coordinates, fps)
    };
    let (x, y) = (rate(0), rate(1));
    x.into_iter().zip(y).map(|(x, y)| Some([x?, y?])).collect()
}

/// Returns the animal's full length in the image: the 80th percentile of its lengths, at least 1 pixel.
/// Returns `None` without lengths.
pub(super) fn reference_length_px(lengths_px: impl Iterator<Item = f64>) -> Option<f64> {
    let mut lengths_px: Vec<f64> = lengths_px.collect();
    lengths_px.sort_by(f64::total_cmp);
    let length_px = lengths_px.get(lengths_px.len() * 4 / 5)?;
    Some(length_px.max(1.0))
}

/// Returns a pose with the values of the detection only.
fn detection(tracked: &Tracked) -> Pose {
    let mut pose = Pose {
        time_s: tracked.time_s,
        ..Pose::default()
    };
    if let Some(sighting) = &tracked.sighting {
        pose.cut = sighting.cut;
        pose.confidence = Some(sighting.confidence);
        pose.centroid_px = Some(sighting.moments.centroid_px);
        pose.box_px = Some(sighting.box_px);
        pose.area_px = Some(sighting.moments.area_px);
    }
    pose
}

/// Returns the length axis of every sighting.
///
/// In top view, it is the axis of the body without the tail, which may point to one side for seconds. In side
/// view, it is the axis farther from the vertical (Nakajima et al., section 5.3). With memory, it is the axis
/// nearest to the previous one, unless the other is nearer the horizontal by 10 degrees. A fish seen head-on
/// is taller than long, and a steeply pitched fish has a vertical major axis.
fn length_axes(track: &[Tracked], view: View, rule: AxisAndHead) -> Vec<Option<Axes>> {
    let mut last: Option<f64> = None;
    track
        .iter()
        .map(|tracked| {
            let sighting = tracked.sighting.as_ref()?;
            if view == View::Top && rule == AxisAndHead::Corrected {
                return Some(axes_of_body(sighting));
            }
            let Some(major) = sighting.moments.major_rad else {
                return Some(axes_of_moments(sighting, true));
            };
            let minor = fold_axis_rad(major + FRAC_PI_2);
            let from_vertical = |axis: f64| FRAC_PI_2 - axis.abs();
            let lead = from_vertical(major) - from_vertical(minor);
            let near = |last: f64| fold_axis_rad(major - last).abs() <= FRAC_PI_4;
            let major_is_length = match last.map(near) {
                Some(true) => lead > -SWITCH_LEAD_RAD,
                Some(false) => lead > SWITCH_LEAD_RAD,
                None => lead >= 0.0,
            };
            let axes = axes_of_moments(sighting, major_is_length);
            last = axes.axis_rad.filter(|_| rule == AxisAndHead::Corrected);
            Some(axes)
        })
        .collect()
}

fn axes_of_body(sighting: &Sighting) -> Axes {
    let (moments, extent) = (&sighting.moments, sighting.body_extent_px);
    let turned = sighting
        .body_rad
        .zip(moments.major_rad)
        .map_or(0.0, |(body, major)| body - major);
    Axes {
        axis_rad: sighting.body_rad,
        length_px: extent[0],
        height_px: extent[1],
        skew: moments.skew[0] * libm::cos(turned).signum(),
    }
}

fn axes_of_moments(sighting: &Sighting, major_is_length: bool) -> Axes {
    let (moments, extent) = (&sighting.moments, sighting.extent_px);
    if major_is_length {
        let axis_rad = moments.major_rad;
        return Axes {
            axis_rad,
            length_px: extent[0],
            height_px: extent[1],
            skew: moments.skew[0],
        };
    }
    let turned = moments.major_rad.map(|major| major + FRAC_PI_2);
    let axis_rad = turned.map(fold_axis_rad);
    // The skew refers to major + pi/2; folding may reverse the axis.
    let folded = turned.is_some_and(|turned| turned > FRAC_PI_2);
    let skew = if folded {
        -moments.skew[1]
    } else {
        moments.skew[1]
    };
    Axes {
        axis_rad,
        length_px: extent[1],
        height_px: extent[0],
        skew,
    }
}

/// Returns the angle of an axis, folded into (-pi/2, pi/2].
fn fold_axis_rad(angle_rad: f64) -> f64 {
    let folded = wrap_rad(2.0 * angle_rad) / 2.0;
    if folded <= -FRAC_PI_2 {
        FRAC_PI_2
    } else {
        folded
    }
}
