//! Writes the sentences of the advice, with their numbers.

use std::fmt;

use super::{Advice, Motion};
use crate::geometry::Rect;
use crate::library::{Mover, MoverKind, View};

impl Advice {
    /// Writes the sentences about other moving objects, other scenes and the view.
    fn write_scene(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Advice::OtherMovers { n, longest } => write_movers(f, *n, longest),
            Advice::ForeignFrames { n, first_s } => write!(
                f,
                "{n} frames show another scene, the first at {first_s:.1} s, and are not measured: cut them out of the \
                 film"
            ),
            Advice::ViewUnsure { view, probability } => {
                let (seen, other) = match view {
                    View::Side => ("from the side", "top"),
                    View::Top => ("from above", "side"),
                };
                write!(
                    f,
                    "the film seems to show the animal {seen} (probability {}): set view to {other} if this is wrong",
                    percent(probability)
                )
            }
            _ => Ok(()),
        }
    }
}

impl Motion {
    /// Returns the code of the advice and the words for the motion.
    pub(super) fn names(self) -> (&'static str, &'static str) {
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

    fn write_lack(self, f: &mut fmt::Formatter<'_>, playable_s: f64, filmed_s: f64) -> fmt::Result {
        let words = self.names().1;
        match (playable_s > 0.0, filmed_s > 0.0) {
            (false, false) => write!(
                f,
                "the footage never shows the animal {words}: film for longer"
            ),
            (false, true) => write!(
                f,
                "the footage shows the animal {words} for {filmed_s:.1} s, but in no part that playback can use: film \
                 for longer"
            ),
            (true, _) => write!(
                f,
                "playback can show the animal {words} for only {:.1} s: film for longer",
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
                "the animal covers too few pixels for sprites: film from a shorter distance, or at a higher resolution"
            ),
            Advice::SeveralAnimals => write!(
                f,
                "several animals move in the film, and the largest was followed: film a single animal"
            ),
            Advice::OtherMovers { .. }
            | Advice::ForeignFrames { .. }
            | Advice::ViewUnsure { .. } => self.write_scene(f),
            Advice::SeldomFound(share) => write!(
                f,
                "the animal was found in only {} of the frames: point at it (animal_at) if it rests for long; \
                 otherwise keep it in view, in front of a contrasting background",
                percent(share)
            ),
            Advice::OftenAtBorder(share) => write!(
                f,
                "the animal touches the border in {} of the frames in which it was found: film from farther away",
                percent(share)
            ),
            Advice::NoTransitions => write!(
                f,
                "no moment of the footage is similar to an earlier one, so playback always ends and no flock can be \
                 made: film for longer"
            ),
            Advice::LittlePlayback { share, duration_s } => write!(
                f,
                "endless playback can use only {} of the footage ({duration_s:.1} s): film for longer",
                percent(share)
            ),
            Advice::FewJumps(n) => write!(
                f,
                "playback can jump at only {n} frames, so a flock will repeat itself: film for longer"
            ),
            Advice::LooseJumps(kappa) => write!(
                f,
                "similar moments are rare: the limit for jumps was raised to {kappa:.1} times a natural step, so \
                 jumps may be visible; film for longer"
            ),
            Advice::MostlyRests(share) => write!(
                f,
                "the animal moves in only {} of the playable frames: film it while it is active",
                percent(share)
            ),
            Advice::Lacks {
                motion,
                playable_s,
                filmed_s,
            } => motion.write_lack(f, *playable_s, *filmed_s),
        }
    }
}

fn percent(share: &f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Writes what else moved, with time and box.
fn write_movers(f: &mut fmt::Formatter<'_>, n: usize, mover: &Mover) -> fmt::Result {
    let what = match mover.kind {
        MoverKind::Animal => "an object that looks like the animal",
        MoverKind::MirrorImage => "the animal's mirror image",
        MoverKind::FromBorder => "an object that reaches across the border (a hand, a cable)",
        MoverKind::InPlace => "an object that stays in one place (a plant, a clock, a reflection)",
        MoverKind::Other => "something else",
    };
    let Rect { x, y, w, h } = mover.box_px;
    write!(
        f,
        "{what} also moves, from {:.1} to {:.1} s, within the box {x},{y},{w},{h}",
        mover.from_s, mover.to_s
    )?;
    match n {
        1 => write!(f, ": check that the measured object is the animal"),
        n => write!(
            f,
            ", and {} more: check that the measured object is the animal",
            n - 1
        ),
    }
}
