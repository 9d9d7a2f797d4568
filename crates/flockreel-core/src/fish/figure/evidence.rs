//! Estimate of the bend by the outline of one frame: one step of Gauss and Newton from the slopes of the overlap of figure
//! and matte. Place and direction near the fit are left free.

use glam::{DMat3, DVec3};

use super::chart::Fit;
use super::course::Evidence;
use super::fit::{Outline, changed};
use super::grid::Sheet;

/// Steps of the finite differences: center in body lengths, yaw, pitch, logarithm of the length, bend and wave. Each
/// moves some part of the outline by about a texel. Free choice.
const STEPS: [f64; 8] = [0.02, 0.02, 0.1, 0.05, 0.04, 0.1, 0.3, 0.3];
/// Standard deviations of the first five around the fit. Free choice: about what the search leaves.
const LOOSE: [f64; 5] = [0.03, 0.03, 0.15, 0.08, 0.05];
/// Neighboring points of an outline err alike: this many count as one. Free choice.
const ALIKE: f64 = 300.0;

/// Returns the estimate of the bend by the outline of a frame.
pub(super) fn evidence(fit: &Fit, outline: &Outline, sheet: &Sheet, center_s: f64) -> Evidence {
    let (rows, residuals) = slopes(fit, outline, sheet, center_s);
    let n = residuals.len().max(1) as f64;
    let noise = ALIKE * (residuals.iter().map(|r| r * r).sum::<f64>() / n).max(1e-4);
    let (mut h, mut g) = ([[0.0; 8]; 8], [0.0; 8]);
    for (row, residual) in rows.iter().zip(&residuals) {
        for i in 0..8 {
            g[i] += row[i] * residual / noise;
            for j in 0..8 {
                h[i][j] += row[i] * row[j] / noise;
            }
        }
    }
    for (i, sigma) in LOOSE.iter().enumerate() {
        h[i][i] += 1.0 / (sigma * sigma);
    }
    // Gaussian elimination of the first five leaves what the rest says by itself.
    for i in 0..5 {
        for k in i + 1..8 {
            let share = h[k][i] / h[i][i];
            for j in i..8 {
                h[k][j] -= share * h[i][j];
            }
            g[k] -= share * g[i];
        }
    }
    let weight = DMat3::from_cols_array_2d(&[0, 1, 2].map(|j| [0, 1, 2].map(|i| h[5 + i][5 + j])));
    let weight = (weight + weight.transpose()) * 0.5;
    let pull = DVec3::new(g[5], g[6], g[7]);
    Evidence {
        weight,
        pull: pull + weight * DVec3::from(fit.bend),
    }
}

/// Returns the change of the figure's alpha by each value of the fit, and the difference of the alphas, at every point of
/// the outline.
fn slopes(fit: &Fit, outline: &Outline, sheet: &Sheet, center_s: f64) -> (Vec<[f64; 8]>, Vec<f64>) {
    let alphas = |fit: &Fit| -> Vec<f64> {
        let flat = fit.flat(center_s);
        let alpha = |at| {
            flat.body_at(at)
                .map_or(0.0, |at| f64::from(sheet.alpha_at(at)))
        };
        outline.points.iter().map(|&(at, _)| alpha(at)).collect()
    };
    let here = alphas(fit);
    let mut rows = vec![[0.0; 8]; here.len()];
    for (value, &step) in STEPS.iter().enumerate() {
        let (up, down) = (
            alphas(&changed(fit, value, step)),
            alphas(&changed(fit, value, -step)),
        );
        for (row, (up, down)) in rows.iter_mut().zip(up.iter().zip(&down)) {
            row[value] = (up - down) / (2.0 * step);
        }
    }
    let residual = |(&(_, seen), here): (&([f64; 2], f32), &f64)| f64::from(seen) - here;
    let residuals = outline.points.iter().zip(&here).map(residual).collect();
    (rows, residuals)
}
