//! Tests of the check: plans of the planner pass, and every way to corrupt them is found.

use super::*;
use crate::flock::{Params, PlanCost, plan_flock, synthetic};
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

/// Returns an exact flock: its plans weigh no places.
fn exact(view: View, preset: &str) -> (Library, Flock) {
    let library = synthetic::library(view);
    let params = Params {
        count: Some(4),
        frames: 90,
        position: Position::Leash,
        ..Params::preset(preset).expect("a known preset")
    };
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    (library, flock)
}

fn violation_of(library: &Library, flock: &Flock) -> Violation {
    check(library, flock, &Silent).expect_err("spoiled")
}

#[test]
fn plans_of_the_planner_pass() {
    for (view, preset) in [
        (View::Side, "school"),
        (View::Top, "swarm"),
        (View::Side, "papers"),
    ] {
        let (library, flock) = planned(view, preset);
        let n_jumps = check(&library, &flock, &Silent).expect(preset);
        let jumps = flock.stats.jumps_per_100_frames * 3.6;
        assert!((n_jumps as f64 - jumps).abs() < 0.1, "{jumps} {n_jumps}");
        assert_eq!(flock.individuals[0].cost.exact, preset == "papers");
    }
    for view in [View::Side, View::Top] {
        let (library, flock) = exact(view, "school");
        check(&library, &flock, &Silent).expect("what the planner makes holds");
    }
}

#[test]
fn cost_of_jumps_back_is_recomputed() {
    let library = synthetic::few_looks();
    let params = Params {
        count: Some(3),
        frames: 90,
        position: Position::Leash,
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
    assert_eq!(violation_of(&library, &spoiled).code, "wrong_cost");
    let mut spoiled = flock;
    spoiled.params.matching.w_p = 0.1;
    let code = violation_of(&library, &spoiled).code;
    assert!(["wrong_cost", "not_cheapest"].contains(&code), "{code}");
}

#[test]
fn plans_of_short_segments_pass() {
    for (view, w_p) in [(View::Top, 0.0), (View::Top, 0.1)] {
        let library = synthetic::library(view);
        let mut params = Params {
            count: Some(5),
            frames: 100,
            ..Params::default()
        };
        params.matching.w_p = w_p;
        params.matching.segment_frames = Some(22);
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        check(&library, &flock, &Silent).expect("what the planner makes holds");
        let mut spoiled = flock;
        spoiled.params.matching.segment_frames = Some(25);
        // Turns are measured within a segment.
        assert_eq!(violation_of(&library, &spoiled).code, "wrong_cost");
    }
}

#[test]
fn a_plan_that_claims_to_be_exact_must_be_the_cheapest() {
    let (library, mut flock) = planned(View::Side, "school");
    let lies = |one: &mut Individual| one.cost.exact = true;
    flock.individuals.iter_mut().for_each(lies);
    assert_eq!(violation_of(&library, &flock).code, "not_cheapest");
    let (library, mut flock) = exact(View::Side, "school");
    flock.individuals[2].cost.exact = false;
    let violation = violation_of(&library, &flock);
    assert_eq!(violation.message, "individual 2: the plan is not exact");
}

#[test]
fn step_unknown_to_the_library_is_refused() {
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
    let violation = violation_of(&library, &flock);
    assert_eq!(violation.code, "illegal_step");
    let sentence = "individual 2, frame 41: source frame ";
    assert!(violation.message.starts_with(sentence), "{violation}");
}

#[test]
fn frame_outside_of_the_component_is_refused() {
    let (library, mut flock) = planned(View::Side, "school");
    flock.individuals[1].source_frame[7] = 4_000_000;
    assert_eq!(violation_of(&library, &flock).code, "other_library");
    flock.individuals[1].source_frame[7] = 0;
    assert!(!library.playback.component.contains(&0));
    let violation = violation_of(&library, &flock);
    assert_eq!(violation.code, "outside_component");
    let sentence = "individual 1, frame 7: source frame 0 is not playable";
    assert!(violation.message.starts_with(sentence), "{violation}");
}

#[test]
fn mirrored_frame_is_refused_without_mirror() {
    let (library, mut flock) = planned(View::Side, "papers");
    flock.individuals[0].mirrored[3] = true;
    assert_eq!(violation_of(&library, &flock).code, "outside_component");
}

#[test]
fn jump_before_the_dwell_is_refused() {
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
    let violation = violation_of(&library, &flock);
    assert_eq!(violation.code, "dwell_too_short");
    let sentence = format!("comes {least} frames after the last jump");
    assert!(violation.message.contains(&sentence), "{violation}");
}

#[test]
fn wrong_costs_are_refused() {
    let (library, flock) = planned(View::Side, "school");
    let spoil: [fn(&mut PlanCost) -> &mut f64; 2] =
        [|cost| &mut cost.heading, |cost| &mut cost.total];
    for cost in spoil {
        let mut spoiled = flock.clone();
        *cost(&mut spoiled.individuals[3].cost) += 1.0 / Turns::PER_RAD;
        let violation = violation_of(&library, &spoiled);
        assert_eq!(violation.code, "wrong_cost");
        assert!(
            violation.message.starts_with("individual 3: "),
            "{violation}"
        );
    }
}

#[test]
fn a_plan_that_is_not_the_cheapest_is_refused() {
    let (library, mut flock) = exact(View::Side, "school");
    // Mirrors all frames of the plan. Every step stays legal.
    let mirrored = &mut flock.individuals[3].mirrored;
    mirrored.iter_mut().for_each(|side| *side = !*side);
    let violation = violation_of(&library, &flock);
    assert_eq!(violation.code, "not_cheapest");
    let sentence = "individual 3, from frame 0 on: ";
    assert!(violation.message.starts_with(sentence), "{violation}");
}

#[test]
fn a_costly_jump_in_the_last_frame_is_refused() {
    let (library, flock) = exact(View::Side, "school");
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
        let violation = violation_of(&library, &spoiled);
        (violation.code == "not_cheapest").then_some(violation)
    });
    assert!(spoiled.is_some());
}

#[test]
fn lower_bound_above_a_plan_is_refused() {
    let (library, mut flock) = exact(View::Side, "school");
    flock.individuals[1].cost.lower_bound += 1.0 / Turns::PER_RAD;
    assert_eq!(violation_of(&library, &flock).code, "wrong_lower_bound");
}

#[test]
fn plans_matched_by_direction_are_not_checked() {
    let (library, mut flock) = planned(View::Side, "school");
    flock.params.matching.by = MatchBy::Direction;
    assert_eq!(violation_of(&library, &flock).code, "not_checked");
}

#[test]
fn files_that_do_not_belong_together_are_refused() {
    let (library, flock) = planned(View::Side, "school");
    let spoiled = |spoil: fn(&mut Flock)| {
        let mut flock = flock.clone();
        spoil(&mut flock);
        violation_of(&library, &flock).code
    };
    assert_eq!(spoiled(|flock| flock.fps = 25.0), "other_library");
    let swap = |flock: &mut Flock| flock.individuals.swap(0, 1);
    assert_eq!(spoiled(swap), "other_library");
    let truncate = |flock: &mut Flock| flock.individuals.truncate(3);
    assert_eq!(spoiled(truncate), "other_library");
    assert_eq!(
        spoiled(|flock| flock.params.matching.wx = 9.0),
        "bad_params"
    );
    assert_eq!(
        spoiled(|flock| _ = flock.individuals[2].mirrored.pop()),
        "other_library"
    );
    // With a lower `wx`, plans with jumps cost less than the file says. Plans without jumps may no longer
    // be the cheapest.
    let cheaper_jumps = spoiled(|flock| flock.params.matching.wx = 0.4);
    assert!(["wrong_cost", "not_cheapest"].contains(&cheaper_jumps));
}

#[test]
fn loop_passes_and_wrong_continuations_are_refused() {
    let library = synthetic::library(View::Side);
    let params = Params {
        count: Some(4),
        frames: 90,
        is_loop: true,
        ..Params::default()
    };
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    check(&library, &flock, &Silent).expect("what the planner makes holds");
    let mut spoiled = flock.clone();
    let continuations: Vec<Option<u32>> =
        flock.individuals.iter().map(|i| i.continues_as).collect();
    spoiled.individuals[0].continues_as = continuations[1];
    spoiled.individuals[1].continues_as = continuations[0];
    let code = violation_of(&library, &spoiled).code;
    assert!(
        [
            "illegal_step",
            "wrong_cost",
            "not_cheapest",
            "dwell_too_short"
        ]
        .contains(&code),
        "{code}"
    );
    spoiled.individuals[1].continues_as = continuations[1];
    assert_eq!(violation_of(&library, &spoiled).code, "wrong_continuation");
    spoiled.individuals[1].continues_as = None;
    assert_eq!(violation_of(&library, &spoiled).code, "wrong_continuation");
    let mut spoiled = flock;
    spoiled.params.is_loop = false;
    assert_eq!(violation_of(&library, &spoiled).code, "wrong_continuation");
}
