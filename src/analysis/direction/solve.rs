//! Gauss-Newton with Levenberg-Marquardt damping, over all frames or over a range of them.

use super::States;
use super::banded::N_STATE;
use super::energy::{Energy, State};

/// Largest number of steps over the whole footage. Free choice.
const STEPS: usize = 30;
/// Largest number of steps over a range of frames. Free choice.
const STRETCH_STEPS: usize = 6;
/// The descent over a range stops when this many times the gain of the last step cannot reach the wanted
/// energy. Free choice.
const HOPE: f64 = 2.0;
/// Number of frames that stay fixed at an end of a range where the footage continues. Residuals involve at
/// most three frames.
pub(super) const HELD: usize = 3;

/// Moves the states to a local minimum of the energy.
pub(super) fn whole(energy: &Energy, states: &mut States) {
    descend(energy, 0, states, (STEPS, f64::INFINITY), |_| false);
}

/// Minimises the energy over the frames from `start` that `states` covers, and returns that energy.
///
/// The first and last frames stay fixed where the footage continues. The descent stops early when the energy
/// is unlikely to fall below `wanted`.
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
        // After the first two steps, each step gains less than the one before.
        let hopeless = step >= 2 && cost - HOPE * gained > wanted;
        if settled || hopeless {
            break;
        }
    }
    cost
}
