//! Hidden Markov model over the cells of the direction sphere: the most probable course (Viterbi) and the
//! posterior of every cell (forward-backward).
//!
//! Its input is the cost of every cell in every frame, a negative log likelihood. Turns cost in proportion to
//! their angle.

use rayon::prelude::*;

use super::cells::{N_CELL, N_PITCH, N_YAW, PITCH_STEP_RAD, YAW_STEP_RAD};

/// Largest change from one frame to the next, in cells of yaw and of pitch. Free choice.
const YAW_REACH: usize = 4;
const PITCH_REACH: usize = 2;
/// Cost per radian of turning. The total depends on the angle only, not on the frame rate. Free choice.
const TURN_COST: f64 = 5.8;

/// Number of frames whose costs are in memory at a time. The costs are computed a second time for the
/// backward pass. Only two bytes per cell are kept for every frame.
const BLOCK: usize = 512;

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
    let costs_of = |block_idx: usize| -> Vec<Vec<f64>> {
        let frames = block_idx * BLOCK..n.min((block_idx + 1) * BLOCK);
        frames.into_par_iter().map(&cost).collect()
    };
    let n_blocks = n.div_ceil(BLOCK);
    let mut likeliest = Likeliest::default();
    // The forward probabilities on entry to each block.
    let mut carried = vec![vec![1.0; N_CELL]];
    for block_idx in 0..n_blocks {
        let costs = costs_of(block_idx);
        let ((), ahead) = rayon::join(
            || likeliest.go_on(&costs),
            || ahead(&carried[block_idx], &likelihoods(&costs)),
        );
        carried.extend(ahead.last().map(|last| spread(last)));
    }
    let path = likeliest.path();
    let mut behind = vec![1.0; N_CELL];
    for block_idx in (0..n_blocks).rev() {
        let likely = likelihoods(&costs_of(block_idx));
        let ahead = ahead(&carried[block_idx], &likely);
        for (k, (ahead, likely)) in ahead.iter().zip(&likely).enumerate().rev() {
            let mut mass: Vec<f64> = ahead.iter().zip(&behind).map(|(a, b)| a * b).collect();
            scale_to_one(&mut mass);
            let frame_idx = block_idx * BLOCK + k;
            on_frame(frame_idx, path[frame_idx], &mass);
            behind.iter_mut().zip(likely).for_each(|(b, l)| *b *= l);
            behind = spread(&behind);
            scale_to_one(&mut behind);
        }
    }
}

/// The most probable course (Viterbi).
#[derive(Default)]
struct Likeliest {
    /// The lowest cost of a path to each cell in the current frame; empty before the first frame.
    best: Vec<f64>,
    came_from: Vec<Vec<u16>>,
}

impl Likeliest {
    /// Extends the paths by the costs of the next frames.
    fn go_on(&mut self, costs: &[Vec<f64>]) {
        for cost in costs {
            if self.best.is_empty() {
                self.best.clone_from(cost);
                continue;
            }
            let mut from: Vec<u16> = (0..N_CELL as u16).collect();
            self.best = reach(&self.best, &mut from);
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
fn reach(best: &[f64], from: &mut [u16]) -> Vec<f64> {
    let came: Vec<u16> = from.to_vec();
    let mut turned = best.to_vec();
    for i in 0..N_YAW {
        for shift in 0..=2 * YAW_REACH {
            let other = (i + N_YAW + shift - YAW_REACH) % N_YAW;
            let step = TURN_COST * YAW_STEP_RAD * shift.abs_diff(YAW_REACH) as f64;
            for j in 0..N_PITCH {
                let (cell, other) = (i * N_PITCH + j, other * N_PITCH + j);
                if best[other] + step < turned[cell] {
                    turned[cell] = best[other] + step;
                    from[cell] = came[other];
                }
            }
        }
    }
    let came: Vec<u16> = from.to_vec();
    let mut pitched = turned.clone();
    for i in 0..N_YAW {
        for j in 0..N_PITCH {
            let cell = i * N_PITCH + j;
            for other in j.saturating_sub(PITCH_REACH)..(j + PITCH_REACH + 1).min(N_PITCH) {
                let cost = TURN_COST * PITCH_STEP_RAD * other.abs_diff(j) as f64;
                let other = i * N_PITCH + other;
                if turned[other] + cost < pitched[cell] {
                    pitched[cell] = turned[other] + cost;
                    from[cell] = came[other];
                }
            }
        }
    }
    pitched
}

fn likelihoods(costs: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let of_frame = |cost: &Vec<f64>| {
        let least = cost.iter().copied().fold(f64::INFINITY, f64::min);
        cost.iter().map(|c| libm::exp(least - c)).collect()
    };
    costs.par_iter().map(of_frame).collect()
}

/// Returns the forward probabilities of every cell in the frames of a block.
fn ahead(carried: &[f64], likely: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut ahead: Vec<Vec<f64>> = Vec::with_capacity(likely.len());
    for likely in likely {
        let mut mass = ahead.last().map_or(carried.to_vec(), |last| spread(last));
        mass.iter_mut().zip(likely).for_each(|(m, l)| *m *= l);
        scale_to_one(&mut mass);
        ahead.push(mass);
    }
    ahead
}

/// Returns the probabilities after one transition to neighboring cells, not normalised.
fn spread(mass: &[f64]) -> Vec<f64> {
    let weight = |step: f64, k: usize| libm::exp(-TURN_COST * step * k as f64);
    let yaw: [f64; YAW_REACH + 1] = std::array::from_fn(|k| weight(YAW_STEP_RAD, k));
    let pitch: [f64; PITCH_REACH + 1] = std::array::from_fn(|k| weight(PITCH_STEP_RAD, k));
    let mut turned = vec![0.0; N_CELL];
    for i in 0..N_YAW {
        for shift in 0..=2 * YAW_REACH {
            let other = (i + N_YAW + shift - YAW_REACH) % N_YAW;
            let w = yaw[shift.abs_diff(YAW_REACH)];
            for j in 0..N_PITCH {
                turned[i * N_PITCH + j] += w * mass[other * N_PITCH + j];
            }
        }
    }
    let mut spread = vec![0.0; N_CELL];
    for i in 0..N_YAW {
        let row = &turned[i * N_PITCH..(i + 1) * N_PITCH];
        for j in 0..N_PITCH {
            let near = j.saturating_sub(PITCH_REACH)..(j + PITCH_REACH + 1).min(N_PITCH);
            spread[i * N_PITCH + j] = near.map(|m| pitch[m.abs_diff(j)] * row[m]).sum();
        }
    }
    spread
}

fn scale_to_one(mass: &mut [f64]) {
    let total: f64 = mass.iter().sum();
    if total > 0.0 {
        mass.iter_mut().for_each(|m| *m /= total);
    }
}
