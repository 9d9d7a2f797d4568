//! The animal's path: one candidate a frame, or none, over the whole film at once.
//!
//! The cheapest path by dynamic programming. A candidate costs how unlike the subject it looks; a step costs how far
//! it leads beyond what the animal usually moves in so many frames, and how much its area changes; a frame without
//! the animal has a fixed cost. So a hand that is seen first, a speck where the animal is gone, or the half of a
//! silhouette are taken only where nothing fits better.

use super::sighting::Sighting;
use crate::analysis::params::Follow;
use crate::analysis::subject::{FITS, Look, Subject};
use crate::order;

/// A look that costs more than this is not the animal.
pub(super) const MOST_COST: f64 = 24.0;
/// Cost of a frame in which the animal is not seen.
const ABSENT: f64 = 10.0;
/// Cost of the farthest step, in any time.
const FARTHEST: f64 = 80.0;
/// Weight of the cost of looks that fit.
const FITTING: f64 = 0.05;
/// Cost of the largest change of area.
const LARGEST_CHANGE: f64 = 3.0;
/// Spread of the change of the logarithm of the area from one frame to the next.
const CHANGE_SPREAD: f64 = 0.3;
/// Frames without the animal that a step may lead across; after more the animal may be anywhere.
const MOST_MISSED: usize = 30;

/// What may be the animal in a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    /// What it looks like.
    pub(super) look: Look,
    /// How unlike the subject it looks.
    pub(super) cost: f64,
    /// The animal cut out and measured.
    pub(super) sighting: Sighting,
}

/// Chooses a candidate, or none, for each frame. Where the largest of several animals is followed, a smaller one costs the
/// logarithm of how many times smaller it is.
pub(super) fn choose(
    frames: &[&[Candidate]],
    subject: &Subject,
    follow: Follow,
) -> Vec<Option<usize>> {
    let steps = Steps::of(frames, subject);
    // A node is a candidate; its best predecessor is a node of an earlier frame, or none.
    let mut costs: Vec<Vec<f64>> = Vec::with_capacity(frames.len());
    let mut from: Vec<Vec<Option<(usize, usize)>>> = Vec::with_capacity(frames.len());
    // The cheapest end so far of a path whose last node lies too far back for a step.
    let mut forgotten: (f64, Option<(usize, usize)>) = (0.0, None);
    for (t, candidates) in frames.iter().enumerate() {
        let (mut of_frame, mut from_frame) = (Vec::new(), Vec::new());
        if let Some(old) = t.checked_sub(MOST_MISSED + 1) {
            for (at, cost) in costs[old].iter().enumerate() {
                // Compared as if both had missed all frames up to now.
                let since_start = cost - ABSENT * (old + 1) as f64;
                if since_start < forgotten.0 {
                    forgotten = (since_start, Some((old, at)));
                }
            }
        }
        let fitting = candidates.iter().filter(|c| c.cost < FITS);
        let largest_px = fitting.map(|c| c.look.area_px).fold(0.0, f64::max);
        let smaller = |candidate: &Candidate| match follow {
            Follow::One => 0.0,
            Follow::Largest => libm::log(largest_px / candidate.look.area_px).max(0.0),
        };
        for candidate in *candidates {
            let mut best = (
                forgotten.0
                    + ABSENT * t as f64
                    + if forgotten.1.is_some() { FARTHEST } else { 0.0 },
                forgotten.1,
            );
            for before in t.saturating_sub(MOST_MISSED)..t {
                let n_missed = t - before - 1;
                for (at, previous) in frames[before].iter().enumerate() {
                    let cost = costs[before][at]
                        + ABSENT * n_missed as f64
                        + steps.cost(&previous.look, &candidate.look, n_missed + 1);
                    if cost < best.0 {
                        best = (cost, Some((before, at)));
                    }
                }
            }
            of_frame.push(best.0 + of_look(candidate.cost) + smaller(candidate));
            from_frame.push(best.1);
        }
        costs.push(of_frame);
        from.push(from_frame);
    }
    let n = frames.len();
    let ends = costs.iter().enumerate().flat_map(|(t, costs)| {
        let with_rest =
            move |(at, cost): (usize, &f64)| (cost + ABSENT * (n - 1 - t) as f64, (t, at));
        costs.iter().enumerate().map(with_rest)
    });
    let mut node = ends
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(cost, _)| *cost < ABSENT * n as f64)
        .map(|(_, node)| node);
    let mut chosen = vec![None; n];
    while let Some((t, at)) = node {
        chosen[t] = Some(at);
        node = from[t][at];
    }
    chosen
}

/// What a look costs in a path: nearly nothing while it fits, however well another may fit. Looks of neighboring frames are
/// alike, so small differences say less than as many independent ones.
fn of_look(cost: f64) -> f64 {
    FITTING * cost.min(FITS) + 0.5 * (cost - FITS).max(0.0)
}

/// What a step from one look to another costs.
struct Steps {
    /// How far the animal moves in a frame, nine times of ten, pixels.
    usual_px: f64,
    /// Spread of what goes beyond that, pixels.
    spread_px: f64,
}

impl Steps {
    fn of(frames: &[&[Candidate]], subject: &Subject) -> Steps {
        let best = |candidates: &&[Candidate]| {
            let fitting = candidates.iter().filter(|c| c.cost < FITS);
            fitting
                .min_by(|a, b| a.cost.total_cmp(&b.cost))
                .map(|c| c.look.centroid_px)
        };
        let places: Vec<Option<[f64; 2]>> = frames.iter().map(best).collect();
        let step = |pair: &[Option<[f64; 2]>]| Some(distance(pair[0]?, pair[1]?));
        let mut steps: Vec<f64> = places.windows(2).filter_map(step).collect();
        Steps {
            usual_px: order::percentile(&mut steps, 0.9).unwrap_or(0.0),
            spread_px: (0.5 * subject.diagonal_px).max(4.0),
        }
    }

    fn cost(&self, a: &Look, b: &Look, n_frames: usize) -> f64 {
        let n = n_frames as f64;
        let beyond = (distance(a.centroid_px, b.centroid_px) - self.usual_px * n).max(0.0);
        let far = beyond / (self.spread_px * n.sqrt());
        let change = libm::log(b.area_px / a.area_px) / (CHANGE_SPREAD * n.sqrt());
        (0.5 * far * far).min(FARTHEST) + (0.5 * change * change).min(LARGEST_CHANGE)
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}
