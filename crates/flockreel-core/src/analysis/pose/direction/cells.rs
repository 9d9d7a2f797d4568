//! The cells of the direction sphere, the appearance of the body from each, and the cost of each in one frame
//! (docs/explanation/algorithms.md, "Direction in space").

use std::f64::consts::{PI, TAU};

use super::body::{BodyAxes, MOMENT_AXES, bilinear_form};
use super::observations::Silhouette;
use super::shape::Shape;

pub(super) const N_YAW: usize = 36;
pub(super) const N_PITCH: usize = 13;
pub(super) const N_CELL: usize = N_YAW * N_PITCH;
/// Distance between neighboring cells in yaw and in pitch, radians.
pub(super) const YAW_STEP_RAD: f64 = TAU / N_YAW as f64;
pub(super) const PITCH_STEP_RAD: f64 = 2.0 * MAX_PITCH_RAD / (N_PITCH - 1) as f64;
/// Largest pitch of a cell, radians. Free choice.
const MAX_PITCH_RAD: f64 = PI / 3.0;
/// Standard deviations of the velocity in x, y and depth, body lengths per second. Free choice.
const MOTION_BL: [f64; 3] = [0.25, 0.25, 0.6];
/// Standard deviation of the pitch, radians. Free choice.
const PITCH_NOISE: f64 = 0.4;
/// Residuals grow linearly beyond this many standard deviations. Free choice.
const HUBER: f64 = 3.0;

/// The cells, with the expected measurements for each.
pub(super) struct Cells {
    pub(super) axes: Vec<BodyAxes>,
    pitch: [f64; N_PITCH],
    /// Projected moments xx, xy, yy, square metres.
    moments: Vec<[f64; 3]>,
    /// Inverse covariance of the measured moments, as xx, xy, xz, yy, yz, zz. x, y and z are the three
    /// moments. `half_log_det` is half the logarithm of the determinant of the covariance.
    inverse: Vec<[f64; 6]>,
    half_log_det: Vec<f64>,
    /// Vertical extent by pitch, metres.
    vertical_m: [f64; N_PITCH],
}

impl Cells {
    pub(super) fn new(shape: &Shape) -> Cells {
        let pitch: [f64; N_PITCH] =
            std::array::from_fn(|j| -MAX_PITCH_RAD + PITCH_STEP_RAD * j as f64);
        let mut cells = Cells {
            axes: Vec::with_capacity(N_CELL),
            pitch,
            moments: Vec::with_capacity(N_CELL),
            inverse: Vec::with_capacity(N_CELL),
            half_log_det: Vec::with_capacity(N_CELL),
            vertical_m: pitch.map(|p| shape.vertical_extent(p).m),
        };
        let body = shape.covariance_m2(0.0);
        for yaw in (0..N_YAW).map(|i| (i as f64 + 0.5) * YAW_STEP_RAD) {
            for pitch in pitch {
                let axes = BodyAxes::new(yaw, pitch);
                let seen = axes.projected([0.0; 2], 1.0);
                let moments = MOMENT_AXES.map(|(i, j)| bilinear_form(&seen[i], &seen[j], &body));
                let sway = MOMENT_AXES
                    .map(|(i, j)| seen[i][0] * seen[j][2] + seen[i][2] * seen[j][0])
                    .map(|v| v * shape.sway_sd);
                let (inverse, half_log_det) = inverse_covariance(moments, sway, shape);
                cells.axes.push(axes);
                cells.moments.push(moments);
                cells.inverse.push(inverse);
                cells.half_log_det.push(half_log_det);
            }
        }
        cells
    }

    /// Returns the cost of a velocity for each cell. The velocity is in metres per second, relative to the
    /// line of sight.
    pub(super) fn motion_costs(&self, velocity: [f64; 3], length_m: f64) -> Vec<f64> {
        let noise = MOTION_BL.map(|bl| bl * length_m);
        let moved: [f64; 3] = std::array::from_fn(|c| velocity[c] / noise[c]);
        let cost = |(k, axes): (usize, &BodyAxes)| {
            let along: [f64; 3] = std::array::from_fn(|c| axes.forward[c] / noise[c]);
            let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            // The speed that explains most of the velocity. Animals do not swim backward.
            let speed = (dot(&along, &moved) / dot(&along, &along)).max(0.0);
            let residual: [f64; 3] = std::array::from_fn(|c| moved[c] - speed * along[c]);
            let pitch = self.pitch[k % N_PITCH] / PITCH_NOISE;
            0.5 * huber_loss(dot(&residual, &residual)) + 0.5 * pitch * pitch
        };
        self.axes.iter().enumerate().map(cost).collect()
    }

    /// Adds the cost of the silhouette's moments to each cell. The vertical extent gives the scale.
    pub(super) fn add_moment_costs(&self, silhouette: &Silhouette, costs: &mut [f64]) {
        let scale = self
            .vertical_m
            .map(|m| (m / silhouette.vertical_px).powi(2));
        for (k, cost) in costs.iter_mut().enumerate() {
            let residual: [f64; 3] = std::array::from_fn(|c| {
                silhouette.covariance_px2[c] * scale[k % N_PITCH] - self.moments[k][c]
            });
            let [a, b, c, d, e, f] = self.inverse[k];
            let square = a * residual[0] * residual[0]
                + d * residual[1] * residual[1]
                + f * residual[2] * residual[2]
                + 2.0
                    * (b * residual[0] * residual[1]
                        + c * residual[0] * residual[2]
                        + e * residual[1] * residual[2]);
            *cost += 0.5 * huber_loss(square) + self.half_log_det[k];
        }
    }

    /// Returns the mean direction of the posterior within 50 degrees of a cell, a unit vector.
    pub(super) fn mean_near(&self, posterior: &[f64], cell: usize) -> [f64; 3] {
        const COS_50: f64 = 0.642_787_609_686_539_4;
        let center = self.axes[cell].forward;
        let mut sum = [0.0; 3];
        for (axes, &p) in self.axes.iter().zip(posterior) {
            let f = axes.forward;
            if f[0] * center[0] + f[1] * center[1] + f[2] * center[2] > COS_50 {
                for c in 0..3 {
                    sum[c] += p * f[c];
                }
            }
        }
        let norm = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
        if norm > 1e-6 {
            sum.map(|c| c / norm)
        } else {
            center
        }
    }
}

/// Returns the inverse covariance of the measured moments of a cell, and half the logarithm of its
/// determinant.
///
/// The covariance adds the noise of each moment, the noise of the common scale, and the sway.
fn inverse_covariance(m: [f64; 3], sway: [f64; 3], shape: &Shape) -> ([f64; 6], f64) {
    let mean = (m[0] * m[2]).max(0.0).sqrt();
    let noise = [0.08 * m[0] + 0.04 * mean, 0.08 * mean, 0.08 * m[2]]
        .map(|n| n * shape.moment_noise.max(1.0));
    // The vertical extent gives the scale. Moments grow with its square.
    let scale = (2.0 * shape.vertical_noise).powi(2);
    let entry = |i: usize, j: usize| {
        let own = if i == j { noise[i] * noise[i] } else { 0.0 };
        own + scale * m[i] * m[j] + sway[i] * sway[j]
    };
    let (a, b, c) = (entry(0, 0), entry(0, 1), entry(0, 2));
    let (d, e, f) = (entry(1, 1), entry(1, 2), entry(2, 2));
    let minors = [
        d * f - e * e,
        c * e - b * f,
        b * e - c * d,
        a * f - c * c,
        b * c - a * e,
        a * d - b * b,
    ];
    let det = (a * minors[0] + b * minors[1] + c * minors[2]).max(1e-300);
    (minors.map(|v| v / det), 0.5 * libm::log(det))
}

fn huber_loss(square: f64) -> f64 {
    if square > HUBER * HUBER {
        HUBER * (2.0 * square.sqrt() - HUBER)
    } else {
        square
    }
}
