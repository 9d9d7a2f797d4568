//! From poses to motion: position and rotation of the virtual fish are those of the measured animal. Its
//! body bends along the measured midline, or in a swimming wave that fits the measured speed (Nakajima et
//! al., section 7; docs/explanation/algorithms.md, "Virtual fish").
//!
//! With a calibrated camera the fish moves in space. Without one its depth is unknown. The fish then keeps
//! a constant distance from an assumed camera, at which it is as long in the picture as the animal. When
//! its heading changes sides, it turns by way of the camera. Short gaps are filled by interpolation. In
//! longer gaps the fish is invisible.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::error::Error;
use super::figure::{Figure, Fit, Midline};
use super::motion::{Motion, Posture, bank_rad, nearest_sign, rotation_of, slerp, upright_along};
use super::params::Params;
use super::spine::{
    N_JOINTS, ORIGIN_S, Swimming, bend_of_turn_bl, effort_at, joint_angles_of_midline_rad,
    joint_frames, spine_at_m, tail_beat_hz,
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
    let smooth = smoothed(&filled, params.smooth_s * poses.fps);
    Ok(Motion {
        fps: poses.fps,
        image_size_px: poses.image_size_px,
        camera: setup.camera,
        size: setup.size,
        center_s: setup.center_s(),
        frames: swim(&smooth, poses, &setup, params),
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

    /// Returns the position of a fish whose silhouette has its centroid at a point.
    fn around_center(&self, center_m: DVec3, rotation: DQuat) -> DVec3 {
        center_m - rotation * DVec3::X * ((ORIGIN_S - self.center_s()) * self.size.length_m)
    }

    /// Returns the placement of a fitted figure. Its apparent depth follows from its length.
    fn fitted(&self, fit: &Fit) -> Placement {
        let rotation = rotation_of(fit.yaw_rad, fit.pitch_rad, 0.0);
        let z_apparent_m = self.size.length_m * self.camera.focal_px() / fit.length_px;
        let center_m = self.camera.point_in_camera(fit.center_px, z_apparent_m);
        Placement {
            position_m: self.around_center(center_m.into(), rotation),
            rotation,
            joint_angles_rad: None,
            bend: [fit.bend_bl, libm::sin(fit.yaw_rad).abs()],
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
    /// Bend of a fitted body, in body lengths (see `Swimming`), and how far it shows, 0..=1; 0 if unknown.
    bend: [f64; 2],
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
            bend: [0.0; 2],
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

/// Fills gaps of at most `longest` frames between two known frames by interpolation.
fn fill_gaps(measured: &[Option<Placement>], longest: usize) -> Vec<Option<Placement>> {
    let mut filled = measured.to_vec();
    let known = (0..)
        .zip(measured)
        .filter_map(|(k, placement)| Some((k, (*placement)?)));
    let known: Vec<(usize, Placement)> = known.collect();
    for pair in known.windows(2) {
        let [(from, a), (to, b)] = [pair[0], pair[1]];
        if to - from - 1 > longest {
            continue;
        }
        for k in from + 1..to {
            let share = (k - from) as f64 / (to - from) as f64;
            filled[k] = Some(between(&a, &b, share));
        }
    }
    filled
}

fn between(a: &Placement, b: &Placement, share: f64) -> Placement {
    let joints = a.joint_angles_rad.zip(b.joint_angles_rad);
    Placement {
        position_m: a.position_m.lerp(b.position_m, share),
        rotation: slerp(a.rotation, b.rotation, share),
        bend: [0, 1].map(|c| a.bend[c] + share * (b.bend[c] - a.bend[c])),
        joint_angles_rad: joints
            .map(|(a, b)| std::array::from_fn(|j| a[j] + share * (b[j] - a[j]))),
    }
}

/// Returns Gaussian means of positions and rotations over time, within each run without gaps. Joint angles
/// stay unchanged, and so does a fish that lies on a midline.
fn smoothed(placements: &[Option<Placement>], sigma_frames: f64) -> Vec<Option<Placement>> {
    let around = |k: usize| {
        let middle = placements[k]?;
        // A fish on a midline is placed by all of its points.
        if middle.joint_angles_rad.is_some() {
            return Some(middle);
        }
        let (mut position, mut total) = (DVec3::ZERO, 0.0);
        let mut turn = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let unbroken = |other: usize| {
            let (lo, hi) = (other.min(k), other.max(k));
            placements[lo..=hi].iter().all(Option::is_some)
        };
        for (other, weight) in window(placements.len(), k, sigma_frames) {
            let Some(near) = placements[other].filter(|_| unbroken(other)) else {
                continue;
            };
            position += weight * near.position_m;
            turn += nearest_sign(middle.rotation, near.rotation) * weight;
            total += weight;
        }
        Some(Placement {
            position_m: position / total,
            rotation: turn.normalize(),
            ..middle
        })
    };
    (0..placements.len()).map(around).collect()
}

/// Returns the indices within three standard deviations of `middle`, with their Gaussian weights.
fn window(n: usize, middle: usize, sigma_frames: f64) -> impl Iterator<Item = (usize, f64)> {
    let reach = (3.0 * sigma_frames).floor() as usize;
    (middle.saturating_sub(reach)..(middle + reach + 1).min(n)).map(move |k| {
        let off = (k as f64 - middle as f64) / sigma_frames.max(1e-9);
        (k, libm::exp(-0.5 * off * off))
    })
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
        // Where the bend shows, it is the fitted one; where it does not, it follows from speed and turn.
        let [bend_bl, shown] = here.bend;
        let turn_bl = bend_of_turn_bl(moving.turn_rad_per_s);
        let swimming = Swimming {
            phase_turns,
            effort: effort_at(speed_bl_per_s) * (1.0 - shown),
            bend_bl: turn_bl + shown * (bend_bl - turn_bl),
        };
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
