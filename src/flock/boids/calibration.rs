//! What a boid may do is what the animal was seen to do: speeds, turn rates, and in side view how
//! steeply it points (ALGORITHMS.md 7, "from the footage").

use super::tank::Tank;
use crate::flock::motion::FrameMotion;
use crate::library::{Library, View};
use crate::order::percentile;

/// The limits of a boid, in body lengths and seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The speed it returns to.
    pub cruise_bl_per_s: f64,
    /// Least and greatest speed.
    pub speed_limits_bl_per_s: [f64; 2],
    /// Greatest turn rate.
    pub turn_rad_per_s: f64,
    /// Root mean square of the turn rate.
    pub wander_rad_per_s: f64,
    /// In side view with depth. `None` where every direction can be shown.
    pub slopes: Option<Slopes>,
}

/// How steeply the animal swims: vertical to level speed, positive downward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slopes {
    /// Greatest slope upward (positive) and downward.
    pub limits: [f64; 2],
    /// The median.
    pub usual: f64,
    /// Standard deviation, from the middle two thirds.
    pub spread: f64,
    /// Greatest slope in the picture, upward and downward: an animal may be seen to rise often and hardly ever to sink.
    /// Who swims nearly along the line of sight is seen to head steeply when it rises a little, or keeps its height far
    /// above the camera or below.
    pub in_picture: [f64; 2],
}

/// Share of the frames that may rise more steeply than a boid, and of those that may sink so.
const STEEPER: f64 = 0.02;
/// Share of the frames that rise more steeply in the picture than a boid may be seen to, and of those that sink so: few
/// frames, for which no plan finds one that follows.
const STEEPER_IN_PICTURE: f64 = 0.15;
/// Share of the frames that are slower, or turn less, than a boid may at most.
const FASTEST: f64 = 0.95;
/// No boid turns faster.
const FASTEST_TURN_RAD_PER_S: f64 = 6.0;
/// Greatest radius of a turn, as a share of half the width of the tank. A free choice: a boid that swims along the middle can
/// turn round before either wall.
const TURNED_IN: f64 = 0.5;
/// And of those that are slower than it must be.
const SLOWEST: f64 = 0.05;
/// A boid may point this steeply whatever was seen.
const LEAST_STEEP_RAD: f64 = 0.05;
const MOST_STEEP_RAD: f64 = 1.2;

impl Default for Calibration {
    /// Of an animal that nothing is known of: it goes straight on.
    fn default() -> Calibration {
        Calibration {
            cruise_bl_per_s: 1.0,
            speed_limits_bl_per_s: [0.5, 1.5],
            turn_rad_per_s: 2.0,
            wander_rad_per_s: 0.0,
            slopes: None,
        }
    }
}

impl Calibration {
    /// Measured on the frames that may be shown. `flat`: without depth, where there is no way to turn round
    /// but through the vertical.
    pub fn of(library: &Library, motion: &[FrameMotion], flat: bool) -> Calibration {
        let shown = || (library.playback.component.iter()).map(|&frame| &motion[frame as usize]);
        let mut paces: Vec<f64> = shown().filter_map(|m| m.pace_bl_per_s).collect();
        let unknown = Calibration::default();
        let (cruise, [slow, fast]) = (unknown.cruise_bl_per_s, unknown.speed_limits_bl_per_s);
        let [slow, cruise, fast] = [(SLOWEST, slow), (0.5, cruise), (FASTEST, fast)]
            .map(|(share, usual)| percentile(&mut paces, share).unwrap_or(usual));
        // An animal that mostly sits still would make a flock of statues: a quarter of its best.
        let cruise = cruise.max(0.25 * fast).max(0.05);
        let mut swings: Vec<f64> = shown().filter_map(|m| m.swing_rad_per_s).collect();
        let turn_rad_per_s = percentile(&mut swings, FASTEST)
            .map_or(unknown.turn_rad_per_s, |rate| {
                rate.clamp(0.5, FASTEST_TURN_RAD_PER_S)
            });
        Calibration {
            cruise_bl_per_s: cruise,
            speed_limits_bl_per_s: [slow.max(0.25 * cruise).min(cruise), fast.max(cruise)],
            turn_rad_per_s,
            wander_rad_per_s: root_mean_square(&swings, turn_rad_per_s),
            slopes: (library.poses.view == View::Side && !flat).then(|| {
                let pitches = shown().map(|m| libm::asin(m.forward[1].clamp(-1.0, 1.0)));
                let elevations = shown().map(|m| libm::asin(libm::sin(m.heading_rad)));
                Slopes::of(pitches.collect(), elevations.collect())
            }),
        }
    }

    /// The same with a turn rate that lets a boid turn round in the tank at cruising speed. A short film may never show the
    /// animal turning.
    pub fn in_tank(self, tank: &Tank) -> Calibration {
        let [x, y, z] = tank.reach_bl;
        let narrow_bl = if tank.is_flat() { x.min(y) } else { x.min(z) };
        let least = self.cruise_bl_per_s / (TURNED_IN * narrow_bl).max(1e-3);
        Calibration {
            turn_rad_per_s: self.turn_rad_per_s.max(least.min(FASTEST_TURN_RAD_PER_S)),
            ..self
        }
    }

    /// The usual acceleration: what turns half again as fast as the animal does on average, at cruising speed.
    pub fn usual_acceleration_bl_per_s2(&self) -> f64 {
        let usual = 1.5 * self.wander_rad_per_s;
        self.cruise_bl_per_s * usual.min(self.turn_rad_per_s)
    }

    /// The greatest acceleration: what turns at the greatest rate at cruising speed.
    pub fn acceleration_bl_per_s2(&self) -> f64 {
        self.cruise_bl_per_s * self.turn_rad_per_s
    }
}

impl Slopes {
    /// Of an animal seen at these pitches in space, and at these angles to the horizontal in the picture; positive downward.
    fn of(mut pitches: Vec<f64>, mut elevations: Vec<f64>) -> Slopes {
        let limits = |angles: &mut Vec<f64>, steeper: f64| {
            let [up, down] = [steeper, 1.0 - steeper].map(|share| percentile(angles, share));
            [up.map_or(0.0, |up| -up), down.unwrap_or(0.0)]
                .map(|rad| libm::tan(rad.clamp(LEAST_STEEP_RAD, MOST_STEEP_RAD)))
        };
        let in_space = limits(&mut pitches, STEEPER);
        let mut at = |share| percentile(&mut pitches, share).unwrap_or(0.0);
        let [low, usual, high] = [0.1587, 0.5, 0.8413].map(|share| libm::tan(at(share)));
        Slopes {
            limits: in_space,
            usual,
            spread: 0.5 * (high - low),
            in_picture: limits(&mut elevations, STEEPER_IN_PICTURE),
        }
    }
}

/// Of values up to `most`: what was measured beyond is noise.
fn root_mean_square(values: &[f64], most: f64) -> f64 {
    let squares: f64 = values.iter().map(|v| v.min(most) * v.min(most)).sum();
    (squares / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_was_seen_to_rise_steeply_and_hardly_to_sink_may_do_just_that() {
        let degrees = |least: i32, most: i32| (least..=most).map(|deg| f64::from(deg).to_radians());
        let slopes = Slopes::of(degrees(-50, 0).collect(), degrees(-50, 10).collect());
        let close = |slope: f64, deg: f64| assert!((slope.atan().to_degrees() - deg).abs() < 1e-9);
        close(slopes.limits[0], 49.0);
        close(slopes.limits[1], LEAST_STEEP_RAD.to_degrees());
        close(slopes.in_picture[0], 41.0);
        close(slopes.in_picture[1], LEAST_STEEP_RAD.to_degrees());
        close(slopes.usual, -25.0);
    }
}
