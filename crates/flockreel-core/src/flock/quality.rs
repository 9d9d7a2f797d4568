//! Quality measures of a flock that need no pixels (docs/explanation/algorithms.md, "Quality measures").

use std::collections::HashMap;

use rayon::prelude::*;

use super::boids::measures::Order;
use super::boids::vector::angle_between;
use super::individual::Individual;
use super::params::{MatchBy, Params};
use super::placement::is_jump;
use crate::geometry::{rounded, wrap_rad};
use crate::library::Library;
use crate::order::percentile;

/// Two individuals are clones if their boids are nearer than this, body lengths, and they show frames nearer
/// in the footage than this, seconds. Free choices.
const CLONE_BL: f64 = 4.0;
const CLONE_S: f64 = 0.3;
/// Time within which a frame shown again counts as a repeat, seconds. Free choice.
const REPEAT_S: f64 = 3.0;
/// Least speed of the steps on which slip is measured, body lengths per second. Free choice.
const MOVING_BL_PER_S: f64 = 0.1;

/// Quality measures of a whole flock.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Stats {
    /// Median of |shown heading - heading of the boid|, radians. With `by: direction`, median angle between
    /// the directions in space.
    pub heading_error_median_rad: f64,
    /// 90th percentile of the same error, radians.
    pub heading_error_p90_rad: f64,
    /// Jumps per 100 frames of one individual.
    pub jumps_per_100_frames: f64,
    /// Repeats per 100 frames: frames that the same individual showed less than 3 s before.
    pub repeats_per_100_frames: f64,
    /// 95th percentile of the distance from individual to boid in the image, body lengths.
    pub path_deviation_p95_bl: f64,
    /// Median angle between displacement and shown heading, radians.
    pub slip_median_rad: f64,
    /// Share of clones among pairs of individuals within 4 BL, over all frames. Clones show frames less than
    /// 0.3 s apart on the same mirror side.
    pub clone_share: f64,
    /// Largest number of individuals that can be shown at once without clones. It counts frames of the
    /// component at least 0.3 s apart, on each allowed mirror side. A larger flock has clones with any plan.
    pub distinct_looks: u32,
    /// Number of individuals that the tank has room for. In a larger flock some overlap. 0 = unknown.
    pub room_for: u32,
    /// Share of the steps that ended at a wall, so that an animal moved less than the filmed one, 0..=1.
    pub clipped_share: f64,
    /// Share of the component's frames that are shown.
    pub variety: f64,
    /// Polarization, mean over the frames, 0..=1.
    pub polarization: f64,
    /// Milling, mean over the frames, 0..=1.
    pub milling: f64,
    /// Distance from a boid to its nearest neighbor in space, mean over boids and frames, body lengths.
    pub nearest_neighbor_bl: f64,
    /// Distance from an individual to its nearest neighbor in the image, mean over individuals and frames,
    /// body lengths. 0 for a single animal.
    pub spacing_bl: f64,
    /// Number of times per minute that two animals come nearer than half a body length in the image.
    pub crossings_per_min: f64,
    /// Share of an animal that no nearer animal covers, mean over animals and frames, 0..=1.
    pub visible_share: f64,
    /// Share of boids with a neighbor within 3 body lengths, mean over the frames.
    pub neighbor_share: f64,
    /// Number of groups, mean over the frames. Boids within 4 body lengths of each other are in one group.
    pub groups: f64,
    /// Distance that boids keep from each other, body lengths: 0.5, or less if the tank is small for the
    /// flock.
    pub overlap_bl: f64,
    /// Number of boids beyond a wall or within an obstacle, summed over the frames.
    pub wall_violations: u64,
    /// Number of pairs of boids nearer than `overlap_bl`, summed over the frames.
    pub overlap_violations: u64,
}

/// Returns the measures of a flock, rounded as in files. `room_for`, `clipped_share`, `spacing_bl`, `crossings_per_min`,
/// `visible_share` and `overlap_bl` are 0.
pub fn measure(
    individuals: &[Individual],
    orders: &[Order],
    library: &Library,
    params: &Params,
    length_px: f64,
) -> Stats {
    let fps = library.poses.fps;
    let errors = |one| match params.matching.by {
        MatchBy::Direction => direction_errors(one),
        _ => heading_errors(one),
    };
    let headings: Vec<f64> = individuals.iter().flat_map(errors).collect();
    let deviations = individuals.iter().flat_map(deviations_px).collect();
    let least_step_px = MOVING_BL_PER_S * length_px / fps;
    let slips = individuals.iter().flat_map(|i| slips(i, least_step_px));
    let mean = |of: fn(&Order) -> f64| orders.iter().map(of).sum::<f64>() / orders.len() as f64;
    let sum = |of: fn(&Order) -> u32| orders.iter().map(|order| u64::from(of(order))).sum();
    let r = |value| rounded(value, 4);
    Stats {
        heading_error_median_rad: r(quantile(headings.clone(), 0.5)),
        heading_error_p90_rad: r(quantile(headings, 0.9)),
        jumps_per_100_frames: r(jumps_per_100_frames(individuals)),
        repeats_per_100_frames: r(repeats_per_100_frames(individuals, fps)),
        path_deviation_p95_bl: r(quantile(deviations, 0.95) / length_px),
        slip_median_rad: r(quantile(slips.collect(), 0.5)),
        clone_share: r(clone_share(
            individuals,
            CLONE_BL * length_px,
            CLONE_S * fps,
        )),
        distinct_looks: distinct_looks(&library.playback.component, CLONE_S * fps)
            * if params.mirror { 2 } else { 1 },
        variety: r(variety(individuals, library)),
        polarization: r(mean(|order| order.polarization)),
        milling: r(mean(|order| order.milling)),
        nearest_neighbor_bl: r(mean(|order| order.nearest_bl)),
        neighbor_share: r(mean(|order| order.neighbor_share)),
        groups: r(mean(|order| f64::from(order.n_groups))),
        wall_violations: sum(|order| order.n_outside),
        overlap_violations: sum(|order| order.n_overlaps),
        ..Stats::default()
    }
}

fn heading_errors(individual: &Individual) -> Vec<f64> {
    let pairs = individual
        .heading_rad
        .iter()
        .zip(&individual.boid.heading_rad);
    pairs
        .map(|(shown, wanted)| wrap_rad(shown - wanted).abs())
        .collect()
}

/// Returns the angles between shown and wanted directions in space, radians.
fn direction_errors(individual: &Individual) -> Vec<f64> {
    let shown = individual.forward.iter().flatten();
    let pairs = shown.zip(individual.boid.forward.iter().flatten());
    pairs
        .map(|(&shown, &wanted)| angle_between(shown, wanted))
        .collect()
}

fn deviations_px(individual: &Individual) -> impl Iterator<Item = f64> {
    let pairs = individual
        .centroid_px
        .iter()
        .zip(&individual.boid.position_px);
    pairs.map(|(shown, boid)| (shown[0] - boid[0]).hypot(shown[1] - boid[1]))
}

fn slips(individual: &Individual, least_step_px: f64) -> impl Iterator<Item = f64> {
    let steps = individual
        .centroid_px
        .windows(2)
        .zip(&individual.heading_rad[1..]);
    steps.filter_map(move |(step, heading)| {
        let (dx, dy) = (step[1][0] - step[0][0], step[1][1] - step[0][1]);
        (dx.hypot(dy) > least_step_px).then(|| wrap_rad(libm::atan2(dy, dx) - heading).abs())
    })
}

fn shown(individual: &Individual, t: usize) -> (u32, bool) {
    (individual.source_frame[t], individual.mirrored[t])
}

fn jumps_per_100_frames(individuals: &[Individual]) -> f64 {
    let n_frames: usize = individuals.iter().map(|i| i.source_frame.len()).sum();
    let jumps = |i: &Individual| {
        let steps = 1..i.source_frame.len();
        steps
            .filter(|&t| is_jump(shown(i, t - 1), shown(i, t)))
            .count()
    };
    let n_jumps: usize = individuals.iter().map(jumps).sum();
    100.0 * n_jumps as f64 / n_frames.max(1) as f64
}

/// Returns the number of repeats per 100 shown frames. A repeat is a frame that the same individual showed, on the
/// same mirror side, less than `REPEAT_S` earlier.
fn repeats_per_100_frames(individuals: &[Individual], fps: f64) -> f64 {
    let span = (REPEAT_S * fps).round() as usize;
    let repeats = |individual: &Individual| {
        let mut last = HashMap::new();
        let frames = 0..individual.source_frame.len();
        let is_repeat = |&t: &usize| {
            let before = last.insert(shown(individual, t), t);
            before.is_some_and(|before| t - before < span)
        };
        frames.filter(is_repeat).count()
    };
    let n_frames: usize = individuals.iter().map(|i| i.source_frame.len()).sum();
    let n_repeats: usize = individuals.iter().map(repeats).sum();
    100.0 * n_repeats as f64 / n_frames.max(1) as f64
}

fn clone_share(individuals: &[Individual], within_px: f64, within_frames: f64) -> f64 {
    let of_pair = |(a, b): (&Individual, &Individual)| {
        let (mut near, mut clones) = (0u64, 0u64);
        for (t, (p, q)) in (a.boid.position_px.iter().zip(&b.boid.position_px)).enumerate() {
            let square: f64 = p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum();
            if square > within_px * within_px {
                continue;
            }
            let (one, other) = (shown(a, t), shown(b, t));
            let apart = f64::from(one.0.abs_diff(other.0));
            near += 1;
            clones += u64::from(one.1 == other.1 && apart < within_frames);
        }
        [near, clones]
    };
    let sum = |[a, b]: [u64; 2], [c, d]: [u64; 2]| [a + c, b + d];
    let with_later = |(k, a): (usize, &Individual)| {
        let pairs = individuals[k + 1..].iter().map(|b| of_pair((a, b)));
        pairs.fold([0; 2], sum)
    };
    let all = individuals.par_iter().enumerate().map(with_later);
    let [near, clones] = all.reduce(|| [0; 2], sum);
    clones as f64 / near.max(1) as f64
}

/// Returns the largest number of frames of which no two are nearer than `apart_frames`.
fn distinct_looks(component: &[u32], apart_frames: f64) -> u32 {
    let mut n_looks = 0;
    let mut last: Option<u32> = None;
    for &frame in component {
        if last.is_none_or(|last| f64::from(frame - last) >= apart_frames) {
            n_looks += 1;
            last = Some(frame);
        }
    }
    n_looks
}

fn variety(individuals: &[Individual], library: &Library) -> f64 {
    let mut used = vec![false; library.poses.frames.len()];
    for frame in individuals.iter().flat_map(|i| &i.source_frame) {
        used[*frame as usize] = true;
    }
    let n_used = used.iter().filter(|&&used| used).count();
    n_used as f64 / library.playback.component.len().max(1) as f64
}

/// Returns the quantile, or 0 for an empty list.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    percentile(&mut values, share).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::distinct_looks;

    #[test]
    fn distinct_looks_are_far_enough_apart() {
        let component: Vec<u32> = (10..37).chain(40..42).collect();
        assert_eq!(distinct_looks(&component, 9.0), 4, "10, 19, 28 and 40");
        assert_eq!(distinct_looks(&component, 1.0), 29);
        assert_eq!(distinct_looks(&[], 9.0), 0);
    }
}
