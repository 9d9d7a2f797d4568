//! The energy that the estimate minimises: a weighted sum of squared residuals over all frames
//! (docs/explanation/algorithms.md, "Direction in space").
//!
//! Each frame has five unknowns: logarithm of the apparent depth, yaw, pitch, speed and sway. Sway is the
//! covariance of the body's forward and side axes; it is large where the tail lies to one side. Each residual
//! is in units of its standard deviation. Measurements have Huber weights.
//!
//! - The second moments of the silhouette are compared with those of the projected body.
//! - The vertical extent is compared with the animal's height.
//! - The motion is compared with the speed along the forward axis; some sideways slip is allowed.
//! - Priors limit changes of yaw rate, pitch rate and speed, backward swimming, and pitch.
//! - A prior ties the sway to the bend that the turn would cause.

use super::banded::{N_STATE, Normal};
use super::body::{Axes, form};
use super::shape::Shape;
use super::{Outline, View, Views};

/// Residuals of measurements grow linearly beyond this many standard deviations (Huber 1964). Free choice.
const HUBER: f64 = 2.5;
/// Standard deviation of a centroid coordinate, pixels. Free choice.
const CENTROID_NOISE_PX: f64 = 0.2;
/// Standard deviation of the sideways speed, body lengths per second. Free choice.
const SLIP_BL: f64 = 0.2;
/// Standard deviation of the yaw rate, radians per second. Free choice.
const TURN_RATE: f64 = 3.0;
/// Standard deviation of the change in yaw rate within one second, radians per second. It grows with the
/// square root of time. Free choice.
const TURN_CHANGE: f64 = 6.5;
/// Standard deviation of the change in pitch rate within one second, radians per second. Free choice.
const PITCH_CHANGE: f64 = 1.5;
/// Standard deviation of the pitch, radians. Free choice.
const PITCH: f64 = 0.5;
/// Standard deviation of the change in speed within one second, body lengths per second. It grows with the
/// square root of time. Free choice.
const SPEED_CHANGE_BL: f64 = 2.2;
/// Standard deviation of the backward speed, body lengths per second. Free choice.
const BACKWARD_BL: f64 = 0.1;
/// Standard deviation of the component of the forward vector that points away from a head given by the user.
/// Small: the user's choice holds.
const PINNED: f64 = 0.01;
/// Yaw rates above this do not bend the body further, radians per second. Free choice.
pub(super) const BEND_RATE: f64 = 4.0;

/// The unknowns of one frame: logarithm of apparent depth (metres), yaw and pitch (radians), speed (metres
/// per second), sway (square metres).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State(pub(super) [f64; N_STATE]);

impl State {
    pub(super) fn log_z(&self) -> f64 {
        self.0[0]
    }
    pub(super) fn yaw(&self) -> f64 {
        self.0[1]
    }
    pub(super) fn pitch(&self) -> f64 {
        self.0[2]
    }
    pub(super) fn speed(&self) -> f64 {
        self.0[3]
    }
    pub(super) fn sway(&self) -> f64 {
        self.0[4]
    }
}

/// The energy of a sequence of states, for given measurements and a given body shape.
pub(super) struct Energy<'a> {
    pub(super) views: &'a Views,
    pub(super) shape: &'a Shape,
}

/// Returns the standard deviations of the measured moments xx, xy and yy, square pixels, from their values.
pub(super) fn moment_noise([xx, _, yy]: [f64; 3]) -> [f64; 3] {
    let mean = (xx * yy).max(1.0).sqrt();
    [
        0.05 * xx + 0.03 * mean,
        0.06 * mean,
        0.05 * yy + 0.01 * mean,
    ]
}

impl<'a> Energy<'a> {
    pub(super) fn new(views: &'a Views, shape: &'a Shape) -> Energy<'a> {
        Energy { views, shape }
    }

    /// Returns the energy of `states`, which begin at frame `start`. Only residuals among these frames count.
    pub(super) fn cost(&self, start: usize, states: &[State]) -> f64 {
        let mut cost = 0.0;
        self.visit(start, states, &mut |residual, scale, robust, _| {
            cost += scale * loss(residual, robust);
        });
        cost
    }

    /// Returns the normal equations of [`Energy::cost`], with the cost itself.
    pub(super) fn normal(&self, start: usize, states: &[State]) -> Normal {
        let mut normal = Normal::new(states.len() * N_STATE);
        let mut cost = 0.0;
        self.visit(start, states, &mut |residual, scale, robust, terms| {
            cost += scale * loss(residual, robust);
            let size = residual.abs();
            let weight = if robust && size > HUBER {
                HUBER / size
            } else {
                1.0
            };
            normal.add(residual, scale * weight, terms);
        });
        normal.cost = cost;
        normal
    }

    /// Calls `add` for every residual with its value, its weight, whether it is robust, and its derivatives.
    fn visit(&self, start: usize, states: &[State], add: &mut Add) {
        let evidence = self.views.evidence();
        let axes: Vec<Axes> = states
            .iter()
            .map(|s| Axes::of(s.yaw(), s.pitch()))
            .collect();
        for (k, state) in states.iter().enumerate() {
            let view = &self.views.frames[start + k];
            if let Some(outline) = &view.outline {
                self.moments(k, state, &axes[k], (view, outline), &mut |r, terms| {
                    add(r, evidence, true, terms);
                });
                self.upright(k, state, outline, &mut |r, terms| {
                    add(r, evidence, true, terms)
                });
            }
            let backward = state.speed().min(0.0) / (BACKWARD_BL * self.shape.length_m);
            if backward < 0.0 {
                let slope = backward / state.speed();
                add(backward, 1.0, true, &[(k * N_STATE + 3, slope)]);
            }
            add(
                state.pitch() / PITCH,
                evidence,
                false,
                &[(k * N_STATE + 2, 1.0 / PITCH)],
            );
            let pinned = view.toward.map(|toward| toward.map(|c| c / PINNED));
            for (toward, weight) in [(pinned, 1.0), (view.ends, evidence)] {
                let Some([x, y]) = toward else { continue };
                let along = |v: [f64; 3]| x * v[0] + y * v[1];
                let residual = along(axes[k].forward);
                if residual < 0.0 {
                    let slopes = [axes[k].by_yaw(), axes[k].by_pitch()].map(|a| along(a.forward));
                    let at = k * N_STATE;
                    let terms = [(at + 1, slopes[0]), (at + 2, slopes[1])];
                    add(residual, weight, false, &terms);
                }
            }
            if k + 1 < states.len() {
                let pair = [&axes[k], &axes[k + 1]];
                self.motion(start, k, states, pair, &mut |r, terms| {
                    add(r, evidence, true, terms)
                });
            }
            self.habits(k, states, &mut |r, terms| add(r, 1.0, false, terms));
        }
    }

    fn moments(
        &self,
        k: usize,
        state: &State,
        axes: &Axes,
        (view, outline): (&View, &Outline),
        add: &mut AddOne,
    ) {
        let flatten = 1.0 / self.views.medium_index;
        let body = self.shape.body(state.sway());
        let scale = (self.views.focal_px * libm::exp(-state.log_z())).powi(2);
        let seen = axes.seen(view.slope, flatten);
        let by = [axes.by_yaw(), axes.by_pitch()].map(|a| a.seen(view.slope, flatten));
        let noise = moment_noise(outline.covariance_px2).map(|n| n * self.shape.moment_noise);
        for (c, (i, j)) in [(0, 0), (0, 1), (1, 1)].into_iter().enumerate() {
            let value = scale * form(&seen[i], &seen[j], &body);
            let turned =
                by.map(|b| scale * (form(&b[i], &seen[j], &body) + form(&seen[i], &b[j], &body)));
            let swayed = scale * (seen[i][0] * seen[j][2] + seen[i][2] * seen[j][0]);
            // Each pixel is a square with a second moment of 1/12.
            let pixel = if i == j { 1.0 / 12.0 } else { 0.0 };
            let residual = (value + pixel - outline.covariance_px2[c]) / noise[c];
            let at = k * N_STATE;
            add(
                residual,
                &[
                    (at, -2.0 * value / noise[c]),
                    (at + 1, turned[0] / noise[c]),
                    (at + 2, turned[1] / noise[c]),
                    (at + 4, swayed / noise[c]),
                ],
            );
        }
    }

    fn upright(&self, k: usize, state: &State, outline: &Outline, add: &mut AddOne) {
        let (extent_m, by_pitch) = self.shape.upright_m(state.pitch());
        let noise = self.shape.upright_noise;
        let shown = libm::log(self.views.focal_px * extent_m) - state.log_z();
        let residual = (shown - libm::log(outline.upright_px)) / noise;
        let at = k * N_STATE;
        let terms = [(at, -1.0 / noise), (at + 2, by_pitch / extent_m / noise)];
        add(residual, &terms);
    }

    /// Adds the residuals of the displacement to the next frame against the speed along the forward axis.
    fn motion(&self, start: usize, k: usize, states: &[State], axes: [&Axes; 2], add: &mut AddOne) {
        let views = self.views;
        let both = [&views.frames[start + k], &views.frames[start + k + 1]];
        let pair = [&states[k], &states[k + 1]];
        let depth = pair.map(|s| libm::exp(s.log_z()));
        let pixel = CENTROID_NOISE_PX * depth[0] / views.focal_px * std::f64::consts::SQRT_2;
        let unsure = if both.iter().all(|v| v.seen) {
            1.0
        } else {
            3.0
        };
        let slip = unsure * libm::hypot(SLIP_BL * self.shape.length_m, pixel / views.dt);
        let speed = (pair[0].speed() + pair[1].speed()) / 2.0;
        let at = [k * N_STATE, (k + 1) * N_STATE];
        let slopes = [0, 1].map(|m| [both[m].slope[0], both[m].slope[1], views.medium_index]);
        let by = axes.map(|a| [a.by_yaw().forward, a.by_pitch().forward]);
        for c in 0..3 {
            // x and y scale with the apparent depth. The medium scales the true depth z.
            let place = [0, 1].map(|m| slopes[m][c] * depth[m]);
            let forward = (axes[0].forward[c] + axes[1].forward[c]) / 2.0;
            let residual = ((place[1] - place[0]) / views.dt - speed * forward) / slip;
            let half = -speed / 2.0 / slip;
            let moved = [-place[0], place[1]].map(|p| p / views.dt / slip);
            add(
                residual,
                &[
                    (at[0], moved[0]),
                    (at[0] + 1, half * by[0][0][c]),
                    (at[0] + 2, half * by[0][1][c]),
                    (at[0] + 3, -forward / 2.0 / slip),
                    (at[1], moved[1]),
                    (at[1] + 1, half * by[1][0][c]),
                    (at[1] + 2, half * by[1][1][c]),
                    (at[1] + 3, -forward / 2.0 / slip),
                ],
            );
        }
    }

    /// Adds the residuals of the priors on turning, speed and sway.
    fn habits(&self, k: usize, states: &[State], add: &mut AddOne) {
        let dt = self.views.dt;
        let root = dt.sqrt();
        let at = |m: usize, part: usize| (k + m) * N_STATE + part;
        if let Some([a, b]) = states
            .get(k..k + 2)
            .and_then(|s| <&[State; 2]>::try_from(s).ok())
        {
            let slope = 1.0 / (dt * TURN_RATE);
            let turned = b.yaw() - a.yaw();
            add(turned * slope, &[(at(0, 1), -slope), (at(1, 1), slope)]);
            let slope = 1.0 / (SPEED_CHANGE_BL * self.shape.length_m * root);
            let faster = b.speed() - a.speed();
            add(faster * slope, &[(at(0, 3), -slope), (at(1, 3), slope)]);
        }
        let Some([a, b, c]) = states
            .get(k..k + 3)
            .and_then(|s| <&[State; 3]>::try_from(s).ok())
        else {
            return;
        };
        for (part, change) in [(1, TURN_CHANGE), (2, PITCH_CHANGE)] {
            let slope = 1.0 / (dt * change * root);
            let second = a.0[part] - 2.0 * b.0[part] + c.0[part];
            let terms = [
                (at(0, part), slope),
                (at(1, part), -2.0 * slope),
                (at(2, part), slope),
            ];
            add(second * slope, &terms);
        }
        let rate = (c.yaw() - a.yaw()) / (2.0 * dt);
        let bend = self.shape.bend * rate.clamp(-BEND_RATE, BEND_RATE);
        let by_yaw = if rate.abs() < BEND_RATE {
            self.shape.bend / (2.0 * dt)
        } else {
            0.0
        };
        let scale = 1.0 / self.shape.sway_sd;
        let terms = [
            (at(0, 1), by_yaw * scale),
            (at(1, 4), scale),
            (at(2, 1), -by_yaw * scale),
        ];
        add((b.sway() - bend) * scale, &terms);
    }
}

/// Receives a residual and its derivatives.
type AddOne<'a> = dyn FnMut(f64, &[(usize, f64)]) + 'a;

/// Receives a residual, its weight, whether Huber weights apply, and its derivatives.
type Add<'a> = dyn FnMut(f64, f64, bool, &[(usize, f64)]) + 'a;

fn loss(residual: f64, robust: bool) -> f64 {
    let size = residual.abs();
    if robust && size > HUBER {
        HUBER * (2.0 * size - HUBER)
    } else {
        residual * residual
    }
}
