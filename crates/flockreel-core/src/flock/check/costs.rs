//! Costs of states and jumps, computed from a library and a flock independently of the planner
//! (docs/explanation/algorithms.md, "Planning"). All costs are whole turns (65536 to the circle).

use std::iter::successors;

use super::optimum::{Edge, Graph, NEVER};
use crate::flock::Flock;
use crate::flock::individual::BoidTrack;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::flock::params::MatchBy;
use crate::geometry::angle::mirrored_rad;
use crate::geometry::{Turns, wrap_rad};
use crate::library::{Library, View};

/// Greatest cost of showing a state at a frame.
const MAX_SHOWN: u64 = (1 << 17) - 1;
/// Greatest cost of a jump.
const MAX_JUMP: f64 = 65535.0;
/// Greatest future cost.
const MAX_FUTURE: f64 = 134_217_728.0;
/// Factor by which the future cost counts less per frame.
const DISCOUNT: f64 = 0.995;

/// Quantities compared between a boid and a state, in turns: heading, or in top view the turn, and the
/// logarithm of the speed. With `MatchBy::Position` both components of the velocity.
pub(super) type Feature = [i64; 2];

/// Costs of a flock's states and jumps.
pub(super) struct Costs<'a> {
    library: &'a Library,
    pub(super) flock: &'a Flock,
    /// Source frame and mirror side of each state, rising.
    states: Vec<(u32, bool)>,
    features: Vec<Feature>,
}

impl<'a> Costs<'a> {
    pub(super) fn new(library: &'a Library, flock: &'a Flock) -> Costs<'a> {
        let sides = if flock.params.mirror {
            &[false, true][..]
        } else {
            &[false]
        };
        let frames = library.playback.component.iter();
        let states = frames.flat_map(|&frame| sides.iter().map(move |&side| (frame, side)));
        let mut costs = Costs {
            library,
            flock,
            states: states.collect(),
            features: Vec::new(),
        };
        costs.features = costs.shown();
        costs
    }

    /// Returns the state that shows a frame on a mirror side.
    pub(super) fn state(&self, frame: u32, side: bool) -> Option<usize> {
        self.states.binary_search(&(frame, side)).ok()
    }

    /// Returns the playback graph without the jumps after which playback would end.
    pub(super) fn graph(&self, dwell: usize) -> Graph {
        let matching = &self.flock.params.matching;
        let mut jumps = Vec::new();
        for jump in &self.library.playback.jumps {
            let share = jump.cost as f64 / self.library.epsilon.max(1) as f64;
            let transition = (matching.wx * Turns::PER_RAD * share).round().min(MAX_JUMP);
            let n_again = f64::from((jump.from + 1).saturating_sub(jump.to));
            let is_return = !jump.mirrored && n_again <= (1.3 * self.flock.fps).round();
            let w_p = if is_return {
                matching.w_p * Turns::PER_RAD
            } else {
                0.0
            };
            let cost = (transition + (w_p * n_again).round()).min(MAX_JUMP) as u64;
            for side in [false, true] {
                let target = self.state(jump.to, side != jump.mirrored);
                if let Some((from, to)) = self.state(jump.from, side).zip(target) {
                    jumps.push(Edge { from, to, cost });
                }
            }
        }
        let states = self.states.iter();
        let next: Vec<Option<usize>> = states
            .map(|&(frame, side)| self.state(frame + 1, side))
            .collect();
        drop_dead_ends(&mut jumps, &next, dwell);
        Graph { next, jumps }
    }

    /// Returns the features of each state.
    fn shown(&self) -> Vec<Feature> {
        let motion = motion_of(self.library, &Lens::new(self.library, &self.flock.params));
        let feature = |&(frame, is_mirrored): &(u32, bool)| {
            let moved = &motion[frame as usize];
            let ([x, y], turn) = (moved.velocity_bl_per_s, moved.turn_rad_per_s);
            let speed = moved.speed_bl_per_s;
            if is_mirrored {
                self.feature(mirrored_rad(moved.heading_rad), -turn, speed, [-x, y])
            } else {
                self.feature(moved.heading_rad, turn, speed, [x, y])
            }
        };
        self.states.iter().map(feature).collect()
    }

    /// Returns the features that a boid asks for at each frame of a segment.
    pub(super) fn wanted(&self, boid: &BoidTrack) -> Vec<Feature> {
        let headings = &boid.heading_rad;
        let feature = |t: usize| {
            let (before, after) = (t.saturating_sub(1), (t + 1).min(headings.len() - 1));
            let span_s = (after - before).max(1) as f64 / self.flock.fps;
            let turn = wrap_rad(headings[after] - headings[before]) / span_s;
            let (heading, speed) = (headings[t], boid.speed_bl_per_s[t]);
            let velocity = [libm::cos(heading), libm::sin(heading)].map(|axis| speed * axis);
            self.feature(heading, turn, speed, velocity)
        };
        (0..headings.len()).map(feature).collect()
    }

    /// Returns the feature of a motion, in radians, body lengths and seconds.
    fn feature(&self, heading: f64, turn: f64, speed: f64, velocity: [f64; 2]) -> Feature {
        // Velocities and turns are limited to a quarter circle.
        let limited = |rad: f64| (rad * Turns::PER_RAD).round().clamp(-16383.0, 16383.0) as i64;
        let median = (self.library.stats.speed_bl_per_s).map_or(1.0, |speeds| speeds[1]);
        let log_speed = libm::log(speed.clamp(0.0, 100.0) + (0.25 * median).max(0.05));
        let log_speed = ((log_speed + 3.0).clamp(0.0, 6.2) * Turns::PER_RAD).round() as i64;
        match (self.flock.params.matching.by, self.library.poses.view) {
            (MatchBy::Position, _) => velocity.map(limited),
            (_, View::Side) => [Turns::from_rad(heading).0.into(), log_speed],
            (_, View::Top) => [limited(0.25 * turn), log_speed],
        }
    }

    /// Returns the cost of showing each state, at the frame of an individual with its crowd cost.
    pub(super) fn row(&self, wanted: Feature, in_crowd: Option<(usize, usize)>) -> Vec<u64> {
        let alone = self
            .features
            .iter()
            .map(|&shown| self.alone(wanted, shown).min(MAX_SHOWN));
        let Some((id, t)) = in_crowd else {
            return alone.collect();
        };
        let with_crowd = alone
            .zip(self.crowd(id, t))
            .map(|(alone, crowd)| alone + crowd);
        with_crowd.map(|cost| cost.min(MAX_SHOWN)).collect()
    }

    /// Returns the cost of heading and speed. Weights are whole 256ths.
    fn alone(&self, wanted: Feature, shown: Feature) -> u64 {
        let matching = &self.flock.params.matching;
        let is_rotated = self.library.poses.view == View::Side && matching.by != MatchBy::Position;
        let rho_deg = if is_rotated { matching.rho_deg } else { 0.0 };
        let gap = i64::from((wanted[0] - shown[0]) as i16).abs();
        let within = gap.min(i64::from(Turns::from_rad(rho_deg.to_radians()).0));
        let w_v = if matching.by == MatchBy::Position {
            matching.w_h
        } else {
            matching.w_v
        };
        let [w_h, w_r, w_v] = [matching.w_h, matching.w_r, w_v].map(|w| (w * 256.0).round() as i64);
        let heading = w_h * (gap - within) + w_r * within;
        ((heading >> 8) + ((w_v * (wanted[1] - shown[1]).abs()) >> 8)) as u64
    }

    /// Returns the crowd cost of each state for individual `id` at frame `t`. The first 64 individuals watch
    /// all of smaller id, later ones all before their round of 16.
    fn crowd(&self, id: usize, t: usize) -> Vec<u64> {
        let length_px = self.library.stats.length_px.unwrap_or(1.0).max(1.0);
        let place =
            |boid: &BoidTrack| boid.position_px[t].map(|px| (px / length_px * 32.0).round());
        let here = place(&self.flock.individuals[id].boid);
        let window = ((0.3 * self.flock.fps).ceil() as u32).saturating_sub(1);
        let n_watched = if id < 64 { id } else { id / 16 * 16 };
        let mut costs = vec![0; self.states.len()];
        for other in &self.flock.individuals[..n_watched] {
            let there = place(&other.boid);
            let square: f64 = (0..3).map(|axis| (here[axis] - there[axis]).powi(2)).sum();
            let sixteenths = (square / 64.0).floor();
            if sixteenths >= 64.0 * 16.0 {
                continue;
            }
            let near = libm::exp(-(sixteenths + 0.5) / 16.0 / 32.0);
            let cost = (self.flock.params.matching.w_c * Turns::PER_RAD * near).round() as u64;
            let (frame, side) = (other.source_frame[t], other.mirrored[t]);
            let first = self
                .states
                .partition_point(|state| state.0 + window < frame);
            let near = self.states[first..].iter().zip(&mut costs[first..]);
            for (state, sum) in near.take_while(|(state, _)| state.0 <= frame + window) {
                *sum += if state.1 == side { cost } else { 0 };
            }
        }
        costs
    }
}

/// Removes the jumps after which playback would end: no jump leaves the run after the dwell.
fn drop_dead_ends(jumps: &mut Vec<Edge>, next: &[Option<usize>], dwell: usize) {
    loop {
        let n_before = jumps.len();
        let mut leaves = vec![false; next.len()];
        for jump in jumps.iter() {
            leaves[jump.from] = true;
        }
        jumps.retain(|jump| {
            let run = successors(Some(jump.to), |&state| next[state]);
            run.skip(dwell - 1).any(|state| leaves[state])
        });
        if jumps.len() == n_before {
            return;
        }
    }
}

/// Returns the future cost of each state, at least `NEVER` if playback cannot continue: the discounted cost of
/// the jumps that endless playback cannot avoid.
pub(super) fn future(graph: &Graph, dwell: usize) -> Vec<u64> {
    let after_dwell = (0..dwell).fold(1.0, |share, _| share * DISCOUNT);
    let mut future = vec![0.0; graph.next.len()];
    for _ in 0..256 {
        let mut now = vec![f64::INFINITY; future.len()];
        for jump in &graph.jumps {
            let mut run = successors(Some(jump.to), |&state| graph.next[state]);
            if let Some(free) = run.nth(dwell - 1) {
                let through = jump.cost as f64 + after_dwell * future[free];
                now[jump.from] = through.min(now[jump.from]);
            }
        }
        for (state, next) in graph.next.iter().enumerate().rev() {
            let later = next.map_or(f64::INFINITY, |next| DISCOUNT * now[next]);
            now[state] = later.min(now[state]);
        }
        future = now;
    }
    let whole = |cost: f64| cost.min(MAX_FUTURE).round() as u64;
    (future.into_iter())
        .map(|cost| if cost.is_finite() { whole(cost) } else { NEVER })
        .collect()
}
