//! Proof that a plan is the cheapest, by duality (docs/explanation/algorithms.md, "Planning").
//!
//! W(t, s, k) is the least cost from state s at frame t to the end of the film, k frames after the last
//! jump. The count k stops at the dwell, from which jumps are allowed. W is computed from the last frame to
//! the first. Every edge is then compared with W. If no edge offers less, no plan costs less than the least
//! W(0, s), even if the computation of W had an error.
//!
//! Along the cheapest plan, the cost so far plus W is constant. At the first frame where the sum rises
//! above the minimum, the plan leaves the optimum. In a loop the first state is given and counts as just
//! jumped to. The first state of the heir (the individual as which it continues) follows the last frame.

use super::cost::{Bill, Ledger};
use super::graph::Graph;
use super::violation::Violation;

/// Cost of a state from which the end cannot be reached. Sums of four such costs do not overflow.
const NEVER: u64 = u64::MAX / 4;

/// W at one frame: `[k - 1][state]`, in turns.
type Column = Vec<Vec<u64>>;

/// Checks that the plan of every segment is the cheapest, and that the lower bound of the file holds.
/// Returns the number of edges checked.
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
    let since_start = if ends.is_some() { 1 } else { ledger.dwell };
    let since = since_jump(graph, (since_start, ledger.dwell), states);
    let mut alone = 0;
    for segment in ledger.segments.windows(2) {
        let (first, end) = (segment[0], segment[1]);
        let part = Part {
            first,
            end,
            start: (first > 0).then(|| (states[first - 1], since[first - 1])),
            ends,
            future: (end < states.len()).then_some(&ledger.future[..]),
        };
        search.check(&part, ledger, bill, (states, &since))?;
        let open = Part {
            ends: None,
            future: None,
            ..part
        };
        let row = |t: usize| ledger.row(graph, bill, t, false);
        alone += search.cheapest(&open, row, |_, _, _| {})?;
    }
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

/// Segment of a plan: the frames `first..end`.
#[derive(Clone, Copy)]
struct Part<'a> {
    first: usize,
    end: usize,
    /// State at the frame before the segment, and the frames since the last jump there; `None` for the
    /// first segment.
    start: Option<(usize, usize)>,
    /// In a loop, the state with which the segment must begin and the state that follows its end.
    ends: Option<(usize, usize)>,
    /// Future cost by state, in turns; `None` for the last segment.
    future: Option<&'a [Option<u64>]>,
}

/// Returns for each frame the frames since the last jump: 1 at the frame jumped to, at most the dwell.
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

impl Part<'_> {
    /// Returns the future cost of ending in a state, in turns.
    fn beyond(&self, state: usize) -> u64 {
        self.future.and_then(|future| future[state]).unwrap_or(0)
    }
}

impl Search<'_> {
    /// Checks that the plan of a segment is the cheapest.
    fn check(
        &mut self,
        part: &Part<'_>,
        ledger: &Ledger<'_>,
        bill: &Bill,
        (states, since): (&[usize], &[usize]),
    ) -> Result<(), Violation> {
        let (first, end, id) = (part.first, part.end, self.id);
        let graph = self.graph;
        let row = |t: usize| ledger.row(graph, bill, t, true);
        // For each frame: W of the state shown, and the cost of showing it.
        let mut at_best = vec![0; end - first];
        let mut shown = vec![0; end - first];
        let least = self.cheapest(part, row, |t, costs, column| {
            at_best[t - first] = column[since[t] - 1][states[t]];
            shown[t - first] = costs[states[t]];
        })?;
        let mut spent = bill.jump_at(first);
        let mut left_at = None;
        for t in first..end {
            if spent + at_best[t - first] > least {
                left_at = left_at.or(Some(t));
            }
            spent += shown[t - first];
            // In a loop a jump may lead to the state after the last frame.
            if t + 1 < end || part.ends.is_some() {
                spent += bill.jump_at(t + 1);
            }
        }
        match left_at {
            Some(t) => Err(Violation::Suboptimal {
                id,
                t,
                cost: spent + part.beyond(states[end - 1]),
                cheapest: least,
            }),
            None => Ok(()),
        }
    }

    /// Returns the least cost of a plan of a segment, with the future cost of its last state, and checks
    /// every edge. `on_column` receives the frame, the cost of each state there, and W, from the last frame
    /// to the first.
    fn cheapest(
        &mut self,
        part: &Part<'_>,
        row: impl Fn(usize) -> Vec<u64>,
        mut on_column: impl FnMut(usize, &[u64], &Column),
    ) -> Result<u64, Violation> {
        let last = part.end - 1;
        let costs = row(last);
        let mut n_open = part.end;
        let mut after: Column;
        match part.ends {
            None => {
                let beyond = |state: usize| part.future.map_or(Some(0), |future| future[state]);
                let ended = (costs.iter().enumerate())
                    .map(|(state, &cost)| beyond(state).map_or(NEVER, |beyond| cost + beyond));
                after = vec![ended.collect(); self.dwell];
                on_column(last, &costs, &after);
                n_open -= 1;
            }
            Some((_, next)) => {
                after = vec![vec![NEVER; costs.len()]; self.dwell];
                for after in &mut after {
                    after[next] = 0;
                }
            }
        }
        for t in (part.first..n_open).rev() {
            let costs = row(t);
            let now = self.fill(&costs, &after);
            self.certify(t, &costs, &now, &after)?;
            on_column(t, &costs, &now);
            after = now;
        }
        if let Some((first, _)) = part.ends {
            return Ok(after[0][first]);
        }
        let Some((state, since)) = part.start else {
            let starts = after.last().into_iter().flatten();
            return Ok(starts.copied().min().unwrap_or(NEVER));
        };
        let goes_on = self.graph.next[state];
        let mut least = goes_on.map_or(NEVER, |next| after[since.min(self.dwell - 1)][next]);
        if since >= self.dwell {
            let jumps = self.graph.jumps.iter().filter(|jump| jump.from == state);
            least = jumps.fold(least, |least, jump| {
                least.min(jump.cost + after[0][jump.to])
            });
        }
        Ok(least)
    }

    /// Returns W at a frame, from W at the next frame.
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

    /// Checks that no edge from frame `t` to the next frame offers less than W.
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
            count: Some(1),
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
