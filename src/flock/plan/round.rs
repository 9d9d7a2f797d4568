//! The plans of individuals that do not look out for one another: who looks out for the same others
//! is planned side by side, eight in the lanes of one vector; the first 64 each alone
//! (ALGORITHMS.md 6).

use rayon::prelude::*;

use super::cost::Feature;
use super::crowd::Settled;
use super::rows::{Alone, InCrowd};
use super::viterbi::Path;
use super::{LANES, Planner};
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
    /// The cheapest path of each among those settled.
    pub(super) fn paths(&self, settled: &Settled) -> Result<Vec<Path>, Error> {
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
        let costs = planner.film().least_costs(&mut Alone { planner, wanted });
        costs.ok_or(Error::NoTransitions)
    }

    fn in_crowd<const N: usize>(
        &self,
        idx: [usize; N],
        settled: &Settled,
    ) -> Result<[Path; N], Error> {
        let ids = idx.map(|idx| self.first + idx);
        let wanted = idx.map(|idx| &self.wanted[idx][..]);
        let rows = InCrowd::new(self.planner, settled, ids, wanted);
        let paths = self.planner.film().cheapest_paths(&rows);
        paths.ok_or(Error::NoTransitions)
    }
}
