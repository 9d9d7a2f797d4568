//! Turns that could also have gone the mirrored way.
//!
//! The picture of an animal that comes is nearly that of one that goes, and a course can take the wrong
//! way round between two moments at which both ways meet: broadside (toward or away) or head-on (left
//! or right). Each such stretch is mirrored, settled, and kept so when its energy is clearly less.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use rayon::prelude::*;

use super::States;
use super::energy::{Energy, State};
use super::solve;
use crate::geometry::wrap_rad;

/// Times all stretches are tried.
const SWEEPS: usize = 2;
/// Frames around a stretch that settle with it.
const MARGIN: usize = 20;
/// Longest stretch, seconds.
const LONGEST_S: f64 = 5.0;
/// Both ways may meet where the sine (or cosine) of yaw is at a minimum below this.
const MEETING: f64 = 0.6;
/// How much less the energy must be.
const GAIN: f64 = 2.0;

/// Which plane a stretch is mirrored in.
#[derive(Clone, Copy)]
enum Plane {
    /// The picture: toward becomes away.
    Picture,
    /// The upright plane along the line of sight: left becomes right.
    Sight,
}

/// Mirrors whatever stretches become likelier by it.
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

/// A stretch that became likelier, with what lies around it.
struct Trial {
    start: usize,
    states: States,
}

/// Takes over the trials in order; one that overlaps an earlier one waits for the next sweep.
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
        // Yaws may be whole turns off: before the stretch by an earlier trial, after it by this one.
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

/// Frames at which both ways meet, with the first frame and the end.
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

/// The frames of a stretch mirrored, if the course becomes likelier by it.
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

/// Makes the yaw continuous from the first frame on.
fn unwrap(states: &mut [State]) {
    for k in 1..states.len() {
        let last = states[k - 1].yaw();
        states[k].0[1] = last + wrap_rad(states[k].yaw() - last);
    }
}
