//! Costs of showing each state at a frame: heading, rotation and speed, and looking like others
//! (docs/explanation/algorithms.md, "Planning").

use super::Planner;
use super::cost::Feature;
use super::recursion::StateCosts;

/// Costs of one individual.
#[derive(Clone, Copy)]
pub(super) struct IndividualCosts<'a> {
    pub(super) planner: &'a Planner<'a>,
    /// Features asked for, by frame. A frame past its end, which follows a loop, costs nothing.
    pub(super) wanted: &'a [Feature],
    /// Id of the individual, and the states that those of smaller id show: `[frame][id]`. `None` without the
    /// cost of looking like them.
    pub(super) among: Option<(usize, &'a [Vec<u32>])>,
}

impl IndividualCosts<'_> {
    /// Calls `add` with the states that look like another individual, as first and one past the last, and
    /// with the cost of looking like it, for all others nearby.
    #[inline(always)]
    fn crowd(&self, t: usize, mut add: impl FnMut([u32; 2], u32)) {
        let Some((id, shown)) = self.among else {
            return;
        };
        let (model, places) = (self.planner.model, &self.planner.places[t]);
        let here = places[id];
        let n_watched = model.crowd.n_watched(id);
        for (place, &state) in places[..n_watched].iter().zip(&shown[t]) {
            let cost = model.crowd.cost_at(here, *place);
            if cost > 0 {
                add(model.alike[state as usize], cost);
            }
        }
    }
}

impl StateCosts for IndividualCosts<'_> {
    #[inline(always)]
    fn fill(&self, t: usize, out: &mut [u32]) {
        let Some(&wanted) = self.wanted.get(t) else {
            return out.fill(0);
        };
        let model = self.planner.model;
        model.weights.fill(wanted, &model.features, out);
        self.crowd(t, |[first, end], cost| {
            out[first as usize..end as usize]
                .iter_mut()
                .for_each(|out| *out += cost);
        });
    }

    fn at(&self, t: usize, state: usize) -> u32 {
        let Some(&wanted) = self.wanted.get(t) else {
            return 0;
        };
        let model = self.planner.model;
        let mut sum = model.weights.total(wanted, model.features[state]);
        self.crowd(t, |[first, end], cost| {
            sum += if (first..end).contains(&(state as u32)) {
                cost
            } else {
                0
            };
        });
        sum
    }
}
