//! Oracle of planning: the least cost of a plan, by plain dynamic programming over frames and states
//! (docs/explanation/algorithms.md, "Planning").
//!
//! It shares no code with the planner. `check-plan` compares stored plans with it, and tests of the planner
//! compare paths with it.

/// States of playback and the steps between them.
pub(in crate::flock) struct Graph {
    /// State of the next frame on the same mirror side, by state.
    pub(in crate::flock) next: Vec<Option<usize>>,
    pub(in crate::flock) jumps: Vec<Edge>,
}

/// Jump between two states, with its cost in turns.
#[derive(Clone, Copy)]
pub(in crate::flock) struct Edge {
    pub(in crate::flock) from: usize,
    pub(in crate::flock) to: usize,
    pub(in crate::flock) cost: u64,
}

/// Cost of a state that cannot be shown. Sums of a few such costs do not overflow.
pub(in crate::flock) const NEVER: u64 = u64::MAX / 4;

/// Least costs of plans up to a frame, in turns: `[since - 1][state]`, where `since` is the number of frames
/// since the last jump, at most the dwell.
type Column = Vec<Vec<u64>>;

impl Graph {
    /// Returns the least cost of a plan, in turns, at least `NEVER` if there is none. `starts` has the states
    /// allowed at the first frame, each with its number of frames since the last jump. `rows` has the cost
    /// of showing each state, frame after frame.
    pub(in crate::flock) fn least_cost(
        &self,
        dwell: usize,
        starts: &[(usize, usize)],
        rows: impl Iterator<Item = Vec<u64>>,
    ) -> u64 {
        let mut column = vec![vec![NEVER; self.next.len()]; dwell];
        for &(state, since) in starts {
            column[since - 1][state] = 0;
        }
        for (t, row) in rows.enumerate() {
            if t > 0 {
                column = self.step(&column);
            }
            for costs in &mut column {
                for (cost, shown) in costs.iter_mut().zip(&row) {
                    *cost = (*cost + shown).min(NEVER);
                }
            }
        }
        column.into_iter().flatten().min().unwrap_or(NEVER)
    }

    /// Returns the cost of the jump between two states, in turns, if there is one.
    pub(super) fn jump_cost(&self, from: usize, to: usize) -> Option<u64> {
        let jumps = self.jumps.iter();
        let jumps = jumps.filter(|jump| (jump.from, jump.to) == (from, to));
        jumps.map(|jump| jump.cost).min()
    }

    /// Returns the least costs after one step, without the cost of showing the state reached.
    fn step(&self, column: &Column) -> Column {
        let dwell = column.len();
        let mut after = vec![vec![NEVER; self.next.len()]; dwell];
        for (k, costs) in column.iter().enumerate() {
            let after = &mut after[(k + 1).min(dwell - 1)];
            for (&cost, next) in costs.iter().zip(&self.next) {
                if let Some(next) = *next {
                    after[next] = after[next].min(cost);
                }
            }
        }
        for jump in &self.jumps {
            let cost = column[dwell - 1][jump.from] + jump.cost;
            after[0][jump.to] = after[0][jump.to].min(cost);
        }
        after
    }
}
