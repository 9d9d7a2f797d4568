//! Rounds: plans of individuals that do not watch one another, computed on all threads.
//!
//! The first 64 individuals watch all individuals of smaller id, so each is a round of its own
//! (docs/explanation/algorithms.md, "Planning").

use rayon::prelude::*;

use super::Planner;
use super::circle::{Asked, Closed, FORBIDDEN, Then};
use super::cost::Feature;
use super::crowd::Settled;
use super::rows::{Alone, InCrowd};
use super::segment::Begun;
use super::viterbi::{Film, Path};
use crate::flock::error::Error;
use crate::progress::Progress;

/// Individuals of consecutive ids that are planned in parallel.
pub(super) struct Round<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// Id of the first individual.
    pub(super) first: usize,
    /// Features that each individual asks for, by frame.
    pub(super) wanted: &'a [Vec<Feature>],
}

impl Round<'_> {
    /// Returns the cheapest path of each individual, given the final plans. Fails if an individual has
    /// none.
    pub(super) fn paths(&self, settled: &Settled) -> Result<Vec<Path>, Error> {
        let wanted = self.wanted.par_iter().enumerate();
        wanted
            .map(|(idx, wanted)| self.in_crowd(self.first + idx, wanted, settled))
            .collect()
    }

    /// Returns the cost of each individual's cheapest path without crowd cost and future cost, in turns.
    pub(super) fn least_costs(&self, progress: &dyn Progress) -> Result<Vec<u32>, Error> {
        let planner = self.planner;
        let open = Film {
            n_frames: planner.places.len(),
            ..planner.film()
        };
        let least = |(idx, wanted): (usize, &Vec<Feature>)| {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let rows = Alone { planner, wanted };
            let mut rows = self.begun(self.first + idx, rows);
            (open.least_cost(&mut rows)).ok_or(Error::NoTransitions)
        };
        self.wanted.par_iter().enumerate().map(least).collect()
    }

    /// Returns the costs with the conditions of a loop. Outside of loops they are unchanged.
    fn closed<'b>(&self, id: usize, rows: InCrowd<'b>) -> Closed<'b, InCrowd<'b>> {
        let ends = self.planner.ends.get(id);
        let asked = ends.map(|ends| Asked {
            first: Some(ends.first),
            then: Then::Only(ends.next),
        });
        self.planner.closed(rows, asked)
    }

    /// Returns the costs with the condition that a plan continues from what the individual has shown
    /// before.
    fn begun<'b, R>(&self, id: usize, rows: R) -> Begun<'b, R> {
        let standing = self.planner.standings.get(id);
        Begun {
            rows,
            from: standing.and_then(|standing| Some((standing.state?, standing.held))),
            n_frames: self.planner.places.len(),
            future: None,
        }
    }

    /// Returns the cheapest path of one individual, given the final plans.
    fn in_crowd(&self, id: usize, wanted: &[Feature], settled: &Settled) -> Result<Path, Error> {
        let planner = self.planner;
        let ends = planner.ends.get(id);
        let rows = InCrowd::new(planner, settled, id, wanted);
        let costs = Begun {
            future: (!planner.is_last).then_some(&planner.model.future[..]),
            ..self.begun(id, self.closed(id, rows))
        };
        let path = (planner.film().cheapest_path(&costs)).ok_or(Error::NoTransitions)?;
        let is_closed = ends.is_none_or(|ends| ends.holds(&path.states));
        match (is_closed && path.cost < FORBIDDEN, ends) {
            (true, _) => Ok(Path {
                cost: planner.cost_among(id, wanted, settled, &path),
                states: path.states,
            }),
            (false, Some(_)) => Err(Error::LoopDoesNotClose(planner.places.len())),
            (false, None) => Err(Error::NoTransitions),
        }
    }
}
