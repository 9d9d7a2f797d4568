//! Independent proof that a plan is the cheapest, by duality of linear programming
//! (docs/explanation/algorithms.md, "Planning").
//!
//! The potentials are the costs of reaching each state at each frame, as the recursion returns them. The
//! proof checks every edge once and sums the costs along forced runs one by one. If no edge offers less
//! than the potentials, and the plan costs what they say at its end, no plan costs less. How the plan was
//! found does not matter.

use super::trellis::Trellis;

/// Reason why a certificate fails.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Violation {
    /// An edge into `state` at frame `t` offers less than the potentials say.
    CheaperEdge {
        /// Output frame.
        t: usize,
        /// State to which the edge leads.
        state: usize,
    },
    /// A cheaper end than that of the plan exists.
    CheaperEnd,
    /// The step to this frame is no edge.
    Impossible(usize),
    /// Sum of the plan's steps, in turns, which is not the cost of the plan.
    Cost(u64),
}

/// Checks `potentials[t][state]` against every edge, and the path against the potentials.
/// `cost_at(t, state)` returns the cost of showing a state, in turns.
pub fn check(
    trellis: &Trellis,
    dwell: usize,
    cost_at: &dyn Fn(usize, usize) -> u32,
    potentials: &[Vec<u32>],
    path: &super::viterbi::Path,
) -> Result<(), Violation> {
    let edges = Edges {
        trellis,
        dwell,
        cost_at,
    };
    let cost = edges.cost_of_path(&path.states)?;
    if cost != u64::from(path.cost) {
        return Err(Violation::Cost(cost));
    }
    for state in (0..trellis.n_states()).filter(|&s| trellis.shown(s).is_some()) {
        if potentials[0][state] > cost_at(0, state) {
            return Err(Violation::CheaperEdge { t: 0, state });
        }
    }
    for t in 1..potentials.len() {
        edges.check_into(t, potentials, cost)?;
    }
    let last = potentials.len() - 1;
    let cheapest = potentials[last].iter().min();
    if cheapest.is_some_and(|&least| u64::from(least) < cost) {
        return Err(Violation::CheaperEnd);
    }
    Ok(())
}

struct Edges<'a> {
    trellis: &'a Trellis,
    dwell: usize,
    cost_at: &'a dyn Fn(usize, usize) -> u32,
}

impl Edges<'_> {
    /// Returns the sum of a path's steps, computed from its states.
    fn cost_of_path(&self, states: &[u32]) -> Result<u64, Violation> {
        let mut cost = u64::from((self.cost_at)(0, states[0] as usize));
        let mut since_jump = self.dwell;
        for t in 1..states.len() {
            let (from, to) = (states[t - 1], states[t]);
            cost += u64::from((self.cost_at)(t, to as usize));
            if self.trellis.continues(from as usize, 1) && from + 1 == to {
                since_jump += 1;
                continue;
            }
            let jump = self.jump(from, to).filter(|_| since_jump >= self.dwell);
            cost += u64::from(jump.ok_or(Violation::Impossible(t))?);
            since_jump = 1;
        }
        Ok(cost)
    }

    /// Checks that no edge that lands at frame `t` or continues into it offers less than the potentials.
    fn check_into(&self, t: usize, v: &[Vec<u32>], plan_cost: u64) -> Result<(), Violation> {
        for state in 0..self.trellis.n_states() {
            if self.trellis.continues(state, 1) {
                let offer = u64::from(v[t - 1][state]) + u64::from((self.cost_at)(t, state + 1));
                if offer < u64::from(v[t][state + 1]) {
                    let state = state + 1;
                    return Err(Violation::CheaperEdge { t, state });
                }
            }
        }
        for (k, &target) in self.trellis.targets().iter().enumerate() {
            for &(source, cost) in self.trellis.sources(k) {
                let landing = u64::from(v[t - 1][source as usize]) + u64::from(cost);
                self.check_run(t, target as usize, landing, v, plan_cost)?;
            }
        }
        Ok(())
    }

    /// Checks the forced run of `dwell` frames after a landing, or the part of it that lies in the film.
    fn check_run(
        &self,
        t: usize,
        target: usize,
        landing: u64,
        v: &[Vec<u32>],
        plan_cost: u64,
    ) -> Result<(), Violation> {
        let n = self.dwell.min(v.len() - t);
        if !self.trellis.continues(target, n - 1) {
            return Ok(());
        }
        let run: u64 = (0..n)
            .map(|k| u64::from((self.cost_at)(t + k, target + k)))
            .sum();
        let (t, state) = (t + n - 1, target + n - 1);
        if n == self.dwell && landing + run < u64::from(v[t][state]) {
            return Err(Violation::CheaperEdge { t, state });
        }
        if n < self.dwell && landing + run < plan_cost {
            return Err(Violation::CheaperEnd);
        }
        Ok(())
    }

    fn jump(&self, from: u32, to: u32) -> Option<u32> {
        let k = self.trellis.targets().binary_search(&to).ok()?;
        let sources = self.trellis.sources(k);
        let at = sources
            .binary_search_by_key(&from, |source| source.0)
            .ok()?;
        Some(sources[at].1)
    }
}
