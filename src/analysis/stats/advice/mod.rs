//! Plain advice to whoever films: what a library lacks, each with a stable code (ALGORITHMS.md 5,
//! pruning: what the component covers). Pure: of a library and the parameters that made it, so that it is
//! never stored as a fact of its own and an older library gets today's advice.
//!
//! A flock can only do what playback shows. From the side that is where the animal heads; from above, where
//! a sprite is turned to any heading, it is which way the animal turns. Mirrored playback makes left of right.

use crate::analysis::Params;
use crate::geometry::wrap_rad;
use crate::library::{Library, Mover, Poses, View};

mod sentence;

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
    let longest = poses
        .other_movers
        .iter()
        .max_by(|a, b| (a.to_s - a.from_s).total_cmp(&(b.to_s - b.from_s)));
    if let Some(mover) = longest {
        all.push(Advice::OtherMovers(poses.other_movers.len(), *mover));
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
