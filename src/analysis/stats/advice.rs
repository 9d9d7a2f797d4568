//! Plain advice to whoever films: what a library lacks, each with a stable code (ALGORITHMS.md 5,
//! pruning: what the component covers). Pure: of a library and the parameters that made it, so that it is
//! never stored as a fact of its own and an older library gets today's advice.
//!
//! A flock can only do what playback shows. From the side that is where the animal heads; from above, where
//! a sprite is turned to any heading, it is which way the animal turns. Mirrored playback makes left of right.

use std::fmt;

use crate::analysis::Params;
use crate::geometry::{Rect, wrap_rad};
use crate::library::{Library, Mover, MoverKind, Poses, View};

/// Less than this of one motion is hardly any.
const LEAST_MOTION_S: f64 = 0.5;
/// Up and down begin so far off the horizontal, in bins of 10 degrees.
const LEVEL_BINS: usize = 3;
/// Turning more slowly than the playback's gate can tell is going straight; a turn is so fast that it
/// is no jitter of the heading.
const STRAIGHT_RAD_PER_S: f64 = 20.0 * std::f64::consts::PI / 180.0;
const TURNING_RAD_PER_S: f64 = 45.0 * std::f64::consts::PI / 180.0;
/// A guess of the view that is less probable than this is worth a word.
const SURE: f64 = 0.9;
/// Of more frames it is said that their transitions can be found approximately.
const MANY_FRAMES: usize = 50_000;
/// Slower than this is rest, lengths a second; measured over so long either way.
const REST_BL_PER_S: f64 = 0.1;
const REACH_S: f64 = 0.1;

/// One thing that a library lacks, the gravest first in the enum's order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Advice {
    /// The animal covers too few pixels: there are no sprites.
    AnimalTooSmall,
    /// Several animals move and the largest was followed.
    SeveralAnimals,
    /// So many things moved besides the animal; this one for the longest.
    OtherMovers(usize, Mover),
    /// So many frames show another scene; the first of them is at this time, seconds.
    ForeignFrames(usize, f64),
    /// The view was guessed, and is right with this probability, below .9.
    ViewUnsure(View, f64),
    /// The animal was found in this share of the frames, below 0.8.
    SeldomFound(f64),
    /// The animal touches the border in this share of the frames in which it was found, above 0.2.
    OftenAtBorder(f64),
    /// Playback always ends: no flock can be made.
    NoTransitions,
    /// Playback without an end holds this share of the frames and lasts so many seconds: below a half
    /// or below 4 s.
    LittlePlayback(f64, f64),
    /// Playback can leave its course after so many frames only, below 20.
    FewJumps(usize),
    /// Epsilon had to be this multiple of the natural step, more than was asked for.
    LooseJumps(f64),
    /// The animal moves in this share of what can be played, below a quarter.
    MostlyRests(f64),
    /// Transitions were looked for approximately, and this share of the like moments was found.
    SomeMissed(f64),
    /// So many frames, above 50 000, were all compared: `approximate` is faster.
    ManyFrames(usize),
    /// Of a motion there are so many seconds in what can be played, below 0.5, and so many in the footage.
    Lacks(Motion, f64, f64),
}

/// What a flock wants to be able to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// From the side: within 30 degrees of the picture's right.
    Right,
    /// From the side: within 30 degrees of the picture's left.
    Left,
    /// From the side, mirrors counted: right or left.
    Level,
    /// From the side: more than 30 degrees above the horizontal.
    Up,
    /// From the side: more than 30 degrees below the horizontal.
    Down,
    /// From above: by more than 45 degrees a second.
    TurningLeft,
    /// From above: by more than 45 degrees a second.
    TurningRight,
    /// From above, mirrors counted: either way.
    Turning,
    /// From above: moving and turning by less than 20 degrees a second.
    Straight,
}

impl Advice {
    /// The stable name: what a program may test for.
    pub fn code(&self) -> &'static str {
        match self {
            Advice::AnimalTooSmall => "animal_too_small",
            Advice::SeveralAnimals => "several_animals",
            Advice::OtherMovers(..) => "other_movers",
            Advice::ForeignFrames(..) => "foreign_frames",
            Advice::ViewUnsure(..) => "view_unsure",
            Advice::SeldomFound(_) => "seldom_found",
            Advice::OftenAtBorder(_) => "often_at_border",
            Advice::NoTransitions => "no_transitions",
            Advice::LittlePlayback(..) => "little_playback",
            Advice::FewJumps(_) => "few_jumps",
            Advice::LooseJumps(_) => "loose_jumps",
            Advice::MostlyRests(_) => "mostly_rests",
            Advice::SomeMissed(_) => "some_missed",
            Advice::ManyFrames(_) => "many_frames",
            Advice::Lacks(motion, ..) => motion.names().0,
        }
    }
}

impl Advice {
    /// What is to be said of what else the film shows and of how it was taken.
    fn write_scene(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Advice::OtherMovers(n, mover) => write_movers(f, *n, mover),
            Advice::ForeignFrames(n, from_s) => write!(
                f,
                "{n} frames show another scene, the first at {from_s:.1} s, and nothing is measured in them: cut them off \
                 before you send the film"
            ),
            Advice::ViewUnsure(view, probability) => {
                let (seen, other) = match view {
                    View::Side => ("from the side", "top"),
                    View::Top => ("from above", "side"),
                };
                write!(
                    f,
                    "the animal seems to be filmed {seen} ({}): if it is not, set view to {other}",
                    percent(probability)
                )
            }
            _ => Ok(()),
        }
    }
}

impl Motion {
    /// The advice's code, and the words.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Motion::Right => ("lacks_right", "heading right"),
            Motion::Left => ("lacks_left", "heading left"),
            Motion::Level => ("lacks_level", "heading right or left"),
            Motion::Up => ("lacks_up", "heading up"),
            Motion::Down => ("lacks_down", "heading down"),
            Motion::TurningLeft => ("lacks_left_turn", "turning left"),
            Motion::TurningRight => ("lacks_right_turn", "turning right"),
            Motion::Turning => ("lacks_turn", "turning"),
            Motion::Straight => ("lacks_straight", "moving straight on"),
        }
    }

    fn lacking(self, f: &mut fmt::Formatter<'_>, playable_s: f64, filmed_s: f64) -> fmt::Result {
        let words = self.names().1;
        match (playable_s > 0.0, filmed_s > 0.0) {
            (false, false) => write!(
                f,
                "this footage never shows the animal {words}: film longer"
            ),
            (false, true) => write!(
                f,
                "this footage shows the animal {words} for {filmed_s:.1} s, but never where playback can go \
                 on: film longer"
            ),
            (true, _) => write!(
                f,
                "only {:.1} s of what can be played show the animal {words}: film longer",
                (10.0 * playable_s).ceil() / 10.0
            ),
        }
    }
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Advice::AnimalTooSmall => write!(
                f,
                "the animal covers too few pixels to be cut out: come nearer, or film at a higher resolution"
            ),
            Advice::SeveralAnimals => write!(
                f,
                "several animals move in this footage, and the largest was followed: film one alone"
            ),
            Advice::OtherMovers(..) | Advice::ForeignFrames(..) | Advice::ViewUnsure(..) => {
                self.write_scene(f)
            }
            Advice::SeldomFound(share) => write!(
                f,
                "the animal was found in only {} of the frames: keep it in view, before a background that it \
                 stands out from",
                percent(share)
            ),
            Advice::OftenAtBorder(share) => write!(
                f,
                "the animal touches the border of the picture in {} of the frames: step back",
                percent(share)
            ),
            Advice::NoTransitions => write!(
                f,
                "no moment of this footage leads back to an earlier one, so no flock can be made of it: film longer"
            ),
            Advice::LittlePlayback(share, seconds) => write!(
                f,
                "only {} of the footage ({seconds:.1} s) can be played without an end: film longer",
                percent(share)
            ),
            Advice::FewJumps(n) => write!(
                f,
                "playback can leave its course at only {n} moments, so a flock will repeat itself: film longer"
            ),
            Advice::LooseJumps(kappa) => write!(
                f,
                "to find enough moments that look alike, differences up to {kappa:.1} times a natural step had to be \
                 allowed, so jumps may be seen: film longer"
            ),
            Advice::MostlyRests(share) => write!(
                f,
                "the animal moves in only {} of what can be played: film it while it is lively",
                percent(share)
            ),
            Advice::SomeMissed(recall) => write!(
                f,
                "like moments were looked for approximately, and {} of them were found: set approximate to false \
                 to find all",
                percent(recall)
            ),
            Advice::ManyFrames(n) => write!(
                f,
                "all {n} frames were compared with one another: set approximate to true where that takes too long"
            ),
            Advice::Lacks(motion, playable_s, filmed_s) => {
                motion.lacking(f, *playable_s, *filmed_s)
            }
        }
    }
}

fn percent(share: &f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// What moved besides the animal, where and when.
fn write_movers(f: &mut fmt::Formatter<'_>, n: usize, mover: &Mover) -> fmt::Result {
    let what = match mover.kind {
        MoverKind::Animal => "something that looks like the animal",
        MoverKind::MirrorImage => "the animal's mirror image",
        MoverKind::FromBorder => "something that reaches in across the border (a hand, a cable)",
        MoverKind::InPlace => "something that stays at its place (a plant, a clock, a reflection)",
        MoverKind::Other => "something else",
    };
    let Rect { x, y, w, h } = mover.box_px;
    write!(
        f,
        "besides the animal {what} moved, from {:.1} to {:.1} s, within the box {x},{y},{w},{h}",
        mover.from_s, mover.to_s
    )?;
    match n {
        1 => write!(f, ": see whether the right one was measured"),
        n => write!(
            f,
            ", and {} more: see whether the right one was measured",
            n - 1
        ),
    }
}

/// What a library lacks, the gravest first; nothing of a good one.
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
    of_scene(library, &mut all);
    let found = stats.n_detected as f64 / stats.n_frames.max(1) as f64;
    if found < 0.8 {
        all.push(Advice::SeldomFound(found));
    }
    let n_cut = poses.frames.iter().filter(|pose| pose.cut).count();
    let cut = n_cut as f64 / stats.n_detected.max(1) as f64;
    if cut > 0.2 {
        all.push(Advice::OftenAtBorder(cut));
    }
    of_search(library, params, &mut all);
    match library.playback.jumps.is_empty() {
        // Without sprites nothing is compared: the animal's size is the reason.
        true if stats.animal_too_small => {}
        true => all.push(Advice::NoTransitions),
        false => of_playback(library, params, &mut all),
    }
    all
}

/// What else the film shows, and how it was taken.
fn of_scene(library: &Library, all: &mut Vec<Advice>) {
    let (stats, poses) = (&library.stats, &library.poses);
    let longest = stats
        .other_movers
        .iter()
        .max_by(|a, b| (a.to_s - a.from_s).total_cmp(&(b.to_s - b.from_s)));
    if let Some(mover) = longest {
        all.push(Advice::OtherMovers(stats.other_movers.len(), *mover));
    }
    if let Some(from_s) = stats.first_foreign_s {
        all.push(Advice::ForeignFrames(stats.n_foreign_frames, from_s));
    }
    match poses.view_confidence {
        Some(probability) if probability < SURE => {
            all.push(Advice::ViewUnsure(poses.view, probability));
        }
        _ => {}
    }
}

/// How the search for transitions went, and how else it could.
fn of_search(library: &Library, params: &Params, all: &mut Vec<Advice>) {
    let n_frames = library.stats.n_frames;
    match library.stats.recall {
        Some(recall) => all.push(Advice::SomeMissed(recall)),
        None if n_frames > MANY_FRAMES && !params.approximate => {
            all.push(Advice::ManyFrames(n_frames));
        }
        None => {}
    }
}

fn of_playback(library: &Library, params: &Params, all: &mut Vec<Advice>) {
    let playback = &library.playback;
    let share = library.stats.component_share;
    let lasts_s = playback.component.len() as f64 / library.poses.fps;
    if share < 0.5 || lasts_s < 4.0 {
        all.push(Advice::LittlePlayback(share, lasts_s));
    }
    let mut leaves: Vec<u32> = playback.jumps.iter().map(|jump| jump.from).collect();
    leaves.dedup(); // jumps are sorted by where they leave
    if leaves.len() < 20 {
        all.push(Advice::FewJumps(leaves.len()));
    }
    if let Some(kappa) = library
        .stats
        .kappa_used
        .filter(|&kappa| kappa > params.kappa)
    {
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
    let lacks = match library.poses.view {
        View::Side => of_headings(library, params.mirror),
        View::Top => of_turns(library, &motion, params.mirror),
    };
    all.extend(lacks);
}

fn lacks(of: &[(Motion, usize, usize)], fps: f64) -> Vec<Advice> {
    let seconds = |n_frames: usize| n_frames as f64 / fps;
    of.iter()
        .map(|&(motion, playable, filmed)| (motion, seconds(playable), seconds(filmed)))
        .filter(|(_, playable_s, _)| *playable_s < LEAST_MOTION_S)
        .map(|(motion, playable_s, filmed_s)| Advice::Lacks(motion, playable_s, filmed_s))
        .collect()
}

/// From the side: the headings of the component (its histogram), and of the whole footage.
fn of_headings(library: &Library, mirror: bool) -> Vec<Advice> {
    let all: Vec<u32> = (0..library.poses.frames.len() as u32).collect();
    let filmed = by_direction(&super::histogram(&library.poses, &all));
    let playable = by_direction(&library.stats.heading_histogram);
    let [right, down, left, up] = std::array::from_fn(|k| (playable[k], filmed[k]));
    let sides = match mirror {
        true => vec![(Motion::Level, right.0 + left.0, right.1 + left.1)],
        false => vec![
            (Motion::Right, right.0, right.1),
            (Motion::Left, left.0, left.1),
        ],
    };
    let upright = [(Motion::Up, up.0, up.1), (Motion::Down, down.0, down.1)];
    lacks(&[sides, upright.to_vec()].concat(), library.poses.fps)
}

/// Frames that head right, down, left and up, of a histogram from -180 degrees.
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

/// From above: which way the animal turns while it moves.
fn of_turns(library: &Library, motion: &[FrameMotion], mirror: bool) -> Vec<Advice> {
    let count = |holds: &dyn Fn(&FrameMotion) -> bool| {
        let component = library.playback.component.iter();
        (
            component.filter(|&&f| holds(&motion[f as usize])).count(),
            motion.iter().filter(|&frame| holds(frame)).count(),
        )
    };
    // y runs down: a rising heading turns to the animal's right.
    let right = count(&|frame| frame.turn_rad_per_s > TURNING_RAD_PER_S);
    let left = count(&|frame| frame.turn_rad_per_s < -TURNING_RAD_PER_S);
    let straight = count(&|frame| frame.moves && frame.turn_rad_per_s.abs() <= STRAIGHT_RAD_PER_S);
    let turns = match mirror {
        true => vec![(Motion::Turning, left.0 + right.0, left.1 + right.1)],
        false => vec![
            (Motion::TurningLeft, left.0, left.1),
            (Motion::TurningRight, right.0, right.1),
        ],
    };
    let straight = (Motion::Straight, straight.0, straight.1);
    lacks(&[turns, vec![straight]].concat(), library.poses.fps)
}

#[derive(Clone, Copy, Default)]
struct FrameMotion {
    moves: bool,
    turn_rad_per_s: f64,
}

/// Over a tenth of a second either way; rest where the animal was not found at either end.
fn motion(library: &Library) -> Vec<FrameMotion> {
    let poses = &library.poses;
    let length_px = library.stats.length_px.unwrap_or(1.0).max(1.0);
    let reach = ((poses.fps * REACH_S).round() as usize).max(1);
    let of = |frame: usize| {
        let (before, after) = (frame.checked_sub(reach)?, frame + reach);
        between(poses, before, after, length_px)
    };
    (0..poses.frames.len())
        .map(|frame| of(frame).unwrap_or_default())
        .collect()
}

fn between(poses: &Poses, before: usize, after: usize, length_px: f64) -> Option<FrameMotion> {
    let span_s = (after - before) as f64 / poses.fps;
    let (before, after) = (poses.frames.get(before)?, poses.frames.get(after)?);
    let ([x0, y0], [x1, y1]) = (before.centroid_px?, after.centroid_px?);
    let turned = after.heading_rad.zip(before.heading_rad);
    Some(FrameMotion {
        moves: libm::hypot(x1 - x0, y1 - y0) / length_px / span_s > REST_BL_PER_S,
        turn_rad_per_s: turned.map_or(0.0, |(to, from)| wrap_rad(to - from) / span_s),
    })
}
