//! Limits of boids, measured on the animal: speeds, turn rates, and in side view slopes
//! (docs/explanation/algorithms.md, "Boids").

use super::tank::Tank;
use crate::flock::motion::FrameMotion;
use crate::library::{Library, View};
use crate::order::percentile;

/// Limits of a boid.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Cruising speed, body lengths per second.
    pub cruise_bl_per_s: f64,
    /// Least and greatest speed, body lengths per second.
    pub speed_limits_bl_per_s: [f64; 2],
    /// Greatest turn rate, radians per second.
    pub turn_rad_per_s: f64,
    /// Root mean square of the turn rate, radians per second.
    pub wander_rad_per_s: f64,
    /// Slopes in side view. `None` in top view and in a tank without depth: slopes then have no limits.
    pub slopes: Option<Slopes>,
}

/// Slopes at which the animal swims: vertical over horizontal speed, positive downward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slopes {
    /// Greatest slope upward and downward, both positive.
    pub limits: [f64; 2],
    /// Median slope.
    pub usual: f64,
    /// Standard deviation of the slope, from the middle two thirds of the frames.
    pub spread: f64,
    /// Greatest slope in the image, upward and downward, both positive. A boid that swims nearly along the
    /// line of sight is seen at a steep slope if it rises a little. The same holds if it keeps its height far
    /// above or below the camera.
    pub in_picture: [f64; 2],
}

/// Share of frames that rise more steeply than the upward limit, and of frames that sink more steeply than
/// the downward limit. Free choice.
const STEEP_SHARE: f64 = 0.02;
/// Share for slopes in the image, defined as above. For steeper boids, plans would find too few frames. Free
/// choice.
const STEEP_SHARE_IN_PICTURE: f64 = 0.15;
/// Share of frames below the greatest speed, and below the greatest turn rate
/// (docs/explanation/algorithms.md, "Boids").
const FAST_SHARE: f64 = 0.95;
/// Largest value of the greatest turn rate, radians per second. Free choice.
const MAX_TURN_RAD_PER_S: f64 = 6.0;
/// Largest radius of a turn at cruising speed, as a share of half the width of the tank. Free choice. A boid
/// in the middle can turn round before either wall.
const MAX_TURN_RADIUS_SHARE: f64 = 0.5;
/// Share of frames below the least speed (docs/explanation/algorithms.md, "Boids").
const SLOW_SHARE: f64 = 0.05;
/// Least and greatest angle of a slope limit, radians. Free choices.
const MIN_SLOPE_RAD: f64 = 0.05;
const MAX_SLOPE_RAD: f64 = 1.2;

impl Default for Calibration {
    /// Returns the limits for an unknown animal, which swims straight ahead.
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
    /// Returns the limits measured on the frames that may be shown. `flat` means that the tank has no depth.
    /// Boids can then turn round only through the vertical, so slopes have no limits.
    pub fn from_library(library: &Library, motion: &[FrameMotion], flat: bool) -> Calibration {
        let shown = || (library.playback.component.iter()).map(|&frame| &motion[frame as usize]);
        let mut paces: Vec<f64> = shown().filter_map(|m| m.pace_bl_per_s).collect();
        let unknown = Calibration::default();
        let [min, max] = unknown.speed_limits_bl_per_s;
        let mut speed = |share, default| percentile(&mut paces, share).unwrap_or(default);
        let (slow, fast) = (speed(SLOW_SHARE, min), speed(FAST_SHARE, max));
        let cruise = speed(0.5, unknown.cruise_bl_per_s);
        // The boids of an animal that mostly rests still cruise at a quarter of its greatest speed.
        let cruise = cruise.max(0.25 * fast).max(0.05);
        let mut swings: Vec<f64> = shown().filter_map(|m| m.swing_rad_per_s).collect();
        let fast_turn = percentile(&mut swings, FAST_SHARE);
        let fast_turn = fast_turn.map(|rate| rate.clamp(0.5, MAX_TURN_RAD_PER_S));
        let turn_rad_per_s = fast_turn.unwrap_or(unknown.turn_rad_per_s);
        Calibration {
            cruise_bl_per_s: cruise,
            speed_limits_bl_per_s: [slow.max(0.25 * cruise).min(cruise), fast.max(cruise)],
            turn_rad_per_s,
            wander_rad_per_s: root_mean_square(&swings, turn_rad_per_s),
            slopes: (library.poses.view == View::Side && !flat).then(|| {
                let pitches = shown().map(|m| libm::asin(m.forward[1].clamp(-1.0, 1.0)));
                let elevations = shown().map(|m| libm::asin(libm::sin(m.heading_rad)));
                Slopes::from_angles(pitches.collect(), elevations.collect())
            }),
        }
    }

    /// Returns the limits with a turn rate at which a boid can turn round in the tank at cruising speed.
    /// Short footage may never show the animal turning.
    pub fn in_tank(self, tank: &Tank) -> Calibration {
        let [x, y, z] = tank.half_extent_bl;
        let narrow_bl = if tank.is_flat() { x.min(y) } else { x.min(z) };
        let min_rate = self.cruise_bl_per_s / (MAX_TURN_RADIUS_SHARE * narrow_bl).max(1e-3);
        Calibration {
            turn_rad_per_s: self.turn_rad_per_s.max(min_rate.min(MAX_TURN_RAD_PER_S)),
            ..self
        }
    }

    /// Returns the usual acceleration: that of a turn at 1.5 times the root mean square of the turn rate, at
    /// cruising speed.
    pub fn usual_acceleration_bl_per_s2(&self) -> f64 {
        let usual = 1.5 * self.wander_rad_per_s;
        self.cruise_bl_per_s * usual.min(self.turn_rad_per_s)
    }

    /// Returns the greatest acceleration: that of a turn at the greatest rate, at cruising speed.
    pub fn acceleration_bl_per_s2(&self) -> f64 {
        self.cruise_bl_per_s * self.turn_rad_per_s
    }
}

impl Slopes {
    /// Returns the slopes for pitches in space and for angles to the horizontal in the image, radians,
    /// positive downward.
    fn from_angles(mut pitches: Vec<f64>, mut elevations: Vec<f64>) -> Slopes {
        let limits = |angles: &mut Vec<f64>, steep_share: f64| {
            let [up, down] =
                [steep_share, 1.0 - steep_share].map(|share| percentile(angles, share));
            [up.map_or(0.0, |up| -up), down.unwrap_or(0.0)]
                .map(|rad| libm::tan(rad.clamp(MIN_SLOPE_RAD, MAX_SLOPE_RAD)))
        };
        let in_space = limits(&mut pitches, STEEP_SHARE);
        let mut at = |share| percentile(&mut pitches, share).unwrap_or(0.0);
        let [low, usual, high] = [0.1587, 0.5, 0.8413].map(|share| libm::tan(at(share)));
        Slopes {
            limits: in_space,
            usual,
            spread: 0.5 * (high - low),
            in_picture: limits(&mut elevations, STEEP_SHARE_IN_PICTURE),
        }
    }
}

/// Returns the root mean square of values cut to `limit`. Larger values are noise.
fn root_mean_square(values: &[f64], limit: f64) -> f64 {
    let squares: f64 = values.iter().map(|v| v.min(limit) * v.min(limit)).sum();
    (squares / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_limits_follow_the_measured_angles_in_each_direction() {
        let degrees = |least: i32, most: i32| (least..=most).map(|deg| f64::from(deg).to_radians());
        let slopes = Slopes::from_angles(degrees(-50, 0).collect(), degrees(-50, 10).collect());
        let close = |slope: f64, deg: f64| assert!((slope.atan().to_degrees() - deg).abs() < 1e-9);
        close(slopes.limits[0], 49.0);
        close(slopes.limits[1], MIN_SLOPE_RAD.to_degrees());
        close(slopes.in_picture[0], 41.0);
        close(slopes.in_picture[1], MIN_SLOPE_RAD.to_degrees());
        close(slopes.usual, -25.0);
    }
}
