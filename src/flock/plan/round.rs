//! The plans of individuals that do not look out for one another, each on whatever thread is free; the first
//! 64 look out for all before them and come one by one (ALGORITHMS.md 6).

use rayon::prelude::*;

use super::circle::{Asked, Closed, Then};
use super::cost::Feature;
use super::crowd::Settled;
use super::memory::N_REPLANS;
use super::rows::{Alone, InCrowd};
use super::viterbi::{Film, Path};
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

    /// What the cheapest path of each costs alone, turns.
    pub(super) fn least_costs(&self, progress: &dyn Progress) -> Result<Vec<u32>, Error> {
        let planner = self.planner;
        let open = Film {
            n_frames: planner.places.len(),
            ..planner.film()
        };
        let least = |wanted: &Vec<Feature>| match progress.cancelled() {
            true => Err(Error::Cancelled),
            false => (open.least_cost(&mut Alone { planner, wanted })).ok_or(Error::NoTransitions),
        };
        self.wanted.par_iter().map(least).collect()
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

    fn in_crowd(&self, id: usize, wanted: &[Feature], settled: &Settled) -> Result<Found, Error> {
        let (planner, memory) = (self.planner, self.planner.memory);
        let n_frames = planner.places.len();
        let (film, ends) = (planner.film(), planner.ends.get(id).copied());
        let rows = InCrowd::new(planner, settled, id, wanted);
        let open = self.closed(id, rows.clone());
        if let Some(horizon) = &planner.horizon {
            let least = film.least_cost(&mut open.clone());
            let plan = horizon.path(&film, &open).zip(least);
            let (states, least) = plan.ok_or(Error::NoTransitions)?;
            let mut path = Path { states, cost: 0 };
            path.cost = planner.cost_among(id, wanted, settled, &path);
            return Ok(Found {
                least,
                ..planner.found(path)
            });
        }
        let path = film.cheapest_path(&open).ok_or(Error::NoTransitions)?;
        let is_closed = |path: &Path| ends.is_none_or(|ends| ends.holds(&path.states));
        if !is_closed(&path) {
            return Err(Error::LoopDoesNotClose(n_frames));
        }
        let mut last = planner.found(path);
        let mut found = last.clone();
        let mut raised = memory.nothing_raised(n_frames);
        for _ in 0..N_REPLANS {
            if last.repetition == 0 {
                break;
            }
            memory.raise(&mut raised, planner.film_of(&last.path));
            let dearer = self.closed(id, rows.clone().raised(&raised));
            let path = film.cheapest_path(&dearer).ok_or(Error::NoTransitions)?;
            last = planner.found(path);
            if is_closed(&last.path) {
                last.path.cost = planner.cost_among(id, wanted, settled, &last.path);
                found.keep_cheaper(&last);
            }
        }
        Ok(found)
    }
}
