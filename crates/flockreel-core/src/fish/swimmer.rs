//! Random swimmer in a tank: the motion of the sample fish.
//!
//! Turn rate and speed are Ornstein-Uhlenbeck processes. Now and then the fish turns aside abruptly, and it
//! turns away from walls ahead. All random numbers depend on the seed.

use std::f64::consts::PI;

use glam::DVec3;

use super::spine::tail_beat_hz;
use crate::geometry::wrap_rad;
use crate::random;

/// Width, height and depth of the tank, in metres. Free choice.
pub const TANK_M: [f64; 3] = [0.60, 0.36, 0.30];
/// Distance from the camera to the tank's front pane, in metres. Free choice.
pub const PANE_Z_M: f64 = 0.70;

/// Distance ahead at which the fish reacts to a wall, in metres. Free choice.
const LOOK_AHEAD_M: f64 = 0.11;
/// Least distance of the middle of the fish from a wall along x, y and z, in metres. Half of the fish lies
/// ahead of its middle and half behind.
const CLEARANCE_M: [f64; 3] = [0.055, 0.045, 0.055];

/// State of the swimmer in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwimmerState {
    /// Position in the camera frame, in metres.
    pub position_m: DVec3,
    /// Yaw: atan2(dz, dx) of the direction, in (-pi, pi].
    pub yaw_rad: f64,
    /// Pitch: asin(dy) of the direction; positive = nose down.
    pub pitch_rad: f64,
    /// Speed, in metres a second.
    pub speed_m_per_s: f64,
    /// Turn rate, in radians a second; positive = to the left of the fish.
    pub turn_rad_per_s: f64,
    /// Number of tail beats since the start.
    pub phase_turns: f64,
}

impl SwimmerState {
    /// Returns the direction of the swimmer, a unit vector.
    pub fn forward(&self) -> DVec3 {
        let (cos_pitch, sin_pitch) = (libm::cos(self.pitch_rad), libm::sin(self.pitch_rad));
        DVec3::new(
            libm::cos(self.yaw_rad) * cos_pitch,
            sin_pitch,
            libm::sin(self.yaw_rad) * cos_pitch,
        )
    }
}

/// Returns `n_frames` states of a swimmer of `length_m`, at `fps` frames a second.
pub fn simulate(seed: u64, n_frames: usize, fps: f64, length_m: f64) -> Vec<SwimmerState> {
    let dt_s = 1.0 / fps;
    let mut state = SwimmerState {
        position_m: DVec3::new(0.0, 0.0, PANE_Z_M + 0.5 * TANK_M[2]),
        yaw_rad: PI * (2.0 * random::uniform(seed, &[0, 0]) - 1.0),
        pitch_rad: 0.0,
        speed_m_per_s: 0.09,
        turn_rad_per_s: 0.0,
        phase_turns: 0.0,
    };
    (1..=n_frames as u64)
        .map(|step| {
            steer_at_random(&mut state, seed, step, dt_s);
            avoid_walls(&mut state, dt_s);
            advance(&mut state, dt_s, length_m);
            state
        })
        .collect()
}

/// Changes turn rate, speed and pitch at random, as in open water.
fn steer_at_random(state: &mut SwimmerState, seed: u64, step: u64, dt_s: f64) {
    let noise = |channel: u64| random::normal(seed, &[step, channel]);
    let chance = |channel: u64| random::uniform(seed, &[step, channel]);
    // The strength of the noise per second does not depend on the frame rate.
    let kick = (dt_s / 30.0).sqrt();
    state.turn_rad_per_s += -2.2 * state.turn_rad_per_s * dt_s + 6.5 * noise(1) * kick;
    if chance(2) < 0.35 * dt_s {
        let side = if chance(3) < 0.5 { -1.0 } else { 1.0 };
        state.turn_rad_per_s += side * (2.0 + 2.0 * chance(4));
    }
    state.speed_m_per_s += 0.8 * (0.10 - state.speed_m_per_s) * dt_s + 0.22 * noise(5) * kick;
    state.speed_m_per_s = state.speed_m_per_s.clamp(0.02, 0.24);
    state.pitch_rad += -0.8 * state.pitch_rad * dt_s + 1.9 * noise(6) * kick;
}

/// Turns the fish away from a wall ahead. The nearer the wall, the sharper the turn and the slower the
/// fish.
fn avoid_walls(state: &mut SwimmerState, dt_s: f64) {
    let ahead = state.position_m + LOOK_AHEAD_M * state.forward();
    let into = inward(ahead);
    let depth_m = into.x.hypot(into.z);
    if depth_m > 0.0 {
        let mut gap = wrap_rad(libm::atan2(into.z, into.x) - state.yaw_rad);
        if gap.abs() > 2.0 {
            // Head-on, both sides are equally good. The fish keeps its present direction of turning.
            gap = gap.abs().copysign(state.turn_rad_per_s);
        }
        let urgency = (0.3 + depth_m / 0.04).min(1.6);
        state.turn_rad_per_s += 8.0 * urgency * gap.clamp(-1.0, 1.0) * dt_s;
        state.speed_m_per_s += 1.6 * urgency * (0.06 - state.speed_m_per_s) * dt_s;
    }
    state.turn_rad_per_s = state.turn_rad_per_s.clamp(-4.0, 4.0);
    if into.y != 0.0 {
        let away_rad = (12.0 * into.y).clamp(-0.4, 0.4);
        state.pitch_rad += 7.0 * (away_rad - state.pitch_rad) * dt_s;
    }
    state.pitch_rad = state.pitch_rad.clamp(-0.5, 0.5);
}

/// Returns the displacement that moves a point clear of every wall, in metres.
fn inward(point: DVec3) -> DVec3 {
    let [lo, hi] = allowed_region();
    point.clamp(lo, hi) - point
}

fn allowed_region() -> [DVec3; 2] {
    let clear = DVec3::from(CLEARANCE_M);
    let half = 0.5 * DVec3::from(TANK_M);
    let middle = DVec3::new(0.0, 0.0, PANE_Z_M + half.z);
    [middle - half + clear, middle + half - clear]
}

fn advance(state: &mut SwimmerState, dt_s: f64, length_m: f64) {
    state.yaw_rad = wrap_rad(state.yaw_rad + state.turn_rad_per_s * dt_s);
    let [lo, hi] = allowed_region();
    let step = state.speed_m_per_s * dt_s * state.forward();
    state.position_m = (state.position_m + step).clamp(lo, hi);
    state.phase_turns += tail_beat_hz(state.speed_m_per_s / length_m) * dt_s;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nose_and_tail_stay_inside_the_tank() {
        let half = 0.5 * DVec3::from(TANK_M);
        let middle = DVec3::new(0.0, 0.0, PANE_Z_M + half.z);
        for seed in 1..=8 {
            for state in simulate(seed, 3000, 30.0, 0.1) {
                for reach in [-0.054, 0.046] {
                    let end = state.position_m + reach * state.forward() - middle;
                    assert!(end.abs().cmple(half).all(), "seed {seed}: {state:?}");
                }
            }
        }
    }

    #[test]
    fn swimmer_moves_along_its_direction_without_jumps() {
        let states = simulate(3, 3000, 30.0, 0.1);
        let mut n_slid = 0;
        for pair in states.windows(2) {
            let step = pair[1].position_m - pair[0].position_m;
            assert!(step.length() <= 0.24 / 30.0 + 1e-12);
            let along = step.dot(pair[1].forward());
            n_slid += usize::from((step.length() - along).abs() > 1e-9);
        }
        assert!(
            n_slid < states.len() / 20,
            "slid along a wall in {n_slid} frames"
        );
    }

    #[test]
    fn swimmer_faces_every_direction_and_visits_the_whole_tank() {
        let states = simulate(1, 3000, 30.0, 0.1);
        let mut octants = [0; 8];
        for state in &states {
            octants[((state.yaw_rad + PI) / (PI / 4.0)) as usize % 8] += 1;
        }
        assert!(octants.iter().all(|&n| n > 60), "{octants:?}");
        let spread = |axis: usize| {
            let values = states.iter().map(|s| s.position_m[axis]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        assert!(spread(0) > 0.35 && spread(1) > 0.15 && spread(2) > 0.15);
    }
}
