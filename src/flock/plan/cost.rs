//! What it costs to show a state at a moment, in whole turns (65536 to the circle), so that the same
//! plan comes out on any machine (ALGORITHMS.md 6).
//!
//! In side view headings are compared; in top view the sprite is turned to any heading, so what is
//! compared is how far animal and boid turn in a quarter of a second.

use super::trellis::Trellis;
use crate::flock::motion::FrameMotion;
use crate::flock::params::{MatchBy, Matching};
use crate::geometry::Turns;
use crate::library::{Library, View};

/// Every cost of a state at a frame stays below.
pub const CEILING: u32 = 1 << 17;

/// Turn rates are compared over this time.
const TURN_SPAN_S: f64 = 0.25;

/// What is compared: of a state, or wanted by a boid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Feature {
    /// Heading; in top view the turn in a quarter second.
    pub turns: u16,
    /// ln(speed + v0) in turns, shifted to be positive.
    pub log_speed: u16,
}

/// The weights as integers: 256ths, and turns.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    heading: u32,
    rotation: u32,
    speed: u32,
    rho_turns: u16,
    jump_turns: f64,
    view: View,
    by: MatchBy,
    v0_bl_per_s: f64,
}

impl Weights {
    /// The weights of a library's view; `rho` is no matter in top view.
    pub fn new(matching: &Matching, library: &Library) -> Weights {
        let fixed = |w: f64| (w * 256.0).round() as u32;
        let view = library.poses.view;
        let cruise = library.stats.speed_bl_per_s.map_or(1.0, |speeds| speeds[1]);
        Weights {
            heading: fixed(matching.w_h),
            rotation: fixed(matching.w_r),
            speed: match matching.by {
                MatchBy::Heading => fixed(matching.w_v),
                MatchBy::Position => fixed(matching.w_h),
            },
            rho_turns: match (view, matching.by) {
                (View::Side, MatchBy::Heading) => Turns::from_rad(matching.rho_deg.to_radians()).0,
                _ => 0,
            },
            jump_turns: matching.wx * Turns::PER_RAD,
            view,
            by: matching.by,
            v0_bl_per_s: (0.25 * cruise).max(0.05),
        }
    }

    /// What a jump between clips at distance `distance` costs, turns below 2^16.
    pub fn of_jump(&self, distance: u64, epsilon: u64) -> u32 {
        let share = distance as f64 / epsilon.max(1) as f64;
        (self.jump_turns * share).round().min(65535.0) as u32
    }

    /// What showing `state` costs who wants `wanted`, turns, without the ceiling: heading (with
    /// rotation), and speed.
    pub fn of_state(&self, wanted: Feature, state: Feature) -> [u32; 2] {
        let gap = (wanted.turns.wrapping_sub(state.turns) as i16).unsigned_abs();
        let within = u32::from(gap.min(self.rho_turns));
        let beyond = u32::from(gap) - within;
        let speed_gap = u32::from(wanted.log_speed.abs_diff(state.log_speed));
        [
            (self.heading * beyond + self.rotation * within) >> 8,
            (self.speed * speed_gap) >> 8,
        ]
    }

    /// The sum of `of_state`, below the ceiling.
    #[inline(always)]
    pub fn total(&self, wanted: Feature, state: Feature) -> u32 {
        let [heading, speed] = self.of_state(wanted, state);
        (heading + speed).min(CEILING - 1)
    }

    /// What a boid wants: its heading, how fast that turns, and its speed.
    pub fn wanted(&self, heading_rad: f64, turn_rad_per_s: f64, speed_bl_per_s: f64) -> Feature {
        if self.by == MatchBy::Position {
            let along = [libm::cos(heading_rad), libm::sin(heading_rad)];
            return moving(along.map(|axis| speed_bl_per_s * axis));
        }
        Feature {
            turns: match self.view {
                View::Side => Turns::from_rad(heading_rad).0,
                View::Top => turn_of_rate(turn_rad_per_s),
            },
            log_speed: log_speed(speed_bl_per_s, self.v0_bl_per_s),
        }
    }

    /// The features of every state of the trellis; barriers get zeros.
    pub fn features(&self, trellis: &Trellis, motion: &[FrameMotion]) -> Vec<Feature> {
        let feature = |state| {
            let Some((frame, mirrored)) = trellis.shown(state) else {
                return Feature::default();
            };
            let moved = &motion[frame as usize];
            if self.by == MatchBy::Position {
                let [x, y] = moved.velocity_bl_per_s;
                return moving([if mirrored { -x } else { x }, y]);
            }
            let (heading, turn) = match mirrored {
                false => (Turns::from_rad(moved.heading_rad), moved.turn_rad_per_s),
                true => (
                    Turns::from_rad(moved.heading_rad).mirrored(),
                    -moved.turn_rad_per_s,
                ),
            };
            Feature {
                turns: match self.view {
                    View::Side => heading.0,
                    View::Top => turn_of_rate(turn),
                },
                log_speed: log_speed(moved.speed_bl_per_s, self.v0_bl_per_s),
            }
        };
        (0..trellis.n_states()).map(feature).collect()
    }
}

/// A velocity in the picture in the place of heading and speed: a body length a second is a radian, and
/// more than a quarter circle's worth is cut down to it, so that differences never wrap.
fn moving(velocity_bl_per_s: [f64; 2]) -> Feature {
    let [x, y] = velocity_bl_per_s
        .map(|bl_per_s| (bl_per_s * Turns::PER_RAD).round().clamp(-16383.0, 16383.0) as i16);
    Feature {
        turns: x as u16,
        log_speed: (y as u16).wrapping_add(1 << 15),
    }
}

/// Clamped to half a circle either way, so that differences never wrap.
fn turn_of_rate(turn_rad_per_s: f64) -> u16 {
    let turns = turn_rad_per_s * TURN_SPAN_S * Turns::PER_RAD;
    turns.round().clamp(-16383.0, 16383.0) as i16 as u16
}

fn log_speed(speed_bl_per_s: f64, v0_bl_per_s: f64) -> u16 {
    // From 0.05 to 100 BL/s the logarithm spans -3 to 5: 2 radians to the 65536 would not hold it.
    let log = libm::log(speed_bl_per_s.clamp(0.0, 100.0) + v0_bl_per_s);
    ((log + 3.0).clamp(0.0, 6.2) * Turns::PER_RAD).round() as u16
}
