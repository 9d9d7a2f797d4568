//! Tries mirrored versions of each turn, and keeps those that fit better.
//!
//! An approaching animal looks almost like a receding one. A course can therefore follow the wrong
//! alternative between two frames in which both agree. They agree at broadside (toward or away) and head-on
//! (left or right). Each range between two such frames is mirrored and optimised. It is kept if its energy is
//! clearly lower.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use rayon::prelude::*;

use super::States;
use super::energy::{Energy, State};
use super::solve;
use crate::geometry::wrap_rad;

/// Largest number of passes over all ranges. Free choice.
const SWEEPS: usize = 2;
/// Number of frames on each side of a range that are optimised with it. Free choice.
const MARGIN: usize = 20;
/// Longest range that is tried, seconds. Free choice.
const LONGEST_S: f64 = 5.0;
/// The two alternatives may agree at a local minimum of |sin yaw| (or |cos yaw|) below this. Free choice.
const MEETING: f64 = 0.6;
/// Decrease in energy that a mirrored range must exceed to be kept. Free choice.
const GAIN: f64 = 2.0;

/// The plane in which a range is mirrored.
#[derive(Clone, Copy)]
enum Plane {
    /// The image plane: toward becomes away.
    Picture,
    /// The vertical plane along the line of sight: left becomes right.
    Sight,
}

/// Mirrors each range whose mirrored version has clearly less energy.
pub(super) fn improve(energy: &Energy, states: &mut States) {
    for _ in 0..SWEEPS {
        let mut changed = false;
        for plane in [Plane::Picture, Plane::Sight] {
            for n_turns in [1, 2] {
                let meetings = meetings(states, plane);
                let better: Vec<Trial> = meetings
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
    states: States,
}

/// Accepts the trials in order. A trial that overlaps an accepted one is skipped until the next pass.
fn accept(states: &mut States, trials: Vec<Trial>) {
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
        let whole = |gap: f64| TAU * (gap / TAU).round();
        let offset = whole(states[start].yaw() - trial[0].yaw());
        let turns = whole(trial[trial.len() - 1].yaw() + offset - states[end - 1].yaw());
        for (state, mut settled) in states[start..end].iter_mut().zip(trial) {
            settled.0[1] += offset;
            *state = settled;
        }
        for state in &mut states[end..] {
            state.0[1] += turns;
        }
        free_from = end;
    }
}

/// Returns the frames in which both alternatives agree, together with frame 0 and the end.
fn meetings(states: &[State], plane: Plane) -> Vec<usize> {
    let size: Vec<f64> = states
        .iter()
        .map(|state| match plane {
            Plane::Picture => libm::sin(state.yaw()).abs(),
            Plane::Sight => libm::cos(state.yaw()).abs(),
        })
        .collect();
    let mut meetings = vec![0];
    for k in 1..size.len().saturating_sub(1) {
        let around = &size[k.saturating_sub(4)..(k + 5).min(size.len())];
        let least = around.iter().all(|&other| size[k] <= other);
        if size[k] < MEETING && least && k > meetings[meetings.len() - 1] + 2 {
            meetings.push(k);
        }
    }
    meetings.push(size.len());
    meetings
}

/// Returns the range mirrored and optimised, or `None` if the energy falls by at most `GAIN`.
fn mirrored(
    energy: &Energy,
    states: &[State],
    plane: Plane,
    stretch: Range<usize>,
) -> Option<Trial> {
    if stretch.len() as f64 * energy.views.dt > LONGEST_S {
        return None;
    }
    let start = stretch.start.saturating_sub(MARGIN);
    let end = (stretch.end + MARGIN).min(states.len());
    let before = energy.cost(start, &states[start..end]);
    let mut trial: States = states[start..end].to_vec();
    for state in &mut trial[stretch.start - start..stretch.end - start] {
        state.0[1] = match plane {
            Plane::Picture => -state.yaw(),
            Plane::Sight => PI - state.yaw(),
        };
        state.0[4] = -state.sway();
    }
    unwrap(&mut trial);
    let wanted = before - GAIN;
    (solve::stretch(energy, start, &mut trial, wanted) < wanted).then_some(Trial {
        start,
        states: trial,
    })
}

/// Adds whole turns so that yaw changes by at most half a turn from frame to frame.
fn unwrap(states: &mut [State]) {
    for k in 1..states.len() {
        let last = states[k - 1].yaw();
        states[k].0[1] = last + wrap_rad(states[k].yaw() - last);
    }
}
