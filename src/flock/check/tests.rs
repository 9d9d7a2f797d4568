//! Tests of the check: plans of the planner pass, and every way to corrupt them is found.

use super::*;
use crate::flock::{Params, plan_flock, synthetic};
use crate::geometry::{Turns, rounded};
use crate::library::View;
use crate::progress::Silent;

fn planned(view: View, preset: &str) -> (Library, Flock) {
    let library = synthetic::library(view);
    let params = Params {
        count: Some(4),
        frames: 90,
        ..Params::preset(preset).expect("a known preset")
    };
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    (library, flock)
}

fn red(library: &Library, flock: &Flock) -> Violation {
    check(library, flock, &Silent).expect_err("spoiled")
}

/// Returns the flock with the costs of individual `id` changed to the sums over its steps. Then only the
/// plan can be wrong.
fn with_honest_costs(library: &Library, mut flock: Flock, id: usize) -> Flock {
    for _ in 0..6 {
        let Err(Violation::Cost { part, found, .. }) = check(library, &flock, &Silent) else {
            break;
        };
        let cost = &mut flock.individuals[id].cost;
        let rad = rounded(found as f64 / Turns::PER_RAD, 6);
        match part {
            "cost.heading" => cost.heading = rad,
            "cost.speed" => cost.speed = rad,
            "cost.transition" => cost.transition = rad,
            "cost.crowd" => cost.crowd = rad,
            "cost.repetition" => cost.repetition = rad,
            _ => cost.total = rad,
        }
    }
    flock
}

#[test]
fn what_the_planner_makes_holds() {
    for (view, preset) in [
        (View::Side, "school"),
        (View::Top, "swarm"),
        (View::Side, "papers"),
    ] {
        let (library, flock) = planned(view, preset);
        let report = check(&library, &flock, &Silent).expect(preset);
        assert_eq!((report.n_individuals, report.n_frames), (4, 360));
        let jumps = flock.stats.jumps_per_100_frames * 3.6;
        assert!(
            (report.n_jumps as f64 - jumps).abs() < 0.1,
            "{jumps} {report:?}"
        );
        let jumps = library.playback.jumps.iter().filter(|jump| !jump.mirrored);
        let least = 4 * 89 * jumps.count() as u64;
        assert!(report.n_edges > least, "every edge of every frame");
    }
}

#[test]
fn what_jumps_back_cost_is_recomputed() {
    let library = synthetic::few_looks();
    let params = Params {
        count: Some(3),
        frames: 90,
        ..Params::default()
    };
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    check(&library, &flock, &Silent).expect("what the planner makes holds");
    let mut spoiled = flock.clone();
    assert!(
        flock.individuals[1].cost.repetition > 0.0,
        "so few frames cannot but come back"
    );
    spoiled.individuals[1].cost.repetition = 0.0;
    assert_eq!(red(&library, &spoiled).code(), "wrong_cost");
    let mut spoiled = flock;
    spoiled.params.matching.w_p = 0.1;
    assert_eq!(red(&library, &spoiled).code(), "wrong_cost");
}

#[test]
fn the_plan_of_every_segment_is_the_cheapest_from_where_it_begins() {
    for (view, w_p) in [(View::Side, 0.0), (View::Top, 0.0), (View::Side, 0.1)] {
        let library = synthetic::library(view);
        let mut params = Params {
            count: Some(5),
            frames: 100,
            ..Params::default()
        };
        params.matching.w_p = w_p;
        params.matching.segment_frames = Some(22);
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        let report = check(&library, &flock, &Silent).expect("what the planner makes holds");
        assert_eq!(report.n_individuals, 5);
        let mut spoiled = flock;
        spoiled.params.matching.segment_frames = Some(25);
        let code = red(&library, &spoiled).code();
        assert!(["wrong_cost", "not_cheapest"].contains(&code), "{code}");
    }
}

#[test]
fn a_step_that_the_library_does_not_know_is_named() {
    let (library, mut flock) = planned(View::Side, "school");
    let one = &mut flock.individuals[2];
    let far = (one.source_frame[40] + 1..).step_by(3);
    let lost = far.skip(3).find(|&to| {
        let ends = (one.source_frame[40], to);
        !library
            .playback
            .jumps
            .iter()
            .any(|jump| (jump.from, jump.to) == ends)
    });
    let lost = lost.expect("most are not").min(580);
    for (k, frame) in one.source_frame[41..].iter_mut().enumerate() {
        *frame = (lost + k as u32).min(590);
    }
    let violation = red(&library, &flock);
    assert_eq!(violation.code(), "illegal_step");
    assert!(
        violation
            .to_string()
            .starts_with("individual 2, frame 41: the step from source frame")
    );
}

#[test]
fn a_frame_outside_of_the_component_is_named() {
    let (library, mut flock) = planned(View::Side, "school");
    flock.individuals[1].source_frame[7] = 4_000_000;
    let sentence = "individual 1, frame 7: source frame 4000000 is not in the library's component";
    assert_eq!(red(&library, &flock).to_string(), sentence);
}

#[test]
fn a_mirror_image_needs_leave() {
    let (library, mut flock) = planned(View::Side, "papers");
    flock.individuals[0].mirrored[3] = true;
    assert_eq!(red(&library, &flock), Violation::Mirror { id: 0, t: 3 });
}

#[test]
fn a_longer_dwell_than_was_kept_is_missed() {
    let (library, mut flock) = planned(View::Side, "swarm");
    let least = (0..4).filter_map(|id| {
        let shown = |t: usize| {
            let one: &Individual = &flock.individuals[id];
            (one.source_frame[t], one.mirrored[t])
        };
        let is_jump = |&t: &usize| crate::flock::placement::is_jump(shown(t - 1), shown(t));
        let jumps: Vec<usize> = (1..90).filter(is_jump).collect();
        jumps.windows(2).map(|pair| pair[1] - pair[0]).min()
    });
    let least = least.min().expect("two jumps somewhere");
    assert!(least >= library.clip_frames);
    flock.params.dwell_frames = Some(least as u32 + 1);
    // Plans of earlier individuals meet the longer dwell too. A lower bound that is too low is no
    // violation.
    let violation = red(&library, &flock);
    let jumped = matches!(violation, Violation::Dwell { since, .. } if since == least);
    assert!(jumped, "{violation}");
}

#[test]
fn every_part_of_the_cost_is_recomputed() {
    let (library, flock) = planned(View::Side, "school");
    let turn = 1.0 / Turns::PER_RAD;
    type Part = fn(&mut crate::flock::PlanCost) -> &mut f64;
    let spoil: [(&str, Part); 6] = [
        ("cost.heading", |cost| &mut cost.heading),
        ("cost.speed", |cost| &mut cost.speed),
        ("cost.transition", |cost| &mut cost.transition),
        ("cost.crowd", |cost| &mut cost.crowd),
        ("cost.repetition", |cost| &mut cost.repetition),
        ("cost.total", |cost| &mut cost.total),
    ];
    for (name, of) in spoil {
        let mut spoiled = flock.clone();
        *of(&mut spoiled.individuals[3].cost) += turn;
        let violation = red(&library, &spoiled);
        let told = matches!(violation, Violation::Cost { id: 3, part, said, found } if part == name && said == found + 1);
        assert!(told, "{violation}");
        *of(&mut spoiled.individuals[3].cost) += 0.3 * turn;
        assert_eq!(red(&library, &spoiled).code(), "cost_not_whole", "{name}");
    }
}

#[test]
fn a_plan_that_could_be_cheaper_is_told_where_it_goes_wrong() {
    let (library, mut flock) = planned(View::Side, "school");
    // Mirrors all frames of the plan. Every step stays legal.
    let mirrored = &mut flock.individuals[3].mirrored;
    mirrored.iter_mut().for_each(|side| *side = !*side);
    let flock = with_honest_costs(&library, flock, 3);
    let violation = red(&library, &flock);
    let told = matches!(violation, Violation::Suboptimal { id: 3, t: 0, cost, cheapest } if cost > cheapest);
    assert!(told, "{violation}");
}

#[test]
fn a_jump_too_many_late_in_the_film_is_told_by_its_frame() {
    let (library, flock) = planned(View::Side, "school");
    // The last frame takes another jump, which is legal but seldom as cheap.
    let spoiled = (0..4).rev().find_map(|id| {
        let mut spoiled = flock.clone();
        let one = &mut spoiled.individuals[id];
        let (before, side) = (one.source_frame[88], one.mirrored[88]);
        let jump = library
            .playback
            .jumps
            .iter()
            .rev()
            .find(|jump| jump.from == before)?;
        (one.source_frame[89], one.mirrored[89]) = (jump.to, side != jump.mirrored);
        let spoiled = with_honest_costs(&library, spoiled, id);
        let violation = red(&library, &spoiled);
        matches!(violation, Violation::Suboptimal { .. }).then_some(violation)
    });
    let told = matches!(spoiled, Some(Violation::Suboptimal { t: 89, .. }));
    assert!(told, "{spoiled:?}");
}

#[test]
fn a_lower_bound_above_a_plan_is_none() {
    let (library, mut flock) = planned(View::Side, "school");
    flock.individuals[1].cost.lower_bound += 1.0 / Turns::PER_RAD;
    assert_eq!(red(&library, &flock).code(), "wrong_lower_bound");
}

#[test]
fn files_that_do_not_belong_together_are_told_first() {
    let (library, flock) = planned(View::Side, "school");
    let spoiled = |spoil: fn(&mut Flock)| {
        let mut flock = flock.clone();
        spoil(&mut flock);
        red(&library, &flock).code()
    };
    assert_eq!(spoiled(|flock| flock.fps = 25.0), "other_library");
    assert_eq!(spoiled(|flock| flock.individuals.swap(0, 1)), "wrong_order");
    assert_eq!(
        spoiled(|flock| flock.individuals.truncate(3)),
        "wrong_count"
    );
    assert_eq!(
        spoiled(|flock| flock.params.matching.wx = 9.0),
        "bad_params"
    );
    assert_eq!(
        spoiled(|flock| _ = flock.individuals[2].mirrored.pop()),
        "wrong_length"
    );
    // With a lower `wx`, plans with jumps cost less than the file says. Plans without jumps may no longer
    // be the cheapest.
    let cheaper_jumps = spoiled(|flock| flock.params.matching.wx = 0.4);
    assert!(["wrong_cost", "not_cheapest"].contains(&cheaper_jumps));
}

#[test]
fn a_loop_holds_and_a_seam_that_is_no_step_is_named() {
    let library = synthetic::library(View::Side);
    let params = Params {
        count: Some(4),
        frames: 90,
        is_loop: true,
        ..Params::default()
    };
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    let report = check(&library, &flock, &Silent).expect("what the planner makes holds");
    assert_eq!(report.n_individuals, 4);
    let mut spoiled = flock.clone();
    let heirs: Vec<Option<u32>> = flock.individuals.iter().map(|i| i.continues_as).collect();
    spoiled.individuals[0].continues_as = heirs[1];
    spoiled.individuals[1].continues_as = heirs[0];
    let code = red(&library, &spoiled).code();
    assert!(
        ["illegal_step", "wrong_cost", "dwell_too_short"].contains(&code),
        "{code}"
    );
    spoiled.individuals[1].continues_as = heirs[1];
    assert_eq!(red(&library, &spoiled), Violation::Heir { id: 1 });
    spoiled.individuals[1].continues_as = None;
    assert_eq!(red(&library, &spoiled), Violation::Heir { id: 1 });
    let mut spoiled = flock;
    spoiled.params.is_loop = false;
    assert_eq!(red(&library, &spoiled), Violation::Heir { id: 0 });
}
