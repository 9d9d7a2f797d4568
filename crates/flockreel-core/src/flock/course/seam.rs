//! Seam of a loop: the last frame leads into the first (docs/explanation/algorithms.md, "Boids").
//!
//! Some seconds before the first frame are simulated too: the lead. Some time before the end, each individual
//! is assigned its continuation: the individual as which it continues after the last frame. Individuals are
//! interchangeable, so continuations are chosen by least distance. From there on each individual is steered
//! toward the positions of its continuation in the lead, within the usual limits. The remaining difference is
//! blended away.

use crate::flock::boids::vector::{Vec3, add_scaled, dot, minus};
use crate::flock::boids::{Boids, TargetStates};

/// Length of the lead, seconds, at most four fifths of the video. Free choice.
const MEETING_S: f64 = 8.0;
/// Time by which a difference in velocity is multiplied to compare it with a distance, seconds. Free choice.
const AHEAD_S: f64 = 1.0;
/// Largest number of passes in which pairs of individuals swap continuations. Free choice.
const N_PASSES: usize = 20;

/// Positions and velocities of all boids at one moment, by id.
#[derive(Clone, Debug, Default)]
pub(super) struct Snapshot {
    /// Positions, body lengths.
    pub(super) positions: Vec<Vec3>,
    /// Velocities, body lengths per second.
    pub(super) velocities: Vec<Vec3>,
    /// Position of the predator, body lengths.
    pub(super) predator: Option<Vec3>,
}

/// Returns the number of frames of the lead for a video of `n_frames` frames. As many frames at the end are
/// steered.
pub(super) fn n_meeting_frames(n_frames: u32, fps: f64) -> usize {
    ((MEETING_S * fps).round() as usize).min(4 * n_frames as usize / 5)
}

/// Returns the continuation of each individual, a permutation of the ids. `end` holds the boids when
/// steering begins, `lead` the moments before the first frame.
pub(super) fn continuations(end: &Snapshot, lead: &[Snapshot]) -> Vec<u32> {
    let Some(first) = lead.first() else {
        return (0..end.positions.len() as u32).collect();
    };
    assign(end.positions.len(), |from, to| {
        let way = minus(first.positions[to], end.positions[from]);
        let change = minus(first.velocities[to], end.velocities[from]);
        dot(way, way) + AHEAD_S * AHEAD_S * dot(change, change)
    })
}

/// Returns a permutation of `n` targets with a small sum of squares.
///
/// The nearest pairs are assigned first, ties to the smaller ids. Then pairs swap targets until no swap
/// lowers the sum, at most `N_PASSES` times.
fn assign(n: usize, square: impl Fn(usize, usize) -> f64) -> Vec<u32> {
    let mut pairs: Vec<(f64, u32, u32)> = (0..n as u32)
        .flat_map(|from| (0..n as u32).map(move |to| (from, to)))
        .map(|(from, to)| (square(from as usize, to as usize), from, to))
        .collect();
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut continuations = vec![u32::MAX; n];
    let mut is_taken = vec![false; n];
    for (_, from, to) in pairs {
        if continuations[from as usize] == u32::MAX && !is_taken[to as usize] {
            continuations[from as usize] = to;
            is_taken[to as usize] = true;
        }
    }
    for _ in 0..N_PASSES {
        let mut is_done = true;
        for a in 0..n {
            for b in a + 1..n {
                let (to_a, to_b) = (continuations[a] as usize, continuations[b] as usize);
                if square(a, to_b) + square(b, to_a) < square(a, to_a) + square(b, to_b) {
                    continuations.swap(a, b);
                    is_done = false;
                }
            }
        }
        if is_done {
            break;
        }
    }
    continuations
}

/// Returns the positions and velocities to reach, `left` frames before the end of the video. The first frame
/// follows the last moment of `lead`.
pub(super) fn meeting(lead: &[Snapshot], continuations: &[u32], left: usize) -> TargetStates {
    let snapshot = &lead[lead.len() - left];
    let n_frames = lead.len() as f64;
    TargetStates {
        // Full weight after a third of the lead.
        weight: smooth(3.0 * (n_frames - left as f64) / n_frames),
        states: (continuations.iter())
            .map(|&continuation| {
                let continuation = continuation as usize;
                (
                    snapshot.positions[continuation],
                    snapshot.velocities[continuation],
                )
            })
            .collect(),
    }
}

/// Blends the last moments of a video into the lead.
pub(super) fn blend_into_lead(
    snapshots: &mut [Snapshot],
    lead: &[Snapshot],
    continuations: &[u32],
    fps: f64,
) {
    let first = snapshots.len() - lead.len();
    let n_frames = lead.len() as f64;
    for (k, (now, before)) in snapshots[first..].iter_mut().zip(lead).enumerate() {
        let gone = k as f64 / n_frames;
        let (share, slope) = (smooth(gone), slope(gone) * fps / n_frames);
        for (id, &continuation) in continuations.iter().enumerate() {
            let continuation = continuation as usize;
            let missing = minus(before.positions[continuation], now.positions[id]);
            let change = minus(before.velocities[continuation], now.velocities[id]);
            now.positions[id] = add_scaled(now.positions[id], share, missing);
            let velocity = add_scaled(now.velocities[id], share, change);
            now.velocities[id] = add_scaled(velocity, slope, missing);
        }
        if let (Some(predator), Some(before)) = (&mut now.predator, before.predator) {
            *predator = add_scaled(*predator, share, minus(before, *predator));
        }
    }
}

impl Snapshot {
    /// Returns the current moment of the boids.
    pub(super) fn new(boids: &Boids) -> Snapshot {
        Snapshot {
            positions: boids.positions().to_vec(),
            velocities: boids.velocities().to_vec(),
            predator: boids.predator(),
        }
    }
}

/// Rises from 0 to 1 over shares 0 to 1, with zero slope and curvature at both ends. Constant outside.
pub(super) fn smooth(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 - s * (15.0 - 6.0 * s))
}

/// Returns the derivative of `smooth`.
pub(super) fn slope(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    30.0 * s * s * (1.0 - s) * (1.0 - s)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn snapshot(positions: Vec<Vec3>) -> Snapshot {
        Snapshot {
            velocities: vec![[1.0, 0.0, 0.0]; positions.len()],
            positions,
            predator: None,
        }
    }

    proptest! {
        #[test]
        fn continuations_are_a_permutation_that_no_swap_improves(
            from in prop::collection::vec(prop::array::uniform3(-9.0..9.0), 1..9),
            seed in prop::collection::vec(prop::array::uniform3(-9.0..9.0), 9),
        ) {
            let (end, lead) = (snapshot(from.clone()), [snapshot(seed[..from.len()].to_vec())]);
            let continuations = continuations(&end, &lead);
            let mut sorted = continuations.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..from.len() as u32).collect::<Vec<_>>());
            let square = |a: usize, b: u32| {
                let way = minus(seed[b as usize], from[a]);
                dot(way, way)
            };
            for a in 0..from.len() {
                for b in 0..a {
                    let kept = square(a, continuations[a]) + square(b, continuations[b]);
                    prop_assert!(kept <= square(a, continuations[b]) + square(b, continuations[a]) + 1e-9);
                }
            }
        }
    }

    #[test]
    fn difference_at_the_seam_is_blended_away() {
        let at = |x: f64| snapshot(vec![[x, 0.0, 0.0]]);
        let lead: Vec<Snapshot> = (0..60).map(|k| at(k as f64 / 30.0 - 2.0)).collect();
        let mut film: Vec<Snapshot> = (0..90).map(|t| at(t as f64 / 30.0 - 2.6)).collect();
        blend_into_lead(&mut film, &lead, &[0], 30.0);
        let x = |t: usize| film[t].positions[0][0];
        assert!(x(89).abs() < 0.04, "a frame before 0: {}", x(89));
        for t in 1..90 {
            let step = 30.0 * (x(t) - x(t - 1));
            assert!((0.2..1.1).contains(&step), "{t}: {step}");
            let velocity = film[t].velocities[0][0];
            assert!((velocity - step).abs() < 0.1, "{t}: {velocity} {step}");
        }
    }
}
