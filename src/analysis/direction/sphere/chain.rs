//! The chain of directions over time: the likeliest course (Viterbi) and the posterior of every cell
//! (forward-backward), from the costs of every cell in every frame.

use super::cells::{N_CELL, N_PITCH, N_YAW, PITCH_STEP_RAD, YAW_STEP_RAD};

/// Cells that the yaw, and the pitch, may go in one frame.
const YAW_REACH: usize = 4;
const PITCH_REACH: usize = 2;
/// Cost of turning, per radian: of the whole way, whatever the frame rate.
const TURN_COST: f64 = 5.8;

/// The likeliest cell of every frame.
pub(super) fn viterbi(costs: &[Vec<f64>]) -> Vec<usize> {
    let mut best = costs[0].clone();
    let mut came_from: Vec<Vec<u16>> = Vec::with_capacity(costs.len());
    for cost in &costs[1..] {
        let mut from: Vec<u16> = (0..N_CELL as u16).collect();
        best = reach(&best, &mut from);
        best.iter_mut().zip(cost).for_each(|(b, c)| *b += c);
        came_from.push(from);
    }
    let mut cell = (0..N_CELL).fold(0, |a, b| if best[b] < best[a] { b } else { a });
    let mut path = vec![cell; costs.len()];
    for (k, from) in came_from.iter().enumerate().rev() {
        cell = usize::from(from[cell]);
        path[k] = cell;
    }
    path
}

/// The least cost of reaching each cell, and from which one: pitch after yaw.
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

/// The posterior of every cell in every frame.
pub(super) fn posterior(costs: &[Vec<f64>]) -> Vec<Vec<f32>> {
    let likely: Vec<Vec<f64>> = costs
        .iter()
        .map(|cost| {
            let least = cost.iter().copied().fold(f64::INFINITY, f64::min);
            cost.iter().map(|c| libm::exp(least - c)).collect()
        })
        .collect();
    let mut ahead: Vec<Vec<f64>> = Vec::with_capacity(costs.len());
    for k in 0..costs.len() {
        let mut mass = match ahead.last() {
            Some(last) => spread(last),
            None => vec![1.0; N_CELL],
        };
        mass.iter_mut().zip(&likely[k]).for_each(|(m, l)| *m *= l);
        scale_to_one(&mut mass);
        ahead.push(mass);
    }
    let mut behind = vec![1.0; N_CELL];
    let mut posterior = vec![Vec::new(); costs.len()];
    for k in (0..costs.len()).rev() {
        let mut mass: Vec<f64> = ahead[k].iter().zip(&behind).map(|(a, b)| a * b).collect();
        scale_to_one(&mut mass);
        posterior[k] = mass.iter().map(|&m| m as f32).collect();
        behind.iter_mut().zip(&likely[k]).for_each(|(b, l)| *b *= l);
        behind = spread(&behind);
        scale_to_one(&mut behind);
    }
    posterior
}

/// Probability carried to the neighbors of every cell.
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
