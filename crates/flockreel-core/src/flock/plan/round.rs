//! Rounds: plans of individuals that do not watch one another, computed on all threads.
//!
//! The first 64 individuals watch all individuals of smaller id, so each is a round of its own
//! (docs/explanation/algorithms.md, "Planning").

use rayon::prelude::*;

use super::Planner;
use super::conditions::{ConditionedCosts, Conditions, FORBIDDEN};
use super::cost::Feature;
use super::crowd::FinalPlans;
use super::state_costs::{CrowdedCosts, OwnCosts};
use super::viterbi::{Path, PathSearch};
use crate::flock::error::Error;
use crate::progress::Progress;

impl Planner<'_> {
    /// Returns the cheapest path of each individual of a round, given the final plans. `first` is the id of
    /// the first individual. Fails if an individual has no path.
    pub(super) fn paths_of_round(
        &self,
        first: usize,
        wanted: &[Vec<Feature>],
        final_plans: &FinalPlans,
    ) -> Result<Vec<Path>, Error> {
        let wanted = wanted.par_iter().enumerate();
        wanted
            .map(|(idx, wanted)| self.cheapest_path(first + idx, wanted, final_plans))
            .collect()
    }

    /// Returns the cost of each individual's cheapest path without crowd cost and future cost, in turns.
    pub(super) fn least_costs(
        &self,
        wanted: &[Vec<Feature>],
        progress: &dyn Progress,
    ) -> Result<Vec<u32>, Error> {
        let open = PathSearch {
            n_frames: self.places.len(),
            ..self.search()
        };
        let least = |(id, wanted): (usize, &Vec<Feature>)| {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let planner = self;
            let mut state_costs = ConditionedCosts {
                state_costs: OwnCosts { planner, wanted },
                conditions: self.continued(id),
            };
            (open.least_cost(&mut state_costs)).ok_or(Error::NoTransitions)
        };
        wanted.par_iter().enumerate().map(least).collect()
    }

    /// Returns the condition that a plan continues from what the individual has shown before. Frame 0 is then
    /// the last frame of the segment before. Only one path leads from its state through the frames that must
    /// be played on.
    fn continued(&self, id: usize) -> Conditions<'_> {
        let shown = self.statuses.get(id);
        let Some((state, n_forced)) =
            shown.and_then(|status| Some((status.state?, status.n_forced)))
        else {
            return Conditions::default();
        };
        let only = |t: usize| Some((t, state as usize + t));
        let n_forced = n_forced.min(self.places.len() - 1);
        Conditions {
            only: [only(0), only(n_forced), None],
            outside: Some(0),
            added: None,
        }
    }

    /// Returns the cheapest path of one individual, given the final plans.
    fn cheapest_path(
        &self,
        id: usize,
        wanted: &[Feature],
        final_plans: &FinalPlans,
    ) -> Result<Path, Error> {
        let ends = self.ends.get(id);
        let n_frames = self.places.len();
        let mut conditions = match ends {
            Some(ends) => ends.conditions(n_frames, self.model.dwell),
            None => self.continued(id),
        };
        if !self.is_last {
            conditions.added = Some((n_frames - 1, &self.model.future[..]));
        }
        let state_costs = ConditionedCosts {
            state_costs: CrowdedCosts::new(self, final_plans, id, wanted),
            conditions,
        };
        let path = (self.search().cheapest_path(&state_costs)).ok_or(Error::NoTransitions)?;
        let is_closed = ends.is_none_or(|ends| ends.holds(&path.states));
        match (is_closed && path.cost < FORBIDDEN, ends) {
            (true, _) => Ok(Path {
                cost: self.cost_among(id, wanted, final_plans, &path),
                states: path.states,
            }),
            (false, Some(_)) => Err(Error::LoopDoesNotClose(self.places.len())),
            (false, None) => Err(Error::NoTransitions),
        }
    }
}
