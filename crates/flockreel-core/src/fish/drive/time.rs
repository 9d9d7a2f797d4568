//! Placements over time: short gaps are filled, and noise is smoothed.

use glam::{DQuat, DVec3};

use super::Placement;
use crate::fish::motion::{nearest_sign, slerp};

/// Fills gaps of at most `longest` frames between two known frames by interpolation.
pub(super) fn fill_gaps(measured: &[Option<Placement>], longest: usize) -> Vec<Option<Placement>> {
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
        bend: None,
        joint_angles_rad: joints
            .map(|(a, b)| std::array::from_fn(|j| a[j] + share * (b[j] - a[j]))),
    }
}

/// Returns Gaussian means of positions and rotations over time, within each run without gaps. Joint angles
/// stay unchanged, and so does a fish that lies on a midline.
pub(super) fn smoothed(
    placements: &[Option<Placement>],
    sigma_frames: f64,
) -> Vec<Option<Placement>> {
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
pub(super) fn window(
    n: usize,
    middle: usize,
    sigma_frames: f64,
) -> impl Iterator<Item = (usize, f64)> {
    let reach = (3.0 * sigma_frames).floor() as usize;
    (middle.saturating_sub(reach)..(middle + reach + 1).min(n)).map(move |k| {
        let off = (k as f64 - middle as f64) / sigma_frames.max(1e-9);
        (k, libm::exp(-0.5 * off * off))
    })
}
