//! Every kind of advice, with its code and its sentence.

use crate::geometry::Rect;
use crate::library::{Disturbance, DisturbanceKind, Mover, MoverKind, View};

/// One deficiency of a library. The variants are in order of severity, the most severe first.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Advice {
    /// The animal covers too few pixels, so there are no sprites.
    #[error(
        "the animal covers too few pixels for sprites: film from a shorter distance, or at a higher resolution"
    )]
    AnimalTooSmall,
    /// Several animals move. The largest was followed.
    #[error("several animals move in the film, and the largest was followed: film a single animal")]
    SeveralAnimals,
    /// A part of the animal never left its place. The floor under it is not known, and neither is whether
    /// more of the animal never moved.
    #[error(
        "a part of the animal never leaves its place, so the floor under it was filled in: check that the \
         whole animal is measured, film until it has left, or give a picture of the empty scene as background"
    )]
    NeverLeaves,
    /// Other objects move.
    #[error("{}", movers_sentence(*n, longest))]
    OtherMovers {
        /// Number of the objects.
        n: usize,
        /// The object that moves longest.
        longest: Mover,
    },
    /// Some frames show another scene.
    #[error(
        "{n} frames show another scene, the first at {first_s:.1} s, and are not measured: cut them out of the film"
    )]
    ForeignFrames {
        /// Number of the frames.
        n: usize,
        /// Time of the first, seconds.
        first_s: f64,
    },
    /// For a time the camera shakes, its focus hunts, or the light differs from that of the other frames.
    #[error("{}", disturbance_sentence(*n, longest))]
    Disturbed {
        /// Number of such times, of one kind.
        n: usize,
        /// The longest of them.
        longest: Disturbance,
    },
    /// The view was guessed with a probability below 0.9.
    #[error(
        "the film seems to show the animal {} (probability {}): set view to {} if this is wrong",
        seen(*view), percent(probability), other_view(*view)
    )]
    ViewUnsure {
        /// The guessed view.
        view: View,
        /// Its probability.
        probability: f64,
    },
    /// Share of the frames in which the animal was found, below 0.8.
    #[error(
        "the animal was found in only {} of the frames: point at it (animal_at) if it rests for long; \
         otherwise keep it in view, in front of a contrasting background",
        percent(.0)
    )]
    SeldomFound(f64),
    /// Share of the frames with the animal in which it touches the border, above 0.2.
    #[error(
        "the animal touches the border in {} of the frames in which it was found: film from farther away",
        percent(.0)
    )]
    OftenAtBorder(f64),
    /// Playback always ends, so no flock can be made.
    #[error(
        "no moment of the footage is similar to an earlier one, so playback always ends and no flock can be \
         made: film for longer"
    )]
    NoTransitions,
    /// Endless playback has less than half of the frames or less than 4 s.
    #[error(
        "endless playback can use only {} of the footage ({duration_s:.1} s): film for longer",
        percent(share)
    )]
    LittlePlayback {
        /// Share of the frames that endless playback can use, 0..=1.
        share: f64,
        /// Duration of these frames, seconds.
        duration_s: f64,
    },
    /// Number of frames from which playback can jump, below 20.
    #[error("playback can jump at only {0} frames, so a flock will repeat itself: film for longer")]
    FewJumps(usize),
    /// Multiple of the natural step that epsilon needed, above the requested `kappa`.
    #[error(
        "similar moments are rare: the limit for jumps was raised to {0:.1} times a natural step, so \
         jumps may be visible; film for longer"
    )]
    LooseJumps(f64),
    /// Share of playable frames in which the animal moves, below 0.25.
    #[error(
        "the animal moves in only {} of the playable frames: film it while it is active",
        percent(.0)
    )]
    MostlyRests(f64),
    /// Playback shows a motion for less than 0.5 s.
    #[error("{}", motion.lack_sentence(*playable_s, *filmed_s))]
    Lacks {
        /// The motion.
        motion: Motion,
        /// Its duration in playback, seconds.
        playable_s: f64,
        /// Its duration in the footage, seconds.
        filmed_s: f64,
    },
}

/// A motion that a flock should be able to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Side view: within 30 degrees of the right of the image.
    Right,
    /// Side view: within 30 degrees of the left of the image.
    Left,
    /// Side view with mirrored playback: right or left.
    Level,
    /// Side view: more than 30 degrees above the horizontal.
    Up,
    /// Side view: more than 30 degrees below the horizontal.
    Down,
    /// Top view: turns left by more than 45 degrees per second.
    TurningLeft,
    /// Top view: turns right by more than 45 degrees per second.
    TurningRight,
    /// Top view with mirrored playback: turns left or right.
    Turning,
    /// Top view: moves, and turns by at most 20 degrees per second.
    Straight,
}

impl Advice {
    /// Returns the stable code, for use by programs.
    pub fn code(&self) -> &'static str {
        match self {
            Advice::AnimalTooSmall => "animal_too_small",
            Advice::SeveralAnimals => "several_animals",
            Advice::NeverLeaves => "never_leaves",
            Advice::OtherMovers { .. } => "other_movers",
            Advice::ForeignFrames { .. } => "foreign_frames",
            Advice::Disturbed { longest, .. } => match longest.kind {
                DisturbanceKind::Camera => "camera_unsteady",
                DisturbanceKind::Light => "light_changes",
            },
            Advice::ViewUnsure { .. } => "view_unsure",
            Advice::SeldomFound(_) => "seldom_found",
            Advice::OftenAtBorder(_) => "often_at_border",
            Advice::NoTransitions => "no_transitions",
            Advice::LittlePlayback { .. } => "little_playback",
            Advice::FewJumps(_) => "few_jumps",
            Advice::LooseJumps(_) => "loose_jumps",
            Advice::MostlyRests(_) => "mostly_rests",
            Advice::Lacks { motion, .. } => motion.names().0,
        }
    }
}

impl Motion {
    /// Returns the code of the advice and the words for the motion.
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

    fn lack_sentence(self, playable_s: f64, filmed_s: f64) -> String {
        let words = self.names().1;
        if playable_s > 0.0 {
            let playable_s = (10.0 * playable_s).ceil() / 10.0;
            format!(
                "playback can show the animal {words} for only {playable_s:.1} s: film for longer"
            )
        } else if filmed_s > 0.0 {
            format!(
                "the footage shows the animal {words} for {filmed_s:.1} s, but in no part that playback can use: film \
                 for longer"
            )
        } else {
            format!("the footage never shows the animal {words}: film for longer")
        }
    }
}

fn seen(view: View) -> &'static str {
    match view {
        View::Side => "from the side",
        View::Top => "from above",
    }
}

fn other_view(view: View) -> &'static str {
    match view {
        View::Side => "top",
        View::Top => "side",
    }
}

fn percent(share: &f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Returns the sentence about an unsteady camera or another light, with the time of one.
fn disturbance_sentence(n: usize, &Disturbance { kind, from_s, to_s }: &Disturbance) -> String {
    let (what, advice) = match kind {
        DisturbanceKind::Camera => (
            "the whole picture shakes or is out of focus",
            "fix the camera and its focus, or measure a part without it",
        ),
        DisturbanceKind::Light => (
            "the light differs from that of the rest of the film",
            "film in steady light; a flock does not show the animal as it looks in a very different light",
        ),
    };
    let times = match n {
        1 => String::new(),
        2 => ", and once more".to_string(),
        n => format!(", and {} times more", n - 1),
    };
    format!("{what} from {from_s:.1} to {to_s:.1} s{times}: {advice}")
}

/// Returns the sentence about other moving objects, with the time and the box of one.
fn movers_sentence(n: usize, mover: &Mover) -> String {
    let what = match mover.kind {
        MoverKind::Animal => "an object that looks like the animal",
        MoverKind::MirrorImage => "the animal's mirror image",
        MoverKind::FromBorder => "an object that reaches across the border (a hand, a cable)",
        MoverKind::InPlace => "an object that stays in one place (a plant, a clock, a reflection)",
        MoverKind::Other => "something else",
    };
    let Rect { x, y, w, h } = mover.box_px;
    let (from_s, to_s) = (mover.from_s, mover.to_s);
    let more = match n {
        1 => String::new(),
        n => format!(", and {} more", n - 1),
    };
    format!(
        "{what} also moves, from {from_s:.1} to {to_s:.1} s, within the box {x},{y},{w},{h}{more}: check that the \
         measured object is the animal"
    )
}
