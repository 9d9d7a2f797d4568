//! The bend over the whole film. Each frame says, with an uncertainty, how far body and tail are bent. A model of swimming
//! joins them: the bend of the body changes slowly, and the wave of the tail beats at one rate, the most likely of the
//! film. The Kalman filter with the smoother of Rauch, Tung and Striebel (1965) gives the bend of every frame with its
//! uncertainty (docs/explanation/algorithms.md, "Virtual fish").

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4, SQRT_2, TAU};

use glam::{DMat3, DVec3};

use crate::fish::motion::Beat;
use crate::fish::spine::{JOINT_S, N_JOINTS, Swimming, joint_frames, lateral_parts_bl, spine_at_m};

/// Bend of the body in one frame: bend and both parts of the wave (`Swimming::of_wave`), with their covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::fish) struct Bend {
    pub(in crate::fish) mean: DVec3,
    covariance: DMat3,
}

/// Estimate of the bend by one frame: the inverse covariance, and the product of that and the bend.
#[derive(Clone, Copy)]
pub(in crate::fish) struct Evidence {
    pub(super) weight: DMat3,
    pub(super) pull: DVec3,
}

/// Error of the angle within which it counts as right, radians. The bar of issue 62.
const RIGHT_RAD: f64 = 8.0 * TAU / 360.0;
/// Standard deviation of the angle that no frame tells: the outline is not exactly that of a bent figure, radians. Measured
/// on sample films, 5.5 to 6.5 degrees.
const MODEL_RAD: f64 = 6.0 * TAU / 360.0;
/// Probability from which a phase is reported. Free choice.
const SURE: f64 = 0.75;

/// Usual bend of a body, body lengths, and usual effort of a stroke (`Swimming`). Free choice.
const USUAL: [f64; 3] = [0.04, 0.6, 0.6];
/// Time over which a bend lasts, and a beat keeps its rate and strength, seconds. Free choice.
const LASTS_S: [f64; 2] = [0.3, 2.0];

/// Returns the rate of the tail beat, 0.8 to 12 hertz, and the bend in every frame. Frames without evidence have one
/// too, an uncertain one.
pub(in crate::fish) fn bends(evidence: &[Evidence], fps: f64) -> (f64, Vec<Bend>) {
    let most_likely = |rates: &mut dyn Iterator<Item = f64>| {
        let ranked = rates
            .filter(|&hz| hz < 0.45 * fps)
            .map(|hz| (Swimmer::new(hz, fps).likelihood(evidence), hz));
        ranked
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(1.0, |(_, hz)| hz)
    };
    let near = most_likely(&mut (8..=120).map(|k| 0.1 * f64::from(k)));
    let hz = most_likely(&mut (-5..=5).map(|k| near + 0.02 * f64::from(k)));
    (hz, Swimmer::new(hz, fps).smooth(evidence))
}

impl Evidence {
    pub(in crate::fish) const NONE: Evidence = Evidence {
        weight: DMat3::ZERO,
        pull: DVec3::ZERO,
    };

    /// Returns what a known spine says.
    pub(in crate::fish) fn of_spine(angles_rad: &[f64; N_JOINTS]) -> Evidence {
        let joints = joint_frames(1.0, angles_rad);
        let mut evidence = Evidence::NONE;
        for s in SPINE_S {
            let parts = DVec3::from(lateral_parts_bl(s)) / SPINE_ERROR_BL;
            let left = spine_at_m(1.0, &joints, s).z / SPINE_ERROR_BL;
            evidence.weight += DMat3::from_cols(parts * parts.x, parts * parts.y, parts * parts.z);
            evidence.pull += parts * left;
        }
        evidence
    }
}

/// Positions along the body at which a spine is compared with the bend. Free choice.
const SPINE_S: [f64; 4] = [0.4, 0.6, 0.8, 1.0];
/// Standard deviation of a measured spine from a bend of this form, body lengths. Free choice.
const SPINE_ERROR_BL: f64 = 0.02;

/// Model of swimming at one rate of the tail beat.
struct Swimmer {
    /// Change from one frame to the next.
    step: DMat3,
    /// Covariance of what it adds.
    added: DMat3,
    usual: DMat3,
}

impl Swimmer {
    fn new(beat_hz: f64, fps: f64) -> Swimmer {
        let [bend, wave] = LASTS_S.map(|lasts_s| libm::exp(-1.0 / (lasts_s * fps)));
        let angle = TAU * beat_hz / fps;
        let (sin, cos) = (wave * libm::sin(angle), wave * libm::cos(angle));
        let usual = DVec3::from(USUAL.map(|v| v * v));
        let added = usual * DVec3::new(1.0 - bend * bend, 1.0 - wave * wave, 1.0 - wave * wave);
        Swimmer {
            step: DMat3::from_cols_array(&[bend, 0.0, 0.0, 0.0, cos, sin, 0.0, -sin, cos]),
            added: DMat3::from_diagonal(added),
            usual: DMat3::from_diagonal(usual),
        }
    }

    /// Returns the prediction from the frame before.
    fn predicted(&self, before: Option<&Bend>) -> Bend {
        match before {
            None => Bend {
                mean: DVec3::ZERO,
                covariance: self.usual,
            },
            Some(before) => Bend {
                mean: self.step * before.mean,
                covariance: self.step * before.covariance * self.step.transpose() + self.added,
            },
        }
    }

    /// Returns the logarithm of the likelihood of a film, up to a constant.
    fn likelihood(&self, evidence: &[Evidence]) -> f64 {
        let (mut total, mut before) = (0.0, None);
        for one in evidence {
            let predicted = self.predicted(before.as_ref());
            let updated = predicted.updated(one);
            let (was, is) = (predicted.covariance.inverse(), updated.covariance.inverse());
            total += 0.5
                * (updated.mean.dot(is * updated.mean) - predicted.mean.dot(was * predicted.mean));
            total += 0.5
                * libm::log(updated.covariance.determinant() / predicted.covariance.determinant());
            before = Some(updated);
        }
        total
    }

    /// Returns the bend of every frame, given all frames.
    fn smooth(&self, evidence: &[Evidence]) -> Vec<Bend> {
        let mut bends: Vec<Bend> = Vec::with_capacity(evidence.len());
        for one in evidence {
            let predicted = self.predicted(bends.last());
            bends.push(predicted.updated(one));
        }
        for k in (0..bends.len().saturating_sub(1)).rev() {
            let predicted = self.predicted(Some(&bends[k]));
            let gain = bends[k].covariance * self.step.transpose() * predicted.covariance.inverse();
            let (after, here) = (bends[k + 1], &mut bends[k]);
            here.mean += gain * (after.mean - predicted.mean);
            here.covariance += gain * (after.covariance - predicted.covariance) * gain.transpose();
        }
        bends
    }
}

impl Bend {
    /// Returns the beat of the tail; `None` where the frames say less of it than the model of swimming knows anyway.
    pub(in crate::fish) fn beat(&self, side_confidence: f64) -> Option<Beat> {
        if self.told() < LEAST_TOLD {
            return None;
        }
        let [bend_bl, cosine, sine] = self.mean.to_array();
        let swimming = Swimming::of_wave(bend_bl, [cosine, sine]);
        let (parts, deviation) = (tail_tip_parts(), self.deviation(tail_tip_parts()));
        let across = DVec3::new(0.0, -sine, cosine) / swimming.effort.max(1e-9);
        let lever = swimming.effort * libm::sin(FRAC_PI_4) / self.deviation(across);
        let phase_confidence = libm::erf(lever * FRAC_1_SQRT_2);
        let phase_turns = swimming.phase_turns.rem_euclid(1.0);
        Some(Beat {
            bend_bl,
            tail_tip_rad: libm::atan(parts.dot(self.mean)),
            tail_tip_confidence: libm::erf(RIGHT_RAD / (SQRT_2 * deviation.hypot(MODEL_RAD))),
            phase_turns: (phase_confidence >= SURE).then_some(phase_turns),
            phase_confidence,
            side_confidence,
        })
    }

    /// Returns how much of the variance of the tail tip the frames take away, 0..=1.
    pub(in crate::fish) fn told(&self) -> f64 {
        let parts = tail_tip_parts();
        let usual = (parts * DVec3::from(USUAL)).length_squared();
        (1.0 - self.deviation(parts) * self.deviation(parts) / usual).clamp(0.0, 1.0)
    }

    fn deviation(&self, parts: DVec3) -> f64 {
        parts.dot(self.covariance * parts).max(1e-12).sqrt()
    }

    fn updated(&self, evidence: &Evidence) -> Bend {
        let weight = self.covariance.inverse();
        let covariance = (weight + evidence.weight).inverse();
        Bend {
            mean: covariance * (weight * self.mean + evidence.pull),
            covariance,
        }
    }
}

/// Least share of the variance that the frames take away from what is reported. Free choice.
const LEAST_TOLD: f64 = 0.5;

/// Returns the tangent of the angle of the tail tip for each part of the bend.
fn tail_tip_parts() -> DVec3 {
    DVec3::from(lateral_parts_bl(1.0)) / (1.0 - JOINT_S[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    const FPS: f64 = 30.0;
    const BEAT_HZ: f64 = 2.4;

    fn swimming(k: usize) -> Swimming {
        Swimming {
            phase_turns: BEAT_HZ * k as f64 / FPS,
            effort: 0.8,
            bend_bl: 0.03,
        }
    }

    /// Returns what 90 spines say, but nothing from frame 40 to 47.
    fn evidence() -> Vec<Evidence> {
        let one = |k: usize| match k {
            40..48 => Evidence::NONE,
            _ => Evidence::of_spine(&swimming(k).joint_angles_rad()),
        };
        (0..90).map(one).collect()
    }

    #[test]
    fn beat_and_phase_of_a_swimming_spine_are_found_even_where_it_is_hidden() {
        let (beat_hz, bends) = bends(&evidence(), FPS);
        assert!((beat_hz / BEAT_HZ - 1.0).abs() < 0.03, "{beat_hz}");
        for (k, bend) in bends.iter().enumerate() {
            let [bend_bl, cosine, sine] = bend.mean.to_array();
            let found = Swimming::of_wave(bend_bl, [cosine, sine]);
            let gap = (found.phase_turns - swimming(k).phase_turns + 0.5).rem_euclid(1.0) - 0.5;
            assert!(gap.abs() < 0.06, "frame {k}: {gap}");
        }
        let beat = bends[20].beat(1.0).expect("it shows");
        assert!(beat.phase_turns.is_some() && beat.phase_confidence > 0.95);
        let angles = swimming(20).joint_angles_rad();
        assert!((beat.tail_tip_rad - crate::fish::spine::tail_tip_rad(&angles)).abs() < 0.05);
    }

    #[test]
    fn frames_that_show_no_bend_have_no_beat() {
        let (_, bends) = bends(&[Evidence::NONE; 30], FPS);
        assert!(bends.iter().all(|bend| bend.beat(1.0).is_none()));
    }
}
