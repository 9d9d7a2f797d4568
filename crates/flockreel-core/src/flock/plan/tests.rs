//! Tests of plans of whole flocks, against the independent check and against all paths.

use super::*;
use crate::flock::check::check;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::flock::params::{MatchBy, Matching, Position};
use crate::flock::synthetic;
use crate::flock::{Flock, PlanCost, plan_flock};
use crate::geometry::Turns;
use crate::library::View;
use crate::parameters::Parameters;
use crate::progress::Silent;

/// Returns a flock of the named preset. `position` is a school matched by position.
fn flock(view: View, name: &str) -> (Library, Flock) {
    let library = synthetic::library(view);
    let (preset, by) = match name {
        "position" => ("school", MatchBy::Position),
        name => (name, MatchBy::Heading),
    };
    let mut params = Params {
        count: Some(10),
        frames: 120,
        ..Params::preset(preset).expect("a known preset")
    };
    params.matching.by = by;
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    (library, flock)
}

#[test]
fn plans_read_from_their_file_pass_the_check() {
    for (view, name) in [
        (View::Side, "school"),
        (View::Top, "swarm"),
        (View::Side, "papers"),
        (View::Side, "position"),
        (View::Top, "position"),
    ] {
        let (library, flock) = flock(view, name);
        let bytes = crate::formats::flock_json::write(&flock);
        let flock = crate::formats::flock_json::read(&bytes).unwrap();
        check(&library, &flock, &Silent).expect(name);
        for individual in &flock.individuals {
            let cost = individual.cost;
            let parts = cost.heading + cost.speed + cost.transition + cost.crowd + cost.repetition;
            assert!((parts - cost.total).abs() < 1e-5);
            assert!(cost.lower_bound <= cost.total);
        }
    }
}

#[test]
fn part_of_the_cost_without_its_weight_is_zero() {
    type Disable = fn(&mut Matching);
    type Part = fn(&PlanCost) -> f64;
    let library = synthetic::library(View::Side);
    let parts: [(Disable, Part); 5] = [
        (|m| (m.w_h, m.w_r) = (0.0, 0.0), |cost| cost.heading),
        (|m| m.w_v = 0.0, |cost| cost.speed),
        (|m| m.wx = 0.0, |cost| cost.transition),
        (|m| m.w_c = 0.0, |cost| cost.crowd),
        (|m| m.w_p = 0.0, |cost| cost.repetition),
    ];
    for (idx, (disable, part)) in parts.into_iter().enumerate() {
        let mut params = Params {
            count: Some(4),
            frames: 60,
            ..Params::default()
        };
        disable(&mut params.matching);
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        let costs = flock.individuals.iter().map(|one| part(&one.cost));
        assert_eq!(costs.sum::<f64>(), 0.0, "part {idx}");
        let totals = flock.individuals.iter().map(|one| one.cost.total);
        assert!(totals.sum::<f64>() > 0.0, "part {idx}");
    }
}

/// Returns the least cost of all paths of the first individual, in turns, by trying all of them. Outside of a
/// loop a path begins with any state and then plays on or jumps.
fn least_by_brute_force(planner: &Planner, path: &mut Vec<u32>) -> u32 {
    let ends = planner.ends.first();
    if path.len() == planner.places.len() + planner.ends.len() {
        if ends.is_some_and(|ends| path.last() != Some(&ends.next)) {
            return u32::MAX;
        }
        let wanted = &planner.wanted[0][..];
        let costs = IndividualCosts {
            planner,
            wanted,
            among: None,
        };
        let shown = path
            .iter()
            .enumerate()
            .map(|(t, &state)| costs.at(t, state as usize))
            .sum::<u32>();
        let path = Path {
            states: path.clone(),
            cost: 0,
        };
        return shown + planner.jump_costs(&path)[0];
    }
    let trellis = &planner.model.trellis;
    let states = 0..trellis.n_states() as u32;
    let shown = states.filter(|&state| trellis.shown(state as usize).is_some());
    let since_jump = (path.iter().rev().zip(path.iter().rev().skip(1)))
        .position(|(&now, &before)| now != before + 1)
        .map_or(usize::MAX, |k| k + 1);
    let since_jump = match ends {
        Some(_) => since_jump.min(path.len()),
        None => since_jump,
    };
    let next: Vec<u32> = match path.last() {
        None => ends.map_or_else(|| shown.collect(), |ends| vec![ends.first]),
        Some(&last) => {
            let jumps = shown.filter(|&state| {
                let k = trellis.targets().binary_search(&state);
                since_jump >= planner.model.dwell
                    && k.is_ok_and(|k| trellis.sources(k).iter().any(|s| s.0 == last))
            });
            let on = trellis.continues(last as usize, 1).then_some(last + 1);
            jumps.chain(on).collect()
        }
    };
    let least = next.into_iter().map(|state| {
        path.push(state);
        let least = least_by_brute_force(planner, path);
        path.pop();
        least
    });
    least.min().unwrap_or(u32::MAX)
}

#[test]
fn plan_is_the_cheapest_and_the_jump_back_cost_reduces_repeats() {
    let library = synthetic::few_looks();
    let mut params = Params {
        count: Some(1),
        frames: 32,
        position: Position::Leash,
        ..Params::default()
    };
    let [mut n_again, mut n_again_for_nothing] = [0.0; 2];
    for seed in 0..60 {
        params.seed = seed;
        params.matching.w_p = 0.0;
        let unaware = plan_flock(&library, &params, &Silent).unwrap();
        params.matching.w_p = 0.15;
        let aware = plan_flock(&library, &params, &Silent).unwrap();
        let boids = [aware.individuals[0].boid.clone()];
        let motion = motion_of(&library, &Lens::new(&library, &aware.params));
        let model = Model::new(&library, &motion, &aware.params);
        let planner = Planner::new(&model, &boids);
        let least = least_by_brute_force(&planner, &mut Vec::new());
        let stored = (aware.individuals[0].cost.total * Turns::PER_RAD).round() as u32;
        assert_eq!(stored, least, "seed {seed}");
        n_again += aware.stats.repeats_per_100_frames;
        n_again_for_nothing += unaware.stats.repeats_per_100_frames;
    }
    assert!(
        n_again < 0.8 * n_again_for_nothing,
        "{n_again} of {n_again_for_nothing}"
    );
}

#[test]
fn loop_plan_is_the_cheapest_that_leads_to_its_continuation() {
    let library = synthetic::few_looks();
    for seed in 0..16 {
        let params = Params {
            count: Some(1),
            // Most cycles of this library are multiples of ten frames long.
            frames: 30 + 10 * (seed as u32 % 2),
            seed,
            is_loop: true,
            dwell_frames: Some(1 + seed as u32 % 4),
            ..Params::default()
        };
        let flock = plan_flock(&library, &params, &Silent).unwrap();
        let one = &flock.individuals[0];
        let boids = [one.boid.clone()];
        let motion = motion_of(&library, &Lens::new(&library, &flock.params));
        let model = Model::new(&library, &motion, &flock.params);
        let mut planner = Planner::new(&model, &boids);
        let own = (one.source_frame[0], one.mirrored[0]);
        // Frame 200 is the first of the component: only jumps lead to it.
        for (frame, side) in [own, (200, false)] {
            let first = planner.model.trellis.state(frame, side);
            let first = first.expect("a frame of the component");
            planner.ends = vec![LoopEnds { first, next: first }];
            let found = planner.paths(&Silent).unwrap();
            let least = least_by_brute_force(&planner, &mut Vec::new());
            assert_eq!(found[0].cost, least, "seed {seed}");
            if (frame, side) == own {
                let stored = (one.cost.total * Turns::PER_RAD).round() as u32;
                assert_eq!(stored, least, "seed {seed}");
            }
        }
    }
}

#[test]
fn loop_closes_if_any_plan_of_its_length_returns() {
    let library = synthetic::few_looks();
    let plan = |count, frames, seed| {
        let params = Params {
            count: Some(count),
            frames,
            seed,
            is_loop: true,
            ..Params::default()
        };
        plan_flock(&library, &params, &Silent)
    };
    for seed in 0..16 {
        // Cycles of playback take 10 or 20 frames. A cycle of 24 frames changes the mirror side, and one of
        // 10 frames can change it back.
        for frames in [30, 34, 40, 44, 48, 54] {
            let flock = plan(1 + seed as u32 % 3, frames, seed);
            assert!(flock.is_ok(), "{frames} frames, seed {seed}: {flock:?}");
        }
        for frames in [31, 35, 42, 46] {
            let flock = plan(1, frames, seed);
            assert!(matches!(flock, Err(Error::LoopDoesNotClose(_))), "{frames}");
        }
    }
}

#[test]
fn jumps_are_at_least_the_dwell_apart() {
    let (library, flock) = flock(View::Side, "swarm");
    for individual in &flock.individuals {
        let shown: Vec<(u32, bool)> = individual
            .source_frame
            .iter()
            .copied()
            .zip(individual.mirrored.iter().copied())
            .collect();
        let jumps: Vec<usize> = (1..shown.len())
            .filter(|&t| shown[t] != (shown[t - 1].0 + 1, shown[t - 1].1))
            .collect();
        let dwell = library.clip_frames;
        assert!(
            jumps.windows(2).all(|pair| pair[1] - pair[0] >= dwell),
            "{jumps:?}"
        );
    }
}

#[test]
fn matching_by_position_follows_boid_velocities_better_than_by_heading() {
    let gap = |by: MatchBy| {
        let library = synthetic::library(View::Side);
        let mut params = Params {
            count: Some(10),
            frames: 120,
            position: Position::Boid,
            ..Params::default()
        };
        (params.matching.by, params.matching.w_v) = (by, 0.1);
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        let motion = motion_of(&library, &Lens::new(&library, &flock.params));
        let gaps = flock.individuals.iter().flat_map(|individual| {
            (0..individual.source_frame.len()).map(|t| {
                let [x, y] = motion[individual.source_frame[t] as usize].velocity_bl_per_s;
                let x = if individual.mirrored[t] { -x } else { x };
                let (boid, speed) = (
                    individual.boid.heading_rad[t],
                    individual.boid.speed_bl_per_s[t],
                );
                (x - speed * libm::cos(boid)).abs() + (y - speed * libm::sin(boid)).abs()
            })
        });
        gaps.sum::<f64>()
    };
    let (by_place, by_heading) = (gap(MatchBy::Position), gap(MatchBy::Heading));
    assert!(by_place < by_heading, "{by_place} {by_heading}");
}

#[test]
fn individuals_of_later_rounds_watch_all_rounds_before() {
    let crowd = Crowd::new(0.3, 30.0, 40.0);
    assert_eq!([0, 1, 63].map(|id| crowd.n_watched(id)), [0, 1, 63]);
    let later = [64, 79, 80, 95, 96].map(|id| crowd.n_watched(id));
    assert_eq!(later, [64, 64, 80, 80, 96]);
    let indifferent = Crowd::new(0.0, 30.0, 40.0);
    assert_eq!([1, 63, 80].map(|id| indifferent.n_watched(id)), [0; 3]);
}

#[test]
fn large_flock_has_the_same_plans_for_any_number_of_threads() {
    let library = synthetic::library(View::Side);
    let params = Params {
        count: Some(90),
        frames: 40,
        ..Params::default()
    };
    let planned = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| plan_flock(&library, &params, &Silent))
            .unwrap()
    };
    let flock = planned(1);
    assert_eq!(flock, planned(3));
    check(&library, &flock, &Silent).expect("what the planner makes holds");
}
