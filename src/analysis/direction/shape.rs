//! The body that all silhouettes of a footage show: its second moments in its own axes, learned from
//! the footage.
//!
//! The silhouette of an ellipsoid under parallel projection is an ellipse whose second moments are
//! the projected moments of the body. Fish are near enough to it once the sway of the tail is an unknown
//! of its own.

use super::body::{Axes, form};
use super::energy::{BEND_RATE, State, moment_noise};
use super::{Outline, View, Views};
use crate::library::Animal;
use crate::order::{median, percentile};

/// The body's constants, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// Nose to tail tip.
    pub(super) length_m: f64,
    /// Of the whole silhouette, fins included.
    height_m: f64,
    /// Second moments about the centroid, square metres: along forward, down and side.
    along_m2: f64,
    down_m2: f64,
    side_m2: f64,
    /// Forward and down together: the tail above or below the axis.
    slant_m2: f64,
    /// Forward and side together, per radian a second of turning.
    pub(super) bend: f64,
    /// Standard deviation of the sway, square metres.
    pub(super) sway_sd: f64,
    /// Noise of the upright extent, relative: fins rise and fall.
    pub(super) upright_noise: f64,
    /// Noise of the moments, against `moment_noise`.
    pub(super) moment_noise: f64,
}

/// Half the time over which the way of an animal is measured, seconds.
const STRIDE_S: f64 = 0.1;
/// Slower than this, lengths a second, the way says nothing.
const LEAST_SPEED_BL: f64 = 0.4;
/// Sway of an unknown animal, against its second moment along forward.
const FIRST_SWAY: f64 = 0.15;
/// And never less than this.
const LEAST_SWAY: f64 = 0.1;
/// Noise of the upright extent of an unknown animal.
const FIRST_UPRIGHT_NOISE: f64 = 0.03;
/// Residuals are smaller than the noise, for the states follow it.
const FOLLOWED: f64 = 1.2;
/// Learning changes a moment by at most this factor at a time.
const TRUST: f64 = 1.25;

impl Shape {
    /// From frames in which the animal is seen broadside (the longest fifth) and head-on (the shortest).
    pub(super) fn first(views: &Views, animal: &Animal) -> Option<Shape> {
        // In units of the animal's height, which the upright extent shows in every frame.
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

    /// The covariance of the body as `body::form` takes it.
    pub(super) fn body(&self, sway: f64) -> [f64; 5] {
        [
            self.along_m2,
            self.down_m2,
            self.side_m2,
            self.slant_m2,
            sway,
        ]
    }

    /// How tall the animal stands at a pitch, metres, and the derivative by pitch: an ellipse of the
    /// animal's height and length.
    pub(super) fn upright_m(&self, pitch_rad: f64) -> (f64, f64) {
        let (sin, cos) = libm::sincos(pitch_rad);
        let (height2, length2) = (self.height_m.powi(2), self.length_m.powi(2));
        let extent = (height2 * cos * cos + length2 * sin * sin).sqrt();
        (extent, (length2 - height2) * sin * cos / extent)
    }

    /// The silhouette's apparent depth when the animal is level, metres.
    pub(super) fn level_depth_m(&self, views: &Views, outline: &Outline) -> f64 {
        views.focal_px * self.height_m / outline.upright_px
    }

    /// The shape that explains the moments best where the states are right: robust linear least squares.
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

    /// How far off the measurements lie from what the states make of the shape.
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

    /// The moments that a silhouette shows in a state: xx, xy, yy.
    fn moments_px2(&self, views: &Views, view: &View, state: &State) -> [f64; 3] {
        let seen = Axes::of(state.yaw(), state.pitch()).seen(view.slope, 1.0 / views.medium_index);
        let scale = (views.focal_px * libm::exp(-state.log_z())).powi(2);
        let body = self.body(state.sway());
        [(0, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let pixel = if i == j { 1.0 / 12.0 } else { 0.0 };
            scale * form(&seen[i], &seen[j], &body) + pixel
        })
    }

    /// The three moments of one frame as rows of a linear system for (along, down, side), in standard
    /// deviations; the slant and the sway are taken out.
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

/// How the body's length and depth vary together, in square metres, of an animal that swims the way it
/// points: its silhouettes seen at length are slanted against its motion by that much. Learning it from
/// states would not do, for their pitch follows it.
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
        // Nose down by so much, whichever way it faces.
        let (sin, cos) = (y / way, x.abs() / way);
        let scale = (animal.height_m / outline.upright_px).powi(2);
        let shown = outline.covariance_px2[1] * scale * x.signum();
        (cos > 0.8).then(|| (shown - excess_m2 * sin * cos) / (cos * cos - sin * sin))
    }))
}

/// How far the body sways for each radian a second of turning: least squares over the frames in which sway
/// shows, the animal being seen between broadside and head-on.
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

/// Radians a second, limited to what bends the body.
fn turn_rate(views: &Views, states: &[State], k: usize) -> f64 {
    let (a, b) = (k.saturating_sub(1), (k + 1).min(states.len() - 1));
    let rate = (states[b].yaw() - states[a].yaw()) / ((b - a).max(1) as f64 * views.dt);
    rate.clamp(-BEND_RATE, BEND_RATE)
}

/// Least squares with Huber weights beyond two standard deviations.
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

/// Solves three equations with their right side in the last column; `None` when they say too little.
fn eliminate(mut a: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    let scale: [f64; 3] = std::array::from_fn(|k| a[k][k].sqrt().max(1e-300));
    for i in 0..3 {
        for j in 0..3 {
            a[i][j] /= scale[i] * scale[j];
        }
        a[i][3] /= scale[i];
    }
    for k in 0..3 {
        // Symmetric and scaled: a small pivot means that an unknown is not determined.
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
