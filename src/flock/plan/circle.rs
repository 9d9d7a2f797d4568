//! Plans that play into one another: the last frame of each into the first of whom it becomes
//! (ALGORITHMS.md 6, loop).
//!
//! Plans without that give a leader its first state, that of an heir follows from the plan before it, until
//! one is the leader's own again; from there on the plan is found anew, exact among all that begin so, jump
//! no sooner than a dwell after the first frame (as if it had just been jumped to), and end where the heir's
//! first state follows. The recursion sees one frame more than the film has, at which only that state may
//! be shown.

use std::iter;

use super::Planner;
use super::cost::Feature;
use super::rows::Alone;
use super::viterbi::{Block, FRAMES, Film, Path, Rows};
use crate::flock::error::Error;
use crate::progress::Progress;

/// What a plan that may not be costs at least. Three of these and all costs of a loop's plan stay below
/// 2^31.
pub(super) const FORBIDDEN: u32 = 1 << 28;

/// Where a plan begins, and what follows its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// The state at the first frame.
    pub first: u32,
    /// The state after the last.
    pub next: u32,
}

/// What a loop asks of a plan.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    /// To begin with it and go on for a dwell.
    pub(super) first: Option<u32>,
    pub(super) then: Then<'a>,
}

/// What may be shown after the last frame.
#[derive(Clone, Copy)]
pub(super) enum Then<'a> {
    Only(u32),
    /// What each state costs there.
    Any(&'a [u32]),
}

/// What each state costs in a plan of which something is asked.
#[derive(Clone)]
pub(super) struct Closed<'a, R> {
    rows: R,
    /// Nothing is asked of a plan that is no part of a loop.
    asked: Option<Asked<'a>>,
    /// The frame after the film's last.
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
    /// Whether a plan, with what follows it, is one.
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

    /// The states that a loop's plans begin with, by id. Not from every state does a film of this length lead
    /// back; if it does from any, then from one that is jumped to: where the leader of a circle of heirs
    /// cannot begin as in its open plan, all those are tried, the cheapest first.
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

    /// Why there is none.
    fn no_circle(&self, progress: &dyn Progress) -> Error {
        match progress.cancelled() {
            true => Error::Cancelled,
            false => Error::LoopDoesNotClose(self.places.len()),
        }
    }

    /// The states that are jumped to, by what the cheapest plan that begins with each costs.
    fn beginnings(&self, wanted: &[Feature]) -> Vec<u32> {
        let costs = self.costs_before(wanted, &vec![0; self.model.trellis.n_states()]);
        let mut targets = self.model.trellis.targets().to_vec();
        targets.sort_by_key(|&target| costs[target as usize]);
        targets
    }

    /// The cheapest that each of a circle can begin with, each the heir of the one before, when the first
    /// of them begins with `first` and the last leads back to that; `None` if none does.
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

    /// What it costs to begin with each state and go on for a dwell, when what comes after the last frame costs
    /// `then`; the cheapest 0, `FORBIDDEN` where no plan begins.
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

    /// What comes after the cheapest plan that begins with `first`.
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
