//! Gauss-Newton with Levenberg's damping over all frames, or over a stretch of them.

use super::States;
use super::banded::N_STATE;
use super::energy::{Energy, State};

/// Steps over the whole footage at most.
const STEPS: usize = 30;
/// Steps over a stretch at most.
const STRETCH_STEPS: usize = 6;
/// A stretch is given up when so many times the last gain would not be enough.
const HOPE: f64 = 2.0;
/// Frames at an inner end of a stretch that stay where they are.
pub(super) const HELD: usize = 3;

/// Finds the nearest least energy of the whole course.
pub(super) fn whole(energy: &Energy, states: &mut States) {
    descend(energy, 0, states, (STEPS, f64::INFINITY), |_| false);
}

/// The same for the frames from `start` on that `states` covers; returns the energy among them. The
/// ends stay fixed where the footage goes on. Gives up early where it will not come below `wanted`.
pub(super) fn stretch(energy: &Energy, start: usize, states: &mut [State], wanted: f64) -> f64 {
    let n = states.len();
    let goes_on = start + n < energy.views.frames.len();
    let held = move |k: usize| (start > 0 && k < HELD) || (goes_on && k + HELD >= n);
    descend(energy, start, states, (STRETCH_STEPS, wanted), held)
}

fn descend(
    energy: &Energy,
    start: usize,
    states: &mut [State],
    (steps, wanted): (usize, f64),
    held: impl Fn(usize) -> bool,
) -> f64 {
    let mut damping = 1e-3;
    let mut cost = f64::INFINITY;
    for step in 0..steps {
        let normal = energy.normal(start, states);
        cost = normal.cost;
        let mut better = None;
        for _ in 0..8 {
            let Some(move_by) = normal.step(damping, |unknown| held(unknown / N_STATE)) else {
                damping *= 5.0;
                continue;
            };
            let moved: States = states
                .iter()
                .zip(move_by.chunks_exact(N_STATE))
                .map(|(state, by)| State(std::array::from_fn(|k| state.0[k] + by[k])))
                .collect();
            let reached = energy.cost(start, &moved);
            if reached < cost {
                better = Some((moved, reached));
                damping = (damping / 5.0).max(1e-6);
                break;
            }
            damping *= 5.0;
        }
        let Some((moved, reached)) = better else {
            break;
        };
        states.copy_from_slice(&moved);
        let gained = cost - reached;
        let settled = gained < 1e-4 * cost;
        cost = reached;
        // Each step gains less than the one before it, but for the first two.
        let hopeless = step >= 2 && cost - HOPE * gained > wanted;
        if settled || hopeless {
            break;
        }
    }
    cost
}
