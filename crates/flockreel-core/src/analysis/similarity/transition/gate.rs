//! The heading gate. In side view, two clips may be joined only if the animal points in the same direction
//! (Okabe et al., section 3.3). In top view, sprites are rotated to any heading, so the gate compares turning
//! rates (docs/explanation/algorithms.md, "Transitions and playback").

use std::f64::consts::TAU;

use crate::analysis::Params;
use crate::analysis::similarity::distance::Marks;
use crate::geometry::angle::{mean_rad, mirrored_rad, wrap_rad};
use crate::library::{Poses, View};

/// Largest difference between turning rates in top view, radians per second: 20 degrees per second. Free
/// choice.
const TURN_GATE_RAD_PER_S: f64 = TAU / 18.0;

/// Decides which pairs of clips pass.
pub(super) struct Gate {
    /// `None` where a heading is unknown or the headings cancel.
    clips: Vec<Option<ClipMotion>>,
    view: View,
    heading_gate_rad: f64,
    /// The compared quantity of each clip as a fraction of a circle, 2^32 units to the circle, so that
    /// differences wrap. Headings in side view, scaled turning rates in top view; 0 where unknown.
    units: Vec<u32>,
    /// Largest difference that may pass, in the same units, with a margin for rounding.
    max_gap_units: u32,
}

/// Direction and turn of the animal during a clip.
#[derive(Clone, Copy)]
struct ClipMotion {
    mean_heading_rad: f64,
    turn_rate_rad_per_s: f64,
}

impl ClipMotion {
    fn mirrored(self) -> ClipMotion {
        ClipMotion {
            mean_heading_rad: mirrored_rad(self.mean_heading_rad),
            turn_rate_rad_per_s: -self.turn_rate_rad_per_s,
        }
    }
}

/// Units per radian. Rounding errors are far below any relevant difference.
const UNITS_PER_RAD: f64 = 4_294_967_296.0 / TAU;
/// Turning rates are clamped to this, radians per second, so that scaled rates differ by less than half a
/// circle.
const MAX_TURN_RATE_RAD_PER_S: f64 = 1000.0;
/// Scale from turning rates to angles, radians per (radian per second). The difference between the two
/// extreme rates then stays below half a circle.
const RATE_SCALE: f64 = 1e-3;

impl Gate {
    /// Computes the gate for every clip of the footage.
    pub(super) fn new(poses: &Poses, clip_frames: usize, params: &Params) -> Gate {
        let headings: Vec<Option<f64>> = poses.frames.iter().map(|pose| pose.heading_rad).collect();
        let motion = |clip: &[Option<f64>]| {
            let headings_rad: Vec<f64> = clip.iter().copied().collect::<Option<_>>()?;
            Some(ClipMotion {
                mean_heading_rad: mean_rad(headings_rad.iter().copied())?,
                turn_rate_rad_per_s: turn_rate(&headings_rad) * poses.fps,
            })
        };
        let clips: Vec<_> = headings.windows(clip_frames).map(motion).collect();
        let heading_gate_rad = params.heading_gate_deg.to_radians();
        let max_gap_rad = match poses.view {
            View::Side => heading_gate_rad,
            View::Top => TURN_GATE_RAD_PER_S * RATE_SCALE,
        };
        let units = clips
            .iter()
            .map(|clip| clip.map_or(0, |clip| units(poses.view, clip)));
        Gate {
            units: units.collect(),
            max_gap_units: ((max_gap_rad * UNITS_PER_RAD).ceil() as u32).saturating_add(4),
            clips,
            view: poses.view,
            heading_gate_rad,
        }
    }

    /// Marks the pairs of clip `i` that may pass: entry k is the pair (i, i + k).
    ///
    /// Every pair that passes is marked, and few others. The test uses integers, because it runs on every
    /// pair of the footage.
    pub(super) fn mark_passing(&self, i: usize, mirrored: bool, row: &mut Marks) {
        let as_shown = match (self.view, mirrored) {
            // Mirroring turns a heading h into pi - h and reverses a turning rate.
            (_, false) => |units: u32| units,
            (View::Side, true) => |units: u32| (1u32 << 31).wrapping_sub(units),
            (View::Top, true) => |units: u32| units.wrapping_neg(),
        };
        let units = as_shown(self.units[i]);
        row.mark_where(&self.units[i..], |&other| {
            let gap = units.wrapping_sub(other) as i32;
            gap.unsigned_abs() <= self.max_gap_units
        });
    }

    /// Returns the difference between the mean headings of two clips, 0..=pi, or `None` if the pair does not
    /// pass.
    ///
    /// A mirrored pair compares heading i with pi - heading j, and turning rate i with minus turning rate j.
    /// A clip with an unknown heading never passes.
    pub(super) fn passing_gap_rad(&self, i: usize, j: usize, mirrored: bool) -> Option<f64> {
        let (a, b) = (self.clips[i]?, self.clips[j]?);
        let b = if mirrored { b.mirrored() } else { b };
        let gap_rad = wrap_rad(a.mean_heading_rad - b.mean_heading_rad).abs();
        let passes = match self.view {
            View::Side => gap_rad < self.heading_gate_rad,
            View::Top => {
                (a.turn_rate_rad_per_s - b.turn_rate_rad_per_s).abs() < TURN_GATE_RAD_PER_S
            }
        };
        passes.then_some(gap_rad)
    }
}

/// Returns the compared quantity of a clip in units of a circle.
fn units(view: View, clip: ClipMotion) -> u32 {
    let max_rate = MAX_TURN_RATE_RAD_PER_S;
    let rad = match view {
        View::Side => clip.mean_heading_rad,
        View::Top => clip.turn_rate_rad_per_s.clamp(-max_rate, max_rate) * RATE_SCALE,
    };
    (rad * UNITS_PER_RAD).round() as i64 as u32
}

/// Returns the slope of a line fitted to the unwrapped headings, radians per frame; 0 for a single frame.
fn turn_rate(headings_rad: &[f64]) -> f64 {
    let middle = (headings_rad.len() as f64 - 1.0) / 2.0;
    let mut heading = headings_rad[0];
    let (mut covariance, mut variance) = (0.0, 0.0);
    for (t, &measured) in headings_rad.iter().enumerate() {
        heading += wrap_rad(measured - heading);
        covariance += (t as f64 - middle) * heading;
        variance += (t as f64 - middle).powi(2);
    }
    if variance > 0.0 {
        covariance / variance
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::Pose;

    fn gate(view: View, headings_deg: &[f64]) -> Gate {
        let frames = headings_deg.iter().map(|deg| Pose {
            heading_rad: Some(wrap_rad(deg.to_radians())),
            ..Pose::default()
        });
        let poses = Poses {
            tail_beat: None,
            fps: 10.0,
            image_size_px: [100, 100],
            view,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: frames.collect(),
        };
        Gate::new(&poses, 2, &Params::default())
    }

    #[test]
    fn in_side_view_only_clips_of_similar_heading_pass() {
        // Mean headings of the clips: 1, 7.5, 16, 98.5 and 178 degrees.
        let gate = gate(View::Side, &[0.0, 2.0, 13.0, 19.0, 178.0, 178.0]);
        let gap_deg = gate
            .passing_gap_rad(0, 1, false)
            .expect("6.5 degrees apart")
            .to_degrees();
        assert!((gap_deg - 6.5).abs() < 1e-9);
        assert_eq!(
            gate.passing_gap_rad(0, 2, false),
            None,
            "exactly 15 degrees apart"
        );
        assert_eq!(gate.passing_gap_rad(0, 4, false), None);
    }

    #[test]
    fn a_mirrored_pair_is_compared_with_the_mirrored_heading() {
        let gate = gate(View::Side, &[0.0, 2.0, 178.0, 178.0]);
        let gap_deg = gate
            .passing_gap_rad(0, 2, true)
            .expect("178 mirrored is 2")
            .to_degrees();
        assert!((gap_deg - 1.0).abs() < 1e-9);
        assert_eq!(gate.passing_gap_rad(0, 2, false), None);
    }

    #[test]
    fn in_top_view_only_clips_of_similar_turn_rate_pass() {
        // Turning rates, degrees per second: +30 across the seam at 180 degrees, then +40 and -30.
        let gate = gate(View::Top, &[179.0, 182.0, 10.0, 14.0, 50.0, 47.0]);
        assert!(gate.passing_gap_rad(0, 2, false).is_some());
        assert!(gate.passing_gap_rad(0, 4, false).is_none());
        assert!(gate.passing_gap_rad(0, 4, true).is_some());
    }

    /// Returns the difference of a pair minus the gate, radians or radians per second. Positive pairs do not
    /// pass.
    fn excess(gate: &Gate, i: usize, j: usize, mirrored: bool) -> f64 {
        let clip = |k: usize| gate.clips[k].expect("every heading is known");
        let (a, b) = (clip(i), clip(j));
        let b = if mirrored { b.mirrored() } else { b };
        if gate.view == View::Top {
            return (a.turn_rate_rad_per_s - b.turn_rate_rad_per_s).abs() - TURN_GATE_RAD_PER_S;
        }
        wrap_rad(a.mean_heading_rad - b.mean_heading_rad).abs() - gate.heading_gate_rad
    }

    proptest::proptest! {
        #[test]
        fn marks_include_every_passing_pair_and_few_others(
            headings_deg in proptest::collection::vec(-179f64..180.0, 3..40),
            whole: bool, from_above: bool, mirrored: bool,
        ) {
            // Whole degrees sometimes lie exactly on the limit of the gate.
            let mut headings = headings_deg;
            if whole {
                headings.iter_mut().for_each(|heading| *heading = heading.round());
            }
            let gate = gate(if from_above { View::Top } else { View::Side }, &headings);
            for i in 0..headings.len() - 1 {
                let mut row = Marks::none(headings.len() - 1 - i);
                gate.mark_passing(i, mirrored, &mut row);
                let marked: Vec<usize> = row.ones().map(|k| i + k).collect();
                for j in i..headings.len() - 1 {
                    let marked = marked.contains(&j);
                    let passes = gate.passing_gap_rad(i, j, mirrored).is_some();
                    proptest::prop_assert!(marked || !passes, "({}, {})", i, j);
                    let on_edge = whole || excess(&gate, i, j, mirrored).abs() < 1e-5;
                    proptest::prop_assert!(!marked || passes || on_edge, "({}, {})", i, j);
                }
            }
        }
    }

    #[test]
    fn a_clip_of_one_frame_does_not_turn() {
        assert_eq!(turn_rate(&[1.0]), 0.0);
        assert!((turn_rate(&[3.0, 3.2, 3.4 - TAU]) - 0.2).abs() < 1e-12);
    }
}
