//! The exact plan against all paths of small graphs, and against its certificate.

use proptest::prelude::*;

use std::sync::LazyLock;

use super::*;
use crate::flock::plan::certificate;
use crate::library::{Jump, Playback};

/// A small playback graph, the costs of its states at every frame, and a dwell.
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
        Trellis::new(&self.playback, self.mirror, |d| d as u32)
    }

    /// What showing a state costs lane `lane`.
    fn cost(&self, t: usize, state: usize, lane: usize) -> u32 {
        self.costs[(t * 31 + state * 7 + lane * 3) % self.costs.len()]
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

    fn rows<const LANES: usize>(&self) -> impl Rows<LANES> + Clone + Send + Sync {
        |t: usize, first: usize, row: &mut [[u32; LANES]]| {
            for (state, out) in (first..).zip(row) {
                *out = std::array::from_fn(|lane| self.cost(t, state, lane));
            }
        }
    }

    fn plan<const LANES: usize>(&self) -> Option<[Path; LANES]> {
        self.plan_at(Level::detect(), self.n_frames)
    }

    fn plan_at<const LANES: usize>(&self, cpu: Level, segment: usize) -> Option<[Path; LANES]> {
        let trellis = self.trellis();
        let film = self.film(&trellis, cpu);
        film.cheapest_paths_by_segments(&self.rows(), segment)
    }

    fn check(&self, path: &Path) -> Result<(), certificate::Violation> {
        let trellis = self.trellis();
        let cost_at = |t: usize, state: usize| self.cost(t, state, 0);
        let columns = self
            .film(&trellis, Level::detect())
            .potentials(&mut self.rows());
        certificate::check(&trellis, self.dwell, &cost_at, &columns, path)
    }

    /// The least cost over all paths, by trying them all.
    fn by_brute_force(&self) -> Option<u64> {
        let trellis = self.trellis();
        let states = 0..trellis.n_states();
        states
            .filter(|&state| trellis.shown(state).is_some())
            .filter_map(|state| self.cheapest_from(&trellis, 0, state, self.dwell))
            .min()
    }

    fn cheapest_from(&self, trellis: &Trellis, t: usize, state: usize, run: usize) -> Option<u64> {
        let here = u64::from(self.cost(t, state, 0));
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
    fn case(most_frames: u32, most_jumps: usize)(
        n_states in 1u32..=most_frames,
        gap in prop::option::of(0u32..8),
        jumps in prop::collection::vec(
            (0..most_frames, 0..most_frames, 0u64..60, any::<bool>()), 0..most_jumps
        ),
        mirror in any::<bool>(),
        n_frames in 1usize..=7,
        dwell in 1usize..=4,
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

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, ..ProptestConfig::default() })]

    #[test]
    fn no_path_of_a_small_graph_is_cheaper(case in case(7, 9)) {
        let found = case.plan::<1>().map(|[path]| u64::from(path.cost));
        prop_assert_eq!(found, case.by_brute_force());
    }

    #[test]
    fn the_certificate_holds_for_the_plan(case in case(8, 9)) {
        if let Some([path]) = case.plan::<1>() {
            prop_assert_eq!(case.check(&path), Ok(()));
        }
    }
}

proptest! {
    #[test]
    fn lanes_segments_and_instruction_sets_change_nothing(
        case in prop_oneof![case(8, 9), case(40, 200)], segment in 1usize..4
    ) {
        let whole = case.plan::<8>();
        let first = whole.clone().map(|paths| [paths[0].clone()]);
        for cpu in Level::available() {
            prop_assert_eq!(&case.plan_at::<8>(cpu, segment), &whole);
            prop_assert_eq!(&case.plan_at::<1>(cpu, segment), &first);
        }
        let trellis = case.trellis();
        let film = case.film(&trellis, Level::detect());
        let costs = whole.map(|paths| paths.map(|path| path.cost));
        prop_assert_eq!(film.least_costs::<8>(&mut case.rows()), costs);
    }

    #[test]
    fn another_jump_never_raises_the_cost(
        case in case(8, 9), from in 0u32..8, to in 0u32..8, cost in 0u64..60
    ) {
        prop_assume!(to != from + 1);
        let mut more = case.clone();
        more.playback.jumps.push(Jump { from, to, cost, mirrored: false });
        more.playback.jumps.sort_unstable();
        if let (Some([before]), Some([after])) = (case.plan::<1>(), more.plan::<1>()) {
            prop_assert!(after.cost <= before.cost);
        }
    }

    #[test]
    fn the_certificate_sees_a_plan_that_is_too_dear(case in case(8, 9)) {
        if let Some([mut path]) = case.plan::<1>() {
            path.cost += 1;
            prop_assert!(case.check(&path).is_err());
        }
    }
}
