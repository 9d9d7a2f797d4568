//! What showing each state costs, a stretch of stations and a block of frames at a time
//! (ALGORITHMS.md 6): alone, and among those whose plans are final.

use super::Planner;
use super::added::Added;
use super::cost::Feature;
use super::crowd::Settled;
use super::memory::Raised;
use super::viterbi::{Block, FRAMES, Moments, Rows};

/// Heading, rotation and speed alone.
#[derive(Clone)]
pub(super) struct Alone<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// By frame; past its end nothing in particular is wanted.
    pub(super) wanted: &'a [Feature],
}

impl Rows for Alone<'_> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        let wanted = |t: usize| self.wanted.get(t).copied().unwrap_or_default();
        let (wanted, planner) = (block.times.map(wanted), self.planner);
        (planner.weights).fill(&wanted, &planner.features, (block, first), out);
    }
}

/// The same with what the crowd adds.
#[derive(Clone)]
pub(super) struct InCrowd<'a> {
    alone: Alone<'a>,
    settled: &'a Settled,
    id: usize,
    /// What is dearer for having been repeated.
    raised: Option<&'a Raised>,
    added: Added,
    /// What looking like each of those looked out for costs, by moment of a block.
    near: Vec<[u32; FRAMES]>,
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
            raised: None,
            added: Added::new(planner.trellis.n_states()),
            near: vec![[0; FRAMES]; planner.crowd.n_watched(id)],
        }
    }

    /// The same with what it has repeated made dearer.
    pub(super) fn raised(self, raised: &'a Raised) -> InCrowd<'a> {
        InCrowd {
            raised: Some(raised),
            ..self
        }
    }

    #[inline(always)]
    fn gather(&mut self, block: &Block) {
        self.added.clear();
        let planner = self.alone.planner;
        let moments = block.moments(planner.places.len());
        self.gather_others(&moments);
        if let Some(raised) = self.raised {
            for moment in moments.range.clone() {
                for &state in raised.at(moments.frame(moment)) {
                    let states = [state, state + 1];
                    self.added.add(states, moment, &[raised.cost]);
                }
            }
        }
    }

    #[inline(always)]
    fn gather_others(&mut self, moments: &Moments) {
        let Planner { crowd, places, .. } = self.alone.planner;
        for moment in moments.range.clone() {
            let places = &places[moments.frame(moment)];
            crowd.costs_at(self.id, places, moment, &mut self.near);
        }
        for (other, costs) in self.near.iter().enumerate() {
            if *costs == [0; FRAMES] {
                continue;
            }
            let mut moment = moments.range.start;
            while moment < moments.range.end {
                let shown = self.settled.at(moments.frame(moment))[other];
                let n = (shown.n_steady as usize).min(moments.range.end - moment);
                (self.added).add(shown.alike, moment, &costs[moment..moment + n]);
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
