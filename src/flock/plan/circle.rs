//! Plans of a loop: the last frame of each plan leads to the first frame of its heir's plan. The heir of an
//! individual is the individual as which it continues (docs/explanation/algorithms.md, "Planning").
//!
//! Heirs form circles. The leader of a circle, its smallest id, takes the first state of its plan without
//! loop conditions. The first state of each heir follows from the cheapest plan of the individual before
//! it, until the circle is back at the leader. Each plan is then found exactly, with its first state given
//! and the heir's first state after its last frame. The first state counts as just jumped to, so the next
//! jump must wait for the dwell.
//!
//! The recursion sees one frame more than the film has. At that frame only the heir's first state is
//! allowed.

use std::iter;

use super::Planner;
use super::cost::Feature;
use super::rows::Alone;
use super::viterbi::{Block, FRAMES, Film, Path, Rows};
use crate::flock::error::Error;
use crate::progress::Progress;

/// Least cost of a plan that is not allowed, in turns. Three of these plus all costs of a loop's plan stay
/// below 2^31.
pub(super) const FORBIDDEN: u32 = 1 << 28;

/// First state of a plan, and the state that follows its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// State at the first frame.
    pub first: u32,
    /// State after the last frame.
    pub next: u32,
}

/// Conditions of a loop on a plan.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    /// State with which the plan begins and plays on for a dwell; `None` = any.
    pub(super) first: Option<u32>,
    pub(super) then: Then<'a>,
}

/// States allowed after the last frame.
#[derive(Clone, Copy)]
pub(super) enum Then<'a> {
    /// Only this state.
    Only(u32),
    /// Every state, with its cost, in turns.
    Any(&'a [u32]),
}

/// Costs of a plan under the conditions of a loop.
#[derive(Clone)]
pub(super) struct Closed<'a, R> {
    rows: R,
    /// Conditions; `None` outside of loops.
    asked: Option<Asked<'a>>,
    /// Number of frames of the film, which is the index of the frame after the last.
    n_frames: usize,
    dwell: usize,
}

impl<R: Rows> Rows for Closed<'_, R> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        self.rows.fill(block, first, out);
        let Some(asked) = self.asked else {
            return;
        };
        for (lane, &t) in block.times.iter().enumerate() {
            if t == self.n_frames {
                for (station, out) in (first..).zip(&mut *out) {
                    out[lane] = asked.then.cost(block.state(station));
                }
            } else if let Some(begun) = asked.first
                && (t == 0 || t == self.dwell - 1)
            {
                let only = begun as usize + t;
                for (station, out) in (first..).zip(&mut *out) {
                    if block.state(station) != only {
                        out[lane] += FORBIDDEN;
                    }
                }
            }
        }
    }
}

impl Then<'_> {
    #[inline(always)]
    fn cost(self, state: usize) -> u32 {
        match self {
            Then::Only(next) if state == next as usize => 0,
            Then::Only(_) => FORBIDDEN,
            Then::Any(costs) => costs[state],
        }
    }
}

impl Ends {
    /// Returns whether a plan, including the state after its last frame, has these ends.
    pub fn holds(&self, states: &[u32]) -> bool {
        states.first() == Some(&self.first) && states.last() == Some(&self.next)
    }
}

impl Planner<'_> {
    pub(super) fn closed<'b, R>(&self, rows: R, asked: Option<Asked<'b>>) -> Closed<'b, R> {
        Closed {
            rows,
            asked,
            n_frames: self.places.len(),
            dwell: self.model.dwell,
        }
    }

    /// Returns the first states of a loop's plans, by id. Fails if no loop of this length closes.
    ///
    /// Playback does not return to every state after a film of this length. If it returns to any state, it
    /// also returns to one at which a jump lands. If the leader of a circle cannot begin as in its open
    /// plan, those states are tried, the cheapest first.
    pub(super) fn firsts(
        &self,
        open: &[Path],
        wanted: &[Vec<Feature>],
        heirs: &[u32],
        progress: &dyn Progress,
    ) -> Result<Vec<u32>, Error> {
        let mut firsts = vec![None; heirs.len()];
        for (leader, path) in open.iter().enumerate() {
            if firsts[leader].is_some() {
                continue;
            }
            let heir = |&id: &usize| Some(heirs[id] as usize).filter(|&heir| heir != leader);
            let ids: Vec<usize> = iter::successors(Some(leader), heir).collect();
            let of_circle: Vec<&[Feature]> = ids.iter().map(|&id| &wanted[id][..]).collect();
            let led_back = |first| match progress.cancelled() {
                true => None,
                false => self.circle(first, &of_circle),
            };
            let others = || self.beginnings(&wanted[leader]).into_iter();
            let circle = led_back(path.states[0])
                .or_else(|| others().find_map(led_back))
                .ok_or_else(|| self.no_circle(progress))?;
            for (id, first) in ids.into_iter().zip(circle) {
                firsts[id] = Some(first);
            }
        }
        Ok(firsts.into_iter().flatten().collect())
    }

    /// Returns the error for a circle without first states.
    fn no_circle(&self, progress: &dyn Progress) -> Error {
        match progress.cancelled() {
            true => Error::Cancelled,
            false => Error::LoopDoesNotClose(self.places.len()),
        }
    }

    /// Returns the states at which jumps land, sorted by the cost of the cheapest plan that begins with
    /// each.
    fn beginnings(&self, wanted: &[Feature]) -> Vec<u32> {
        let costs = self.costs_before(wanted, &vec![0; self.model.trellis.n_states()]);
        let mut targets = self.model.trellis.targets().to_vec();
        targets.sort_by_key(|&target| costs[target as usize]);
        targets
    }

    /// Returns the cheapest first state of each individual of a circle, in which each is the heir of the
    /// one before. The first individual begins with `first`, and the last leads back to it. `None` if that
    /// is impossible.
    fn circle(&self, first: u32, wanted: &[&[Feature]]) -> Option<Vec<u32>> {
        let mut back = vec![FORBIDDEN; self.model.trellis.n_states()];
        back[first as usize] = 0;
        let mut then = vec![back];
        for wanted in wanted.iter().rev() {
            then.push(self.costs_before(wanted, &then[then.len() - 1]));
        }
        if then.pop()?[first as usize] >= FORBIDDEN {
            return None;
        }
        let mut firsts = vec![first];
        for (&wanted, then) in wanted.iter().zip(then.iter().rev().take(wanted.len() - 1)) {
            firsts.push(self.next_after(firsts[firsts.len() - 1], wanted, then)?);
        }
        Some(firsts)
    }

    /// Returns the cost of beginning with each state and playing on for a dwell, in turns, if the states
    /// after the last frame cost `then`. The cheapest has 0. States with which no plan begins have
    /// `FORBIDDEN`.
    fn costs_before(&self, wanted: &[Feature], then: &[u32]) -> Vec<u32> {
        let mut costs = self
            .film_and_next()
            .costs_from(&mut self.asking(wanted, None, then));
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
    fn next_after(&self, first: u32, wanted: &[Feature], then: &[u32]) -> Option<u32> {
        let rows = self.asking(wanted, Some(first), then);
        let path = self.film_and_next().cheapest_path(&rows)?;
        path.states.last().copied()
    }

    fn asking<'b>(
        &'b self,
        wanted: &'b [Feature],
        first: Option<u32>,
        then: &'b [u32],
    ) -> Closed<'b, Alone<'b>> {
        let alone = Alone {
            planner: self,
            wanted,
        };
        let then = Then::Any(then);
        self.closed(alone, Some(Asked { first, then }))
    }

    fn film_and_next(&self) -> Film<'_> {
        Film {
            n_frames: self.places.len() + 1,
            ..self.film()
        }
    }
}
