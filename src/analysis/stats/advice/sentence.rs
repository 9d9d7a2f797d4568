//! Writes the sentences of the advice, with their numbers.

use std::fmt;

use super::{Advice, Motion};
use crate::geometry::Rect;
use crate::library::{Mover, MoverKind, View};

impl Advice {
    /// Writes the sentences about other moving objects, other scenes and the view.
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
            Advice::Lacks(motion, playable_s, filmed_s) => {
                motion.lacking(f, *playable_s, *filmed_s)
            }
        }
    }
}

fn percent(share: &f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Writes what else moved, with time and box.
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
