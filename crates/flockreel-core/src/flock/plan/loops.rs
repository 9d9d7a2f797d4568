//! Plans of a loop: the last frame of each plan leads to the first frame of its continuation's plan. The
//! continuation of an individual is the individual as which it continues
//! (docs/explanation/algorithms.md, "Planning").
//!
//! Continuations form cycles. The leader of a cycle, its smallest id, takes the first state of its plan
//! without loop conditions. The first state of each continuation follows from the cheapest plan of the
//! individual before it, until the cycle is back at the leader. Each plan is then found exactly, with its
//! first state given and the continuation's first state after its last frame. The first state counts as just
//! jumped to, so the next jump must wait for the dwell.
//!
//! The recursion sees one frame more than the film has, which costs nothing. At that frame only the
//! continuation's first state is allowed.

use std::iter;

use super::Planner;
use super::cost::Feature;
use super::recursion::{Path, PathSearch, StateCosts, UNREACHED};
use super::segment::FORBIDDEN;
use super::state_costs::IndividualCosts;
use crate::flock::error::Error;
use crate::progress::Progress;

/// First state of a plan, and the state that follows its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopEnds {
    /// State at the first frame.
    pub first: u32,
    /// State after the last frame.
    pub next: u32,
}

impl Planner<'_> {
    /// Returns the first states of a loop's plans, by id. Fails if no loop of this length closes.
    ///
    /// Playback does not return to every state after a film of this length. If it returns to any state, it
    /// also returns to one at which a jump lands. If the leader of a cycle cannot begin as in its open
    /// plan, those states are tried, the cheapest first.
    pub(super) fn first_states(
        &self,
        open: &[Path],
        continuations: &[u32],
        progress: &dyn Progress,
    ) -> Result<Vec<u32>, Error> {
        let mut first_states = vec![None; continuations.len()];
        for (leader, path) in open.iter().enumerate() {
            if first_states[leader].is_some() {
                continue;
            }
            let next =
                |&id: &usize| Some(continuations[id] as usize).filter(|&next| next != leader);
            let ids: Vec<usize> = iter::successors(Some(leader), next).collect();
            let of_cycle: Vec<&[Feature]> = ids.iter().map(|&id| &self.wanted[id][..]).collect();
            let closed_by = |first| {
                let is_open = !progress.cancelled();
                is_open.then(|| self.cycle(first, &of_cycle))?
            };
            let others = || self.start_candidates(&self.wanted[leader]).into_iter();
            let cycle = closed_by(path.states[0])
                .or_else(|| others().find_map(closed_by))
                .ok_or_else(|| self.no_loop(progress))?;
            for (id, first) in ids.into_iter().zip(cycle) {
                first_states[id] = Some(first);
            }
        }
        Ok(first_states.into_iter().flatten().collect())
    }

    /// Returns the error for a cycle without first states.
    fn no_loop(&self, progress: &dyn Progress) -> Error {
        if progress.cancelled() {
            return Error::Cancelled;
        }
        Error::LoopDoesNotClose(self.places.len())
    }

    /// Returns the states at which jumps land, sorted by the cost of showing each and the frames after it for a
    /// dwell.
    fn start_candidates(&self, wanted: &[Feature]) -> Vec<u32> {
        let costs = self.costs_of(wanted);
        let trellis = &self.model.trellis;
        let cost = |&target: &u32| -> u32 {
            let target = target as usize;
            let shown = (0..self.model.dwell).filter(|&t| trellis.continues(target, t));
            shown.map(|t| costs.at(t, target + t)).sum()
        };
        let mut targets = trellis.targets().to_vec();
        targets.sort_by_cached_key(cost);
        targets
    }

    /// Returns the cheapest first state of each individual of a cycle, in which each is the continuation of
    /// the one before. The first individual begins with `first`, and the last leads back to it. `None` if that
    /// is impossible.
    fn cycle(&self, first: u32, wanted: &[&[Feature]]) -> Option<Vec<u32>> {
        // Costs up to the first frame of each individual, by state. Then the way back from the end.
        let mut starts = vec![self.beginning_with(first)];
        for wanted in wanted {
            let search = self.search_between(&starts[starts.len() - 1], None);
            let mut costs = search.costs_to(&self.costs_of(wanted));
            let least = costs
                .iter()
                .copied()
                .min()
                .filter(|&least| least < UNREACHED)?;
            costs
                .iter_mut()
                .for_each(|cost| *cost = (*cost - least).min(FORBIDDEN));
            starts.push(costs);
        }
        if starts.pop()?[first as usize] >= FORBIDDEN {
            return None;
        }
        let mut first_states = vec![first];
        for (wanted, start) in wanted.iter().zip(&starts).rev() {
            let next = first_states.last().copied();
            let path =
                self.cheapest_path(&self.search_between(start, next), &self.costs_of(wanted))?;
            first_states.push(path.states[0]);
        }
        first_states.reverse();
        first_states.pop();
        Some(first_states)
    }

    /// Returns costs by state that allow only `first` at the beginning.
    pub(super) fn beginning_with(&self, first: u32) -> Vec<u32> {
        let mut start = vec![FORBIDDEN; self.model.trellis.n_states()];
        start[first as usize] = 0;
        start
    }

    /// Returns the search for paths of a loop that begin with a state of `start`, as if just jumped to, and lead
    /// to the state `end` after the last frame.
    pub(super) fn search_between<'b>(
        &'b self,
        start: &'b [u32],
        end: Option<u32>,
    ) -> PathSearch<'b> {
        PathSearch {
            n_frames: self.places.len() + 1,
            start: Some(start),
            end,
            ..self.search()
        }
    }

    fn costs_of<'b>(&'b self, wanted: &'b [Feature]) -> IndividualCosts<'b> {
        IndividualCosts {
            planner: self,
            wanted,
            among: None,
        }
    }
}
