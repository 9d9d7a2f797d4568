//! Whether a plan is the cheapest (ALGORITHMS.md 6, proof b), by duality.
//!
//! W(t, s, k) is what the rest of a film costs from state s at frame t on, k frames after the last jump
//! (k stops at the dwell, from where jumps are free). It is filled in from the last frame to the first; then
//! every edge is asked whether it offers less: if none does, W holds whoever filled it in, and no plan
//! costs less than the least W(0, s). Along the plan, cost so far plus W never falls: where it first
//! rises above that least, the plan left the cheapest way. In a loop the first state is given, counts as
//! just jumped to, and the first of the heir comes after the last frame.

use super::cost::{Bill, Ledger};
use super::graph::Graph;
use super::violation::Violation;

/// No way to the end.
const NEVER: u64 = u64::MAX / 4;

/// W at one frame: `[k - 1][state]`.
type Column = Vec<Vec<u64>>;

/// Checks that the plan is the cheapest, if it claims so, and that its lower bound is one. Returns how
/// many edges were looked at.
pub(super) fn check(
    graph: &Graph,
    ledger: &Ledger<'_>,
    id: usize,
    (states, next): (&[usize], Option<usize>),
    bill: &Bill,
) -> Result<u64, Violation> {
    let ends = next.map(|next| (states[0], next));
    let mut search = Search {
        graph,
        dwell: ledger.dwell,
        id,
        n_edges: 0,
    };
    let n_frames = bill.before.len() - 1;
    let since_start = if ends.is_some() { 1 } else { ledger.dwell };
    let since = since_jump(graph, (since_start, ledger.dwell), states);
    // What the plan costs if from each frame on it goes the cheapest way.
    let mut at_best = vec![0; n_frames];
    let row = |t: usize| ledger.row(graph, bill, t, true);
    let cheapest = search.cheapest((n_frames, ends), row, |t, column| {
        at_best[t] = bill.before[t] + column[since[t] - 1][states[t]];
    })?;
    let left_at = at_best.iter().position(|&cost| cost > cheapest);
    if let Some(t) = left_at.filter(|_| ledger.is_exact(id)) {
        return Err(Violation::Suboptimal {
            id,
            t,
            cost: bill.total(),
            cheapest,
        });
    }
    let gap = ledger.gap(id)?;
    if ledger.is_exact(id) != (gap == 0) {
        return Err(Violation::Exact { id, gap });
    }
    if bill.total() > cheapest + gap {
        let found = bill.total() - cheapest;
        return Err(Violation::Gap {
            id,
            said: gap,
            found,
        });
    }
    let alone = match bill.has_crowd() || ends.is_some() {
        true => search.cheapest(
            (n_frames, None),
            |t| ledger.row(graph, bill, t, false),
            |_, _| {},
        )?,
        false => cheapest,
    };
    let said = ledger.lower_bound(id)?;
    match said > alone {
        true => Err(Violation::LowerBound {
            id,
            said,
            cheapest: alone,
        }),
        false => Ok(search.n_edges),
    }
}

/// Frames since the last jump, 1 on its own frame; never above the dwell.
fn since_jump(graph: &Graph, (since_start, dwell): (usize, usize), states: &[usize]) -> Vec<usize> {
    let mut since = vec![since_start; states.len()];
    for t in 1..states.len() {
        since[t] = match graph.next[states[t - 1]] == Some(states[t]) {
            true => (since[t - 1] + 1).min(dwell),
            false => 1,
        };
    }
    since
}

struct Search<'a> {
    graph: &'a Graph,
    dwell: usize,
    id: usize,
    n_edges: u64,
}

impl Search<'_> {
    /// What the cheapest plan costs, every edge looked at; `on_column` is shown W from the last frame to
    /// the first. `ends`: the state that it must begin with, and the one that comes after it.
    fn cheapest(
        &mut self,
        (n_frames, ends): (usize, Option<(usize, usize)>),
        row: impl Fn(usize) -> Vec<u64>,
        mut on_column: impl FnMut(usize, &Column),
    ) -> Result<u64, Violation> {
        let mut after: Column = vec![row(n_frames - 1); self.dwell];
        let mut n_open = n_frames;
        match ends {
            None => {
                on_column(n_frames - 1, &after);
                n_open -= 1;
            }
            Some((_, next)) => {
                for after in &mut after {
                    after.fill(NEVER);
                    after[next] = 0;
                }
            }
        }
        for t in (0..n_open).rev() {
            let costs = row(t);
            let now = self.fill(&costs, &after);
            self.certify(t, &costs, &now, &after)?;
            on_column(t, &now);
            after = now;
        }
        if let Some((first, _)) = ends {
            return Ok(after[0][first]);
        }
        let starts = after.last().into_iter().flatten();
        Ok(starts.copied().min().unwrap_or(NEVER))
    }

    /// W at a frame from W at the next.
    fn fill(&self, costs: &[u64], after: &Column) -> Column {
        let mut now: Column = vec![vec![NEVER; costs.len()]; self.dwell];
        for (k, now) in now.iter_mut().enumerate() {
            let after = &after[(k + 1).min(self.dwell - 1)];
            for (state, next) in self.graph.next.iter().enumerate() {
                let rest = next.map_or(NEVER, |next| after[next]);
                now[state] = (costs[state] + rest).min(NEVER);
            }
        }
        let free = &mut now[self.dwell - 1];
        for jump in &self.graph.jumps {
            let through = costs[jump.from] + jump.cost + after[0][jump.to];
            free[jump.from] = free[jump.from].min(through);
        }
        now
    }

    /// No edge from frame `t` to the next offers less than W says.
    fn certify(
        &mut self,
        t: usize,
        costs: &[u64],
        now: &Column,
        after: &Column,
    ) -> Result<(), Violation> {
        let mut cheaper = false;
        for state in 0..self.graph.n_states() {
            let Some(next) = self.graph.next[state] else {
                continue;
            };
            for since in 1..=self.dwell {
                let then = (since + 1).min(self.dwell);
                let offer = costs[state] + after[then - 1][next];
                cheaper |= now[since - 1][state] > offer;
            }
            self.n_edges += self.dwell as u64;
        }
        for jump in &self.graph.jumps {
            let offer = costs[jump.from] + jump.cost + after[0][jump.to];
            cheaper |= now[self.dwell - 1][jump.from] > offer;
        }
        self.n_edges += self.graph.jumps.len() as u64;
        match cheaper {
            true => Err(Violation::Certificate { id: self.id, t }),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;

    #[test]
    fn a_certificate_that_asks_too_much_of_one_state_is_refused() {
        let library = synthetic::library(View::Side);
        let params = Params {
            count: 1,
            frames: 20,
            ..Params::default()
        };
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        let graph = Graph::new(&library, &flock);
        let mut search = Search {
            graph: &graph,
            dwell: 8,
            id: 0,
            n_edges: 0,
        };
        let costs = vec![3; graph.n_states()];
        let after: Column = vec![costs.clone(); 8];
        let mut now = search.fill(&costs, &after);
        assert_eq!(search.certify(5, &costs, &now, &after), Ok(()));
        let jump = graph.jumps[graph.jumps.len() / 2];
        let refused = Err(Violation::Certificate { id: 0, t: 5 });
        for (since, state) in [(8, jump.from), (1, 17)] {
            now[since - 1][state] += 1;
            assert_eq!(search.certify(5, &costs, &now, &after), refused);
            now[since - 1][state] -= 1;
        }
    }
}
