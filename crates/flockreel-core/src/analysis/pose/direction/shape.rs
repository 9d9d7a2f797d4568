//! The shape of the body: second moments in its own axes, estimated from the footage.
//!
//! An ellipsoid projects to an ellipse whose second moments are the projected moments of the body. Fish are
//! close enough to that once the sway of the tail is a separate unknown.

use super::body::{BodyAxes, MOMENT_AXES, bilinear_form};
use super::observations::{Observation, Observations, PIXEL_MOMENTS_PX2, Silhouette};
use super::state::State;
use crate::library::Animal;
use crate::order::{median, percentile};

/// Constants of the body and of the measurement noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// Length from the nose to the tip of the tail, metres.
    pub(super) length_m: f64,
    /// Height of the silhouette, fins included, metres.
    height_m: f64,
    /// Second moment along the forward axis, square metres. `down_m2` and `side_m2` are those along the other
    /// axes.
    along_m2: f64,
    down_m2: f64,
    side_m2: f64,
    /// Covariance of the forward and down axes, square metres: the tail lies above or below the axis.
    slant_m2: f64,
    /// Sway per radian per second of yaw rate, square metres.
    pub(super) bend: f64,
    /// Standard deviation of the sway, square metres.
    pub(super) sway_sd: f64,
    /// Standard deviation of the vertical extent, as a share of it. Fins rise and fall.
    pub(super) vertical_noise: f64,
    /// Noise of the moments as a multiple of [`Silhouette::moment_noise_px2`].
    pub(super) moment_noise: f64,
}

/// Yaw rates above this do not bend the body further, radians per second. Free choice.
pub(super) const MAX_BEND_RATE: f64 = 4.0;
/// Half the time span over which the direction of motion is measured, seconds. Free choice.
const HALF_SPAN_S: f64 = 0.1;
/// Below this speed, in body lengths per second, the direction of motion is not used. Free choice.
const MIN_SPEED_BL: f64 = 0.4;
/// Initial standard deviation of the sway, as a share of the moment along the forward axis. Free choice.
const INITIAL_SWAY: f64 = 0.15;
/// Smallest standard deviation of the sway, as a share of the moment along the forward axis. Free choice.
const MIN_SWAY: f64 = 0.1;
/// Initial standard deviation of the vertical extent, as a share of it. Free choice.
const INITIAL_VERTICAL_NOISE: f64 = 0.03;
/// Factor from residuals to noise. Residuals are smaller than the noise because the fitted states follow it.
const NOISE_FROM_RESIDUAL: f64 = 1.2;
/// Largest factor by which one estimate may change a moment. Free choice.
const MAX_CHANGE: f64 = 1.25;

impl Shape {
    /// Returns a first estimate from broadside and head-on views, or `None` without silhouettes.
    ///
    /// Broadside views are the fifth with the largest ratio of horizontal to vertical moment. The head-on
    /// value is the third percentile of that ratio.
    pub(super) fn initial(observations: &Observations, animal: &Animal) -> Option<Shape> {
        // In units of the animal's height, which the vertical extent shows in every frame.
        let moment_m2 = |s: &Silhouette, c: usize| {
            s.covariance_px2[c] * (animal.height_m / s.vertical_px).powi(2)
        };
        let silhouettes: Vec<(usize, &Silhouette)> = (observations.frames.iter().enumerate())
            .filter_map(|(k, frame)| Some((k, frame.silhouette.as_ref()?)))
            .collect();
        let ratio = |s: &Silhouette| s.covariance_px2[0] / s.covariance_px2[2].max(1e-9);
        let mut ratios: Vec<f64> = silhouettes.iter().map(|(_, s)| ratio(s)).collect();
        let min_broadside_ratio = percentile(&mut ratios, 0.8)?;
        let head_on_ratio = percentile(&mut ratios, 0.03)?;
        let broadside = || (silhouettes.iter()).filter(|(_, s)| ratio(s) >= min_broadside_ratio);
        let down_m2 = median(silhouettes.iter().map(|(_, s)| moment_m2(s, 2)))?;
        let along_m2 = 1.03 * median(broadside().map(|(_, s)| moment_m2(s, 0)))?;
        let excess_m2 = along_m2 - down_m2;
        Some(Shape {
            length_m: animal.length_m,
            height_m: animal.height_m,
            along_m2,
            down_m2,
            side_m2: (0.8 * head_on_ratio * down_m2).clamp(0.02 * down_m2, down_m2),
            slant_m2: slant_m2(observations, animal, excess_m2, broadside()).unwrap_or(0.0),
            bend: 0.0,
            sway_sd: INITIAL_SWAY * along_m2,
            vertical_noise: INITIAL_VERTICAL_NOISE,
            moment_noise: 1.0,
        })
    }

    /// Returns the covariance of the body in the order that `body::bilinear_form` takes.
    pub(super) fn covariance_m2(&self, sway: f64) -> [f64; 5] {
        [
            self.along_m2,
            self.down_m2,
            self.side_m2,
            self.slant_m2,
            sway,
        ]
    }

    /// Returns the vertical extent of the animal at a pitch.
    ///
    /// The outline is an ellipse with the animal's length and height as axes.
    pub(super) fn vertical_extent(&self, pitch_rad: f64) -> VerticalExtent {
        let (sin, cos) = libm::sincos(pitch_rad);
        let (height2, length2) = (self.height_m.powi(2), self.length_m.powi(2));
        let extent_m = (height2 * cos * cos + length2 * sin * sin).sqrt();
        VerticalExtent {
            m: extent_m,
            m_by_pitch: (length2 - height2) * sin * cos / extent_m,
        }
    }

    /// Returns the apparent depth of the silhouette for an animal without pitch, metres.
    pub(super) fn level_depth_m(
        &self,
        observations: &Observations,
        silhouette: &Silhouette,
    ) -> f64 {
        observations.focal_px * self.height_m / silhouette.vertical_px
    }

    /// Returns the shape that fits the moments best for the given states, by robust linear least squares.
    /// Returns `self` if the moments do not determine a shape.
    pub(super) fn refined(&self, observations: &Observations, states: &[State]) -> Shape {
        let rows: Vec<Row> = fitted_frames(observations, states)
            .flat_map(|frame| self.moment_rows(observations, frame))
            .collect();
        let Some(moments_m2) = robust_fit(&rows) else {
            return *self;
        };
        let near = |value: f64, before: f64| value.clamp(before / MAX_CHANGE, before * MAX_CHANGE);
        let along_m2 = near(moments_m2[0], self.along_m2);
        let down_m2 = near(moments_m2[1], self.down_m2);
        let bend = bend(observations, states);
        let unexplained_sway =
            |k: usize| (states[k].sway - bend * turn_rate(observations, states, k)).abs();
        let sway = median((0..states.len()).map(unexplained_sway));
        Shape {
            along_m2,
            down_m2,
            side_m2: moments_m2[2].clamp(0.02 * down_m2, down_m2),
            bend,
            sway_sd: (1.4826 * sway.unwrap_or(0.0)).max(MIN_SWAY * along_m2),
            ..*self
        }
        .with_noise(observations, states)
    }

    /// Returns the shape with its noise set from the residuals of the given states.
    fn with_noise(self, observations: &Observations, states: &[State]) -> Shape {
        let frames = || fitted_frames(observations, states);
        let spread = |residual: Option<f64>| NOISE_FROM_RESIDUAL * 1.4826 * residual.unwrap_or(0.0);
        let vertical = median(frames().map(|frame| {
            let extent_m = self.vertical_extent(frame.state.pitch).m;
            let depth_m = observations.focal_px * extent_m / frame.silhouette.vertical_px;
            (libm::log(depth_m) - frame.state.log_z).abs()
        }));
        let moments = median(frames().flat_map(|frame| {
            let expected = self.moments_px2(observations, &frame);
            let noise = frame.silhouette.moment_noise_px2();
            [0, 1, 2].map(|c| ((expected[c] - frame.silhouette.covariance_px2[c]) / noise[c]).abs())
        }));
        Shape {
            vertical_noise: spread(vertical).clamp(0.015, 0.15),
            moment_noise: spread(moments).clamp(0.7, 4.0),
            ..self
        }
    }

    /// Returns the moments xx, xy and yy that a silhouette shows in a given state, square pixels.
    fn moments_px2(&self, observations: &Observations, frame: &FittedFrame) -> [f64; 3] {
        let seen = frame.projection(observations);
        let scale = observations.px2_per_m2(frame.state);
        let body = self.covariance_m2(frame.state.sway);
        std::array::from_fn(|c| {
            let (i, j) = MOMENT_AXES[c];
            scale * bilinear_form(&seen[i], &seen[j], &body) + PIXEL_MOMENTS_PX2[c]
        })
    }

    /// Returns the three moments of one frame as rows of a linear system for (along, down, side).
    ///
    /// The known contributions of slant and sway are subtracted.
    fn moment_rows(&self, observations: &Observations, frame: FittedFrame) -> [Row; 3] {
        let seen = frame.projection(observations);
        let scale = observations.px2_per_m2(frame.state);
        let noise = frame.silhouette.moment_noise_px2();
        let unit = |m: usize| std::array::from_fn::<f64, 5, _>(|c| if c == m { 1.0 } else { 0.0 });
        std::array::from_fn(|c| {
            let (i, j) = MOMENT_AXES[c];
            let by = |m: usize| scale * bilinear_form(&seen[i], &seen[j], &unit(m)) / noise[c];
            let measured = (frame.silhouette.covariance_px2[c] - PIXEL_MOMENTS_PX2[c]) / noise[c];
            let known = by(3) * self.slant_m2 + by(4) * frame.state.sway;
            Row {
                factors: [by(0), by(1), by(2)],
                value: measured - known,
            }
        })
    }
}

/// Vertical extent of the animal, metres, and its derivative with respect to pitch.
pub(super) struct VerticalExtent {
    pub(super) m: f64,
    pub(super) m_by_pitch: f64,
}

/// A frame with an uncut silhouette, and its state.
struct FittedFrame<'a> {
    observation: &'a Observation,
    silhouette: &'a Silhouette,
    state: &'a State,
}

impl FittedFrame<'_> {
    fn projection(&self, observations: &Observations) -> [[f64; 3]; 2] {
        let axes = BodyAxes::new(self.state.yaw, self.state.pitch);
        observations.project(&axes, self.observation)
    }
}

fn fitted_frames<'a>(
    observations: &'a Observations,
    states: &'a [State],
) -> impl Iterator<Item = FittedFrame<'a>> {
    let frames = observations.frames.iter().zip(states);
    frames.filter_map(|(observation, state)| {
        Some(FittedFrame {
            observation,
            silhouette: observation.silhouette.as_ref()?,
            state,
        })
    })
}

/// A linear equation for the moments of the body, in units of its standard deviation.
struct Row {
    factors: [f64; 3],
    value: f64,
}

/// Returns the covariance of the forward and down axes, square metres, or `None` without usable frames.
///
/// An animal that swims along its forward axis shows its pitch by its motion. The method compares the tilt of
/// broadside silhouettes with that pitch. The fitted states cannot be used, because their pitch follows the
/// tilt.
fn slant_m2<'a>(
    observations: &Observations,
    animal: &Animal,
    excess_m2: f64,
    broadside: impl Iterator<Item = &'a (usize, &'a Silhouette)>,
) -> Option<f64> {
    let half_span = ((HALF_SPAN_S / observations.dt).round() as usize).max(1);
    median(broadside.filter_map(|&(k, silhouette)| {
        let (last, next) = (k.checked_sub(half_span)?, k + half_span);
        let (from, to) = (
            observations.frames[last].slope,
            observations.frames.get(next)?.slope,
        );
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let length =
            silhouette.vertical_px / observations.focal_px * animal.length_m / animal.height_m;
        let distance = libm::hypot(x, y);
        if distance / length < MIN_SPEED_BL * (next - last) as f64 * observations.dt {
            return None;
        }
        // Sine and cosine of the pitch, positive with the nose down, for either side.
        let (sin, cos) = (y / distance, x.abs() / distance);
        let scale = (animal.height_m / silhouette.vertical_px).powi(2);
        let shown = silhouette.covariance_px2[1] * scale * x.signum();
        (cos > 0.8).then(|| (shown - excess_m2 * sin * cos) / (cos * cos - sin * sin))
    }))
}

/// Returns the sway per radian per second of yaw rate, square metres, by least squares.
///
/// Only frames between broadside and head-on count, because sway is visible there.
fn bend(observations: &Observations, states: &[State]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (k, state) in states.iter().enumerate() {
        let is_oblique = libm::sin(2.0 * state.yaw).abs() > 0.6;
        if is_oblique && observations.frames[k].silhouette.is_some() {
            let rate = turn_rate(observations, states, k);
            product += rate * state.sway;
            square += rate * rate;
        }
    }
    if square > 0.0 { product / square } else { 0.0 }
}

/// Returns the yaw rate, radians per second, limited to the range in which it bends the body.
fn turn_rate(observations: &Observations, states: &[State], k: usize) -> f64 {
    let (a, b) = (k.saturating_sub(1), (k + 1).min(states.len() - 1));
    let rate = (states[b].yaw - states[a].yaw) / ((b - a).max(1) as f64 * observations.dt);
    rate.clamp(-MAX_BEND_RATE, MAX_BEND_RATE)
}

/// Returns the least-squares solution with Huber weights beyond two standard deviations.
fn robust_fit(rows: &[Row]) -> Option<[f64; 3]> {
    let mut solution = [0.0; 3];
    for round in 0..5 {
        let mut normal = [[0.0; 4]; 3];
        for Row { factors, value } in rows {
            let fitted: f64 = factors.iter().zip(&solution).map(|(a, x)| a * x).sum();
            let error = fitted - value;
            let weight = if round > 0 && error.abs() > 2.0 {
                2.0 / error.abs()
            } else {
                1.0
            };
            for i in 0..3 {
                for j in 0..3 {
                    normal[i][j] += weight * factors[i] * factors[j];
                }
                normal[i][3] += weight * factors[i] * value;
            }
        }
        solution = eliminate(normal)?;
    }
    Some(solution)
}

/// Returns the solution of three equations with the right side in the last column, or `None` for a singular
/// system.
fn eliminate(mut a: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    let scale: [f64; 3] = std::array::from_fn(|k| a[k][k].sqrt().max(1e-300));
    for i in 0..3 {
        for j in 0..3 {
            a[i][j] /= scale[i] * scale[j];
        }
        a[i][3] /= scale[i];
    }
    for k in 0..3 {
        // The matrix is symmetric and scaled: a small pivot means an undetermined unknown.
        if a[k][k] < 1e-6 {
            return None;
        }
        for i in k + 1..3 {
            let factor = a[i][k] / a[k][k];
            for j in k..4 {
                a[i][j] -= factor * a[k][j];
            }
        }
    }
    let mut x = [0.0; 3];
    for k in (0..3).rev() {
        let known: f64 = (k + 1..3).map(|j| a[k][j] * x[j]).sum();
        x[k] = (a[k][3] - known) / a[k][k];
    }
    Some(std::array::from_fn(|k| x[k] / scale[k]))
}
