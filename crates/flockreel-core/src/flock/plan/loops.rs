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
//! The recursion sees one frame more than the film has. At that frame only the continuation's first state is
//! allowed.

use std::iter;

use super::Planner;
use super::conditions::{ConditionedCosts, Conditions, FORBIDDEN};
use super::cost::Feature;
use super::state_costs::OwnCosts;
use super::viterbi::{Path, PathSearch};
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

impl LoopEnds {
    /// Returns the conditions of a loop on a plan of `n_frames` frames.
    pub(super) fn conditions(&self, n_frames: usize, dwell: usize) -> Conditions<'static> {
        let [begin, dwelt] = beginning(self.first, dwell);
        Conditions {
            only: [begin, dwelt, Some((n_frames, self.next as usize))],
            outside: Some(n_frames),
            added: None,
        }
    }

    /// Returns whether a plan, including the state after its last frame, has these ends.
    pub fn holds(&self, states: &[u32]) -> bool {
        states.first() == Some(&self.first) && states.last() == Some(&self.next)
    }
}

/// Returns the frames at which a plan that begins with `first` and plays on for a dwell allows one state.
fn beginning(first: u32, dwell: usize) -> [Option<(usize, usize)>; 2] {
    [0, dwell - 1].map(|t| Some((t, first as usize + t)))
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
        wanted: &[Vec<Feature>],
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
            let of_cycle: Vec<&[Feature]> = ids.iter().map(|&id| &wanted[id][..]).collect();
            let closed_by = |first| {
                let is_open = !progress.cancelled();
                is_open.then(|| self.cycle(first, &of_cycle))?
            };
            let others = || self.start_candidates(&wanted[leader]).into_iter();
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

    /// Returns the states at which jumps land, sorted by the cost of the cheapest plan that begins with
    /// each.
    fn start_candidates(&self, wanted: &[Feature]) -> Vec<u32> {
        let costs = self.costs_before(wanted, &vec![0; self.model.trellis.n_states()]);
        let mut targets = self.model.trellis.targets().to_vec();
        targets.sort_by_key(|&target| costs[target as usize]);
        targets
    }

    /// Returns the cheapest first state of each individual of a cycle, in which each is the continuation of
    /// the one before. The first individual begins with `first`, and the last leads back to it. `None` if that
    /// is impossible.
    fn cycle(&self, first: u32, wanted: &[&[Feature]]) -> Option<Vec<u32>> {
        let mut back = vec![FORBIDDEN; self.model.trellis.n_states()];
        back[first as usize] = 0;
        let mut after_end = vec![back];
        for wanted in wanted.iter().rev() {
            after_end.push(self.costs_before(wanted, &after_end[after_end.len() - 1]));
        }
        if after_end.pop()?[first as usize] >= FORBIDDEN {
            return None;
        }
        let mut first_states = vec![first];
        for (&wanted, after_end) in wanted
            .iter()
            .zip(after_end.iter().rev().take(wanted.len() - 1))
        {
            first_states.push(self.next_after(
                first_states[first_states.len() - 1],
                wanted,
                after_end,
            )?);
        }
        Some(first_states)
    }

    /// Returns the cost of beginning with each state and playing on for a dwell, in turns, if the states
    /// after the last frame cost `after_end`. The cheapest has 0. States with which no plan begins have
    /// `FORBIDDEN`.
    fn costs_before(&self, wanted: &[Feature], after_end: &[u32]) -> Vec<u32> {
        let mut costs = self
            .search_with_next()
            .costs_from(&mut self.conditioned(wanted, None, after_end));
        let least = costs.iter().copied().min().unwrap_or(0);
        for cost in &mut costs {
            *cost = match *cost {
                FORBIDDEN.. => FORBIDDEN,
                cost => cost - least,
            };
        }
        costs
    }

    /// Returns the state after the last frame of the cheapest plan that begins with `first`.
    fn next_after(&self, first: u32, wanted: &[Feature], after_end: &[u32]) -> Option<u32> {
        let state_costs = self.conditioned(wanted, Some(first), after_end);
        let path = self.search_with_next().cheapest_path(&state_costs)?;
        path.states.last().copied()
    }

    /// Returns the costs of a plan that begins with `first`, or with any state, if the states after the last
    /// frame cost `after_end`.
    fn conditioned<'b>(
        &'b self,
        wanted: &'b [Feature],
        first: Option<u32>,
        after_end: &'b [u32],
    ) -> ConditionedCosts<'b, OwnCosts<'b>> {
        let (planner, n_frames) = (self, self.places.len());
        let [begin, dwelt] = first.map_or([None; 2], |first| beginning(first, self.model.dwell));
        ConditionedCosts {
            state_costs: OwnCosts { planner, wanted },
            conditions: Conditions {
                only: [begin, dwelt, None],
                outside: Some(n_frames),
                added: Some((n_frames, after_end)),
            },
        }
    }

    fn search_with_next(&self) -> PathSearch<'_> {
        PathSearch {
            n_frames: self.places.len() + 1,
            ..self.search()
        }
    }
}
