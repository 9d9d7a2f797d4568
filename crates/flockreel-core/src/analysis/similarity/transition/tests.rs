//! Tests of transitions on small synthetic films with known similar moments.

use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::geometry::angle::{mirrored_rad, wrap_rad};
use crate::library::{Pose, View};
use crate::progress::Silent;
use crate::random;
use crate::scratch::{Full, InMemory};
use libm::{cos, sin};

const FPS: f64 = 10.0;

/// Phase of the stroke, 0..1, and heading, radians.
type Moment = (f64, f64);

/// Returns sprites of a bright dot that circles in a 16 x 16 image by the phase of the stroke.
///
/// The dot is mirrored where the animal heads left. `None` gives a missing sprite.
fn film(moments: &[Option<Moment>]) -> (Sprites, Poses) {
    let draw = |frame_idx: usize, rgba: &mut [u8]| {
        let Some((phase, heading_rad)) = moments[frame_idx] else {
            return Ok::<_, Full>(false);
        };
        let turn = std::f64::consts::TAU * phase;
        let side = cos(heading_rad).signum();
        let (dot_x, dot_y) = (side * 5.0 * cos(turn), 3.0 * sin(turn));
        for (k, pixel) in rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (x, y) = ((k % 16) as f64 - 7.5 - dot_x, (k / 16) as f64 - 7.5 - dot_y);
            let light = 250.0 * libm::exp(-(x * x + y * y) / 8.0);
            *pixel = [light as u8, light as u8, 20, 255];
        }
        Ok(true)
    };
    let scratch = Arc::new(InMemory::default());
    let sprites = Sprites::drawn([16, 16], moments.len(), scratch, draw).expect("memory has room");
    let pose = |moment: &Option<Moment>| Pose {
        heading_rad: moment.map(|(_, heading_rad)| heading_rad),
        ..Pose::default()
    };
    let poses = Poses {
        tail_beat: None,
        fps: FPS,
        image_size_px: [320, 240],
        view: View::Side,
        view_confidence: None,
        other_movers: Vec::new(),
        camera: None,
        animal: None,
        frames: moments.iter().map(pose).collect(),
    };
    (sprites, poses)
}

/// Returns identical strokes of 20 frames at one heading.
fn strokes(n_frames: usize, heading_rad: f64) -> Vec<Option<Moment>> {
    let phase = |k: usize| (k % 20) as f64 / 20.0;
    (0..n_frames)
        .map(|k| Some((phase(k), heading_rad)))
        .collect()
}

fn params() -> Params {
    Params {
        clip_frames: Some(4),
        ..Params::default()
    }
}

fn connections(moments: &[Option<Moment>], params: &Params) -> Connections {
    let (sprites, poses) = film(moments);
    connect(&sprites, &poses, params, Level::detect(), &Silent).expect("nobody cancels")
}

#[test]
fn repeated_strokes_are_joined_a_whole_number_of_strokes_apart() {
    let found = connections(&strokes(201, 0.0), &params());
    assert!(found.natural_step > 0);
    assert_eq!(found.epsilon, 2 * found.natural_step);
    assert_eq!(found.kappa_used, Some(2.0));
    let plain = found.transitions.iter().filter(|t| !t.mirrored);
    let gaps: Vec<u32> = plain.map(|t| t.to - t.from).collect();
    assert!(
        !gaps.is_empty() && gaps.iter().all(|gap| gap % 20 == 0),
        "{gaps:?}"
    );
    assert!(found.component_share > 0.5, "{}", found.component_share);
    assert!(!found.patches.is_empty());
}

#[test]
fn candidates_are_counted_before_local_minima_are_selected() {
    let still = vec![Some((0.0, 0.0)); 10];
    let params = Params {
        epsilon: Some(1),
        ..params()
    };
    let found = connections(&still, &params);
    // The seven clips are equal. Three pairs are half a second apart; the first one is kept.
    assert_eq!((found.n_candidates, found.kappa_used), (3, None));
    let plain = found.transitions.iter().filter(|t| !t.mirrored);
    let pairs: Vec<_> = plain.map(|t| (t.from, t.to)).collect();
    assert_eq!(pairs, [(0, 5)]);
}

/// Returns the transitions from the definition: all distances, then local minima, then the gate.
fn by_definition(
    sprites: &Sprites,
    poses: &Poses,
    params: &Params,
    epsilon: u64,
) -> Vec<Transition> {
    let pixels = ComparedSprites::new(sprites, poses, params.planes).expect("memory has room");
    let f = params.clip_frames_at(poses.fps);
    let clips = Clips::new(sprites, poses, f);
    let gate = Gate::new(poses, f, params);
    let mut all = Vec::new();
    for (side, min_gap) in [
        (Side::Plain, f.max((MIN_GAP_S * poses.fps).ceil() as usize)),
        (Side::Mirrored, 0),
    ] {
        let mirrored = side == Side::Mirrored;
        let mut minima = LocalMinima::new(&clips.usable, min_gap, epsilon);
        let mut keep = |pair: ClipPair| {
            let gap = gate.passing_gap_rad(pair.from, pair.to, mirrored);
            all.extend(gap.map(|heading_gap_rad| Transition {
                from: pair.from as u32,
                to: pair.to as u32,
                mirrored,
                distance: pair.distance,
                heading_gap_rad,
            }));
        };
        let (clip, pixels, cpu) = (params.clip(f), &pixels, Level::Scalar);
        let distances = Distances {
            pixels,
            clip,
            side,
            cpu,
        };
        let push = |from: usize, row: &[u64]| {
            let pair = |(to, &distance)| ClipPair { from, to, distance };
            let pairs: Vec<ClipPair> = (from..).zip(row).map(pair).collect();
            minima.push(&pairs, &mut keep);
        };
        distances
            .for_each_row(&Silent, push)
            .expect("nobody cancels");
        minima.finish(&mut keep);
    }
    all.sort_unstable_by_key(|t| (t.from, t.to, t.mirrored));
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// An animal that turns and strokes at random, and is sometimes missing, cut, or without a heading.
    #[test]
    fn pruned_search_finds_the_transitions_of_all_distances(
        (n_frames, f, seed) in (1usize..230, 1u32..6, any::<u64>()),
        (turn, kappa, gate_deg) in (0.0f64..0.6, 0.5f64..6.0, 2.0f64..60.0),
        from_above: bool,
    ) {
        let (mut phase, mut heading_rad) = (0.0f64, 0.3f64);
        let moments: Vec<Option<Moment>> = (0..n_frames as u64).map(|t| {
            phase += 0.04 + 0.02 * random::normal(seed, &[t, 0]);
            heading_rad = wrap_rad(heading_rad + turn * random::normal(seed, &[t, 1]));
            (!random::bits(seed, &[t, 2]).is_multiple_of(60)).then_some((phase.rem_euclid(1.0), heading_rad))
        }).collect();
        let (sprites, mut poses) = film(&moments);
        for (t, pose) in (0..).zip(&mut poses.frames) {
            pose.cut = random::bits(seed, &[t, 3]).is_multiple_of(50);
        }
        poses.view = if from_above { View::Top } else { View::Side };
        let params = Params {
            clip_frames: Some(f),
            heading_gate_deg: gate_deg,
            kappa,
            ..Params::default()
        };
        for cpu in [Level::Scalar, Level::detect()] {
            let found = connect(&sprites, &poses, &params, cpu, &Silent).expect("nobody cancels");
            let wanted = by_definition(&sprites, &poses, &params, found.epsilon);
            prop_assert!(found.transitions == wanted, "{:?} {:?}", found.transitions.len(), wanted.len());
        }
    }
}

#[test]
fn epsilon_is_strict() {
    let with = |epsilon| {
        let params = Params {
            epsilon: Some(epsilon),
            mirror: false,
            ..params()
        };
        connections(&strokes(61, 0.0), &params).n_candidates
    };
    assert_eq!(with(0), 0);
    assert_ne!(with(1), 0);
}

#[test]
fn clips_of_different_heading_are_not_joined() {
    let mut moments = strokes(40, 0.0);
    moments.extend(strokes(40, 0.5));
    let found = connections(&moments, &params());
    assert!(!found.transitions.is_empty());
    for t in found.transitions.iter().filter(|t| !t.mirrored) {
        assert!(t.to <= 36 || t.from >= 37, "{t:?} joins two headings");
        assert!(t.heading_gap_rad < 15f64.to_radians());
    }
}

#[test]
fn an_animal_that_swims_back_is_joined_to_its_mirror_image() {
    let mut moments = strokes(40, 0.2);
    moments.extend(strokes(40, mirrored_rad(0.2)));
    let found = connections(&moments, &params());
    let across = |t: &&Transition| t.mirrored && t.from <= 36 && t.to >= 40;
    let joined: Vec<_> = found.transitions.iter().filter(across).collect();
    assert!(
        joined
            .iter()
            .any(|t| t.distance == 0 && t.to - t.from == 40)
    );
    let papers = Params {
        mirror: false,
        ..params()
    };
    let plain = connections(&moments, &papers);
    assert!(plain.transitions.iter().all(|t| !t.mirrored));
}

#[test]
fn no_clip_with_a_missing_cut_or_headless_frame_is_joined() {
    let (mut sprites, mut poses) = film(&strokes(100, 0.0));
    poses.frames[50].cut = true;
    poses.frames[70].heading_rad = None;
    let mut missing = strokes(100, 0.0);
    missing[25] = None;
    sprites = {
        let (with_gap, _) = film(&missing);
        assert!(!with_gap.is_present(25) && sprites.is_present(25));
        with_gap
    };
    let found = connect(&sprites, &poses, &params(), Level::Scalar, &Silent);
    let found = found.expect("nobody cancels");
    assert!(!found.transitions.is_empty());
    for t in &found.transitions {
        for clip in [t.from..t.from + 4, t.to..t.to + 4] {
            assert!([25, 50, 70].iter().all(|bad| !clip.contains(bad)), "{t:?}");
        }
    }
    assert!(
        [25, 50, 70]
            .iter()
            .all(|bad| !found.playback.component.contains(bad))
    );
}

#[test]
fn epsilon_grows_while_the_component_is_short() {
    // No moment repeats: one stroke takes longer than the footage.
    let moments: Vec<_> = (0..60).map(|k| Some((f64::from(k) / 70.0, 0.0))).collect();
    let found = connections(&moments, &params());
    assert_eq!(found.kappa_used, Some(4.0));
    assert_eq!(found.epsilon, 4 * found.natural_step);
    assert!(found.playback.component.len() < 20);
}

#[test]
fn epsilon_grows_if_many_more_frames_become_playable() {
    // Two strokes, then three seconds of faster strokes in the other direction. These are similar to the
    // first part only at a wider epsilon.
    let mut moments = strokes(41, 0.0);
    moments.extend((0..30).map(|k| Some(((1.0 - 0.18 * f64::from(k)).rem_euclid(1.0), 0.0))));
    let grown = connections(&moments, &params());
    assert_eq!(grown.kappa_used, Some(2.5));
    let strict = Params {
        epsilon: Some(2 * grown.natural_step),
        ..params()
    };
    let n_strict = connections(&moments, &strict).playback.component.len();
    assert!((20..45).contains(&n_strict), "{n_strict}");
    assert!(grown.playback.component.len() > 60);
}

#[test]
fn epsilon_stays_if_no_more_frames_become_playable() {
    let mut moments = strokes(41, 0.0);
    moments.extend((0..30).map(|k| Some((f64::from(k) / 35.0, 0.5))));
    let found = connections(&moments, &params());
    assert_eq!(found.kappa_used, Some(2.0));
    assert!(found.component_share < 0.6);
}

#[test]
fn epsilon_grows_to_the_steps_of_an_animal_that_rests() {
    let kappas = |p99| {
        let thresholds = thresholds(&params(), NaturalSteps { median: 10, p99 });
        thresholds
            .iter()
            .map(|threshold| threshold.kappa.expect("not given"))
            .collect::<Vec<_>>()
    };
    assert_eq!(kappas(30), [2.0, 2.5, 3.0, 4.0]);
    assert_eq!(kappas(100), [2.0, 2.5, 3.0, 4.0, 6.0, 9.0, 10.0]);
}

#[test]
fn footage_shorter_than_a_clip_has_no_transitions() {
    let found = connections(&strokes(3, 0.0), &params());
    assert_eq!((found.natural_step, found.n_candidates), (0, 0));
    assert_eq!(found.playback, Playback::default());
}

#[test]
fn every_level_finds_the_same_connections() {
    let (sprites, poses) = film(&strokes(70, 0.1));
    let at = |cpu| connect(&sprites, &poses, &params(), cpu, &Silent).expect("nobody cancels");
    let scalar = at(Level::Scalar);
    for cpu in Level::available() {
        assert_eq!(at(cpu), scalar, "{cpu:?}");
    }
}
