//! Derives advice for the person who films: what a library lacks, each with a stable code.
//!
//! Advice depends only on the library and its parameters. It is computed on request and not stored, so older
//! libraries also get the current advice.
//!
//! A flock can only do what playback shows. In side view, the headings of the animal matter. In top view,
//! sprites are rotated to any heading, so the turns matter. Mirrored playback turns left into right.

use crate::analysis::Params;
use crate::geometry::wrap_rad;
use crate::library::{DisturbanceKind, Library, Poses, View};

mod kind;

pub use kind::{Advice, Motion};

/// Playback with less than this of one motion gives advice, seconds. Free choice.
const MIN_MOTION_S: f64 = 0.5;
/// Number of 10-degree bins from the horizontal to the start of "up" and "down". Free choice.
const LEVEL_BINS: usize = 3;
/// Up to this turning rate the animal moves straight, radians per second. Equal to the gate of
/// transitions in top view.
const STRAIGHT_RAD_PER_S: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Above this turning rate the animal turns, radians per second. High enough to exclude heading noise.
const TURNING_RAD_PER_S: f64 = 45.0 * std::f64::consts::PI / 180.0;
/// A guessed view below this probability gives advice. Free choice.
const MIN_VIEW_PROBABILITY: f64 = 0.9;
/// Speed below which the animal rests, body lengths per second. Free choice.
const REST_BL_PER_S: f64 = 0.1;
/// Half the time span over which speed and turning rate are measured, seconds. Free choice.
const HALF_SPAN_S: f64 = 0.1;

/// Returns the advice for a library, the most severe first; empty for a good library.
pub fn advice(library: &Library, params: &Params) -> Vec<Advice> {
    let stats = &library.stats;
    let poses = &library.poses;
    let mut all = Vec::new();
    if stats.animal_too_small {
        all.push(Advice::AnimalTooSmall);
    }
    if stats.several_animals {
        all.push(Advice::SeveralAnimals);
    }
    if stats.still_px > 0 {
        all.push(Advice::NeverLeaves);
    }
    add_scene_advice(library, &mut all);
    let found = stats.n_detected as f64 / stats.n_frames.max(1) as f64;
    if found < 0.8 {
        all.push(Advice::SeldomFound(found));
    }
    let n_cut = poses.frames.iter().filter(|pose| pose.cut).count();
    let cut = n_cut as f64 / stats.n_detected.max(1) as f64;
    if cut > 0.2 {
        all.push(Advice::OftenAtBorder(cut));
    }
    if !library.playback.jumps.is_empty() {
        add_playback_advice(library, params, &mut all);
    } else if !stats.animal_too_small {
        // Without sprites nothing is compared. The size of the animal is then the reason.
        all.push(Advice::NoTransitions);
    }
    all
}

/// Adds advice about other moving objects, other scenes and the view.
fn add_scene_advice(library: &Library, all: &mut Vec<Advice>) {
    let (stats, poses) = (&library.stats, &library.poses);
    let longest = poses
        .other_movers
        .iter()
        .max_by(|a, b| (a.to_s - a.from_s).total_cmp(&(b.to_s - b.from_s)));
    if let Some(mover) = longest {
        all.push(Advice::OtherMovers {
            n: poses.other_movers.len(),
            longest: *mover,
        });
    }
    if let Some(first_s) = stats.first_foreign_s {
        all.push(Advice::ForeignFrames {
            n: stats.n_foreign_frames,
            first_s,
        });
    }
    for kind in [DisturbanceKind::Camera, DisturbanceKind::Light] {
        let of_kind = || stats.disturbances.iter().filter(|d| d.kind == kind);
        let longest = of_kind().max_by(|a, b| (a.to_s - a.from_s).total_cmp(&(b.to_s - b.from_s)));
        all.extend(longest.map(|&longest| Advice::Disturbed {
            n: of_kind().count(),
            longest,
        }));
    }
    let view_confidence = poses.view_confidence;
    if let Some(probability) = view_confidence.filter(|&p| p < MIN_VIEW_PROBABILITY) {
        all.push(Advice::ViewUnsure {
            view: poses.view,
            probability,
        });
    }
}

fn add_playback_advice(library: &Library, params: &Params, all: &mut Vec<Advice>) {
    let playback = &library.playback;
    let share = library.stats.component_share;
    let duration_s = playback.component.len() as f64 / library.poses.fps;
    if share < 0.5 || duration_s < 4.0 {
        all.push(Advice::LittlePlayback { share, duration_s });
    }
    let mut sources: Vec<u32> = playback.jumps.iter().map(|jump| jump.from).collect();
    sources.dedup(); // jumps are sorted by `from`
    if sources.len() < 20 {
        all.push(Advice::FewJumps(sources.len()));
    }
    let kappa_used = library.stats.kappa_used;
    if let Some(kappa) = kappa_used.filter(|&kappa| kappa > params.kappa) {
        all.push(Advice::LooseJumps(kappa));
    }
    let motion = motion(library);
    let n_moving = playback
        .component
        .iter()
        .filter(|&&f| motion[f as usize].moves);
    let moving = n_moving.count() as f64 / playback.component.len().max(1) as f64;
    if moving < 0.25 {
        all.push(Advice::MostlyRests(moving));
    }
    let coverage = match library.poses.view {
        View::Side => heading_coverage(library, params.mirror),
        View::Top => turn_coverage(library, &motion, params.mirror),
    };
    let fps = library.poses.fps;
    all.extend(coverage.into_iter().filter_map(|motion| motion.advice(fps)));
}

/// How long a motion is shown, frames.
#[derive(Clone, Copy)]
struct Coverage {
    motion: Motion,
    playable: usize,
    filmed: usize,
}

impl Coverage {
    /// Adds the counts of the mirrored motion, under another name.
    fn or(self, mirrored: Coverage, motion: Motion) -> Coverage {
        Coverage {
            motion,
            playable: self.playable + mirrored.playable,
            filmed: self.filmed + mirrored.filmed,
        }
    }

    fn advice(self, fps: f64) -> Option<Advice> {
        let playable_s = self.playable as f64 / fps;
        (playable_s < MIN_MOTION_S).then_some(Advice::Lacks {
            motion: self.motion,
            playable_s,
            filmed_s: self.filmed as f64 / fps,
        })
    }
}

/// Returns the coverage of headings, for side view.
fn heading_coverage(library: &Library, mirror: bool) -> Vec<Coverage> {
    let all: Vec<u32> = (0..library.poses.frames.len() as u32).collect();
    let filmed = by_direction(&super::histogram(&library.poses, &all));
    let playable = by_direction(&library.stats.heading_histogram);
    let motions = [Motion::Right, Motion::Down, Motion::Left, Motion::Up];
    let [right, down, left, up] = std::array::from_fn(|k| Coverage {
        motion: motions[k],
        playable: playable[k],
        filmed: filmed[k],
    });
    if mirror {
        vec![right.or(left, Motion::Level), up, down]
    } else {
        vec![right, left, up, down]
    }
}

/// Returns the number of frames that head right, down, left and up, from a histogram that starts at -180
/// degrees.
fn by_direction(histogram: &[u32]) -> [usize; 4] {
    let half = histogram.len() / 2;
    let mut n_frames = [0; 4];
    for (bin, &n) in histogram.iter().enumerate() {
        let direction = match bin {
            _ if bin < LEVEL_BINS || bin >= 2 * half - LEVEL_BINS => 2,
            _ if bin < half - LEVEL_BINS => 3,
            _ if bin < half + LEVEL_BINS => 0,
            _ => 1,
        };
        n_frames[direction] += n as usize;
    }
    n_frames
}

/// Returns the coverage of turns while the animal moves, for top view.
fn turn_coverage(library: &Library, motion: &[FrameMotion], mirror: bool) -> Vec<Coverage> {
    let count = |name: Motion, holds: &dyn Fn(&FrameMotion) -> bool| {
        let component = library.playback.component.iter();
        Coverage {
            motion: name,
            playable: component.filter(|&&f| holds(&motion[f as usize])).count(),
            filmed: motion.iter().filter(|&frame| holds(frame)).count(),
        }
    };
    // The y axis points down, so an increasing heading turns to the animal's right.
    let right = count(Motion::TurningRight, &|frame| {
        frame.turn_rad_per_s > TURNING_RAD_PER_S
    });
    let left = count(Motion::TurningLeft, &|frame| {
        frame.turn_rad_per_s < -TURNING_RAD_PER_S
    });
    let straight = count(Motion::Straight, &|frame| {
        frame.moves && frame.turn_rad_per_s.abs() <= STRAIGHT_RAD_PER_S
    });
    if mirror {
        vec![left.or(right, Motion::Turning), straight]
    } else {
        vec![left, right, straight]
    }
}

#[derive(Clone, Copy, Default)]
struct FrameMotion {
    moves: bool,
    turn_rad_per_s: f64,
}

/// Returns the motion in each frame, measured from 0.1 s before it to 0.1 s after it. The animal counts as resting
/// if it was not found at one of these times.
fn motion(library: &Library) -> Vec<FrameMotion> {
    let poses = &library.poses;
    let length_px = library.stats.length_px.unwrap_or(1.0).max(1.0);
    let half_span = ((poses.fps * HALF_SPAN_S).round() as usize).max(1);
    let motion_at = |frame: usize| {
        let (before, after) = (frame.checked_sub(half_span)?, frame + half_span);
        motion_between(poses, before, after, length_px)
    };
    (0..poses.frames.len())
        .map(|frame| motion_at(frame).unwrap_or_default())
        .collect()
}

fn motion_between(
    poses: &Poses,
    before: usize,
    after: usize,
    length_px: f64,
) -> Option<FrameMotion> {
    let span_s = (after - before) as f64 / poses.fps;
    let (before, after) = (poses.frames.get(before)?, poses.frames.get(after)?);
    let ([x0, y0], [x1, y1]) = (before.centroid_px?, after.centroid_px?);
    let turned = after.heading_rad.zip(before.heading_rad);
    Some(FrameMotion {
        moves: libm::hypot(x1 - x0, y1 - y0) / length_px / span_s > REST_BL_PER_S,
        turn_rad_per_s: turned.map_or(0.0, |(to, from)| wrap_rad(to - from) / span_s),
    })
}
