//! Position and direction in space (N 5.3 and 6, corrected; ALGORITHMS.md 1 and 4).
//!
//! Depth from the height of the silhouette; yaw from how much of the known length is seen at that
//! depth; toward or away by a decision over the whole footage, because an image of a fish that comes
//! looks like one of a fish that goes.

use super::Params;
use super::params::Eq7;
use super::pose::Motion;
use super::smooth::{Smoothed, smooth};
use crate::geometry::{Camera, wrap_rad};
use crate::library::{Animal, Poses};

/// Fills in position, direction, yaw, pitch and gamma of every pose that can have them. Without a
/// camera or the animal's size nothing is filled in.
pub fn place_in_space(poses: &mut Poses, motion: &Motion, params: &Params) {
    let (Some(camera), Some(animal)) = (poses.camera, poses.animal) else {
        return;
    };
    let seen = Seen::of(poses, &camera, &animal, params);
    let z_apparent = if params.smooth {
        smooth(&seen.z_apparent_m, poses.fps)
    } else {
        raw(seen.z_apparent_m.clone())
    };
    let cosines = foreshortening(poses, &camera, &animal, &z_apparent, params);
    let toward = depth_signs(poses, &camera, motion, &z_apparent, &cosines);
    for (k, pose) in poses.frames.iter_mut().enumerate() {
        let Some(z) = z_apparent.value[k] else {
            continue;
        };
        let Some(centroid) = (if params.smooth {
            motion.x.value[k]
                .zip(motion.y.value[k])
                .map(|(x, y)| [x, y])
        } else {
            pose.centroid_px
        }) else {
            continue;
        };
        pose.position_m = Some(camera.point_in_camera(centroid, z));
        let (Some(cosine), Some(heading)) = (cosines[k], pose.heading_rad) else {
            continue;
        };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let sign = if toward[k].away { 1.0 } else { -1.0 };
        let forward = [
            cosine * libm::cos(heading),
            cosine * libm::sin(heading),
            sign * sine,
        ];
        pose.gamma_rad = Some(libm::acos(cosine));
        pose.depth_sign_confidence = Some(toward[k].confidence);
        pose.yaw_rad = Some(wrap_rad(libm::atan2(forward[2], forward[0])));
        pose.pitch_rad = Some(libm::asin(forward[1].clamp(-1.0, 1.0)));
        pose.forward = Some(forward);
    }
}

/// What one frame alone says.
struct Seen {
    z_apparent_m: Vec<Option<f64>>,
}

impl Seen {
    fn of(poses: &Poses, camera: &Camera, animal: &Animal, params: &Params) -> Seen {
        let depth = |height_px: f64| match params.eq7 {
            Eq7::Corrected => camera.apparent_depth_m(animal.height_m, height_px),
            Eq7::Printed => height_px / camera.pane_px_per_m / animal.height_m * camera.z_min_m,
        };
        // A silhouette cut by the border shows less than its height.
        let one = |pose: &crate::library::Pose| {
            pose.height_px.filter(|&h| h > 0.0 && !pose.cut).map(depth)
        };
        Seen {
            z_apparent_m: poses.frames.iter().map(one).collect(),
        }
    }
}

/// cos(gamma): the share of the animal's length that is seen, 0..=1. With smoothing the cosine is
/// smoothed before it is clamped, for acos is infinitely steep at 1 (N 8 corrected).
fn foreshortening(
    poses: &Poses,
    camera: &Camera,
    animal: &Animal,
    z_apparent: &Smoothed,
    params: &Params,
) -> Vec<Option<f64>> {
    let measured: Vec<Option<f64>> = poses
        .frames
        .iter()
        .zip(&z_apparent.value)
        .map(|(pose, z)| {
            let on_pane_m = pose.length_px.filter(|_| !pose.cut)? / camera.pane_px_per_m;
            Some(on_pane_m * (*z)? / (camera.z_min_m * animal.length_m))
        })
        .collect();
    let cosines = if params.smooth {
        smooth(&measured, poses.fps).value
    } else {
        measured
    };
    cosines
        .iter()
        .map(|cosine| cosine.map(|c| c.clamp(0.0, 1.0)))
        .collect()
}

/// Toward the camera or away from it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sign {
    away: bool,
    confidence: f64,
}

/// The likeliest sequence of signs: the depth must change as a fish of the measured speed and angle
/// would change it, and the sign may only flip when the fish is seen broadside.
fn depth_signs(
    poses: &Poses,
    camera: &Camera,
    motion: &Motion,
    z_apparent: &Smoothed,
    cosines: &[Option<f64>],
) -> Vec<Sign> {
    let n = poses.frames.len();
    let step = |k: usize| {
        let sine = cosines[k].map_or(0.0, |c| (1.0 - c * c).max(0.0).sqrt());
        let z_rate = z_apparent.rate[k]
            .map(|rate| rate * camera.medium_index)
            .unwrap_or(0.0);
        let across = motion.x.rate[k]
            .zip(motion.y.rate[k])
            .zip(z_apparent.value[k])
            .map_or(0.0, |((x, y), z)| libm::hypot(x, y) * z / camera.focal_px());
        let speed = libm::hypot(across, z_rate);
        let cost = |sign: f64| {
            0.075
                * ((z_rate - sign * speed * sine) / 0.05)
                    .clamp(-4.0, 4.0)
                    .powi(2)
        };
        ([cost(-1.0), cost(1.0)], 0.3 + 12.0 * sine * sine)
    };
    let steps: Vec<([f64; 2], f64)> = (0..n).map(step).collect();
    let mut costs = [0.0f64; 2];
    let mut came_from = Vec::with_capacity(n);
    let mut ahead = Vec::with_capacity(n);
    for (emission, flip) in &steps {
        let mut from = [0, 1];
        let mut next = [0.0; 2];
        for state in 0..2 {
            let (stay, swap) = (costs[state], costs[1 - state] + flip);
            from[state] = if stay <= swap { state } else { 1 - state };
            next[state] = stay.min(swap) + emission[state];
        }
        costs = next;
        came_from.push(from);
        ahead.push(costs);
    }
    let mut behind = [0.0f64; 2];
    let mut signs = vec![
        Sign {
            away: true,
            confidence: 0.5
        };
        n
    ];
    let mut state = usize::from(costs[1] <= costs[0]);
    for k in (0..n).rev() {
        // Min-marginals: how much worse the best sequence through the other sign is.
        let other = 1 - state;
        let gap = (ahead[k][other] + behind[other]) - (ahead[k][state] + behind[state]);
        signs[k] = Sign {
            away: state == 1,
            confidence: 1.0 / (1.0 + libm::exp(-gap.max(0.0))),
        };
        let (emission, flip) = &steps[k];
        let through = [behind[0] + emission[0], behind[1] + emission[1]];
        behind = [
            through[0].min(through[1] + flip),
            through[1].min(through[0] + flip),
        ];
        state = came_from[k][state];
    }
    signs
}

/// Values as they are, with rates from central differences left out.
fn raw(value: Vec<Option<f64>>) -> Smoothed {
    let rate = vec![None; value.len()];
    Smoothed { value, rate }
}
