//! Playback graph, read directly from the library.
//!
//! States are (frame of the component, mirror side). Edges are the step to the next frame and every jump on
//! every side. Simple maps are used instead of the planner's sorted arrays.

use std::collections::{BTreeMap, BTreeSet};

use super::cost::dwell;
use crate::flock::Flock;
use crate::flock::plan::cost::Weights;
use crate::library::Library;

/// Jump on one mirror side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) from: usize,
    pub(super) to: usize,
    /// Cost, in turns.
    pub(super) cost: u64,
}

/// States in order of (side, frame), and all edges between them.
pub(super) struct Graph {
    states: Vec<(u32, bool)>,
    numbers: BTreeMap<(bool, u32), usize>,
    /// State of the next frame on the same side, if there is one.
    pub(super) next: Vec<Option<usize>>,
    pub(super) jumps: Vec<Edge>,
    /// Cost by (from, to), in turns.
    costs: BTreeMap<(usize, usize), u64>,
    /// Whether both mirror sides may be shown.
    pub(super) mirror: bool,
}

/// Removes the jumps after which playback must end: the run at their target is shorter than the dwell, or
/// no jump leaves the run after the dwell.
fn drop_dead_ends(costs: &mut BTreeMap<(usize, usize), u64>, next: &[Option<usize>], dwell: usize) {
    loop {
        let leaving: BTreeSet<usize> = costs.keys().map(|&(from, _)| from).collect();
        let run = |state: usize| std::iter::successors(Some(state), |&state| next[state]);
        let goes_on = |&to: &usize| {
            let after_dwell = run(to).nth(dwell - 1);
            after_dwell.is_some_and(|state| run(state).any(|state| leaving.contains(&state)))
        };
        let targets: BTreeSet<usize> = costs.keys().map(|&(_, to)| to).collect();
        let live: BTreeSet<usize> = targets.into_iter().filter(goes_on).collect();
        let n_before = costs.len();
        costs.retain(|(_, to), _| live.contains(to));
        if costs.len() == n_before {
            return;
        }
    }
}

impl Graph {
    pub(super) fn new(library: &Library, flock: &Flock) -> Graph {
        let weights = Weights::new(&flock.params.matching, library);
        let mirror = flock.params.mirror;
        let sides: &[bool] = if mirror { &[false, true] } else { &[false] };
        let frames = &library.playback.component;
        let states: Vec<(u32, bool)> = sides
            .iter()
            .flat_map(|&side| frames.iter().map(move |&frame| (frame, side)))
            .collect();
        let numbers: BTreeMap<(bool, u32), usize> = (states.iter().enumerate())
            .map(|(number, &(frame, side))| ((side, frame), number))
            .collect();
        let at = |frame: u32, side: bool| numbers.get(&(side, frame)).copied();
        let mut costs = BTreeMap::new();
        for jump in &library.playback.jumps {
            for &side in sides {
                let ends = at(jump.from, side).zip(at(jump.to, side != jump.mirrored));
                if let Some(ends) = ends {
                    let cost = u64::from(weights.of_jump(jump));
                    let least = costs.entry(ends).or_insert(cost);
                    *least = cost.min(*least);
                }
            }
        }
        let next: Vec<Option<usize>> = states
            .iter()
            .map(|&(frame, side)| at(frame + 1, side))
            .collect();
        drop_dead_ends(&mut costs, &next, dwell(library, &flock.params));
        Graph {
            next,
            jumps: (costs.iter())
                .map(|(&(from, to), &cost)| Edge { from, to, cost })
                .collect(),
            states,
            numbers,
            costs,
            mirror,
        }
    }

    pub(super) fn n_states(&self) -> usize {
        self.states.len()
    }

    /// Returns the frame and mirror side of each state.
    pub(super) fn shown(&self) -> &[(u32, bool)] {
        &self.states
    }

    pub(super) fn state(&self, frame: u32, side: bool) -> Option<usize> {
        self.numbers.get(&(side, frame)).copied()
    }

    pub(super) fn jump_cost(&self, from: usize, to: usize) -> Option<u64> {
        self.costs.get(&(from, to)).copied()
    }
}
