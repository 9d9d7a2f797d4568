//! Fits the figure to the silhouette of one frame: the place, direction and size at which both overlap most.
//!
//! The overlap is the sum of the smaller alpha over the sum of the larger one, at points spread over the
//! silhouette and around it. A search changes one value at a time, with steps that are halved when they gain nothing.

use std::f64::consts::{FRAC_PI_2, PI};

use super::chart::Fit;
use super::grid::Sheet;
use super::pixels::Pixels;

/// Points of the picture and the alpha of the silhouette there.
pub(super) struct Outline {
    pub(super) points: Vec<([f64; 2], f32)>,
}

/// Number of points at which the overlap is measured. Free choice.
const N_POINTS: f64 = 1500.0;
/// Share of the silhouette's longer side that is added around it. Free choice.
const MARGIN: f64 = 0.25;
/// First steps of the search: center in body lengths, yaw and pitch in radians, logarithm of the length,
/// bend in body lengths. Free choice.
const STEPS: [f64; 6] = [0.04, 0.04, 0.3, 0.15, 0.08, 0.15];
/// Loss of overlap of a body that is bent as far as in a sharp turn. Free choice: a bend that does not show stays 0.
const BEND_COST: f64 = 0.01;
/// Bend of a sharp turn, body lengths (see `Swimming`). Free choice.
const USUAL_BEND_BL: f64 = 0.2;
/// The search ends when the first step is shorter than this, body lengths. Free choice: 5 halvings.
const LEAST_STEP: f64 = 0.0015;
/// Gain of overlap below which the steps are halved. Free choice.
const LEAST_GAIN: f64 = 0.002;
/// Largest number of rounds. Free choice; most searches need 10.
const N_ROUNDS: usize = 25;
/// Yaw at which a second search starts, from broadside toward the camera, radians. Free choice.
const SECOND_YAW_RAD: f64 = 0.9;

impl Outline {
    /// Returns points at an even distance over the matte of a frame. Points outside the footage are left out:
    /// nobody knows what is there.
    pub(super) fn new(pixels: &Pixels) -> Outline {
        let [w, h] = pixels.size.map(|side| side as f64);
        let margin = MARGIN * w.max(h);
        let area = (w + 2.0 * margin) * (h + 2.0 * margin);
        let step = (area / N_POINTS).sqrt().max(1.0);
        let lo = pixels.corner.map(|v| v as f64 - margin);
        let n = [w, h].map(|side| ((side + 2.0 * margin) / step) as usize);
        let mut points = Vec::new();
        for j in 0..n[1] {
            for i in 0..n[0] {
                let at = [
                    (lo[0] + (i as f64 + 0.5) * step).floor(),
                    (lo[1] + (j as f64 + 0.5) * step).floor(),
                ];
                if (0..2).all(|c| at[c] >= 0.0 && at[c] < f64::from(pixels.image_size[c])) {
                    let alpha = pixels.alpha(at[0] as i64, at[1] as i64);
                    points.push((at.map(|v| v + 0.5), alpha));
                }
            }
        }
        Outline { points }
    }

    /// Returns the best of two searches: one from broadside, one from halfway toward the camera.
    pub(super) fn search(&self, sheet: &Sheet, center_s: f64, start: &Fit) -> Fit {
        let toward = if start.faces_right() { -1.0 } else { 1.0 };
        let turned = Fit {
            yaw_rad: start.yaw_rad + toward * SECOND_YAW_RAD,
            ..*start
        };
        let [a, b] = [*start, turned].map(|start| self.fit(sheet, center_s, &start));
        if self.overlap(sheet, center_s, &b) > self.overlap(sheet, center_s, &a) {
            b
        } else {
            a
        }
    }

    /// Returns the place of the largest overlap near `start`.
    pub(super) fn fit(&self, sheet: &Sheet, center_s: f64, start: &Fit) -> Fit {
        self.climb(sheet, center_s, start, &STEPS)
    }

    /// Returns the place of the largest overlap near `start`, bent as that.
    pub(super) fn place(&self, sheet: &Sheet, center_s: f64, start: &Fit) -> Fit {
        // The bend moves the place a little: a quarter of the steps of a search suffices.
        let steps: Vec<f64> = STEPS[..5].iter().map(|step| 0.25 * step).collect();
        self.climb(sheet, center_s, start, &steps)
    }

    fn climb(&self, sheet: &Sheet, center_s: f64, start: &Fit, steps: &[f64]) -> Fit {
        let mut best = *start;
        let mut most = self.overlap(sheet, center_s, &best);
        let mut steps = steps.to_vec();
        for _ in 0..N_ROUNDS {
            let before = most;
            for (k, &step) in steps.iter().enumerate() {
                for step in [step, -step] {
                    let moved = changed(&best, k, step);
                    let overlap = self.overlap(sheet, center_s, &moved);
                    if overlap > most {
                        (best, most) = (moved, overlap);
                    }
                }
            }
            if most - before < LEAST_GAIN {
                steps.iter_mut().for_each(|step| *step *= 0.5);
            }
            if steps[0] < LEAST_STEP {
                break;
            }
        }
        best
    }

    fn overlap(&self, sheet: &Sheet, center_s: f64, fit: &Fit) -> f64 {
        let flat = fit.flat(center_s);
        let (mut both, mut either) = (0.0, 1e-9);
        for &(point, alpha) in &self.points {
            let other = flat.body_at(point).map_or(0.0, |at| sheet.alpha_at(at));
            both += f64::from(alpha.min(other));
            either += f64::from(alpha.max(other));
        }
        let bend = fit.bend[0] / USUAL_BEND_BL;
        both / either - BEND_COST * bend * bend
    }
}

/// Returns the fit with one of its eight values changed by a step.
pub(super) fn changed(fit: &Fit, value: usize, step: f64) -> Fit {
    let mut moved = *fit;
    match value {
        0 | 1 => moved.center_px[value] += step * fit.length_px,
        2 => moved.yaw_rad = (fit.yaw_rad + step).clamp(-PI, 0.0),
        3 => moved.pitch_rad = (fit.pitch_rad + step).clamp(-FRAC_PI_2, FRAC_PI_2),
        4 => moved.length_px *= libm::exp(step),
        _ => moved.bend[value - 5] += step,
    }
    moved
}
