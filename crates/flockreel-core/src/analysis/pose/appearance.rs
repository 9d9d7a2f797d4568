//! Decides which end is the head, from the appearance of both ends in all frames of a film.
//!
//! The difference between the ends (`track::asymmetry`) is the same vector in every frame, except for its
//! sign. It is estimated as the first principal axis of all frames, without centering. This needs neither
//! motion nor a first guess. The direction of motion decides once per film which sign belongs to the head.

use super::Axes;
use crate::analysis::track::Tracked;
use crate::analysis::track::asymmetry::{Asymmetry, N_NUMBERS};

/// Least ratio of the standard deviations along and across the axis. Free choice: round silhouettes have no
/// ends.
const MIN_ELONGATION: f64 = 1.25;
/// Least number of frames to estimate the difference between the ends. Free choice.
const MIN_FRAMES: usize = 8;
/// Iterations of the power method. Free choice.
const N_ITERATIONS: usize = 64;
/// Greatest evidence of one frame, half the log-odds. Free choice.
const MAX_HALF_LOG_ODDS: f64 = 4.0;
/// Least standard deviation of scores, as a share of their mean. Free choice: changing light varies every
/// film.
const MIN_SPREAD: f64 = 0.25;
/// Greatest speed that counts, body lengths per second. Free choice.
const MAX_SPEED_BL_S: f64 = 1.0;
/// Length of the spans that count as independent, seconds. Speeds are averaged over them, and their scatter gives
/// the certainty. Free choice: frames nearer to each other show the same stroke and the same posture.
pub(super) const SPAN_S: f64 = 0.5;

/// Speed with which an animal that stays at its place sways to and fro, body lengths per second. Free choice.
const SWAY_BL_S: f64 = 0.05;
/// Standard deviation of the t-statistic among films that tell which end leads. Free choice.
const INFORMATIVE_T: f64 = 5.0;

/// Least |cosine| of the angle between the length axis and the axis of the moments. Free choice.
///
/// At larger angles, the ends of the moments are not those of the length axis.
const MIN_AXIS_COSINE: f64 = 0.7;

/// Evidence for the head from the appearance of the ends.
pub(super) struct HeadEvidence {
    /// Half the log-odds that the head lies toward +axis, for each frame; `None` when the ends say nothing.
    pub(super) half_log_odds: Vec<Option<f64>>,
    /// Probability that the animal mostly moves head first, 0.5..=1: that `half_log_odds` has the right sign.
    /// `None` without evidence.
    certainty: Option<f64>,
}

impl HeadEvidence {
    /// Estimates the evidence of all frames. `speed` is the speed along +axis, body lengths per second.
    pub(super) fn estimate(
        track: &[Tracked],
        axes: &[Option<Axes>],
        speed: &[Option<f64>],
        fps: f64,
    ) -> HeadEvidence {
        let seen: Vec<Option<&Asymmetry>> = track.iter().map(long_asymmetry).collect();
        let uncut: Vec<&Asymmetry> = seen
            .iter()
            .zip(track)
            .filter(|(_, tracked)| tracked.sighting.as_ref().is_some_and(|s| !s.cut))
            .filter_map(|(seen, _)| *seen)
            .collect();
        if uncut.len() < MIN_FRAMES {
            return HeadEvidence {
                half_log_odds: vec![None; track.len()],
                certainty: None,
            };
        }
        let principal = principal_axis(&uncut);
        let n = uncut.len() as f64;
        let scores = || uncut.iter().map(|a| score(a, &principal));
        let mean = scores().map(f64::abs).sum::<f64>() / n;
        let square = scores().map(|score| score.powi(2)).sum::<f64>() / n;
        let variance = (square - mean * mean)
            .max((MIN_SPREAD * mean).powi(2))
            .max(1e-12);
        let half_log_odds_of = |k: usize| {
            let major_rad = track[k].sighting.as_ref()?.moments.major_rad?;
            let same = libm::cos(axes[k].as_ref()?.axis_rad? - major_rad);
            let evidence = (mean * score(seen[k]?, &principal) / variance)
                .clamp(-MAX_HALF_LOG_ODDS, MAX_HALF_LOG_ODDS);
            (same.abs() > MIN_AXIS_COSINE).then_some(same.signum() * evidence)
        };
        let mut half_log_odds: Vec<Option<f64>> = (0..track.len()).map(half_log_odds_of).collect();
        let t = t_statistic(&half_log_odds, speed, fps);
        if t < 0.0 {
            for half_log_odds in half_log_odds.iter_mut().flatten() {
                *half_log_odds = -*half_log_odds;
            }
        }
        HeadEvidence {
            half_log_odds,
            certainty: Some(certainty(t)),
        }
    }

    /// Returns a probability that assumes the right sign of the evidence, corrected for the risk of the wrong
    /// sign.
    pub(super) fn tempered(&self, probability: f64) -> f64 {
        let certainty = self.certainty.unwrap_or(1.0);
        certainty * probability + (1.0 - certainty) * (1.0 - probability)
    }
}

fn long_asymmetry(tracked: &Tracked) -> Option<&Asymmetry> {
    let sighting = tracked.sighting.as_ref()?;
    let is_long = sighting.moments.eigenvalue_ratio >= MIN_ELONGATION * MIN_ELONGATION;
    sighting.asymmetry.as_ref().filter(|_| is_long)
}

/// Returns the unit vector with the greatest sum of squared projections of all frames.
fn principal_axis(all: &[&Asymmetry]) -> [f64; N_NUMBERS] {
    let largest = all.iter().max_by(|a, b| {
        let square = |a: &Asymmetry| a.ends.iter().map(|v| v * v).sum::<f32>();
        square(a).total_cmp(&square(b))
    });
    let mut axis = largest.map_or([0.0; N_NUMBERS], |a| a.ends.map(f64::from));
    for _ in 0..N_ITERATIONS {
        let mut next = [0.0; N_NUMBERS];
        for asymmetry in all {
            let score = score(asymmetry, &axis);
            for (sum, &number) in next.iter_mut().zip(&asymmetry.ends) {
                *sum += score * f64::from(number);
            }
        }
        let length = next.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-300);
        axis = next.map(|v| v / length);
    }
    axis
}

fn score(asymmetry: &Asymmetry, axis: &[f64; N_NUMBERS]) -> f64 {
    asymmetry
        .ends
        .iter()
        .zip(axis)
        .map(|(a, b)| f64::from(*a) * b)
        .sum()
}

/// Returns the t-statistic of motion toward the end that the evidence names.
///
/// It is the sum over spans of the mean speed toward that end, divided by its standard deviation if both
/// directions were equally likely.
fn t_statistic(evidence: &[Option<f64>], speed_bl_s: &[Option<f64>], fps: f64) -> f64 {
    let span = ((SPAN_S * fps).round() as usize).max(1);
    let spans = evidence
        .chunks(span)
        .zip(speed_bl_s.chunks(span))
        .map(|(evidence, speeds)| {
            let along = |(evidence, speed): (&Option<f64>, &Option<f64>)| {
                let sign = (evidence.as_ref()? / MAX_HALF_LOG_ODDS).clamp(-1.0, 1.0);
                Some(sign * speed.as_ref()?.clamp(-MAX_SPEED_BL_S, MAX_SPEED_BL_S))
            };
            evidence.iter().zip(speeds).filter_map(along).sum::<f64>() / span as f64
        });
    let (mut sum, mut square) = (0.0, 0.0);
    for value in spans {
        sum += value;
        square += value * value + SWAY_BL_S * SWAY_BL_S;
    }
    sum / f64::sqrt(square).max(1e-9)
}

/// Returns the probability that the sign of a t-statistic is that of the mean. Half of the films tell nothing: their
/// statistic is normal. In the others its mean varies, too.
fn certainty(t: f64) -> f64 {
    let variance = 1.0 + INFORMATIVE_T * INFORMATIVE_T;
    let odds = libm::exp(0.5 * t * t * (1.0 - 1.0 / variance)) / variance.sqrt();
    // The logistic function of 1.7 t differs from the normal distribution by less than 0.01.
    let is_right = 1.0 / (1.0 + libm::exp(-1.7 * t.abs()));
    0.5 + (is_right - 0.5) / (1.0 + 1.0 / odds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::pose::synthetic::{Appearance, fish};

    const FPS: f64 = 30.0;
    const N_FRAMES: usize = 240;

    /// Returns whether the head is at the left end; it changes every 30 frames.
    fn is_left(k: usize) -> bool {
        k / 30 % 2 == 1
    }

    /// Returns the evidence for an animal that moves head first at `forward(k)` body lengths per second.
    fn evidence_of(forward: impl Fn(usize) -> f64) -> HeadEvidence {
        let appearance = |k| Appearance {
            is_left: is_left(k),
            is_upper_dark: true,
        };
        let track: Vec<Tracked> = (0..N_FRAMES).map(|k| fish(k, appearance(k))).collect();
        let axes = |tracked: &Tracked| {
            let sighting = tracked.sighting.as_ref()?;
            Some(Axes {
                axis_rad: sighting.moments.major_rad,
                length_px: sighting.extent_px[0],
                height_px: sighting.extent_px[1],
                skew: sighting.moments.skew[0],
            })
        };
        let axes: Vec<Option<Axes>> = track.iter().map(axes).collect();
        let along = |k| {
            if is_left(k) { -forward(k) } else { forward(k) }
        };
        let speed: Vec<Option<f64>> = (0..N_FRAMES).map(|k| Some(along(k))).collect();
        HeadEvidence::estimate(&track, &axes, &speed, FPS)
    }

    /// Returns the number of frames with the head at the wrong end.
    fn n_wrong(ends: &HeadEvidence) -> usize {
        let is_wrong = |k: &usize| ends.half_log_odds[*k].is_none_or(|e| (e < 0.0) != is_left(*k));
        (0..N_FRAMES).filter(is_wrong).count()
    }

    #[test]
    fn the_usual_direction_of_motion_names_the_head_end_in_all_frames() {
        let ends = evidence_of(|_| 0.5);
        assert_eq!(n_wrong(&ends), 0);
        assert!(ends.tempered(0.99) > 0.9);
        let backs_off_at_times = evidence_of(|k| if k % 60 < 15 { -0.4 } else { 0.5 });
        assert_eq!(n_wrong(&backs_off_at_times), 0);
    }

    #[test]
    fn an_animal_that_hardly_leaves_its_place_leaves_the_head_uncertain() {
        let drifts = evidence_of(|_| 0.01).tempered(0.99);
        assert!((0.4..0.65).contains(&drifts), "{drifts}");
        let walks = evidence_of(|_| 0.2).tempered(0.99);
        assert!(walks > 0.9, "{walks}");
    }

    #[test]
    fn equal_motion_in_both_directions_leaves_the_head_uncertain() {
        let ends = evidence_of(|k| if k / 15 % 2 == 0 { 0.5 } else { -0.5 });
        assert!(
            (ends.tempered(0.99) - 0.5).abs() < 0.1,
            "{}",
            ends.tempered(0.99)
        );
    }
}
