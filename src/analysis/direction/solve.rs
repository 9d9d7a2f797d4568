//! Gauss-Newton with Levenberg's damping over all frames, or over a stretch of them.

use super::States;
use super::banded::N_STATE;
use super::energy::{Energy, State};

/// Steps over the whole footage at most.
const STEPS: usize = 30;
/// Steps over a stretch at most.
const STRETCH_STEPS: usize = 6;
/// Frames at an inner end of a stretch that stay where they are.
pub(super) const HELD: usize = 3;

/// Finds the nearest least energy of the whole course.
pub(super) fn whole(energy: &Energy, states: &mut States) {
    descend(energy, 0, states, STEPS, |_| false);
}

/// The same for the frames from `start` on that `states` covers; returns the energy among them. The
/// ends stay fixed where the footage goes on.
pub(super) fn stretch(energy: &Energy, start: usize, states: &mut [State]) -> f64 {
    let n = states.len();
    let goes_on = start + n < energy.views.frames.len();
    let held = move |k: usize| (start > 0 && k < HELD) || (goes_on && k + HELD >= n);
    descend(energy, start, states, STRETCH_STEPS, held)
}

fn descend(
    energy: &Energy,
    start: usize,
    states: &mut [State],
    steps: usize,
    held: impl Fn(usize) -> bool,
) -> f64 {
    let mut damping = 1e-3;
    let mut cost = f64::INFINITY;
    for _ in 0..steps {
        let normal = energy.normal(start, states);
        cost = normal.cost;
        let mut better = None;
        for _ in 0..8 {
            let Some(step) = normal.step(damping, |unknown| held(unknown / N_STATE)) else {
                damping *= 5.0;
                continue;
            };
            let moved: States = states
                .iter()
                .zip(step.chunks_exact(N_STATE))
                .map(|(state, step)| State(std::array::from_fn(|k| state.0[k] + step[k])))
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
        let settled = cost - reached < 1e-4 * cost;
        cost = reached;
        if settled {
            break;
        }
    }
    cost
}
