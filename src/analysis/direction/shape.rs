//! The shape of the body: second moments in its own axes, estimated from the footage.
//!
//! An ellipsoid projects to an ellipse whose second moments are the projected moments of the body. Fish are
//! close enough to that once the sway of the tail is a separate unknown.

use super::body::{Axes, form};
use super::energy::{BEND_RATE, State, moment_noise};
use super::{Outline, View, Views};
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
    pub(super) upright_noise: f64,
    /// Noise of the moments as a multiple of `moment_noise`.
    pub(super) moment_noise: f64,
}

/// Half the time span over which the direction of motion is measured, seconds. Free choice.
const STRIDE_S: f64 = 0.1;
/// Below this speed, in body lengths per second, the direction of motion is not used. Free choice.
const LEAST_SPEED_BL: f64 = 0.4;
/// Initial standard deviation of the sway, as a share of the moment along the forward axis. Free choice.
const FIRST_SWAY: f64 = 0.15;
/// Smallest standard deviation of the sway, as a share of the moment along the forward axis. Free choice.
const LEAST_SWAY: f64 = 0.1;
/// Initial standard deviation of the vertical extent, as a share of it. Free choice.
const FIRST_UPRIGHT_NOISE: f64 = 0.03;
/// Factor from residuals to noise. Residuals are smaller than the noise because the fitted states follow it.
const FOLLOWED: f64 = 1.2;
/// Largest factor by which one estimate may change a moment. Free choice.
const TRUST: f64 = 1.25;

impl Shape {
    /// Returns a first estimate from broadside and head-on views, or `None` without silhouettes.
    ///
    /// Broadside views are the fifth with the largest ratio of horizontal to vertical moment. The head-on
    /// value is the third percentile of that ratio.
    pub(super) fn first(views: &Views, animal: &Animal) -> Option<Shape> {
        // In units of the animal's height, which the vertical extent shows in every frame.
        let moment =
            |o: &Outline, c: usize| o.covariance_px2[c] * (animal.height_m / o.upright_px).powi(2);
        let outlines: Vec<(usize, &Outline)> = views
            .frames
            .iter()
            .enumerate()
            .filter_map(|(k, v)| Some((k, v.outline.as_ref()?)))
            .collect();
        let ratio = |o: &Outline| o.covariance_px2[0] / o.covariance_px2[2].max(1e-9);
        let mut ratios: Vec<f64> = outlines.iter().map(|(_, o)| ratio(o)).collect();
        let broadside = percentile(&mut ratios, 0.8)?;
        let head_on = percentile(&mut ratios, 0.03)?;
        let long = || outlines.iter().filter(|(_, o)| ratio(o) >= broadside);
        let down_m2 = median(outlines.iter().map(|(_, o)| moment(o, 2)))?;
        let along_m2 = 1.03 * median(long().map(|(_, o)| moment(o, 0)))?;
        let slant_m2 = slant(views, animal, along_m2 - down_m2, long()).unwrap_or(0.0);
        Some(Shape {
            length_m: animal.length_m,
            height_m: animal.height_m,
            along_m2,
            down_m2,
            side_m2: (0.8 * head_on * down_m2).clamp(0.02 * down_m2, down_m2),
            slant_m2,
            bend: 0.0,
            sway_sd: FIRST_SWAY * along_m2,
            upright_noise: FIRST_UPRIGHT_NOISE,
            moment_noise: 1.0,
        })
    }

    /// Returns the covariance of the body in the order that `body::form` takes.
    pub(super) fn body(&self, sway: f64) -> [f64; 5] {
        [
            self.along_m2,
            self.down_m2,
            self.side_m2,
            self.slant_m2,
            sway,
        ]
    }

    /// Returns the vertical extent of the animal at a pitch, metres, and its derivative with respect to
    /// pitch.
    ///
    /// The outline is an ellipse with the animal's length and height as axes.
    pub(super) fn upright_m(&self, pitch_rad: f64) -> (f64, f64) {
        let (sin, cos) = libm::sincos(pitch_rad);
        let (height2, length2) = (self.height_m.powi(2), self.length_m.powi(2));
        let extent = (height2 * cos * cos + length2 * sin * sin).sqrt();
        (extent, (length2 - height2) * sin * cos / extent)
    }

    /// Returns the apparent depth of the silhouette for an animal without pitch, metres.
    pub(super) fn level_depth_m(&self, views: &Views, outline: &Outline) -> f64 {
        views.focal_px * self.height_m / outline.upright_px
    }

    /// Returns the shape that fits the moments best for the given states, by robust linear least squares.
    /// Returns `self` if the moments do not determine a shape.
    pub(super) fn learned(&self, views: &Views, states: &[State]) -> Shape {
        let rows: Vec<([f64; 3], f64)> = views
            .frames
            .iter()
            .enumerate()
            .filter_map(|(k, view)| Some((k, view, view.outline.as_ref()?)))
            .flat_map(|(k, view, outline)| self.rows(views, states, k, (view, outline)))
            .collect();
        let Some(found) = robust_fit(&rows) else {
            return *self;
        };
        let near = |value: f64, before: f64| value.clamp(before / TRUST, before * TRUST);
        let along_m2 = near(found[0], self.along_m2);
        let down_m2 = near(found[1], self.down_m2);
        let bend = bend(views, states);
        let sway = median(
            (0..states.len())
                .map(|k| (states[k].sway() - bend * turn_rate(views, states, k)).abs()),
        );
        Shape {
            along_m2,
            down_m2,
            side_m2: found[2].clamp(0.02 * down_m2, down_m2),
            bend,
            sway_sd: (1.4826 * sway.unwrap_or(0.0)).max(LEAST_SWAY * along_m2),
            ..*self
        }
        .with_noise(views, states)
    }

    /// Returns the shape with its noise set from the residuals of the given states.
    fn with_noise(self, views: &Views, states: &[State]) -> Shape {
        let outlines = || {
            let seen = views.frames.iter().zip(states);
            seen.filter_map(|(view, state)| Some((view, view.outline.as_ref()?, state)))
        };
        let off = |values: Option<f64>| FOLLOWED * 1.4826 * values.unwrap_or(0.0);
        let upright = median(outlines().map(|(_, outline, state)| {
            let shown = views.focal_px * self.upright_m(state.pitch()).0;
            (libm::log(shown / outline.upright_px) - state.log_z()).abs()
        }));
        let moments = median(outlines().flat_map(|(view, outline, state)| {
            let expected = self.moments_px2(views, view, state);
            let noise = moment_noise(outline.covariance_px2);
            [0, 1, 2].map(|c| ((expected[c] - outline.covariance_px2[c]) / noise[c]).abs())
        }));
        Shape {
            upright_noise: off(upright).clamp(0.015, 0.15),
            moment_noise: off(moments).clamp(0.7, 4.0),
            ..self
        }
    }

    /// Returns the moments xx, xy and yy that a silhouette shows in a given state, square pixels.
    fn moments_px2(&self, views: &Views, view: &View, state: &State) -> [f64; 3] {
        let seen = Axes::of(state.yaw(), state.pitch()).seen(view.slope, 1.0 / views.medium_index);
        let scale = (views.focal_px * libm::exp(-state.log_z())).powi(2);
        let body = self.body(state.sway());
        [(0, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let pixel = if i == j { 1.0 / 12.0 } else { 0.0 };
            scale * form(&seen[i], &seen[j], &body) + pixel
        })
    }

    /// Returns the three moments of one frame as rows of a linear system for (along, down, side).
    ///
    /// The rows are in units of the standard deviation. The known contributions of slant and sway are
    /// subtracted.
    fn rows(
        &self,
        views: &Views,
        states: &[State],
        k: usize,
        (view, outline): (&View, &Outline),
    ) -> [([f64; 3], f64); 3] {
        let state = &states[k];
        let seen = Axes::of(state.yaw(), state.pitch()).seen(view.slope, 1.0 / views.medium_index);
        let scale = (views.focal_px * libm::exp(-state.log_z())).powi(2);
        let noise = moment_noise(outline.covariance_px2);
        let unit = |m: usize| std::array::from_fn::<f64, 5, _>(|c| if c == m { 1.0 } else { 0.0 });
        let pairs = [(0, 0), (0, 1), (1, 1)];
        std::array::from_fn(|c| {
            let (i, j) = pairs[c];
            let by = |m: usize| scale * form(&seen[i], &seen[j], &unit(m)) / noise[c];
            let pixel = if i == j { 1.0 / 12.0 } else { 0.0 };
            let rest = (outline.covariance_px2[c] - pixel) / noise[c];
            let known = by(3) * self.slant_m2 + by(4) * state.sway();
            ([by(0), by(1), by(2)], rest - known)
        })
    }
}

/// Returns the covariance of the forward and down axes, square metres, or `None` without usable frames.
///
/// An animal that swims along its forward axis shows its pitch by its motion. The method compares the tilt of
/// broadside silhouettes with that pitch. The fitted states cannot be used, because their pitch follows the
/// tilt.
fn slant<'a>(
    views: &Views,
    animal: &Animal,
    excess_m2: f64,
    long: impl Iterator<Item = &'a (usize, &'a Outline)>,
) -> Option<f64> {
    let reach = ((STRIDE_S / views.dt).round() as usize).max(1);
    median(long.filter_map(|&(k, outline)| {
        let (last, next) = (k.checked_sub(reach)?, k + reach);
        let (from, to) = (views.frames[last].slope, views.frames.get(next)?.slope);
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let length = outline.upright_px / views.focal_px * animal.length_m / animal.height_m;
        let way = libm::hypot(x, y);
        if way / length < LEAST_SPEED_BL * (next - last) as f64 * views.dt {
            return None;
        }
        // Sine and cosine of the pitch, positive with the nose down, for either side.
        let (sin, cos) = (y / way, x.abs() / way);
        let scale = (animal.height_m / outline.upright_px).powi(2);
        let shown = outline.covariance_px2[1] * scale * x.signum();
        (cos > 0.8).then(|| (shown - excess_m2 * sin * cos) / (cos * cos - sin * sin))
    }))
}

/// Returns the sway per radian per second of yaw rate, square metres, by least squares.
///
/// Only frames between broadside and head-on count, because sway is visible there.
fn bend(views: &Views, states: &[State]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (k, state) in states.iter().enumerate() {
        let shows = libm::sin(2.0 * state.yaw()).abs() > 0.6;
        if shows && views.frames[k].outline.is_some() {
            let rate = turn_rate(views, states, k);
            product += rate * state.sway();
            square += rate * rate;
        }
    }
    if square > 0.0 { product / square } else { 0.0 }
}

/// Returns the yaw rate, radians per second, limited to the range in which it bends the body.
fn turn_rate(views: &Views, states: &[State], k: usize) -> f64 {
    let (a, b) = (k.saturating_sub(1), (k + 1).min(states.len() - 1));
    let rate = (states[b].yaw() - states[a].yaw()) / ((b - a).max(1) as f64 * views.dt);
    rate.clamp(-BEND_RATE, BEND_RATE)
}

/// Returns the least-squares solution with Huber weights beyond two standard deviations.
fn robust_fit(rows: &[([f64; 3], f64)]) -> Option<[f64; 3]> {
    let mut found = [0.0; 3];
    for round in 0..5 {
        let mut normal = [[0.0; 4]; 3];
        for (row, value) in rows {
            let error: f64 = row.iter().zip(&found).map(|(a, x)| a * x).sum::<f64>() - value;
            let weight = if round > 0 && error.abs() > 2.0 {
                2.0 / error.abs()
            } else {
                1.0
            };
            for i in 0..3 {
                for j in 0..3 {
                    normal[i][j] += weight * row[i] * row[j];
                }
                normal[i][3] += weight * row[i] * value;
            }
        }
        found = eliminate(normal)?;
    }
    Some(found)
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
