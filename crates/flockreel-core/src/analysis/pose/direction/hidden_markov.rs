//! Hidden Markov model over the cells of the direction sphere: the most probable course (Viterbi) and the
//! posterior of every cell (forward-backward).
//!
//! Its input is the cost of every cell in every frame, a negative log likelihood. Turns cost in proportion to
//! their angle.

use rayon::prelude::*;

use super::cells::{N_CELL, N_PITCH, N_YAW, PITCH_STEP_RAD, YAW_STEP_RAD};

/// Largest change from one frame to the next, in cells of yaw and of pitch. Free choice.
const MAX_YAW_STEP: usize = 4;
const MAX_PITCH_STEP: usize = 2;
/// Cost per radian of turning. The total depends on the angle only, not on the frame rate. Free choice.
const TURN_COST: f64 = 5.8;

/// Number of frames whose costs are in memory at a time. The costs are computed a second time for the
/// backward pass. Only two bytes per cell are kept for every frame.
const BLOCK_FRAMES: usize = 512;

/// Decodes a course of `n` frames, at least 1.
///
/// `cost(k)` returns the cost of every cell in frame k. `on_frame` is called for every frame, from the last
/// to the first. Its arguments are the frame, its cell on the most probable course, and the posterior of all
/// cells.
pub(super) fn decode(
    n: usize,
    cost: impl Fn(usize) -> Vec<f64> + Sync,
    mut on_frame: impl FnMut(usize, usize, &[f64]),
) {
    let block_costs = |block_idx: usize| -> Vec<Vec<f64>> {
        let frames = block_idx * BLOCK_FRAMES..n.min((block_idx + 1) * BLOCK_FRAMES);
        frames.into_par_iter().map(&cost).collect()
    };
    let n_blocks = n.div_ceil(BLOCK_FRAMES);
    let mut viterbi = Viterbi::default();
    // The forward probabilities on entry to each block.
    let mut entry_messages = vec![vec![1.0; N_CELL]];
    for block_idx in 0..n_blocks {
        let costs = block_costs(block_idx);
        let ((), forward) = rayon::join(
            || viterbi.extend(&costs),
            || forward(&entry_messages[block_idx], &likelihoods(&costs)),
        );
        entry_messages.extend(forward.last().map(|last| propagated(last)));
    }
    let path = viterbi.path();
    let mut backward = vec![1.0; N_CELL];
    for block_idx in (0..n_blocks).rev() {
        let likelihoods = likelihoods(&block_costs(block_idx));
        let forward = forward(&entry_messages[block_idx], &likelihoods);
        for (k, (forward, likelihood)) in forward.iter().zip(&likelihoods).enumerate().rev() {
            let both = forward.iter().zip(&backward);
            let mut posterior: Vec<f64> = both.map(|(f, b)| f * b).collect();
            normalize(&mut posterior);
            let frame_idx = block_idx * BLOCK_FRAMES + k;
            on_frame(frame_idx, path[frame_idx], &posterior);
            backward
                .iter_mut()
                .zip(likelihood)
                .for_each(|(b, l)| *b *= l);
            backward = propagated(&backward);
            normalize(&mut backward);
        }
    }
}

/// The most probable course (Viterbi).
#[derive(Default)]
struct Viterbi {
    /// The lowest cost of a path to each cell in the current frame; empty before the first frame.
    best: Vec<f64>,
    came_from: Vec<Vec<u16>>,
}

impl Viterbi {
    /// Extends the paths by the costs of the next frames.
    fn extend(&mut self, costs: &[Vec<f64>]) {
        for cost in costs {
            if self.best.is_empty() {
                self.best.clone_from(cost);
                continue;
            }
            let mut from: Vec<u16> = (0..N_CELL as u16).collect();
            self.best = step_to_neighbors(&self.best, &mut from);
            self.best.iter_mut().zip(cost).for_each(|(b, c)| *b += c);
            self.came_from.push(from);
        }
    }

    /// Returns the cell of every frame.
    fn path(self) -> Vec<usize> {
        let best = &self.best;
        let mut cell = (0..N_CELL).fold(0, |a, b| if best[b] < best[a] { b } else { a });
        let mut path = vec![cell; self.came_from.len() + 1];
        for (k, from) in self.came_from.iter().enumerate().rev() {
            cell = usize::from(from[cell]);
            path[k] = cell;
        }
        path
    }
}

/// Returns the lowest cost of reaching each cell from its neighbors, yaw first, then pitch. `from` receives
/// the predecessors.
fn step_to_neighbors(best: &[f64], from: &mut [u16]) -> Vec<f64> {
    let predecessors: Vec<u16> = from.to_vec();
    let mut after_yaw = best.to_vec();
    for i in 0..N_YAW {
        for shift in 0..=2 * MAX_YAW_STEP {
            let other = (i + N_YAW + shift - MAX_YAW_STEP) % N_YAW;
            let step = TURN_COST * YAW_STEP_RAD * shift.abs_diff(MAX_YAW_STEP) as f64;
            for j in 0..N_PITCH {
                let (cell, other) = (i * N_PITCH + j, other * N_PITCH + j);
                if best[other] + step < after_yaw[cell] {
                    after_yaw[cell] = best[other] + step;
                    from[cell] = predecessors[other];
                }
            }
        }
    }
    let predecessors: Vec<u16> = from.to_vec();
    let mut after_pitch = after_yaw.clone();
    for i in 0..N_YAW {
        for j in 0..N_PITCH {
            let cell = i * N_PITCH + j;
            for other in j.saturating_sub(MAX_PITCH_STEP)..(j + MAX_PITCH_STEP + 1).min(N_PITCH) {
                let cost = TURN_COST * PITCH_STEP_RAD * other.abs_diff(j) as f64;
                let other = i * N_PITCH + other;
                if after_yaw[other] + cost < after_pitch[cell] {
                    after_pitch[cell] = after_yaw[other] + cost;
                    from[cell] = predecessors[other];
                }
            }
        }
    }
    after_pitch
}

fn likelihoods(costs: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let of_frame = |cost: &Vec<f64>| {
        let least = cost.iter().copied().fold(f64::INFINITY, f64::min);
        cost.iter().map(|c| libm::exp(least - c)).collect()
    };
    costs.par_iter().map(of_frame).collect()
}

/// Returns the forward probabilities of every cell in the frames of a block.
fn forward(entry_message: &[f64], likelihoods: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut forward: Vec<Vec<f64>> = Vec::with_capacity(likelihoods.len());
    for likelihood in likelihoods {
        let mut probability = forward
            .last()
            .map_or(entry_message.to_vec(), |last| propagated(last));
        probability
            .iter_mut()
            .zip(likelihood)
            .for_each(|(p, l)| *p *= l);
        normalize(&mut probability);
        forward.push(probability);
    }
    forward
}

/// Returns the probabilities after one transition to neighboring cells, not normalised.
fn propagated(probability: &[f64]) -> Vec<f64> {
    let weight = |step: f64, k: usize| libm::exp(-TURN_COST * step * k as f64);
    let yaw: [f64; MAX_YAW_STEP + 1] = std::array::from_fn(|k| weight(YAW_STEP_RAD, k));
    let pitch: [f64; MAX_PITCH_STEP + 1] = std::array::from_fn(|k| weight(PITCH_STEP_RAD, k));
    let mut after_yaw = vec![0.0; N_CELL];
    for i in 0..N_YAW {
        for shift in 0..=2 * MAX_YAW_STEP {
            let other = (i + N_YAW + shift - MAX_YAW_STEP) % N_YAW;
            let w = yaw[shift.abs_diff(MAX_YAW_STEP)];
            for j in 0..N_PITCH {
                after_yaw[i * N_PITCH + j] += w * probability[other * N_PITCH + j];
            }
        }
    }
    let mut propagated = vec![0.0; N_CELL];
    for i in 0..N_YAW {
        let row = &after_yaw[i * N_PITCH..(i + 1) * N_PITCH];
        for j in 0..N_PITCH {
            let near = j.saturating_sub(MAX_PITCH_STEP)..(j + MAX_PITCH_STEP + 1).min(N_PITCH);
            propagated[i * N_PITCH + j] = near.map(|m| pitch[m.abs_diff(j)] * row[m]).sum();
        }
    }
    propagated
}

fn normalize(probability: &mut [f64]) {
    let total: f64 = probability.iter().sum();
    if total > 0.0 {
        probability.iter_mut().for_each(|m| *m /= total);
    }
}
