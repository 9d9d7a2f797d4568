//! What showing each state costs, a block of states at a time (ALGORITHMS.md 6): alone, and among
//! those whose plans are final.

use super::Planner;
use super::cost::{CEILING, Feature};
use super::crowd::Settled;
use super::viterbi::Rows;

/// Heading, rotation and speed alone.
#[derive(Clone)]
pub(super) struct Alone<'a, const LANES: usize> {
    pub(super) planner: &'a Planner<'a>,
    pub(super) wanted: [&'a [Feature]; LANES],
}

impl<const LANES: usize> Rows<LANES> for Alone<'_, LANES> {
    #[inline(always)]
    fn fill(&mut self, t: usize, first: usize, out: &mut [[u32; LANES]]) {
        let wanted: [Feature; LANES] = std::array::from_fn(|lane| self.wanted[lane][t]);
        let features = &self.planner.features[first..first + out.len()];
        for (out, &feature) in out.iter_mut().zip(features) {
            for lane in 0..LANES {
                out[lane] = self.planner.weights.total(wanted[lane], feature);
            }
        }
    }
}

/// The same with what the crowd adds.
#[derive(Clone)]
pub(super) struct InCrowd<'a, const LANES: usize> {
    planner: &'a Planner<'a>,
    settled: &'a Settled,
    n_watched: usize,
    ids: [usize; LANES],
    wanted: [&'a [Feature]; LANES],
    /// What the crowd adds to each state; with several lanes, by how much that is more than
    /// what it adds to the state before.
    added: Vec<[u32; LANES]>,
    /// With several lanes: what it adds to the last state filled in.
    sum: [u32; LANES],
}

impl<'a, const LANES: usize> InCrowd<'a, LANES> {
    pub(super) fn new(
        planner: &'a Planner<'a>,
        settled: &'a Settled,
        ids: [usize; LANES],
        wanted: [&'a [Feature]; LANES],
    ) -> InCrowd<'a, LANES> {
        InCrowd {
            planner,
            settled,
            n_watched: planner.crowd.n_watched(ids[0]),
            ids,
            wanted,
            added: vec![[0; LANES]; planner.trellis.n_states() + 1],
            sum: [0; LANES],
        }
    }

    #[inline(always)]
    fn gather(&mut self, t: usize) {
        let planner = self.planner;
        let places = &planner.places[t];
        let here = self.ids.map(|id| places[id]);
        self.added.fill([0; LANES]);
        self.sum = [0; LANES];
        let others = self.settled.at(t)[..self.n_watched].iter().zip(places);
        for (&state, &place) in others {
            let mut costs = [0; LANES];
            for lane in 0..LANES {
                costs[lane] = u32::from(planner.crowd.cost_at(here[lane], place));
            }
            if costs == [0; LANES] {
                continue;
            }
            let [low, high] = planner.alike[state as usize];
            let (first, end) = (low as usize, high as usize);
            if LANES == 1 {
                for added in &mut self.added[first..end] {
                    added[0] += costs[0];
                }
            } else {
                for lane in 0..LANES {
                    let (up, down) = (self.added[first][lane], self.added[end][lane]);
                    self.added[first][lane] = up.wrapping_add(costs[lane]);
                    self.added[end][lane] = down.wrapping_sub(costs[lane]);
                }
            }
        }
    }
}

impl<const LANES: usize> Rows<LANES> for InCrowd<'_, LANES> {
    #[inline(always)]
    fn fill(&mut self, t: usize, first: usize, out: &mut [[u32; LANES]]) {
        if first == 0 {
            self.gather(t);
        }
        let wanted: [Feature; LANES] = std::array::from_fn(|lane| self.wanted[lane][t]);
        let features = &self.planner.features[first..first + out.len()];
        let added = &self.added[first..first + out.len()];
        for ((out, &feature), added) in out.iter_mut().zip(features).zip(added) {
            for lane in 0..LANES {
                let crowd = if LANES == 1 {
                    added[lane]
                } else {
                    self.sum[lane] = self.sum[lane].wrapping_add(added[lane]);
                    self.sum[lane]
                };
                let alone = self.planner.weights.total(wanted[lane], feature);
                out[lane] = (alone + crowd).min(CEILING - 1);
            }
        }
    }
}
