//! The heading gate. In side view, two clips may be joined only if the animal points in the same direction
//! (Okabe et al., section 3.3). In top view, sprites are rotated to any heading, so the gate compares turning
//! rates (docs/explanation/algorithms.md, "Transitions and playback").

use std::f64::consts::TAU;

use crate::analysis::Params;
use crate::analysis::distance::Marks;
use crate::geometry::angle::{mean_rad, mirrored_rad, wrap_rad};
use crate::library::{Poses, View};

/// Largest difference between turning rates in top view, radians per second: 20 degrees per second. Free
/// choice.
const TURN_GATE_RAD_PER_S: f64 = TAU / 18.0;

/// Decides which pairs of clips pass.
pub(super) struct Gate {
    mean_heading_rad: Vec<Option<f64>>,
    turn_rate_rad_per_s: Vec<Option<f64>>,
    view: View,
    heading_gate_rad: f64,
    /// The compared quantity of each clip as a fraction of a circle, 2^32 units to the circle, so that
    /// differences wrap. Headings in side view, scaled turning rates in top view; 0 where unknown.
    units: Vec<u32>,
    /// Largest difference that may pass, in the same units, with a margin for rounding.
    max_gap_units: u32,
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
        let per_clip = |value: fn(&[f64]) -> Option<f64>| -> Vec<Option<f64>> {
            headings
                .windows(clip_frames)
                .map(|clip| clip.iter().copied().collect::<Option<Vec<f64>>>())
                .map(|clip| value(&clip?))
                .collect()
        };
        let rad_per_frame = per_clip(|clip| Some(turn_rate(clip)));
        let mean_heading_rad = per_clip(|clip| mean_rad(clip.iter().copied()));
        let turn_rate_rad_per_s: Vec<Option<f64>> = rad_per_frame
            .into_iter()
            .map(|rate| Some(rate? * poses.fps))
            .collect();
        let heading_gate_rad = params.heading_gate_deg.to_radians();
        let (compared, max_gap) = match poses.view {
            View::Side => (&mean_heading_rad, heading_gate_rad),
            View::Top => (&turn_rate_rad_per_s, TURN_GATE_RAD_PER_S * RATE_SCALE),
        };
        Gate {
            units: compared
                .iter()
                .map(|v| units(poses.view, v.unwrap_or(0.0)))
                .collect(),
            max_gap_units: ((max_gap * UNITS_PER_RAD).ceil() as u32).saturating_add(4),
            mean_heading_rad,
            turn_rate_rad_per_s,
            view: poses.view,
            heading_gate_rad,
        }
    }

    /// Marks the pairs of clip `i` that may pass: entry k is the pair (i, i + k).
    ///
    /// Every pair that passes is marked, and few others. The test uses integers, because it runs on every
    /// pair of the footage.
    pub(super) fn mark_passing(&self, i: usize, mirrored: bool, row: &mut Marks) {
        let turned = match (self.view, mirrored) {
            // Mirroring turns a heading h into pi - h and reverses a turning rate.
            (_, false) => |units: u32| units,
            (View::Side, true) => |units: u32| (1u32 << 31).wrapping_sub(units),
            (View::Top, true) => |units: u32| units.wrapping_neg(),
        };
        let here = turned(self.units[i]);
        row.mark_where(&self.units[i..], |&there| {
            let gap = here.wrapping_sub(there) as i32;
            gap.unsigned_abs() <= self.max_gap_units
        });
    }

    /// Returns the difference between the mean headings of two clips, 0..=pi, or `None` if the pair does not
    /// pass.
    ///
    /// A mirrored pair compares heading i with pi - heading j, and turning rate i with minus turning rate j.
    /// A clip with an unknown heading never passes.
    pub(super) fn passing_gap_rad(&self, i: usize, j: usize, mirrored: bool) -> Option<f64> {
        let (a, b) = (self.mean_heading_rad[i]?, self.mean_heading_rad[j]?);
        let gap_rad = wrap_rad(a - if mirrored { mirrored_rad(b) } else { b }).abs();
        let passes = match self.view {
            View::Side => gap_rad < self.heading_gate_rad,
            View::Top => {
                let (a, b) = (self.turn_rate_rad_per_s[i]?, self.turn_rate_rad_per_s[j]?);
                (a - if mirrored { -b } else { b }).abs() < TURN_GATE_RAD_PER_S
            }
        };
        passes.then_some(gap_rad)
    }
}

/// Returns a heading or a turning rate in units of a circle.
fn units(view: View, value: f64) -> u32 {
    let rad = match view {
        View::Side => value,
        View::Top => value.clamp(-MAX_TURN_RATE_RAD_PER_S, MAX_TURN_RATE_RAD_PER_S) * RATE_SCALE,
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
        let of = |values: &[Option<f64>], k: usize| values[k].expect("every heading is known");
        if gate.view == View::Top {
            let rate = |k| of(&gate.turn_rate_rad_per_s, k);
            let other = if mirrored { -rate(j) } else { rate(j) };
            return (rate(i) - other).abs() - TURN_GATE_RAD_PER_S;
        }
        let heading = |k| of(&gate.mean_heading_rad, k);
        let other = if mirrored {
            mirrored_rad(heading(j))
        } else {
            heading(j)
        };
        wrap_rad(heading(i) - other).abs() - gate.heading_gate_rad
    }

    proptest::proptest! {
        #[test]
        fn marks_include_every_passing_pair_and_few_others(
            headings_deg in proptest::collection::vec(-179f64..180.0, 3..40),
            whole: bool, from_above: bool, mirrored: bool,
        ) {
            // Whole degrees sometimes lie exactly on the limit of the gate.
            let headings: Vec<f64> = match whole {
                true => headings_deg.iter().map(|h| h.round()).collect(),
                false => headings_deg,
            };
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
