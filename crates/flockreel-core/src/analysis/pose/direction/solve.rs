//! Gauss-Newton with Levenberg-Marquardt damping, over all frames or over a range of them.

use super::energy::Energy;
use super::state::{N_STATE, State};

/// Largest number of steps over the whole footage. Free choice.
const MAX_STEPS: usize = 30;
/// Largest number of steps over a range of frames. Free choice.
const MAX_RANGE_STEPS: usize = 6;
/// The descent over a range stops when this many times the gain of the last step cannot reach the wanted
/// energy. Free choice.
const MAX_REMAINING_GAIN: f64 = 2.0;
/// Number of frames that stay fixed at an end of a range where the footage continues. Residuals involve at
/// most three frames.
const N_FIXED: usize = 3;

/// Limits at which a descent ends.
struct Limits {
    max_steps: usize,
    /// The descent stops when it is unlikely to fall below this energy.
    wanted: f64,
}

/// Moves the states to a local minimum of the energy.
pub(super) fn minimize(energy: &Energy, states: &mut [State]) {
    let limits = Limits {
        max_steps: MAX_STEPS,
        wanted: f64::INFINITY,
    };
    descend(energy, 0, states, limits, |_| false);
}

/// Minimises the energy over the frames from `start` that `states` covers, and returns that energy.
///
/// The first and last frames stay fixed where the footage continues. The descent stops early when the energy
/// is unlikely to fall below `wanted`.
pub(super) fn minimize_range(
    energy: &Energy,
    start: usize,
    states: &mut [State],
    wanted: f64,
) -> f64 {
    let n = states.len();
    let continues = start + n < energy.observations.frames.len();
    let is_fixed = move |k: usize| (start > 0 && k < N_FIXED) || (continues && k + N_FIXED >= n);
    let limits = Limits {
        max_steps: MAX_RANGE_STEPS,
        wanted,
    };
    descend(energy, start, states, limits, is_fixed)
}

fn descend(
    energy: &Energy,
    start: usize,
    states: &mut [State],
    limits: Limits,
    is_fixed: impl Fn(usize) -> bool,
) -> f64 {
    let mut damping = 1e-3;
    let mut cost = f64::INFINITY;
    for step_idx in 0..limits.max_steps {
        let normal = energy.normal_equations(start, states);
        cost = normal.cost;
        let mut better = None;
        for _ in 0..8 {
            let step = normal.step(damping, |unknown| is_fixed(unknown / N_STATE));
            if let Some(step) = step {
                let moved: Vec<State> = (states.iter().zip(step.chunks_exact(N_STATE)))
                    .map(|(state, step)| state.moved(step))
                    .collect();
                let moved_cost = energy.cost(start, &moved);
                if moved_cost < cost {
                    better = Some((moved, moved_cost));
                    damping = (damping / 5.0).max(1e-6);
                    break;
                }
            }
            damping *= 5.0;
        }
        let Some((moved, moved_cost)) = better else {
            break;
        };
        states.copy_from_slice(&moved);
        let gain = cost - moved_cost;
        let is_settled = gain < 1e-4 * cost;
        cost = moved_cost;
        // After the first two steps, each step gains less than the one before.
        let is_hopeless = step_idx >= 2 && cost - MAX_REMAINING_GAIN * gain > limits.wanted;
        if is_settled || is_hopeless {
            break;
        }
    }
    cost
}
