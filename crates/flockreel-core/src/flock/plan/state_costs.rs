//! Costs of showing each state, for a range of stations and a block of frames at a time.
//!
//! `OwnCosts` has the costs of one individual, `CrowdedCosts` adds its crowd cost
//! (docs/explanation/algorithms.md, "Planning").

use std::ops::Range;

use super::Planner;
use super::cost::Feature;
use super::crowd::FinalPlans;
use super::range_costs::RangeCosts;
use super::viterbi::{Block, FRAMES, Moments, StateCosts};

/// Number of other individuals processed together, so that their data stay in the nearest cache. Free
/// choice.
const NEIGHBOR_BATCH: usize = 256;

/// Costs of heading, rotation and speed.
#[derive(Clone)]
pub(super) struct OwnCosts<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// Features asked for, by frame. Past its end the default feature is used.
    pub(super) wanted: &'a [Feature],
}

impl StateCosts for OwnCosts<'_> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        let wanted = |t: usize| self.wanted.get(t).copied().unwrap_or_default();
        let (wanted, planner) = (block.times.map(wanted), self.planner);
        (planner.model.weights).fill(&wanted, &planner.model.features, block, first, out);
    }
}

/// Costs of `OwnCosts` plus the crowd cost.
#[derive(Clone)]
pub(super) struct CrowdedCosts<'a> {
    own: OwnCosts<'a>,
    final_plans: &'a FinalPlans,
    id: usize,
    crowd: RangeCosts,
}

impl<'a> CrowdedCosts<'a> {
    pub(super) fn new(
        planner: &'a Planner<'a>,
        final_plans: &'a FinalPlans,
        id: usize,
        wanted: &'a [Feature],
    ) -> CrowdedCosts<'a> {
        CrowdedCosts {
            own: OwnCosts { planner, wanted },
            final_plans,
            id,
            crowd: RangeCosts::new(planner.model.trellis.n_states()),
        }
    }

    /// Collects the crowd cost for the frames of a block.
    #[inline(always)]
    fn collect_crowd(&mut self, block: &Block) {
        self.crowd.clear();
        let planner = self.own.planner;
        let moments = block.moments(planner.places.len());
        let n_watched = planner.model.crowd.n_watched(self.id);
        for first in (0..n_watched).step_by(NEIGHBOR_BATCH) {
            self.collect_crowd_of(&moments, first..n_watched.min(first + NEIGHBOR_BATCH));
        }
    }

    /// Collects the crowd cost of some of the watched individuals.
    #[inline(always)]
    fn collect_crowd_of(&mut self, moments: &Moments, others: Range<usize>) {
        let planner = self.own.planner;
        let mut costs = [[0; FRAMES]; NEIGHBOR_BATCH];
        let costs = &mut costs[..others.len()];
        for moment in moments.range.clone() {
            let places = &planner.places[moments.frame(moment)];
            let crowd = &planner.model.crowd;
            crowd.costs_at(self.id, others.clone(), places, moment, costs);
        }
        for (other, costs) in others.zip(costs) {
            if *costs == [0; FRAMES] {
                continue;
            }
            let mut moment = moments.range.start;
            while moment < moments.range.end {
                let t = moments.frame(moment);
                let alike = planner.model.alike[self.final_plans.at(t)[other] as usize];
                let n_steady = usize::from(self.final_plans.steady_at(t)[other]);
                let n = n_steady.min(moments.range.end - moment);
                (self.crowd).add(alike, moment, &costs[moment..moment + n]);
                moment += n;
            }
        }
    }
}

impl StateCosts for CrowdedCosts<'_> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        if first == 0 {
            self.collect_crowd(block);
        }
        self.own.fill(block, first, out);
        self.crowd.apply(block, first, out);
    }
}
