//! Conditions on a plan by what is shown before it and after it (docs/explanation/algorithms.md, "Planning").
//!
//! A segment continues from the state shown last. A loop begins with a given state and leads to another one.
//! The recursion sees these states as frames outside of the plan.

use super::viterbi::{Block, FRAMES, StateCosts};

/// Least cost of a plan that is not allowed, in turns. Three of these plus all costs of a plan stay below
/// 2^31.
pub(super) const FORBIDDEN: u32 = 1 << 28;

/// Conditions on a plan.
#[derive(Clone, Copy, Default)]
pub(super) struct Conditions<'a> {
    /// Frames at which only one state is allowed: frame and state.
    pub(super) only: [Option<(usize, usize)>; 3],
    /// Frame outside of the plan, at which showing a state costs nothing.
    pub(super) outside: Option<usize>,
    /// Frame, and the cost that each state adds there, in turns.
    pub(super) added: Option<(usize, &'a [u32])>,
}

/// Costs of a plan under conditions.
#[derive(Clone)]
pub(super) struct ConditionedCosts<'a, R> {
    pub(super) state_costs: R,
    pub(super) conditions: Conditions<'a>,
}

impl<R: StateCosts> StateCosts for ConditionedCosts<'_, R> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        self.state_costs.fill(block, first, out);
        let conditions = self.conditions;
        for (lane, &t) in block.times.iter().enumerate() {
            if conditions.outside == Some(t) {
                out.iter_mut().for_each(|out| out[lane] = 0);
            }
            for (_, only) in conditions
                .only
                .into_iter()
                .flatten()
                .filter(|only| only.0 == t)
            {
                for (station, out) in (first..).zip(&mut *out) {
                    if block.state(station) != only {
                        out[lane] = FORBIDDEN;
                    }
                }
            }
            if let Some((_, costs)) = conditions.added.filter(|added| added.0 == t) {
                for (station, out) in (first..).zip(&mut *out) {
                    out[lane] += costs[block.state(station)];
                }
            }
        }
    }
}
