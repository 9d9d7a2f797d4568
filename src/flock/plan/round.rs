//! The plans of individuals that do not look out for one another, each on whatever thread is free; the first
//! 64 look out for all before them and come one by one (ALGORITHMS.md 6).

use rayon::prelude::*;

use super::circle::{Asked, Closed, FORBIDDEN, Then};
use super::cost::Feature;
use super::crowd::Settled;
use super::memory::N_REPLANS;
use super::rows::{Alone, InCrowd};
use super::segment::Begun;
use super::viterbi::Film;
use super::{Found, Planner};
use crate::flock::error::Error;
use crate::progress::Progress;

/// Individuals of consecutive ids.
pub(super) struct Round<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// The id of the first.
    pub(super) first: usize,
    /// What each wants.
    pub(super) wanted: &'a [Vec<Feature>],
}

impl Round<'_> {
    /// The cheapest path of each among those settled, or the best found where the cheapest repeats.
    pub(super) fn paths(&self, settled: &Settled) -> Result<Vec<Found>, Error> {
        let wanted = self.wanted.par_iter().enumerate();
        wanted
            .map(|(idx, wanted)| self.in_crowd(self.first + idx, wanted, settled))
            .collect()
    }

    /// Cost of the cheapest path of each alone, without a future cost, turns.
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

    /// In a loop, the costs of plans that begin and go on as they must.
    fn closed<'b>(&self, id: usize, rows: InCrowd<'b>) -> Closed<'b, InCrowd<'b>> {
        let ends = self.planner.ends.get(id);
        let asked = ends.map(|ends| Asked {
            first: Some(ends.first),
            then: Then::Only(ends.next),
        });
        self.planner.closed(rows, asked)
    }

    /// The costs of plans that continue from what an individual has shown before.
    fn begun<'b, R>(&self, id: usize, rows: R) -> Begun<'b, R> {
        let standing = self.planner.standings.get(id);
        Begun {
            rows,
            from: standing.and_then(|standing| Some((standing.state()?, standing.held))),
            repeats: None,
            n_frames: self.planner.places.len(),
            future: None,
        }
    }

    fn in_crowd(&self, id: usize, wanted: &[Feature], settled: &Settled) -> Result<Found, Error> {
        let planner = self.planner;
        let (model, memory) = (planner.model, planner.model.memory);
        let n_frames = planner.places.len();
        let (film, ends) = (planner.film(), planner.ends.get(id).copied());
        let shown = planner.standings.get(id).filter(|_| memory.cost > 0);
        let repeated = shown.map(|s| memory.repeated_until(&s.shown, model.trellis.n_states()));
        let rows = InCrowd::new(planner, settled, id, wanted);
        let found = |rows: InCrowd<'_>| {
            let costs = Begun {
                repeats: repeated.as_deref().map(|until| (until, memory.cost)),
                future: (!planner.is_last).then_some(&model.future[..]),
                ..self.begun(id, self.closed(id, rows))
            };
            let path = film.cheapest_path(&costs)?;
            let is_closed = ends.is_none_or(|ends| ends.holds(&path.states));
            let is_open = path.cost < FORBIDDEN;
            Some((
                planner.found(id, (wanted, settled), path),
                is_closed && is_open,
            ))
        };
        let (mut last, holds) = found(rows.clone()).ok_or(Error::NoTransitions)?;
        if !holds {
            return Err(match ends {
                Some(_) => Error::LoopDoesNotClose(n_frames),
                None => Error::NoTransitions,
            });
        }
        let mut best = last.clone();
        let mut raised = memory.nothing_raised(n_frames);
        for _ in 0..N_REPLANS {
            let states = planner.film_of(&last.path);
            if memory.cost == 0 || memory.repeats(states).is_empty() {
                break;
            }
            memory.raise(&mut raised, states);
            let holds;
            (last, holds) = found(rows.clone().raised(&raised)).ok_or(Error::NoTransitions)?;
            if holds {
                best.keep_cheaper(&last);
            }
        }
        Ok(best)
    }
}
