//! Cost of showing a state at a frame, in whole turns (65536 to the circle). Integers make plans the same
//! on every machine (docs/explanation/algorithms.md, "Planning").
//!
//! In side view headings are compared. In top view a sprite can be rotated to any heading, so the turns of
//! animal and boid within a quarter of a second are compared.

use super::recursion::CEILING;
use super::trellis::Trellis;
use crate::flock::boids::vector::Vec3;
use crate::flock::individual::BoidTrack;
use crate::flock::motion::FrameMotion;
use crate::flock::params::{MatchBy, Matching};
use crate::geometry::angle::mirrored_rad;
use crate::geometry::{Turns, wrap_rad};
use crate::library::{Jump, Library, View};

/// Length of a unit vector in a feature.
const UNIT: f64 = 16384.0;

/// Time over which turns are compared in top view, in seconds. Free choice.
const TURN_SPAN_S: f64 = 0.25;
/// Longest jump back that costs extra for showing frames again, in seconds. Viewers do not notice longer
/// loops.
const RETURN_S: f64 = 1.3;

/// Quantities that are compared: those of a state, or those that a boid asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Feature {
    /// Heading, in turns. In top view the turn within a quarter of a second. With `MatchBy::Position` the
    /// horizontal velocity.
    pub turns: u16,
    /// ln(speed + v0), in turns, shifted to be positive. With `MatchBy::Position` the vertical velocity.
    pub log_speed: u16,
    /// Length of the direction's projection into the picture, in 16384ths.
    pub level: i16,
    /// Component of the direction away from the viewer, in 16384ths.
    pub away: i16,
}

/// Weights as integers: in 256ths, and in turns.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    pub(super) heading: u32,
    pub(super) rotation: u32,
    pub(super) speed: u32,
    pub(super) rho_turns: u16,
    jump_turns: f64,
    epsilon: u64,
    /// Cost of each frame that a jump goes back, in turns.
    repetition_turns: f64,
    /// Longest jump back that has this cost, in frames.
    max_back_frames: u32,
    view: View,
    pub(super) by: MatchBy,
    /// Weight of differences along the line of sight.
    away: f32,
    /// Whether poses tell if the animal points away from the viewer or toward the viewer.
    is_signed: bool,
    v0_bl_per_s: f64,
}

impl Weights {
    /// Returns the weights for a library. In top view `rho` is not used.
    pub fn new(matching: &Matching, library: &Library) -> Weights {
        let fixed = |w: f64| (w * 256.0).round() as u32;
        let view = library.poses.view;
        let by = matching.by;
        let cruise = library.stats.speed_bl_per_s.map_or(1.0, |speeds| speeds[1]);
        Weights {
            heading: fixed(matching.w_h),
            rotation: fixed(matching.w_r),
            speed: match by {
                MatchBy::Heading | MatchBy::Direction => fixed(matching.w_v),
                MatchBy::Position => fixed(matching.w_h),
            },
            rho_turns: match (view, by) {
                (View::Top, _) | (_, MatchBy::Position) => 0,
                _ => Turns::from_rad(matching.rho_deg.to_radians()).0,
            },
            jump_turns: matching.wx * Turns::PER_RAD,
            epsilon: library.epsilon,
            repetition_turns: matching.w_p * Turns::PER_RAD,
            max_back_frames: (RETURN_S * library.poses.fps).round() as u32,
            view,
            by,
            away: matching.w_d as f32,
            is_signed: library
                .poses
                .frames
                .iter()
                .any(|pose| pose.forward.is_some()),
            v0_bl_per_s: (0.25 * cruise).max(0.05),
        }
    }

    /// Returns the cost of a jump, in turns, below 2^16.
    pub fn jump_cost(&self, jump: &Jump) -> u32 {
        let share = jump.cost as f64 / self.epsilon.max(1) as f64;
        let transition = (self.jump_turns * share).round().min(65535.0) as u32;
        (transition + self.repetition_cost(jump)).min(65535)
    }

    /// Returns the part of a jump's cost for showing frames again, in turns, below 2^16. It is 0 for jumps
    /// that change the mirror side, because mirrored frames look different.
    pub fn repetition_cost(&self, jump: &Jump) -> u32 {
        let n_again = (jump.from + 1).saturating_sub(jump.to);
        let is_return = !jump.mirrored && n_again <= self.max_back_frames;
        let turns = self.repetition_turns * f64::from(n_again);
        if is_return {
            turns.round().min(65535.0) as u32
        } else {
            0
        }
    }

    /// Returns the costs of showing `state` where `wanted` is asked for, in turns, without the ceiling:
    /// heading with rotation, and speed.
    pub fn parts_of(&self, wanted: Feature, state: Feature) -> [u32; 2] {
        match self.by {
            MatchBy::Direction => {
                let [beyond, within] = self.parts(wanted.turns, state.turns);
                let chord_turns = self.chord_turns(wanted, state, u32::from(beyond));
                let speed = self.speed_cost(wanted.log_speed, state.log_speed);
                [self.heading_cost(chord_turns, u32::from(within)), speed]
            }
            _ => self.of_gaps(
                [wanted.turns, state.turns],
                [wanted.log_speed, state.log_speed],
            ),
        }
    }

    /// Returns `parts_of` for matching that does not compare directions in depth.
    #[inline(always)]
    fn of_gaps(&self, turns: [u16; 2], log_speeds: [u16; 2]) -> [u32; 2] {
        let [beyond, within] = self.parts(turns[0], turns[1]);
        [
            self.heading_cost(u32::from(beyond), u32::from(within)),
            self.speed_cost(log_speeds[0], log_speeds[1]),
        ]
    }

    /// Returns the parts of the gap between two headings beyond rho and within rho, in turns.
    #[inline(always)]
    fn parts(&self, a: u16, b: u16) -> [u16; 2] {
        let gap = (a.wrapping_sub(b) as i16).unsigned_abs();
        let within = gap.min(self.rho_turns);
        [gap - within, within]
    }

    #[inline(always)]
    fn heading_cost(&self, beyond: u32, within: u32) -> u32 {
        (self.heading * beyond + self.rotation * within) >> 8
    }

    #[inline(always)]
    fn speed_cost(&self, a: u16, b: u16) -> u32 {
        (self.speed * u32::from(a.abs_diff(b))) >> 8
    }

    /// Returns the chord between two directions in space whose headings are `beyond` turns apart. Its unit
    /// is turns, so that a short chord equals the angle between the directions.
    ///
    /// |a - b|^2 = (difference of levels)^2 + 2 level_a level_b (1 - cos beyond) + (weighted difference of
    /// aways)^2.
    #[inline(always)]
    fn chord_turns(&self, a: Feature, b: Feature, beyond: u32) -> u32 {
        // Basic operations and one square root in single precision are the same on every machine.
        let half = beyond as f32 * (std::f32::consts::PI / 65536.0);
        let square = half * half;
        let sine = half * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
        let [level_a, level_b] = [a, b].map(|f| f32::from(f.level));
        let level = level_a - level_b;
        let away = self.away * (f32::from(a.away) - f32::from(b.away));
        let squared = level * level + away * away + 4.0 * level_a * level_b * sine * sine;
        (squared.sqrt() * (Turns::PER_RAD / UNIT) as f32 + 0.5) as u32
    }

    /// Returns the sum of `parts_of`, limited to values below `CEILING`.
    #[inline(always)]
    pub fn total(&self, wanted: Feature, state: Feature) -> u32 {
        let [heading, speed] = self.parts_of(wanted, state);
        (heading + speed).min(CEILING - 1)
    }

    /// Writes the totals of all states where `wanted` is asked for.
    #[inline(always)]
    pub fn fill(&self, wanted: Feature, states: &[Feature], out: &mut [u32]) {
        let pairs = out.iter_mut().zip(states);
        match self.by {
            MatchBy::Direction => pairs.for_each(|(out, &state)| *out = self.total(wanted, state)),
            MatchBy::Heading | MatchBy::Position => pairs.for_each(|(out, state)| {
                let [heading, speed] = self.of_gaps(
                    [wanted.turns, state.turns],
                    [wanted.log_speed, state.log_speed],
                );
                *out = (heading + speed).min(CEILING - 1);
            }),
        }
    }

    /// Returns the features that a boid asks for at every frame, from its track as stored in the file.
    pub fn wanted(&self, boid: &BoidTrack, fps: f64) -> Vec<Feature> {
        let turns = turn_rates(&boid.heading_rad, fps);
        let forward = |t: usize| boid.forward.as_ref().map_or([1.0, 0.0, 0.0], |all| all[t]);
        (turns.into_iter().enumerate())
            .map(|(t, turn)| {
                let (heading, speed) = (boid.heading_rad[t], boid.speed_bl_per_s[t]);
                self.feature_of(heading, turn, speed, forward(t))
            })
            .collect()
    }

    fn feature_of(
        &self,
        heading_rad: f64,
        turn: f64,
        speed_bl_per_s: f64,
        forward: Vec3,
    ) -> Feature {
        match self.by {
            MatchBy::Position => {
                let along = [libm::cos(heading_rad), libm::sin(heading_rad)];
                velocity_feature(along.map(|axis| speed_bl_per_s * axis))
            }
            MatchBy::Direction => Feature {
                turns: Turns::from_rad(libm::atan2(forward[1], forward[0])).0,
                log_speed: log_speed(speed_bl_per_s, self.v0_bl_per_s),
                ..self.depth_parts(forward)
            },
            MatchBy::Heading => Feature {
                turns: match self.view {
                    View::Side => Turns::from_rad(heading_rad).0,
                    View::Top => turn_of_rate(turn),
                },
                log_speed: log_speed(speed_bl_per_s, self.v0_bl_per_s),
                ..Feature::default()
            },
        }
    }

    /// Returns a feature with only `level` and `away`, the foreshortening of a direction.
    fn depth_parts(&self, forward: Vec3) -> Feature {
        let away = if self.is_signed {
            forward[2]
        } else {
            forward[2].abs()
        };
        let whole = |part: f64| (part.clamp(-1.0, 1.0) * UNIT).round() as i16;
        Feature {
            level: whole(forward[0].hypot(forward[1])),
            away: whole(away),
            ..Feature::default()
        }
    }

    /// Returns the features of every state of the trellis; zeros for barriers.
    pub fn features(&self, trellis: &Trellis, motion: &[FrameMotion]) -> Vec<Feature> {
        let feature = |state| {
            let Some((frame, mirrored)) = trellis.shown(state) else {
                return Feature::default();
            };
            let moved = &motion[frame as usize];
            if self.by == MatchBy::Position {
                let [x, y] = moved.velocity_bl_per_s;
                return velocity_feature([if mirrored { -x } else { x }, y]);
            }
            let x = if mirrored { -1.0 } else { 1.0 };
            let turn = x * moved.turn_rad_per_s;
            let heading = match (self.by, mirrored) {
                (MatchBy::Direction, _) => libm::atan2(moved.forward[1], x * moved.forward[0]),
                (_, false) => moved.heading_rad,
                (_, true) => mirrored_rad(moved.heading_rad),
            };
            let [_, y, z] = moved.forward;
            self.feature_of(
                heading,
                turn,
                moved.speed_bl_per_s,
                [x * moved.forward[0], y, z],
            )
        };
        (0..trellis.n_states()).map(feature).collect()
    }
}

/// Returns the turn rate at every frame of a track, in radians a second: central differences, one-sided at
/// the ends.
pub fn turn_rates(heading_rad: &[f64], fps: f64) -> Vec<f64> {
    let last = heading_rad.len().saturating_sub(1);
    (0..heading_rad.len())
        .map(|t| {
            let (before, after) = (t.saturating_sub(1), (t + 1).min(last));
            let span_s = (after - before).max(1) as f64 / fps;
            wrap_rad(heading_rad[after] - heading_rad[before]) / span_s
        })
        .collect()
}

/// Returns a feature that holds a velocity in the picture. A body length a second counts as a radian. Each
/// component is clamped to a quarter circle, so that differences do not wrap.
fn velocity_feature(velocity_bl_per_s: [f64; 2]) -> Feature {
    let [x, y] = velocity_bl_per_s
        .map(|bl_per_s| (bl_per_s * Turns::PER_RAD).round().clamp(-16383.0, 16383.0) as i16);
    Feature {
        turns: x as u16,
        log_speed: (y as u16).wrapping_add(1 << 15),
        ..Feature::default()
    }
}

/// Returns the turn within a quarter of a second, in turns. It is clamped to a quarter circle, so that
/// differences do not wrap.
fn turn_of_rate(turn_rad_per_s: f64) -> u16 {
    let turns = turn_rad_per_s * TURN_SPAN_S * Turns::PER_RAD;
    turns.round().clamp(-16383.0, 16383.0) as i16 as u16
}

fn log_speed(speed_bl_per_s: f64, v0_bl_per_s: f64) -> u16 {
    // The logarithm is clamped to -3..=3.2, or 0.05 to 24 body lengths a second: 6.2 radians fit 65536
    // turns.
    let log = libm::log(speed_bl_per_s.clamp(0.0, 100.0) + v0_bl_per_s);
    ((log + 3.0).clamp(0.0, 6.2) * Turns::PER_RAD).round() as u16
}
