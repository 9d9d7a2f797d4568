//! What a boid may do is what the animal was seen to do: speeds, turn rates, and in side view how
//! steeply it points (ALGORITHMS.md 7, "from the footage").

use crate::flock::individual::rounded;
use crate::flock::params::Params;
use crate::flock::plan::cost::FrameMotion;
use crate::library::{Library, View};

/// The limits of a boid, in body lengths and seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// A body length in the picture.
    pub length_px: f64,
    /// The speed it returns to.
    pub cruise_bl_per_s: f64,
    /// Least and greatest speed.
    pub speed_limits_bl_per_s: [f64; 2],
    /// Greatest turn rate.
    pub turn_rad_per_s: f64,
    /// In side view: greatest slope upward and downward, vertical to horizontal speed. `None` where
    /// every direction can be shown.
    pub slopes: Option<[f64; 2]>,
}

/// Share of the frames that the steepest headings may leave out.
const STEEPEST: f64 = 0.95;

impl Calibration {
    /// Measured on the frames that may be shown.
    pub fn of(library: &Library, motion: &[FrameMotion], params: &Params) -> Calibration {
        let stats = &library.stats;
        let [slow, cruise, fast] = stats.speed_bl_per_s.unwrap_or([0.5, 1.0, 1.5]);
        // An animal that mostly sits still would make a flock of statues: a quarter of its best.
        let cruise = cruise.max(0.25 * fast).max(0.05);
        Calibration {
            length_px: rounded(stats.length_px.unwrap_or(1.0).max(1.0), 2),
            cruise_bl_per_s: cruise,
            speed_limits_bl_per_s: [slow.max(0.25 * cruise).min(cruise), fast.max(cruise)],
            turn_rad_per_s: stats.turn_rate_rad_per_s.unwrap_or(2.0).clamp(0.5, 6.0),
            slopes: match (library.poses.view, params.depth_bl) {
                // Without depth there would be no way to turn round but through the vertical.
                (View::Top, _) | (View::Side, Some(0.0)) => None,
                (View::Side, _) => Some(slopes(library, motion, params)),
            },
        }
    }

    /// The greatest acceleration: what turns at the greatest rate at cruising speed.
    pub fn acceleration_bl_per_s2(&self) -> f64 {
        self.cruise_bl_per_s * self.turn_rad_per_s
    }
}

/// Slopes up and down that nearly all frames stay within, with what rotation adds.
fn slopes(library: &Library, motion: &[FrameMotion], params: &Params) -> [f64; 2] {
    let rise = |frame: &u32| libm::sin(motion[*frame as usize].heading_rad);
    let mut rises: Vec<f64> = library.playback.component.iter().map(rise).collect();
    rises.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| match rises.len() {
        0 => 0.0,
        n => rises[((n - 1) as f64 * share).round() as usize],
    };
    // A heading's budget, not all of it: the rest is for what the plan cannot meet.
    let budget_rad = params.matching.rho_deg.to_radians();
    let slope = |rise: f64| {
        let steepest = (libm::asin(rise.clamp(0.0, 1.0)) + budget_rad).clamp(0.1, 1.2);
        libm::tan(steepest)
    };
    [slope(-at(1.0 - STEEPEST)), slope(at(STEEPEST))]
}
