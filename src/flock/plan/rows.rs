//! What showing each state costs, a block of states at a time (ALGORITHMS.md 6): alone, and among
//! those whose plans are final.

use super::Planner;
use super::circle::Ends;
use super::cost::{CEILING, Feature};
use super::crowd::Settled;
use super::memory::Raised;
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
        let planner = self.planner;
        (planner.weights).fill(&wanted, &planner.features, first, out);
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
    /// What is dearer for having been repeated.
    raised: [Option<&'a Raised>; LANES],
    /// Where plans begin and what follows them, in a loop.
    ends: Option<[Ends; LANES]>,
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
            raised: [None; LANES],
            ends: None,
            added: vec![[0; LANES]; planner.trellis.n_states() + 1],
            sum: [0; LANES],
        }
    }

    /// The same with what each has repeated made dearer.
    pub(super) fn raised(self, raised: [&'a Raised; LANES]) -> InCrowd<'a, LANES> {
        InCrowd {
            raised: raised.map(Some),
            ..self
        }
    }

    /// The same for plans that play into one another.
    pub(super) fn between(self, ends: [Ends; LANES]) -> InCrowd<'a, LANES> {
        InCrowd {
            ends: Some(ends),
            ..self
        }
    }

    #[inline(always)]
    fn fill_film(&mut self, t: usize, first: usize, out: &mut [[u32; LANES]]) {
        if first == 0 {
            self.gather(t);
        }
        let wanted: [Feature; LANES] = std::array::from_fn(|lane| self.wanted[lane][t]);
        let planner = self.planner;
        (planner.weights).fill(&wanted, &planner.features, first, out);
        let added = &self.added[first..first + out.len()];
        let mut sum = self.sum;
        for (out, added) in out.iter_mut().zip(added) {
            for lane in 0..LANES {
                let crowd = if LANES == 1 {
                    added[lane]
                } else {
                    sum[lane] = sum[lane].wrapping_add(added[lane]);
                    sum[lane]
                };
                out[lane] = (out[lane] + crowd).min(CEILING - 1);
            }
        }
        self.sum = sum;
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
            self.add(low as usize..high as usize, costs);
        }
        for lane in 0..LANES {
            let Some(raised) = self.raised[lane] else {
                continue;
            };
            let mut costs = [0; LANES];
            costs[lane] = raised.cost;
            for &state in raised.at(t) {
                self.add(state as usize..state as usize + 1, costs);
            }
        }
    }

    /// Adds to the cost of some states in a row.
    #[inline(always)]
    fn add(&mut self, states: std::ops::Range<usize>, costs: [u32; LANES]) {
        if LANES == 1 {
            for added in &mut self.added[states] {
                added[0] += costs[0];
            }
            return;
        }
        for lane in 0..LANES {
            let (up, down) = (self.added[states.start][lane], self.added[states.end][lane]);
            self.added[states.start][lane] = up.wrapping_add(costs[lane]);
            self.added[states.end][lane] = down.wrapping_sub(costs[lane]);
        }
    }
}

impl<const LANES: usize> Rows<LANES> for InCrowd<'_, LANES> {
    #[inline(always)]
    fn fill(&mut self, t: usize, first: usize, out: &mut [[u32; LANES]]) {
        let n_frames = self.planner.places.len();
        if t < n_frames {
            self.fill_film(t, first, out);
        }
        for (lane, ends) in self.ends.iter().flatten().enumerate() {
            ends.close((t, n_frames, self.planner.dwell), first, out, lane);
        }
    }
}
