//! Tests of exact plans: against all paths of small graphs, and against the oracle of `check`.

use proptest::prelude::*;

use super::*;
use crate::flock::check::optimum::{Edge, Graph, NEVER};
use crate::library::{Jump, Playback};

/// Test case: a small playback graph, the costs of its states at every frame, and a dwell.
#[derive(Clone, Debug)]
struct Case {
    playback: Playback,
    mirror: bool,
    n_frames: usize,
    dwell: usize,
    costs: Vec<u32>,
}

impl Case {
    fn trellis(&self) -> Trellis {
        Trellis::new(&self.playback, self.mirror, |jump| jump.cost as u32)
    }

    /// Returns the cost of showing a state.
    fn cost(&self, t: usize, state: usize) -> u32 {
        self.costs[(t * 31 + state * 7) % self.costs.len()]
    }

    fn search<'a>(&self, trellis: &'a Trellis, cpu: Level) -> PathSearch<'a> {
        PathSearch {
            trellis,
            n_frames: self.n_frames,
            dwell: self.dwell,
            start: None,
            end: None,
            cpu,
        }
    }

    fn plan(&self) -> Option<Path> {
        self.plan_at(Level::detect(), self.n_frames)
    }

    fn plan_at(&self, cpu: Level, segment: usize) -> Option<Path> {
        let trellis = self.trellis();
        let search = self.search(&trellis, cpu);
        search.cheapest_path_by_segments(self, segment, &mut Vec::new())
    }

    /// Returns the least cost over all paths between two states, by trying all of them. The first counts as just
    /// jumped to.
    fn between(&self, first: usize, end: u32) -> Option<u64> {
        let trellis = self.trellis();
        let is_end = |state: usize| state == end as usize;
        self.cheapest_from(&trellis, (0, first, 1), &is_end)
    }

    /// Returns the least cost of a plan by the oracle of `flock::check`.
    fn by_oracle(&self) -> Option<u64> {
        let trellis = self.trellis();
        let n_states = trellis.n_states();
        let targets = trellis.targets().iter().enumerate();
        let jumps = targets.flat_map(|(k, &to)| {
            let sources = trellis.sources(k).iter();
            sources.map(move |&(from, cost)| Edge {
                from: from as usize,
                to: to as usize,
                cost: cost.into(),
            })
        });
        let next = |state: usize| trellis.continues(state, 1).then_some(state + 1);
        let graph = Graph {
            jumps: jumps.collect(),
            next: (0..n_states).map(next).collect(),
        };
        let cost = |t: usize, state: usize| match trellis.shown(state) {
            Some(_) => self.cost(t, state).into(),
            None => NEVER,
        };
        let state_costs = (0..self.n_frames).map(|t| (0..n_states).map(|s| cost(t, s)).collect());
        let starts: Vec<_> = (0..n_states).map(|state| (state, self.dwell)).collect();
        let least = graph.least_cost(self.dwell, &starts, state_costs);
        (least < NEVER).then_some(least)
    }

    /// Returns the cost of a path, summed step by step. `None` if a step is not allowed.
    fn cost_of(&self, path: &Path) -> Option<u64> {
        let trellis = self.trellis();
        let mut cost = u64::from(self.cost(0, path.states[0] as usize));
        let mut since_jump = self.dwell;
        for (t, step) in (1..).zip(path.states.windows(2)) {
            let [from, to] = [step[0], step[1]];
            cost += u64::from(self.cost(t, to as usize));
            if trellis.continues(from as usize, 1) && from + 1 == to {
                since_jump += 1;
                continue;
            }
            let k = trellis.targets().binary_search(&to).ok()?;
            let jump = trellis.sources(k).iter().find(|source| source.0 == from);
            cost += u64::from(jump.filter(|_| since_jump >= self.dwell)?.1);
            since_jump = 1;
        }
        Some(cost)
    }

    /// Returns the least cost over all paths, by trying all of them.
    fn by_brute_force(&self) -> Option<u64> {
        let trellis = self.trellis();
        let states = 0..trellis.n_states();
        states
            .filter(|&state| trellis.shown(state).is_some())
            .filter_map(|state| self.cheapest_from(&trellis, (0, state, self.dwell), &|_| true))
            .min()
    }

    /// Returns the least cost from a state on at a frame, `run` frames after a jump.
    fn cheapest_from(
        &self,
        trellis: &Trellis,
        (t, state, run): (usize, usize, usize),
        is_end: &impl Fn(usize) -> bool,
    ) -> Option<u64> {
        let here = u64::from(self.cost(t, state));
        if t + 1 == self.n_frames {
            return is_end(state).then_some(here);
        }
        let mut best = None;
        let mut offer = |rest: Option<u64>, step: u32| {
            let cost = rest.map(|rest| here + rest + u64::from(step));
            best = [best, cost].into_iter().flatten().min();
        };
        if trellis.continues(state, 1) {
            offer(
                self.cheapest_from(trellis, (t + 1, state + 1, run + 1), is_end),
                0,
            );
        }
        if run >= self.dwell {
            for (k, &target) in trellis.targets().iter().enumerate() {
                for &(source, cost) in trellis.sources(k) {
                    if source as usize == state {
                        offer(
                            self.cheapest_from(trellis, (t + 1, target as usize, 1), is_end),
                            cost,
                        );
                    }
                }
            }
        }
        best
    }
}

impl StateCosts for Case {
    fn fill(&self, t: usize, out: &mut [u32]) {
        (out.iter_mut().enumerate()).for_each(|(state, out)| *out = self.cost(t, state));
    }

    fn at(&self, t: usize, state: usize) -> u32 {
        self.cost(t, state)
    }
}

prop_compose! {
    fn case_of(most_frames: u32, most_jumps: usize, film_frames: usize, most_dwell: usize)(
        n_states in 1u32..=most_frames,
        gap in prop::option::of(0u32..8),
        jumps in prop::collection::vec(
            (0..most_frames, 0..most_frames, 0u64..60, any::<bool>()), 0..most_jumps
        ),
        mirror in any::<bool>(),
        n_frames in 1..=film_frames,
        dwell in 1..=most_dwell,
        costs in prop::collection::vec(0u32..100, 1..60),
    ) -> Case {
        let component: Vec<u32> = (0..n_states).filter(|&f| Some(f) != gap).collect();
        let mut jumps: Vec<Jump> = jumps
            .into_iter()
            .map(|(from, to, cost, mirrored)| Jump { from, to, cost, mirrored })
            .filter(|jump| jump.mirrored || jump.to != jump.from + 1)
            .collect();
        jumps.sort_unstable();
        Case { playback: Playback { jumps, component }, mirror, n_frames, dwell, costs }
    }
}

/// Generates short films, whose blocks have few frames.
fn case(most_frames: u32, most_jumps: usize) -> impl Strategy<Value = Case> {
    case_of(most_frames, most_jumps, 7, 4)
}

/// Generates films of several blocks. Runs after a jump may end anywhere in a block.
fn long_case() -> impl Strategy<Value = Case> {
    case_of(60, 120, 70, 20)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, ..ProptestConfig::default() })]

    #[test]
    fn path_between_two_states_is_the_cheapest(mut case in case(7, 9), ends in any::<[usize; 2]>()) {
        case.n_frames = case.n_frames.max(case.dwell + 1);
        let trellis = case.trellis();
        let n_states = trellis.n_states();
        let shown: Vec<usize> = (0..n_states).filter(|&state| trellis.shown(state).is_some()).collect();
        prop_assume!(!shown.is_empty());
        let [first, end] = ends.map(|k| shown[k % shown.len()]);
        let end = end as u32;
        let mut start = vec![FORBIDDEN; n_states];
        start[first] = 0;
        let search = PathSearch { start: Some(&start), ..case.search(&trellis, Level::detect()) };
        let least = case.between(first, end);
        let to = search.costs_to(&case)[end as usize];
        prop_assert_eq!((to < UNREACHED).then_some(u64::from(to)), least);
        let path = PathSearch { end: Some(end), ..search }.cheapest_path(&case, &mut Vec::new());
        prop_assert_eq!(path.as_ref().map(|path| u64::from(path.cost)), least);
        if let Some(path) = path {
            let ends = [path.states.first(), path.states.last()];
            prop_assert_eq!(ends, [Some(&(first as u32)), Some(&end)]);
        }
    }

    #[test]
    fn path_of_a_small_graph_is_the_cheapest(case in case(7, 9)) {
        let found = case.plan().map(|path| u64::from(path.cost));
        prop_assert_eq!(found, case.by_brute_force());
    }

    #[test]
    fn plan_costs_what_the_oracle_says(case in prop_oneof![case(8, 9), long_case()]) {
        let path = case.plan();
        prop_assert_eq!(path.as_ref().map(|path| u64::from(path.cost)), case.by_oracle());
        if let Some(path) = path {
            prop_assert_eq!(case.cost_of(&path), Some(u64::from(path.cost)));
        }
    }
}

proptest! {
    #[test]
    fn path_is_equal_for_all_segments_and_instruction_sets(
        case in prop_oneof![case(8, 9), case(40, 200), long_case()], segment in 1usize..4
    ) {
        let whole = case.plan();
        for cpu in Level::available() {
            prop_assert_eq!(&case.plan_at(cpu, segment), &whole);
        }
        let trellis = case.trellis();
        let search = case.search(&trellis, Level::detect());
        let cost = whole.map(|path| path.cost);
        prop_assert_eq!(search.least_cost(&case), cost);
    }

    #[test]
    fn additional_jump_never_raises_the_cost(
        case in case(8, 9), from in 0u32..8, to in 0u32..8, cost in 0u64..60
    ) {
        prop_assume!(to != from + 1);
        let mut more = case.clone();
        more.playback.jumps.push(Jump { from, to, cost, mirrored: false });
        more.playback.jumps.sort_unstable();
        if let (Some(before), Some(after)) = (case.plan(), more.plan()) {
            prop_assert!(after.cost <= before.cost);
        }
    }
}
