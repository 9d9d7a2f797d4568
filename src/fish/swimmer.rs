//! A wandering swimmer in a tank: how the sample fish moves. Ornstein-Uhlenbeck turn rate and speed,
//! now and then a dart aside, and a turn away from every wall that comes near. Seeded.

use std::f64::consts::PI;

use glam::DVec3;

use super::spine::tail_beat_hz;
use crate::geometry::wrap_rad;
use crate::random;

/// Width, height and depth of the tank, metres.
pub const TANK_M: [f64; 3] = [0.60, 0.36, 0.30];
/// Distance from the camera to the tank's front pane, metres.
pub const PANE_Z_M: f64 = 0.70;

/// How far ahead it looks for a wall, metres.
const LOOK_AHEAD_M: f64 = 0.10;
/// How near its middle may come to a wall: ahead and behind it is half a fish.
const CLEARANCE_M: [f64; 3] = [0.055, 0.045, 0.055];

/// The swimmer at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Camera frame, metres.
    pub position_m: DVec3,
    /// atan2(dz, dx) of the direction, in (-pi, pi].
    pub yaw_rad: f64,
    /// asin(dy) of the direction: positive = nose down.
    pub pitch_rad: f64,
    /// Metres a second.
    pub speed_m_per_s: f64,
    /// Turn rate, radians a second, positive to the left of the fish.
    pub turn_rad_per_s: f64,
    /// Tail beats since the start.
    pub phase_turns: f64,
}

impl Stroke {
    /// Unit vector along which it swims.
    pub fn forward(&self) -> DVec3 {
        let (cos_pitch, sin_pitch) = (libm::cos(self.pitch_rad), libm::sin(self.pitch_rad));
        DVec3::new(
            libm::cos(self.yaw_rad) * cos_pitch,
            sin_pitch,
            libm::sin(self.yaw_rad) * cos_pitch,
        )
    }
}

/// `n_frames` moments at `fps` of a swimmer `length_m` long.
pub fn wander(seed: u64, n_frames: usize, fps: f64, length_m: f64) -> Vec<Stroke> {
    let dt_s = 1.0 / fps;
    let mut now = Stroke {
        position_m: DVec3::new(0.0, 0.0, PANE_Z_M + 0.5 * TANK_M[2]),
        yaw_rad: PI * (2.0 * random::unit(seed, &[0, 0]) - 1.0),
        pitch_rad: 0.0,
        speed_m_per_s: 0.09,
        turn_rad_per_s: 0.0,
        phase_turns: 0.0,
    };
    (1..=n_frames as u64)
        .map(|step| {
            wish(&mut now, seed, step, dt_s);
            avoid_walls(&mut now, dt_s);
            advance(&mut now, dt_s, length_m);
            now
        })
        .collect()
}

/// What it would do in open water.
fn wish(now: &mut Stroke, seed: u64, step: u64, dt_s: f64) {
    let noise = |channel: u64| random::normal(seed, &[step, channel]);
    let chance = |channel: u64| random::unit(seed, &[step, channel]);
    // White noise of the same strength per second at any frame rate.
    let kick = (dt_s / 30.0).sqrt();
    now.turn_rad_per_s += -2.2 * now.turn_rad_per_s * dt_s + 6.5 * noise(1) * kick;
    if chance(2) < 0.35 * dt_s {
        let side = if chance(3) < 0.5 { -1.0 } else { 1.0 };
        now.turn_rad_per_s += side * (2.0 + 2.0 * chance(4));
    }
    now.speed_m_per_s += 0.8 * (0.10 - now.speed_m_per_s) * dt_s + 0.22 * noise(5) * kick;
    now.speed_m_per_s = now.speed_m_per_s.clamp(0.02, 0.24);
    now.pitch_rad += -0.8 * now.pitch_rad * dt_s + 1.9 * noise(6) * kick;
}

/// Turns from what lies ahead, sharper and slower the nearer it is.
fn avoid_walls(now: &mut Stroke, dt_s: f64) {
    let ahead = now.position_m + LOOK_AHEAD_M * now.forward();
    let into = inward(ahead);
    let depth_m = into.x.hypot(into.z);
    if depth_m > 0.0 {
        let gap = wrap_rad(libm::atan2(into.z, into.x) - now.yaw_rad);
        let urgency = (0.35 + depth_m / 0.04).min(1.5);
        now.turn_rad_per_s += 15.0 * urgency * gap.clamp(-1.0, 1.0) * dt_s;
        now.speed_m_per_s += 1.6 * urgency * (0.06 - now.speed_m_per_s) * dt_s;
    }
    now.turn_rad_per_s = now.turn_rad_per_s.clamp(-4.0, 4.0);
    now.pitch_rad = (now.pitch_rad + 70.0 * into.y * dt_s).clamp(-0.5, 0.5);
}

/// How far the point would have to move to be clear of every wall, metres.
fn inward(point: DVec3) -> DVec3 {
    let [lo, hi] = clear_water();
    point.clamp(lo, hi) - point
}

fn clear_water() -> [DVec3; 2] {
    let clear = DVec3::from(CLEARANCE_M);
    let half = DVec3::new(0.5 * TANK_M[0], 0.5 * TANK_M[1], 0.5 * TANK_M[2]);
    let middle = DVec3::new(0.0, 0.0, PANE_Z_M + half.z);
    [middle - half + clear, middle + half - clear]
}

fn advance(now: &mut Stroke, dt_s: f64, length_m: f64) {
    now.yaw_rad = wrap_rad(now.yaw_rad + now.turn_rad_per_s * dt_s);
    let [lo, hi] = clear_water();
    let step = now.speed_m_per_s * dt_s * now.forward();
    now.position_m = (now.position_m + step).clamp(lo, hi);
    now.phase_turns += tail_beat_hz(now.speed_m_per_s / length_m) * dt_s;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nose_and_tail_stay_inside_the_tank() {
        let half = DVec3::new(0.5 * TANK_M[0], 0.5 * TANK_M[1], 0.5 * TANK_M[2]);
        let middle = DVec3::new(0.0, 0.0, PANE_Z_M + half.z);
        for seed in 1..=8 {
            for stroke in wander(seed, 3000, 30.0, 0.1) {
                for reach in [-0.054, 0.046] {
                    let end = stroke.position_m + reach * stroke.forward() - middle;
                    assert!(end.abs().cmple(half).all(), "seed {seed}: {stroke:?}");
                }
            }
        }
    }

    #[test]
    fn it_moves_along_its_direction_and_never_jumps() {
        let strokes = wander(3, 3000, 30.0, 0.1);
        let mut n_slid = 0;
        for pair in strokes.windows(2) {
            let step = pair[1].position_m - pair[0].position_m;
            assert!(step.length() <= 0.24 / 30.0 + 1e-12);
            let along = step.dot(pair[1].forward());
            n_slid += usize::from((step.length() - along).abs() > 1e-9);
        }
        assert!(
            n_slid < strokes.len() / 20,
            "slid along a wall in {n_slid} frames"
        );
    }

    #[test]
    fn it_faces_every_way_and_uses_the_whole_tank() {
        let strokes = wander(1, 3000, 30.0, 0.1);
        let mut octants = [0; 8];
        for stroke in &strokes {
            octants[((stroke.yaw_rad + PI) / (PI / 4.0)) as usize % 8] += 1;
        }
        assert!(octants.iter().all(|&n| n > 60), "{octants:?}");
        let spread = |axis: usize| {
            let values = strokes.iter().map(|s| s.position_m[axis]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        assert!(spread(0) > 0.35 && spread(1) > 0.15 && spread(2) > 0.15);
    }
}
