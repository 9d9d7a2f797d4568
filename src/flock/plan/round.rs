//! The plans of individuals that do not look out for one another: who looks out for the same others
//! is planned side by side, eight in the lanes of one vector; the first 64 each alone
//! (ALGORITHMS.md 6).

use rayon::prelude::*;

use super::cost::Feature;
use super::crowd::Settled;
use super::memory::N_REPLANS;
use super::rows::{Alone, InCrowd};
use super::viterbi::{Film, Path};
use super::{Found, LANES, Planner};
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
        match self.wanted.len() {
            1 => Ok(self.in_crowd([0], settled)?.into()),
            _ => self.batches(|first| {
                let paths = self.in_crowd(self.lanes::<LANES>(first), settled);
                paths.map(Vec::from)
            }),
        }
    }

    /// What the cheapest path of each costs alone, turns.
    pub(super) fn least_costs(&self, progress: &dyn Progress) -> Result<Vec<u32>, Error> {
        self.batches(|first| match self.wanted.len() - first {
            _ if progress.cancelled() => Err(Error::Cancelled),
            ..=4 => self.alone(self.lanes::<4>(first)).map(Vec::from),
            _ => self.alone(self.lanes::<LANES>(first)).map(Vec::from),
        })
    }

    /// One result for each individual, of batches side by side.
    fn batches<T: Send>(
        &self,
        batch: impl Fn(usize) -> Result<Vec<T>, Error> + Sync,
    ) -> Result<Vec<T>, Error> {
        let firsts: Vec<usize> = (0..self.wanted.len()).step_by(LANES).collect();
        let batches: Result<Vec<_>, Error> = firsts.par_iter().map(|&first| batch(first)).collect();
        Ok(batches?
            .into_iter()
            .flatten()
            .take(self.wanted.len())
            .collect())
    }

    /// The individuals in the lanes of a batch; the last stands in for those that are not.
    fn lanes<const N: usize>(&self, first: usize) -> [usize; N] {
        std::array::from_fn(|lane| (first + lane).min(self.wanted.len() - 1))
    }

    fn alone<const N: usize>(&self, idx: [usize; N]) -> Result<[u32; N], Error> {
        let (planner, wanted) = (self.planner, idx.map(|idx| &self.wanted[idx][..]));
        let open = Film {
            n_frames: planner.places.len(),
            ..planner.film()
        };
        let costs = open.least_costs(&mut Alone { planner, wanted });
        costs.ok_or(Error::NoTransitions)
    }

    fn in_crowd<const N: usize>(
        &self,
        idx: [usize; N],
        settled: &Settled,
    ) -> Result<[Found; N], Error> {
        let (planner, memory) = (self.planner, self.planner.memory);
        let ids = idx.map(|idx| self.first + idx);
        let wanted = idx.map(|idx| &self.wanted[idx][..]);
        let mut rows = InCrowd::new(planner, settled, ids, wanted);
        if !planner.ends.is_empty() {
            rows = rows.between(ids.map(|id| planner.ends[id]));
        }
        let film = planner.film();
        if let Some(horizon) = &planner.horizon {
            let least = film.least_costs(&mut rows.clone());
            let plans = horizon.paths(&film, &rows).zip(least);
            let (plans, least) = plans.ok_or(Error::NoTransitions)?;
            let found = |lane: usize| {
                let mut path = Path {
                    states: plans[lane].clone(),
                    cost: 0,
                };
                path.cost = planner.cost_among(ids[lane], wanted[lane], settled, &path);
                Found {
                    least: least[lane],
                    ..planner.found(path)
                }
            };
            return Ok(std::array::from_fn(found));
        }
        let paths = film.cheapest_paths(&rows).ok_or(Error::NoTransitions)?;
        let is_closed = |(id, path): (&usize, &Path)| match planner.ends.get(*id) {
            Some(ends) => ends.holds(&path.states),
            None => true,
        };
        if !ids.iter().zip(&paths).all(is_closed) {
            return Err(Error::LoopDoesNotClose(planner.places.len()));
        }
        let mut paths = paths.map(|path| planner.found(path));
        let mut found = paths.clone();
        let mut raised = [(); N].map(|()| memory.nothing_raised(planner.places.len()));
        for _ in 0..N_REPLANS {
            if paths.iter().all(|found| found.repetition == 0) {
                break;
            }
            for (raised, found) in raised.iter_mut().zip(&paths) {
                memory.raise(raised, planner.film_of(&found.path));
            }
            let dearer = rows.clone().raised(raised.each_ref());
            let next = film.cheapest_paths(&dearer).ok_or(Error::NoTransitions)?;
            paths = next.map(|path| planner.found(path));
            for lane in 0..N {
                let path = &mut paths[lane].path;
                if is_closed((&ids[lane], &*path)) {
                    path.cost = planner.cost_among(ids[lane], wanted[lane], settled, path);
                    found[lane].keep_cheaper(&paths[lane]);
                }
            }
        }
        Ok(found)
    }
}
