//! From poses to motion: position and rotation of the virtual fish are those of the measured animal. Its
//! body bends along the measured midline, or in a swimming wave that fits the measured speed (Nakajima et
//! al., section 7; docs/explanation/algorithms.md, "Virtual fish").
//!
//! With a calibrated camera the fish moves in space. Without one its depth is unknown. The fish then keeps
//! a constant distance from an assumed camera, at which it is as long in the picture as the animal. When
//! its heading changes sides, it turns by way of the camera. Short gaps are filled by interpolation. In
//! longer gaps the fish is invisible.

mod time; // gaps and smoothing

use glam::{DMat3, DQuat, DVec2, DVec3};

use self::time::{fill_gaps, smoothed, window};
use super::error::Error;
use super::figure::course::{self, Bend, Evidence};
use super::figure::{Figure, Fit, Midline};
use super::motion::{
    Beat, Motion, Posture, bank_rad, nearest_sign, rotation_of, toward_sight, upright_along,
};
use super::params::Params;
use super::spine::{
    N_JOINTS, ORIGIN_S, Swimming, bend_of_turn_bl, effort_at, joint_angles_of_midline_rad,
    joint_frames, spine_at_m, tail_beat_hz, tail_tip_rad,
};
use crate::geometry::Camera;
use crate::library::{Animal, Pose, Poses, View};
use crate::parameters::Parameters;

/// Returns the motion of the virtual fish. Fails if a parameter is out of range, or if the animal was found
/// in no frame.
///
/// A `figure` is the body that moves; without one it is the goldfish.
pub fn drive(poses: &Poses, params: &Params, figure: Option<&Figure>) -> Result<Motion, Error> {
    params.check().map_err(Error::InvalidParams)?;
    let setup = Setup::new(poses, params, figure)?;
    let measured = place_all(poses, &setup, params);
    let filled = fill_gaps(&measured, (params.bridge_s * poses.fps).round() as usize);
    let mut smooth = smoothed(&filled, params.smooth_s * poses.fps);
    let (beat_hz, bends) = setup.bends(&measured);
    let beats = setup.beats(&measured, &bends, &poses.frames);
    for (placement, bend) in smooth.iter_mut().zip(&bends) {
        if let Some(placement) = placement {
            placement.bend = Some(*bend);
        }
    }
    Ok(Motion {
        fps: poses.fps,
        image_size_px: poses.image_size_px,
        camera: setup.camera,
        size: setup.size,
        center_s: setup.center_s(),
        frames: swim(&smooth, poses, &setup, params),
        beat_hz,
        beats,
    })
}

/// Values that are the same for all frames.
struct Setup<'a> {
    figure: Option<&'a Figure>,
    fps: f64,
    view: View,
    camera: Camera,
    size: Animal,
    /// Apparent depth of the fish where no depth was measured, in metres.
    z_apparent_m: f64,
    /// Length of the animal seen broadside, in pixels.
    length_px: f64,
}

impl<'a> Setup<'a> {
    fn new(poses: &Poses, params: &Params, figure: Option<&'a Figure>) -> Result<Setup<'a>, Error> {
        let n_frames = poses.frames.len();
        if !poses.frames.iter().any(Pose::detected) {
            return Err(Error::NothingMoves { n_frames });
        }
        let mut lengths_px: Vec<f64> = poses.frames.iter().filter_map(|p| p.length_px).collect();
        lengths_px.sort_by(f64::total_cmp);
        let [width, height] = poses.image_size_px.map(f64::from);
        // The 90th percentile: foreshortening makes many measured lengths too short, and few are too long.
        let rank = lengths_px.len() * 9 / 10;
        let longest_px = lengths_px.get(rank).copied().unwrap_or(0.15 * width);
        let length_px = figure.map_or(longest_px, |figure| figure.length_px);
        let size = params.size(poses.animal);
        let camera = poses.camera.unwrap_or(Camera {
            z_min_m: ASSUMED_DISTANCE_BL * size.length_m,
            pane_px_per_m: length_px / size.length_m,
            center_px: [0.5 * width, 0.5 * height],
            medium_index: 1.0,
        });
        Ok(Setup {
            figure,
            fps: poses.fps,
            view: poses.view,
            z_apparent_m: size.length_m * camera.focal_px() / length_px,
            camera,
            size,
            length_px,
        })
    }
}

impl Setup<'_> {
    /// Returns the position along the body of the centroid of the silhouette.
    fn center_s(&self) -> f64 {
        self.figure.map_or(ORIGIN_S, |figure| figure.center_s)
    }

    /// Returns the rate of the tail beat and the bend in every frame; empty if no frame shows one.
    fn bends(&self, placements: &[Option<Placement>]) -> (f64, Vec<Bend>) {
        if let Some(figure) = self.figure.filter(|figure| !figure.bends.is_empty()) {
            return (figure.beat_hz, figure.bends.clone());
        }
        let angles = placements.iter().map(|one| one.as_ref()?.joint_angles_rad);
        let evidence: Vec<Evidence> = angles
            .map(|angles| angles.map_or(Evidence::NONE, |angles| Evidence::of_spine(&angles)))
            .collect();
        if self.view == View::Side {
            return (0.0, Vec::new());
        }
        course::bends(&evidence, self.fps)
    }

    /// Returns the beat of the tail in every frame in which the animal was found and the beat shows. From above the angle
    /// of the tail is that of the midline.
    fn beats(
        &self,
        placements: &[Option<Placement>],
        bends: &[Bend],
        poses: &[Pose],
    ) -> Vec<Option<Beat>> {
        let beat = |k: usize| {
            let angles = placements[k]?.joint_angles_rad;
            let side = match self.view {
                View::Top => 1.0,
                View::Side => poses[k].depth_sign_confidence.unwrap_or(0.5),
            };
            let beat = bends.get(k)?.beat(side)?;
            let tail_tip_rad = angles.map_or(beat.tail_tip_rad, |angles| tail_tip_rad(&angles));
            Some(Beat {
                tail_tip_rad,
                ..beat
            })
        };
        (0..placements.len()).map(beat).collect()
    }

    /// Returns the position of a fish whose silhouette has its centroid at a point.
    fn around_center(&self, center_m: DVec3, rotation: DQuat) -> DVec3 {
        center_m - rotation * DVec3::X * ((ORIGIN_S - self.center_s()) * self.size.length_m)
    }

    /// Returns the placement of a fitted figure. Its apparent depth follows from its length.
    fn fitted(&self, fit: &Fit) -> Placement {
        let z_apparent_m = self.size.length_m * self.camera.focal_px() / fit.length_px;
        let center_m = DVec3::from(self.camera.point_in_camera(fit.center_px, z_apparent_m));
        // The fit has no perspective: its direction is that relative to the line of sight.
        let seen = rotation_of(fit.yaw_rad, fit.pitch_rad, 0.0);
        let rotation = toward_sight(&self.camera, center_m) * seen;
        Placement {
            position_m: self.around_center(center_m, rotation),
            rotation,
            joint_angles_rad: None,
            bend: None,
        }
    }

    /// Returns the position at which the front half of the bent spine lies on the midline, in the mean. The
    /// measured tail is longer in some frames than in others.
    fn on_midline(
        &self,
        midline: &Midline,
        rotation: DQuat,
        angles_rad: &[f64; N_JOINTS],
    ) -> DVec3 {
        let length_m = self.size.length_m;
        let joints = joint_frames(length_m, angles_rad);
        let gap = |s: f64| {
            let (point_px, _) = midline.at(s * self.length_px);
            let seen = self.camera.point_in_camera(point_px, self.z_apparent_m);
            DVec3::from(seen) - rotation * spine_at_m(length_m, &joints, s)
        };
        let sum: DVec3 = FRONT_S.map(gap).into_iter().sum();
        sum / FRONT_S.len() as f64
    }
}

/// Positions along the body that lie on the midline. Free choice: the front half, which shows best.
const FRONT_S: [f64; 6] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5];

/// Distance of the assumed camera, in body lengths. Free choice.
const ASSUMED_DISTANCE_BL: f64 = 10.0;

/// Position, rotation and measured bend of the fish in one frame, before swimming is added.
#[derive(Clone, Copy, Debug)]
struct Placement {
    position_m: DVec3,
    rotation: DQuat,
    joint_angles_rad: Option<[f64; N_JOINTS]>,
    /// Bend over all frames, if they show one.
    bend: Option<Bend>,
}

fn place_all(poses: &Poses, setup: &Setup, params: &Params) -> Vec<Option<Placement>> {
    let headings = match setup.view {
        View::Side => headings_in_image(&poses.frames, setup, params),
        View::Top => Vec::new(),
    };
    let place = |(k, pose): (usize, &Pose)| {
        if let Some(fit) = setup.figure.and_then(|figure| *figure.fits.get(k)?) {
            return Some(setup.fitted(&fit));
        }
        let rotation = match (setup.view, pose.forward) {
            (View::Top, _) => seen_from_above(pose.heading_rad?),
            (View::Side, Some(forward)) => upright_along(DVec3::from(forward)),
            (View::Side, None) => upright_along(toward_camera(headings[k]?)),
        };
        let midline = pose.midline_px.as_ref().filter(|_| setup.view == View::Top);
        let joint_angles_rad =
            midline.and_then(|m| joint_angles_of_midline_rad(m, pose.heading_rad?));
        let on_midline = midline.filter(|_| pose.position_m.is_none());
        let on_midline = on_midline.and_then(|points_px| Midline::new(points_px));
        let position_m = match on_midline.zip(joint_angles_rad) {
            Some((midline, angles)) => setup.on_midline(&midline, rotation, &angles),
            None => setup.around_center(position_of(pose, setup)?, rotation),
        };
        Some(Placement {
            position_m,
            rotation,
            joint_angles_rad,
            bend: None,
        })
    };
    poses.frames.iter().enumerate().map(place).collect()
}

fn position_of(pose: &Pose, setup: &Setup) -> Option<DVec3> {
    let by_centroid = |px| setup.camera.point_in_camera(px, setup.z_apparent_m);
    let point = pose.position_m.or(pose.centroid_px.map(by_centroid))?;
    Some(DVec3::from(point))
}

/// Returns the headings as vectors in the image, smoothed over time. A vector is shorter where the fish is
/// foreshortened. When the fish turns around, the vectors pass through zero without a jump.
fn headings_in_image(frames: &[Pose], setup: &Setup, params: &Params) -> Vec<Option<DVec2>> {
    let vector = |pose: &Pose| {
        let heading = pose.heading_rad?;
        let share = |length_px: f64| (1.1 * length_px / setup.length_px).min(1.0);
        let seen = pose.length_px.map_or(1.0, share);
        Some(seen * DVec2::new(libm::cos(heading), libm::sin(heading)))
    };
    let vectors: Vec<Option<DVec2>> = frames.iter().map(vector).collect();
    let sigma_frames = params.smooth_s.max(MIN_HEADING_SMOOTHING_S) * setup.fps;
    (0..frames.len())
        .map(|k| vectors[k].map(|_| weighted_mean(&vectors, k, sigma_frames)))
        .collect()
}

/// Least smoothing of headings that are known only in the image: standard deviation in seconds. A fish
/// takes about three times as long to turn around.
const MIN_HEADING_SMOOTHING_S: f64 = 0.08;

fn weighted_mean(values: &[Option<DVec2>], middle: usize, sigma_frames: f64) -> DVec2 {
    let (mut sum, mut total) = (DVec2::ZERO, 0.0);
    for (k, weight) in window(values.len(), middle, sigma_frames) {
        if let Some(value) = values[k] {
            sum += weight * value;
            total += weight;
        }
    }
    sum / total
}

/// Returns the direction in space of a heading vector of length 0..=1. The missing length points toward the
/// camera.
fn toward_camera(heading: DVec2) -> DVec3 {
    let depth = (1.0 - heading.length_squared()).max(0.0).sqrt();
    DVec3::new(heading.x, heading.y, -depth)
}

/// Returns the rotation of a fish in top view: the heading lies in the image plane, the back faces the
/// camera.
fn seen_from_above(heading_rad: f64) -> DQuat {
    let forward = DVec3::new(libm::cos(heading_rad), libm::sin(heading_rad), 0.0);
    DQuat::from_mat3(&DMat3::from_cols(
        forward,
        DVec3::Z,
        forward.cross(DVec3::Z),
    ))
}

/// Returns the posture of each frame: the body bends along the midline, else in the swimming wave, and
/// rolls into turns. The fish is invisible where its placement is unknown.
fn swim(
    placements: &[Option<Placement>],
    poses: &Poses,
    setup: &Setup,
    params: &Params,
) -> Vec<Posture> {
    let (mut phase_turns, mut speed_bl_per_s) = (0.0, 0.0);
    let first = placements.iter().flatten().next();
    let mut last = first.map_or(Posture::at(DVec3::Z, DQuat::IDENTITY), |p| {
        Posture::at(p.position_m, p.rotation)
    });
    let mut frames = Vec::with_capacity(placements.len());
    for k in 0..placements.len() {
        let Some(here) = placements[k] else {
            last.visible = false;
            frames.push(last);
            continue;
        };
        let moving = Kinematics::at(placements, k, setup.fps);
        let new_speed = moving.speed_m_per_s.max(0.0) / setup.size.length_m;
        // A low-pass of 0.2 s: measured speeds are noisier than the motion of the tail.
        speed_bl_per_s += (new_speed - speed_bl_per_s) * (5.0 / setup.fps).min(1.0);
        // Where no tail beat was measured, its frequency follows from the speed.
        let measured_hz = poses.tail_beat_hz(k);
        let beat_hz = measured_hz.unwrap_or(tail_beat_hz(speed_bl_per_s));
        phase_turns += beat_hz.min(0.45 * setup.fps) / setup.fps;
        let turn_bl = bend_of_turn_bl(moving.turn_rad_per_s);
        let effort = effort_at(speed_bl_per_s);
        let mut swimming = Swimming {
            phase_turns,
            effort,
            bend_bl: turn_bl,
        };
        // As far as the frames show the bend, it is theirs; else it follows from speed and turn.
        if let Some(bend) = here.bend {
            let [bend_bl, cosine, sine] = bend.mean.to_array();
            let (wave, told) = (Swimming::of_wave(bend_bl, [cosine, sine]), bend.told());
            phase_turns = wave.phase_turns;
            swimming = Swimming {
                phase_turns,
                effort: effort + told * (wave.effort - effort),
                bend_bl: turn_bl + told * (bend_bl - turn_bl),
            };
        }
        let roll = match setup.view {
            View::Side => bank_rad(moving.turn_rad_per_s, moving.speed_m_per_s, params.bank_rad),
            View::Top => 0.0,
        };
        let rotation = here.rotation * rotation_of(0.0, 0.0, roll);
        last = Posture {
            position_m: here.position_m,
            rotation: nearest_sign(last.rotation, rotation),
            joint_angles_rad: if params.swim {
                here.joint_angles_rad.unwrap_or(swimming.joint_angles_rad())
            } else {
                [0.0; N_JOINTS]
            },
            visible: true,
        };
        frames.push(last);
    }
    frames
}

/// Speed and turn rate of the fish in one frame.
#[derive(Default)]
struct Kinematics {
    /// Speed along its own direction, in metres a second.
    speed_m_per_s: f64,
    /// Turn rate to its left, in radians a second.
    turn_rad_per_s: f64,
}

impl Kinematics {
    /// Returns the motion between the known neighboring frames; zero if there are none.
    fn at(placements: &[Option<Placement>], k: usize, fps: f64) -> Kinematics {
        let known = |k: usize| placements.get(k).copied().flatten();
        let [before, here, after] = [k.wrapping_sub(1), k, k + 1].map(known);
        let n_steps = [before, after].iter().flatten().count();
        let (Some(a), Some(here), Some(b)) = (before.or(here), here, after.or(here)) else {
            return Kinematics::default();
        };
        if n_steps == 0 {
            return Kinematics::default();
        }
        let per_s = fps / n_steps as f64;
        let turned = (b.rotation * DVec3::X - a.rotation * DVec3::X) * per_s;
        let step = (b.position_m - a.position_m) * per_s;
        Kinematics {
            speed_m_per_s: step.dot(here.rotation * DVec3::X),
            turn_rad_per_s: turned.dot(here.rotation * DVec3::Z),
        }
    }
}

#[cfg(test)]
mod tests;
