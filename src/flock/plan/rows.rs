//! Costs of showing each state, for a range of stations and a block of frames at a time.
//!
//! `Alone` has the costs of one individual, `InCrowd` adds its crowd cost
//! (docs/explanation/algorithms.md, "Planning").

use std::ops::Range;

use super::Planner;
use super::added::Added;
use super::cost::Feature;
use super::crowd::Settled;
use super::viterbi::{Block, FRAMES, Moments, Rows};

/// Number of other individuals processed together, so that their data stay in the nearest cache. Free
/// choice.
const TOGETHER: usize = 256;

/// Costs of heading, rotation and speed.
#[derive(Clone)]
pub(super) struct Alone<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// Features asked for, by frame. Past its end the default feature is used.
    pub(super) wanted: &'a [Feature],
}

impl Rows for Alone<'_> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        let wanted = |t: usize| self.wanted.get(t).copied().unwrap_or_default();
        let (wanted, planner) = (block.times.map(wanted), self.planner);
        (planner.model.weights).fill(&wanted, &planner.model.features, (block, first), out);
    }
}

/// Costs of `Alone` plus the crowd cost.
#[derive(Clone)]
pub(super) struct InCrowd<'a> {
    alone: Alone<'a>,
    settled: &'a Settled,
    id: usize,
    added: Added,
}

impl<'a> InCrowd<'a> {
    pub(super) fn new(
        planner: &'a Planner<'a>,
        settled: &'a Settled,
        id: usize,
        wanted: &'a [Feature],
    ) -> InCrowd<'a> {
        InCrowd {
            alone: Alone { planner, wanted },
            settled,
            id,
            added: Added::new(planner.model.trellis.n_states()),
        }
    }

    #[inline(always)]
    /// Collects the crowd cost for the frames of a block.
    fn gather(&mut self, block: &Block) {
        self.added.clear();
        let planner = self.alone.planner;
        let moments = block.moments(planner.places.len());
        let n_watched = planner.model.crowd.n_watched(self.id);
        for first in (0..n_watched).step_by(TOGETHER) {
            self.gather_some(&moments, first..n_watched.min(first + TOGETHER));
        }
    }

    /// Collects the crowd cost of some of the watched individuals.
    #[inline(always)]
    fn gather_some(&mut self, moments: &Moments, others: Range<usize>) {
        let planner = self.alone.planner;
        let mut costs = [[0; FRAMES]; TOGETHER];
        let costs = &mut costs[..others.len()];
        for moment in moments.range.clone() {
            let (places, pair) = (
                &planner.places[moments.frame(moment)],
                (self.id, others.clone()),
            );
            planner.model.crowd.costs_at(pair, places, moment, costs);
        }
        for (other, costs) in others.zip(costs) {
            if *costs == [0; FRAMES] {
                continue;
            }
            let mut moment = moments.range.start;
            while moment < moments.range.end {
                let t = moments.frame(moment);
                let alike = planner.model.alike[self.settled.at(t)[other] as usize];
                let n_steady = usize::from(self.settled.steady_at(t)[other]);
                let n = n_steady.min(moments.range.end - moment);
                (self.added).add(alike, moment, &costs[moment..moment + n]);
                moment += n;
            }
        }
    }
}

impl Rows for InCrowd<'_> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        if first == 0 {
            self.gather(block);
        }
        self.alone.fill(block, first, out);
        self.added.pass(block, first, out);
    }
}
