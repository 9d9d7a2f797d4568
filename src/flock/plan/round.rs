//! The plans of up to 16 individuals: all as if alone, eight in the lanes of one vector, then again
//! whoever looks like a near neighbor whose plan is final (ALGORITHMS.md 6). The first 64 are
//! planned again one after the other, later ones eight at a time.

use rayon::prelude::*;

use super::cost::Feature;
use super::crowd::{Settled, n_watched};
use super::rows::{Alone, InCrowd};
use super::viterbi::Path;
use super::{LANES, Plan, Planner};
use crate::flock::error::Error;

/// Individuals of consecutive ids.
pub(super) struct Round<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// The id of the first.
    pub(super) first: usize,
    /// What each wants.
    pub(super) wanted: &'a [Vec<Feature>],
}

impl Round<'_> {
    /// Plans them all, and settles them.
    pub(super) fn plan(&self, settled: &mut Settled) -> Result<Vec<Plan>, Error> {
        let firsts: Vec<usize> = (0..self.wanted.len()).step_by(LANES).collect();
        let alone = self.batches(&firsts, |first| {
            let (planner, wanted) = (self.planner, self.lanes(first).map(|idx| self.wants(idx)));
            planner
                .film()
                .cheapest_paths(&mut Alone { planner, wanted })
        })?;
        if n_watched(self.first + 1) > self.first {
            return self.one_by_one(&alone, settled);
        }
        let before = &*settled;
        let again = self.batches(&firsts, |first| self.batch(first, &alone, before))?;
        let plans = (again.par_iter().enumerate())
            .map(|(idx, path)| self.costed(idx, path, alone[idx].cost, before))
            .collect();
        for path in &again {
            settled.push(&path.states);
        }
        Ok(plans)
    }

    /// One path for each individual, from batches planned in parallel.
    fn batches(
        &self,
        firsts: &[usize],
        batch: impl Fn(usize) -> Option<[Path; LANES]> + Sync,
    ) -> Result<Vec<Path>, Error> {
        let paths: Option<Vec<_>> = firsts.par_iter().map(|&first| batch(first)).collect();
        let paths = paths.ok_or(Error::NoTransitions)?.into_iter().flatten();
        Ok(paths.take(self.wanted.len()).collect())
    }

    /// The individuals in the lanes of a batch; the last stands in for those that are not.
    fn lanes(&self, first: usize) -> [usize; LANES] {
        std::array::from_fn(|lane| (first + lane).min(self.wanted.len() - 1))
    }

    fn wants(&self, idx: usize) -> &[Feature] {
        &self.wanted[idx]
    }

    fn one_by_one(&self, alone: &[Path], settled: &mut Settled) -> Result<Vec<Plan>, Error> {
        let mut plans = Vec::with_capacity(alone.len());
        for (idx, path) in alone.iter().enumerate() {
            let again = match self.meets_lookalikes(idx, path, settled) {
                true => Some(self.in_crowd([idx], settled).ok_or(Error::NoTransitions)?),
                false => None,
            };
            let last = again.as_ref().map_or(path, |[again]| again);
            plans.push(self.costed(idx, last, path.cost, settled));
            settled.push(&last.states);
        }
        Ok(plans)
    }

    fn batch(&self, first: usize, alone: &[Path], settled: &Settled) -> Option<[Path; LANES]> {
        let lanes = self.lanes(first);
        let alone = lanes.map(|idx| &alone[idx]);
        let meets = std::array::from_fn::<_, LANES, _>(|lane| {
            self.meets_lookalikes(lanes[lane], alone[lane], settled)
        });
        if !meets.contains(&true) {
            return Some(alone.map(Path::clone));
        }
        let again = self.in_crowd(lanes, settled)?;
        Some(std::array::from_fn(|lane| match meets[lane] {
            true => again[lane].clone(),
            false => alone[lane].clone(),
        }))
    }

    fn meets_lookalikes(&self, idx: usize, path: &Path, settled: &Settled) -> bool {
        let mut crowd = self.planner.crowd_costs(self.first + idx, path, settled);
        crowd.any(|cost| cost > 0)
    }

    fn in_crowd<const N: usize>(&self, idx: [usize; N], settled: &Settled) -> Option<[Path; N]> {
        let ids = idx.map(|idx| self.first + idx);
        let wanted = idx.map(|idx| self.wants(idx));
        let mut rows = InCrowd::new(self.planner, settled, ids, wanted);
        self.planner.film().cheapest_paths(&mut rows)
    }

    fn costed(&self, idx: usize, path: &Path, lower_bound: u32, settled: &Settled) -> Plan {
        let crowd = self.planner.crowd_costs(self.first + idx, path, settled);
        (self.planner).costed(path, self.wants(idx), crowd, lower_bound)
    }
}
