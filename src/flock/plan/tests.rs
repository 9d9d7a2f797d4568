//! Plans of whole flocks: their certificates, and their cost told from the outside.

use super::*;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::flock::params::MatchBy;
use crate::flock::plan::viterbi::Rows;
use crate::flock::synthetic;
use crate::flock::{Flock, plan_flock};
use crate::library::View;
use crate::progress::Silent;

/// By a preset's name, or a school matched by what is named.
fn flock(view: View, name: &str) -> (Library, Flock) {
    let library = synthetic::library(view);
    let (preset, by) = match name {
        "heading" => ("school", Some(MatchBy::Heading)),
        "position" => ("school", Some(MatchBy::Position)),
        name => (name, None),
    };
    let mut params = Params {
        count: 10,
        frames: 120,
        ..Params::preset(preset).expect("a known preset")
    };
    params.matching.by = by.or(params.matching.by);
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    (library, flock)
}

/// J of one individual by the words of ALGORITHMS.md 6, in turns, from what the files hold.
fn cost_from_outside(library: &Library, flock: &Flock, id: usize) -> u32 {
    let motion = motion_of(library, &Lens::of(library, &flock.params));
    let weights = Weights::new(&flock.params.matching, library);
    let crowd = Crowd::new(flock.params.matching.w_c, flock.fps, flock.length_px);
    let trellis = Trellis::new(&library.playback, flock.params.mirror, |_| 0);
    let features = weights.features(&trellis, &motion);
    let individual = &flock.individuals[id];
    let boid = &individual.boid;
    let wanted = weights.wanted(boid, flock.fps);
    let state = |i: usize, t: usize| {
        let other = &flock.individuals[i];
        trellis
            .state(other.source_frame[t], other.mirrored[t])
            .expect("a frame of the component")
    };
    let states: Vec<Vec<u32>> = (0..crowd.n_watched(id))
        .map(|i| (0..wanted.len()).map(|t| state(i, t)).collect())
        .collect();
    let mut total = 0;
    for (t, &wanted) in wanted.iter().enumerate() {
        let here = state(id, t);
        total += weights.total(wanted, features[here as usize]);
        let others = flock.individuals.iter().map(|i| &i.boid);
        let others = others.zip(states.iter().map(Vec::as_slice));
        let near = crowd.lookalikes(boid, others, t);
        total += crowd.cost_of(&trellis, &near, here);
        if t > 0 && state(id, t - 1) + 1 != here {
            let (from, to) = (individual.source_frame[t - 1], individual.source_frame[t]);
            let turned = individual.mirrored[t - 1] != individual.mirrored[t];
            let jumps = library.playback.jumps.iter();
            let mut jumps = jumps.filter(|j| (j.from, j.to, j.mirrored) == (from, to, turned));
            let jump = jumps.next().expect("a jump of the library");
            total += weights.of_jump(jump.cost, library.epsilon);
        }
    }
    total
}

#[test]
fn the_cost_recomputed_from_the_file_and_the_library_is_the_one_told() {
    for (view, name) in [
        (View::Side, "school"),
        (View::Top, "swarm"),
        (View::Side, "papers"),
        (View::Side, "position"),
    ] {
        let (library, flock) = flock(view, name);
        let bytes = crate::formats::flock_json::write(&flock);
        let flock = crate::formats::flock_json::read(&bytes).unwrap();
        for (id, individual) in flock.individuals.iter().enumerate() {
            let cost = individual.cost;
            let told = (cost.total * Turns::PER_RAD).round() as u32;
            assert_eq!(cost_from_outside(&library, &flock, id), told, "{name} {id}");
            let parts = cost.heading + cost.speed + cost.transition + cost.crowd;
            assert!((parts - cost.total).abs() < 1e-5);
            assert!(cost.lower_bound <= cost.total);
        }
    }
}

#[test]
fn the_plans_of_a_flock_hold_their_certificates() {
    let (library, flock) = flock(View::Side, "school");
    let boids: Vec<BoidTrack> = flock.individuals.iter().map(|i| i.boid.clone()).collect();
    let motion = motion_of(&library, &Lens::of(&library, &flock.params));
    let planner = Planner::new(&library, &motion, &boids, &flock.params);
    let mut settled = Settled::new(boids[0].heading_rad.len());
    for (id, boid) in boids.iter().enumerate() {
        let wanted = planner.weights.wanted(boid, planner.fps);
        let rows = || rows::InCrowd::new(&planner, &settled, [id], [&wanted]);
        let film = planner.film();
        let [path] = film.cheapest_paths(&rows()).unwrap();
        let columns = film.potentials(&mut rows());
        let (mut rows, n_states) = (rows(), planner.trellis.n_states());
        let costs: Vec<Vec<[u32; 1]>> = (0..wanted.len())
            .map(|t| {
                let mut row = vec![[0]; n_states];
                rows.fill(t, 0, &mut row);
                row
            })
            .collect();
        let cost_at = |t: usize, state: usize| costs[t][state][0];
        let checked =
            certificate::check(&planner.trellis, planner.dwell, &cost_at, &columns, &path);
        assert_eq!(checked, Ok(()), "individual {id}");
        settled.push(&path.states);
    }
}

#[test]
fn after_a_jump_at_least_the_dwell_is_played() {
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
fn matched_by_place_frames_move_more_as_the_boids_do_than_matched_by_heading() {
    let gap = |name: &str| {
        let (library, flock) = flock(View::Side, name);
        let motion = motion_of(&library, &Lens::of(&library, &flock.params));
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
    let (by_place, by_heading) = (gap("position"), gap("heading"));
    assert!(by_place < by_heading, "{by_place} {by_heading}");
}

#[test]
fn whoever_is_in_a_later_round_looks_out_for_all_rounds_before() {
    let crowd = Crowd::new(0.3, 30.0, 40.0);
    assert_eq!([0, 1, 63].map(|id| crowd.n_watched(id)), [0, 1, 63]);
    let later = [64, 79, 80, 95, 96].map(|id| crowd.n_watched(id));
    assert_eq!(later, [64, 64, 80, 80, 96]);
    let indifferent = Crowd::new(0.0, 30.0, 40.0);
    assert_eq!([1, 63, 80].map(|id| indifferent.n_watched(id)), [0; 3]);
}

#[test]
fn a_large_flock_has_the_same_plans_for_any_number_of_threads_and_its_costs_add_up() {
    let library = synthetic::library(View::Side);
    let params = Params {
        count: 90,
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
    for id in [63, 64, 79, 80, 89] {
        let told = (flock.individuals[id].cost.total * Turns::PER_RAD).round() as u32;
        assert_eq!(cost_from_outside(&library, &flock, id), told, "{id}");
    }
}
