//! Turns that could also have gone the mirrored way.
//!
//! The picture of an animal that comes is nearly that of one that goes, and a course can take the wrong
//! way round between two moments at which both ways meet: broadside (toward or away) or head-on (left
//! or right). Each such stretch is mirrored, settled, and kept so when its energy is clearly less.

use std::f64::consts::{PI, TAU};

use super::States;
use super::energy::{Energy, State};
use super::solve;
use crate::geometry::wrap_rad;

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
    for _ in 0..2 {
        let mut changed = false;
        for plane in [Plane::Picture, Plane::Sight] {
            let meetings = meetings(states, plane);
            for n_turns in [1, 2] {
                for ends in meetings.windows(n_turns + 1) {
                    changed |= try_mirrored(energy, states, plane, ends[0], ends[n_turns]);
                }
            }
        }
        if !changed {
            break;
        }
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

/// Mirrors the frames `a..b` if the course becomes likelier by it.
fn try_mirrored(energy: &Energy, states: &mut States, plane: Plane, a: usize, b: usize) -> bool {
    let dt = energy.views.dt;
    if (b - a) as f64 * dt > LONGEST_S {
        return false;
    }
    let (start, end) = (a.saturating_sub(MARGIN), (b + MARGIN).min(states.len()));
    let before = energy.cost(start, &states[start..end]);
    let mut trial: States = states[start..end].to_vec();
    for state in &mut trial[a - start..b - start] {
        state.0[1] = match plane {
            Plane::Picture => -state.yaw(),
            Plane::Sight => PI - state.yaw(),
        };
        state.0[4] = -state.sway();
    }
    unwrap(&mut trial);
    if solve::stretch(energy, start, &mut trial) >= before - GAIN {
        return false;
    }
    // The yaw after the stretch may be whole turns off what it was.
    let turns = trial[trial.len() - 1].yaw() - states[end - 1].yaw();
    let turns = TAU * (turns / TAU).round();
    states[start..end].copy_from_slice(&trial);
    for state in &mut states[end..] {
        state.0[1] += turns;
    }
    true
}

/// Makes the yaw continuous from the first frame on.
fn unwrap(states: &mut [State]) {
    for k in 1..states.len() {
        let last = states[k - 1].yaw();
        states[k].0[1] = last + wrap_rad(states[k].yaw() - last);
    }
}
