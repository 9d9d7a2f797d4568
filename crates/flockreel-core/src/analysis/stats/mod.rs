//! Computes the statistics of a library: detections, motion of the animal, and playback. The submodule
//! `advice` derives recommendations from them.

mod advice;
#[cfg(test)]
mod tests;

pub use advice::{Advice, Motion, advice};

use super::pose;
use super::similarity::transition::Connections;
use crate::geometry::wrap_rad;
use crate::library::{LibraryStats, Pose, Poses};
use crate::order::percentile;

/// Number of bins in the heading histogram: 10 degrees each, starting at -180.
const N_BINS: usize = 36;

/// Returns the statistics of a library, from those of its scene (`of_scene`). The caller adds the values about the
/// sprites.
pub(super) fn library_stats(
    poses: &Poses,
    connections: &Connections,
    of_scene: LibraryStats,
) -> LibraryStats {
    let component = &connections.playback.component;
    let length_px = length_px(poses);
    LibraryStats {
        n_frames: poses.frames.len(),
        n_detected: poses.frames.iter().filter(|pose| pose.detected()).count(),
        n_candidates: connections.n_candidates,
        n_transitions: connections.transitions.len(),
        kappa_used: connections.kappa_used,
        component_share: connections.component_share,
        heading_histogram: histogram(poses, component),
        speed_bl_per_s: length_px.and_then(|length| speeds(poses, length)),
        turn_rate_rad_per_s: turn_rate(poses),
        length_px,
        ..of_scene
    }
}

/// Returns the length of the animal in the image when seen broadside (80th percentile), pixels; `None` if no
/// frame shows it uncut.
pub fn length_px(poses: &Poses) -> Option<f64> {
    let uncut = poses.frames.iter().filter(|pose| !pose.cut);
    pose::reference_length_px(uncut.filter_map(|pose| pose.length_px))
}

fn histogram(poses: &Poses, component: &[u32]) -> Vec<u32> {
    let mut bins = vec![0; N_BINS];
    for &frame in component {
        if let Some(heading) = poses.frames[frame as usize].heading_rad {
            let turn = (heading + std::f64::consts::PI) / std::f64::consts::TAU;
            bins[((turn * N_BINS as f64) as usize).min(N_BINS - 1)] += 1;
        }
    }
    bins
}

/// Returns the 5th, 50th and 95th percentile of the smoothed centroid's speed, body lengths per second.
fn speeds(poses: &Poses, length_px: f64) -> Option<[f64; 3]> {
    let centroids: Vec<_> = poses.frames.iter().map(|pose| pose.centroid_px).collect();
    let velocities = pose::velocity_px(&centroids, poses.fps);
    let speed = |[x, y]: [f64; 2]| libm::hypot(x, y) / length_px;
    let mut speeds: Vec<f64> = velocities.into_iter().flatten().map(speed).collect();
    let mut speed_at = |share: f64| percentile(&mut speeds, share);
    Some([speed_at(0.05)?, speed_at(0.5)?, speed_at(0.95)?])
}

/// Returns the 95th percentile of the turning rate, radians per second, over 0.1 s on each side of a frame.
fn turn_rate(poses: &Poses) -> Option<f64> {
    let half_span = ((poses.fps * 0.1).round() as usize).max(1);
    let rate = |pair: &[Pose]| {
        let (first, last) = (pair[0].heading_rad?, pair[2 * half_span].heading_rad?);
        Some(wrap_rad(last - first).abs() * poses.fps / (2 * half_span) as f64)
    };
    let mut rates: Vec<f64> = poses
        .frames
        .windows(2 * half_span + 1)
        .filter_map(rate)
        .collect();
    rates.sort_by(f64::total_cmp);
    let rank = rates.len().saturating_sub(1) * 19 / 20;
    rates.get(rank).copied()
}
