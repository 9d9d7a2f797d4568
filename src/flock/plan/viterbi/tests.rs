//! Tests of exact plans: against all paths of small graphs, and against their certificates.

use proptest::prelude::*;

use std::sync::LazyLock;

use super::*;
use crate::flock::plan::certificate;
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

    fn film<'a>(&self, trellis: &'a Trellis, cpu: Level) -> Film<'a> {
        static SHELF: LazyLock<Shelf> = LazyLock::new(Shelf::default);
        Film {
            shelf: &SHELF,
            trellis,
            n_frames: self.n_frames,
            dwell: self.dwell,
            cpu,
        }
    }

    fn rows(&self) -> impl Rows + Clone + Send + Sync {
        |t: usize, state: usize| self.cost(t, state)
    }

    fn plan(&self) -> Option<Path> {
        self.plan_at(Level::detect(), self.n_frames)
    }

    fn plan_at(&self, cpu: Level, segment: usize) -> Option<Path> {
        let trellis = self.trellis();
        let film = self.film(&trellis, cpu);
        film.cheapest_path_by_segments(&self.rows(), segment)
    }

    fn check(&self, path: &Path) -> Result<(), certificate::Violation> {
        let trellis = self.trellis();
        let cost_at = |t: usize, state: usize| self.cost(t, state);
        let columns = self
            .film(&trellis, Level::detect())
            .potentials(&mut self.rows());
        certificate::check(&trellis, self.dwell, &cost_at, &columns, path)
    }

    /// Returns the least cost over all paths, by trying all of them.
    fn by_brute_force(&self) -> Option<u64> {
        let trellis = self.trellis();
        let states = 0..trellis.n_states();
        states
            .filter(|&state| trellis.shown(state).is_some())
            .filter_map(|state| self.cheapest_from(&trellis, 0, state, self.dwell))
            .min()
    }

    fn cheapest_from(&self, trellis: &Trellis, t: usize, state: usize, run: usize) -> Option<u64> {
        let here = u64::from(self.cost(t, state));
        if t + 1 == self.n_frames {
            return Some(here);
        }
        let mut best = None;
        let mut offer = |rest: Option<u64>, step: u32| {
            let cost = rest.map(|rest| here + rest + u64::from(step));
            best = [best, cost].into_iter().flatten().min();
        };
        if trellis.continues(state, 1) {
            offer(self.cheapest_from(trellis, t + 1, state + 1, run + 1), 0);
        }
        if run >= self.dwell {
            for (k, &target) in trellis.targets().iter().enumerate() {
                for &(source, cost) in trellis.sources(k) {
                    if source as usize == state {
                        offer(self.cheapest_from(trellis, t + 1, target as usize, 1), cost);
                    }
                }
            }
        }
        best
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
    fn no_path_that_begins_with_a_state_as_if_jumped_to_is_cheaper(case in case(7, 9)) {
        let trellis = case.trellis();
        let costs = case.film(&trellis, Level::detect()).costs_from(&mut case.rows());
        for (state, &found) in costs.iter().enumerate() {
            let is_shown = trellis.shown(state).is_some();
            let least = is_shown.then(|| case.cheapest_from(&trellis, 0, state, 1)).flatten();
            let found = (found < UNREACHED).then_some(u64::from(found));
            prop_assert_eq!(found, least, "{}", state);
        }
    }

    #[test]
    fn no_path_of_a_small_graph_is_cheaper(case in case(7, 9)) {
        let found = case.plan().map(|path| u64::from(path.cost));
        prop_assert_eq!(found, case.by_brute_force());
    }

    #[test]
    fn the_certificate_holds_for_the_plan(case in case(8, 9)) {
        if let Some(path) = case.plan() {
            prop_assert_eq!(case.check(&path), Ok(()));
        }
    }
}

proptest! {
    #[test]
    fn segments_and_instruction_sets_change_nothing(
        case in prop_oneof![case(8, 9), case(40, 200), long_case()], segment in 1usize..4
    ) {
        let whole = case.plan();
        for cpu in Level::available() {
            prop_assert_eq!(&case.plan_at(cpu, segment), &whole);
        }
        let trellis = case.trellis();
        let film = case.film(&trellis, Level::detect());
        let cost = whole.map(|path| path.cost);
        prop_assert_eq!(film.least_cost(&mut case.rows()), cost);
    }

    #[test]
    fn the_certificate_holds_for_a_plan_of_many_blocks(case in long_case()) {
        if let Some(path) = case.plan() {
            prop_assert_eq!(case.check(&path), Ok(()));
        }
    }

    #[test]
    fn another_jump_never_raises_the_cost(
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

    #[test]
    fn the_certificate_sees_a_plan_that_is_too_dear(case in case(8, 9)) {
        if let Some(mut path) = case.plan() {
            path.cost += 1;
            prop_assert!(case.check(&path).is_err());
        }
    }
}
