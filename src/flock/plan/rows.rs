//! What showing each state costs, a stretch of stations and a block of frames at a time
//! (ALGORITHMS.md 6): alone, and among those whose plans are final.

use std::ops::Range;

use super::Planner;
use super::cost::{CEILING, Feature};
use super::crowd::{Settled, TOGETHER};
use super::memory::Raised;
use super::viterbi::{Block, FRAMES, Rows};

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
    /// What the crowd adds to each station filled in; of those after, by how much that is more than what
    /// it adds to the one before. The first stands before the first station.
    added: Vec<[u32; FRAMES]>,
    /// Whether it adds anything in this block.
    adds: bool,
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
            added: vec![[0; FRAMES]; planner.trellis.n_states() + 2],
            adds: false,
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
        if std::mem::take(&mut self.adds) {
            self.added.fill([0; FRAMES]);
        }
        let planner = self.alone.planner;
        let n_watched = planner.crowd.n_watched(self.id);
        for (lane, &t) in block.times.iter().enumerate() {
            let Some(places) = planner.places.get(t) else {
                continue;
            };
            let others = self.settled.at(t)[..n_watched].chunks(TOGETHER);
            for (states, there) in others.zip(places.chunks(TOGETHER)) {
                let costs = planner.crowd.costs_at(places[self.id], there);
                for (&state, cost) in states.iter().zip(costs) {
                    if cost > 0 {
                        let [low, high] = planner.alike[state as usize];
                        self.add(block, low as usize..high as usize, lane, cost.into());
                    }
                }
            }
            if let Some(raised) = self.raised {
                for &state in raised.at(t) {
                    let states = state as usize..state as usize + 1;
                    self.add(block, states, lane, raised.cost);
                }
            }
        }
    }

    /// Adds to the cost of some states in a row.
    #[inline(always)]
    fn add(&mut self, block: &Block, states: Range<usize>, lane: usize, cost: u32) {
        let stations = block.stations(states);
        let [up, down] = [stations.start + 1, stations.end + 1];
        self.added[up][lane] = self.added[up][lane].wrapping_add(cost);
        self.added[down][lane] = self.added[down][lane].wrapping_sub(cost);
        self.adds = true;
    }
}

impl Rows for InCrowd<'_> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        if first == 0 {
            self.gather(block);
        }
        self.alone.fill(block, first, out);
        if !self.adds {
            return;
        }
        let added = &mut self.added[first..][..=out.len()];
        for (idx, out) in out.iter_mut().enumerate() {
            let (before, more) = (added[idx], added[idx + 1]);
            let now: [u32; FRAMES] = std::array::from_fn(|k| before[k].wrapping_add(more[k]));
            *out = std::array::from_fn(|k| (out[k] + now[k]).min(CEILING - 1));
            added[idx + 1] = now;
        }
    }
}
