//! Tries mirrored versions of each turn, and keeps those that fit better.
//!
//! An approaching animal looks almost like a receding one. A course can therefore follow the wrong
//! alternative between two frames in which both agree. They agree at broadside (toward or away) and head-on
//! (left or right). Each range between two such frames is mirrored and optimised. It is kept if its energy is
//! clearly lower.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use rayon::prelude::*;

use super::energy::Energy;
use super::solve;
use super::state::State;
use crate::geometry::wrap_rad;

/// Largest number of passes over all ranges. Free choice.
const N_PASSES: usize = 2;
/// Number of frames on each side of a range that are optimised with it. Free choice.
const MARGIN: usize = 20;
/// Longest range that is tried, seconds. Free choice.
const MAX_RANGE_S: f64 = 5.0;
/// The two alternatives may agree at a local minimum of |sin yaw| (or |cos yaw|) below this. Free choice.
const MAX_DIFFERENCE: f64 = 0.6;
/// Decrease in energy that a mirrored range must exceed to be kept. Free choice.
const MIN_GAIN: f64 = 2.0;

/// The plane in which a range is mirrored.
#[derive(Clone, Copy)]
enum Plane {
    /// The image plane: toward becomes away.
    Image,
    /// The vertical plane along the line of sight: left becomes right.
    LineOfSight,
}

/// Mirrors each range whose mirrored version has clearly less energy.
pub(super) fn improve(energy: &Energy, states: &mut [State]) {
    for _ in 0..N_PASSES {
        let mut changed = false;
        for plane in [Plane::Image, Plane::LineOfSight] {
            for n_turns in [1, 2] {
                let agreements = agreements(states, plane);
                let better: Vec<Trial> = agreements
                    .par_windows(n_turns + 1)
                    .filter_map(|ends| mirrored(energy, states, plane, ends[0]..ends[n_turns]))
                    .collect();
                changed |= !better.is_empty();
                accept(states, better);
            }
        }
        if !changed {
            break;
        }
    }
}

/// A mirrored range that lowers the energy, with the frames around it.
struct Trial {
    start: usize,
    states: Vec<State>,
}

/// Accepts the trials in order. A trial that overlaps an accepted one is skipped until the next pass.
fn accept(states: &mut [State], trials: Vec<Trial>) {
    let mut free_from = 0;
    for Trial {
        start,
        states: trial,
    } in trials
    {
        if start < free_from {
            continue;
        }
        let end = start + trial.len();
        // Yaw is continuous only up to whole turns. `offset` aligns the trial with the states before it,
        // `turns` the states after it with the trial.
        let whole_turns = |gap: f64| TAU * (gap / TAU).round();
        let offset = whole_turns(states[start].yaw - trial[0].yaw);
        let turns = whole_turns(trial[trial.len() - 1].yaw + offset - states[end - 1].yaw);
        for (state, mut new) in states[start..end].iter_mut().zip(trial) {
            new.yaw += offset;
            *state = new;
        }
        for state in &mut states[end..] {
            state.yaw += turns;
        }
        free_from = end;
    }
}

/// Returns the frames in which both alternatives agree, together with frame 0 and the end.
fn agreements(states: &[State], plane: Plane) -> Vec<usize> {
    let difference: Vec<f64> = states
        .iter()
        .map(|state| match plane {
            Plane::Image => libm::sin(state.yaw).abs(),
            Plane::LineOfSight => libm::cos(state.yaw).abs(),
        })
        .collect();
    let mut agreements = vec![0];
    for k in 1..difference.len().saturating_sub(1) {
        let around = &difference[k.saturating_sub(4)..(k + 5).min(difference.len())];
        let is_minimum = around.iter().all(|&other| difference[k] <= other);
        if difference[k] < MAX_DIFFERENCE && is_minimum && k > agreements[agreements.len() - 1] + 2
        {
            agreements.push(k);
        }
    }
    agreements.push(difference.len());
    agreements
}

/// Returns the range mirrored and optimised, or `None` if the energy falls by at most `MIN_GAIN`.
fn mirrored(energy: &Energy, states: &[State], plane: Plane, range: Range<usize>) -> Option<Trial> {
    if range.len() as f64 * energy.observations.dt > MAX_RANGE_S {
        return None;
    }
    let start = range.start.saturating_sub(MARGIN);
    let end = (range.end + MARGIN).min(states.len());
    let before = energy.cost(start, &states[start..end]);
    let mut trial = states[start..end].to_vec();
    for state in &mut trial[range.start - start..range.end - start] {
        state.yaw = match plane {
            Plane::Image => -state.yaw,
            Plane::LineOfSight => PI - state.yaw,
        };
        state.sway = -state.sway;
    }
    unwrap_yaw(&mut trial);
    let wanted = before - MIN_GAIN;
    (solve::minimize_range(energy, start, &mut trial, wanted) < wanted).then_some(Trial {
        start,
        states: trial,
    })
}

/// Adds whole turns so that yaw changes by at most half a turn from frame to frame.
pub(super) fn unwrap_yaw(states: &mut [State]) {
    for k in 1..states.len() {
        let last = states[k - 1].yaw;
        states[k].yaw = last + wrap_rad(states[k].yaw - last);
    }
}
