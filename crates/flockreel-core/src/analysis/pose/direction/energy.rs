//! The energy that the estimate minimises: a weighted sum of squared residuals over all frames
//! (docs/explanation/algorithms.md, "Direction in space").
//!
//! Each residual is in units of its standard deviation. Measurements have Huber weights.
//!
//! - The second moments of the silhouette are compared with those of the projected body.
//! - The vertical extent is compared with the animal's height.
//! - The motion is compared with the speed along the forward axis; some sideways slip is allowed.
//! - Priors limit changes of yaw rate, pitch rate and speed, backward swimming, and pitch.
//! - A prior ties the sway to the bend that the turn would cause.

use super::banded::NormalEquations;
use super::body::{BodyAxes, MOMENT_AXES, bilinear_form};
use super::observations::{Observation, Observations, PIXEL_MOMENTS_PX2, Silhouette};
use super::shape::{MAX_BEND_RATE, Shape};
use super::state::{LOG_Z, N_STATE, PITCH, SPEED, SWAY, State, YAW};

/// Residuals of measurements grow linearly beyond this many standard deviations (Huber 1964). Free choice.
const HUBER: f64 = 2.5;
/// Standard deviation of a centroid coordinate, pixels. Free choice.
const CENTROID_NOISE_PX: f64 = 0.2;
/// Standard deviation of the sideways speed, body lengths per second. Free choice.
const SLIP_BL: f64 = 0.2;
/// Factor on the standard deviation of the motion beside an interpolated centroid. Free choice.
const INTERPOLATED_SLIP: f64 = 3.0;
/// Standard deviation of the yaw rate, radians per second. Free choice.
const TURN_RATE: f64 = 3.0;
/// Standard deviation of the change in yaw rate within one second, radians per second. It grows with the
/// square root of time. Free choice.
const TURN_CHANGE: f64 = 6.5;
/// Standard deviation of the change in pitch rate within one second, radians per second. Free choice.
const PITCH_CHANGE: f64 = 1.5;
/// Standard deviation of the pitch, radians. Free choice.
const PITCH_NOISE: f64 = 0.5;
/// Standard deviation of the change in speed within one second, body lengths per second. It grows with the
/// square root of time. Free choice.
const SPEED_CHANGE_BL: f64 = 2.2;
/// Standard deviation of the backward speed, body lengths per second. Free choice.
const BACKWARD_BL: f64 = 0.1;
/// Standard deviation of the component of the forward vector that points away from a head given by the user.
/// Small: the user's choice holds.
const GIVEN_HEAD_NOISE: f64 = 0.01;

/// The energy of a sequence of states, for given measurements and a given body shape.
pub(super) struct Energy<'a> {
    pub(super) observations: &'a Observations,
    pub(super) shape: &'a Shape,
}

/// One term of the energy.
struct Residual<'a> {
    /// The residual in standard deviations.
    value: f64,
    weight: f64,
    /// Whether Huber weights apply.
    robust: bool,
    /// Pairs of unknown and derivative, by ascending unknown.
    slopes: &'a [(usize, f64)],
}

/// Receives the residuals.
type Add<'a> = dyn FnMut(Residual<'_>) + 'a;

/// One frame of a sequence of states.
struct Frame<'a> {
    /// Index of the first unknown of the frame.
    at: usize,
    state: &'a State,
    axes: BodyAxes,
    observation: &'a Observation,
}

impl Residual<'_> {
    fn is_outlier(&self) -> bool {
        self.robust && self.value.abs() > HUBER
    }

    fn energy(&self) -> f64 {
        let loss = if self.is_outlier() {
            HUBER * (2.0 * self.value.abs() - HUBER)
        } else {
            self.value * self.value
        };
        self.weight * loss
    }
}

impl Energy<'_> {
    /// Returns the energy of `states`, which begin at frame `start`. Only residuals among these frames count.
    pub(super) fn cost(&self, start: usize, states: &[State]) -> f64 {
        let mut cost = 0.0;
        self.visit(start, states, &mut |residual| cost += residual.energy());
        cost
    }

    /// Returns the normal equations of [`Energy::cost`], with the cost itself.
    pub(super) fn normal_equations(&self, start: usize, states: &[State]) -> NormalEquations {
        let mut normal = NormalEquations::new(states.len() * N_STATE);
        let mut cost = 0.0;
        self.visit(start, states, &mut |residual| {
            cost += residual.energy();
            let huber_weight = if residual.is_outlier() {
                HUBER / residual.value.abs()
            } else {
                1.0
            };
            let weight = residual.weight * huber_weight;
            normal.add(residual.value, weight, residual.slopes);
        });
        normal.cost = cost;
        normal
    }

    /// Calls `add` for every residual.
    fn visit(&self, start: usize, states: &[State], add: &mut Add) {
        let frames: Vec<Frame> = (states.iter().zip(&self.observations.frames[start..]))
            .enumerate()
            .map(|(k, (state, observation))| Frame {
                at: k * N_STATE,
                state,
                axes: BodyAxes::new(state.yaw, state.pitch),
                observation,
            })
            .collect();
        for (k, frame) in frames.iter().enumerate() {
            if let Some(silhouette) = &frame.observation.silhouette {
                self.add_moments(frame, silhouette, add);
                self.add_vertical_extent(frame, silhouette, add);
            }
            self.add_direction_priors(frame, add);
            if let Some(next) = frames.get(k + 1) {
                self.add_motion([frame, next], add);
            }
            self.add_change_priors(&frames[k..], add);
        }
    }

    fn add_moments(&self, frame: &Frame, silhouette: &Silhouette, add: &mut Add) {
        let body = self.shape.covariance_m2(frame.state.sway);
        let scale = self.observations.px2_per_m2(frame.state);
        let projected = |axes: &BodyAxes| self.observations.project(axes, frame.observation);
        let seen = projected(&frame.axes);
        let derivatives = [frame.axes.by_yaw(), frame.axes.by_pitch()].map(|a| projected(&a));
        let noise = (silhouette.moment_noise_px2()).map(|n| n * self.shape.moment_noise);
        for (c, (i, j)) in MOMENT_AXES.into_iter().enumerate() {
            let value = scale * bilinear_form(&seen[i], &seen[j], &body);
            let [by_yaw, by_pitch] = derivatives.map(|b| {
                scale
                    * (bilinear_form(&b[i], &seen[j], &body)
                        + bilinear_form(&seen[i], &b[j], &body))
            });
            let by_sway = scale * (seen[i][0] * seen[j][2] + seen[i][2] * seen[j][0]);
            add(Residual {
                value: (value + PIXEL_MOMENTS_PX2[c] - silhouette.covariance_px2[c]) / noise[c],
                weight: self.observations.frame_weight(),
                robust: true,
                slopes: &[
                    (frame.at + LOG_Z, -2.0 * value / noise[c]),
                    (frame.at + YAW, by_yaw / noise[c]),
                    (frame.at + PITCH, by_pitch / noise[c]),
                    (frame.at + SWAY, by_sway / noise[c]),
                ],
            });
        }
    }

    fn add_vertical_extent(&self, frame: &Frame, silhouette: &Silhouette, add: &mut Add) {
        let extent = self.shape.vertical_extent(frame.state.pitch);
        let noise = self.shape.vertical_noise;
        let expected = libm::log(self.observations.focal_px * extent.m) - frame.state.log_z;
        add(Residual {
            value: (expected - libm::log(silhouette.vertical_px)) / noise,
            weight: self.observations.frame_weight(),
            robust: true,
            slopes: &[
                (frame.at + LOG_Z, -1.0 / noise),
                (frame.at + PITCH, extent.m_by_pitch / extent.m / noise),
            ],
        });
    }

    /// Adds the residuals of backward speed, of pitch, and of directions away from the head in the image.
    fn add_direction_priors(&self, frame: &Frame, add: &mut Add) {
        let weight = self.observations.frame_weight();
        let (state, axes, at) = (frame.state, &frame.axes, frame.at);
        let backward = state.speed.min(0.0) / (BACKWARD_BL * self.shape.length_m);
        if backward < 0.0 {
            add(Residual {
                value: backward,
                weight: 1.0,
                robust: true,
                slopes: &[(at + SPEED, backward / state.speed)],
            });
        }
        add(Residual {
            value: state.pitch / PITCH_NOISE,
            weight,
            robust: false,
            slopes: &[(at + PITCH, 1.0 / PITCH_NOISE)],
        });
        let given = frame.observation.given_head;
        let given = given.map(|toward| toward.map(|c| c / GIVEN_HEAD_NOISE));
        for (toward, weight) in [(given, 1.0), (frame.observation.head_evidence, weight)] {
            let Some([x, y]) = toward else { continue };
            let along = |v: [f64; 3]| x * v[0] + y * v[1];
            let value = along(axes.forward);
            if value < 0.0 {
                let slopes = &[
                    (at + YAW, along(axes.by_yaw().forward)),
                    (at + PITCH, along(axes.by_pitch().forward)),
                ];
                add(Residual {
                    value,
                    weight,
                    robust: false,
                    slopes,
                });
            }
        }
    }

    /// Adds the residuals of the displacement to the next frame against the speed along the forward axis.
    fn add_motion(&self, pair: [&Frame; 2], add: &mut Add) {
        let observations = self.observations;
        let depth = pair.map(|frame| libm::exp(frame.state.log_z));
        let pixel = CENTROID_NOISE_PX * depth[0] / observations.focal_px * std::f64::consts::SQRT_2;
        let are_detected = pair.iter().all(|frame| frame.observation.detected);
        let factor = if are_detected { 1.0 } else { INTERPOLATED_SLIP };
        let slip = factor * libm::hypot(SLIP_BL * self.shape.length_m, pixel / observations.dt);
        let speed = (pair[0].state.speed + pair[1].state.speed) / 2.0;
        let at = pair.map(|frame| frame.at);
        let slopes = pair.map(|frame| {
            let [x, y] = frame.observation.slope;
            [x, y, observations.medium_index]
        });
        let by_yaw = pair.map(|frame| frame.axes.by_yaw().forward);
        let by_pitch = pair.map(|frame| frame.axes.by_pitch().forward);
        for c in 0..3 {
            // x and y scale with the apparent depth. The medium scales the true depth z.
            let place = [0, 1].map(|m| slopes[m][c] * depth[m]);
            let forward = (pair[0].axes.forward[c] + pair[1].axes.forward[c]) / 2.0;
            let half = -speed / 2.0 / slip;
            let moved = [-place[0], place[1]].map(|p| p / observations.dt / slip);
            add(Residual {
                value: ((place[1] - place[0]) / observations.dt - speed * forward) / slip,
                weight: observations.frame_weight(),
                robust: true,
                slopes: &[
                    (at[0] + LOG_Z, moved[0]),
                    (at[0] + YAW, half * by_yaw[0][c]),
                    (at[0] + PITCH, half * by_pitch[0][c]),
                    (at[0] + SPEED, -forward / 2.0 / slip),
                    (at[1] + LOG_Z, moved[1]),
                    (at[1] + YAW, half * by_yaw[1][c]),
                    (at[1] + PITCH, half * by_pitch[1][c]),
                    (at[1] + SPEED, -forward / 2.0 / slip),
                ],
            });
        }
    }

    /// Adds the residuals of the priors on turning, speed and sway, from the first frames of a sequence.
    fn add_change_priors(&self, frames: &[Frame], add: &mut Add) {
        let dt = self.observations.dt;
        let root = dt.sqrt();
        let mut add = |value: f64, slopes: &[(usize, f64)]| {
            add(Residual {
                value,
                weight: 1.0,
                robust: false,
                slopes,
            });
        };
        if let [a, b, ..] = frames {
            let slope = 1.0 / (dt * TURN_RATE);
            let turned = b.state.yaw - a.state.yaw;
            add(turned * slope, &[(a.at + YAW, -slope), (b.at + YAW, slope)]);
            let slope = 1.0 / (SPEED_CHANGE_BL * self.shape.length_m * root);
            let faster = b.state.speed - a.state.speed;
            let terms = [(a.at + SPEED, -slope), (b.at + SPEED, slope)];
            add(faster * slope, &terms);
        }
        let [a, b, c, ..] = frames else {
            return;
        };
        let states = [a.state, b.state, c.state];
        for (unknown, change, angles) in [
            (YAW, TURN_CHANGE, states.map(|s| s.yaw)),
            (PITCH, PITCH_CHANGE, states.map(|s| s.pitch)),
        ] {
            let slope = 1.0 / (dt * change * root);
            let second = angles[0] - 2.0 * angles[1] + angles[2];
            let terms = [
                (a.at + unknown, slope),
                (b.at + unknown, -2.0 * slope),
                (c.at + unknown, slope),
            ];
            add(second * slope, &terms);
        }
        let rate = (c.state.yaw - a.state.yaw) / (2.0 * dt);
        let bend = self.shape.bend * rate.clamp(-MAX_BEND_RATE, MAX_BEND_RATE);
        let by_yaw = if rate.abs() < MAX_BEND_RATE {
            self.shape.bend / (2.0 * dt)
        } else {
            0.0
        };
        let scale = 1.0 / self.shape.sway_sd;
        let terms = [
            (a.at + YAW, by_yaw * scale),
            (b.at + SWAY, scale),
            (c.at + YAW, -by_yaw * scale),
        ];
        add((b.state.sway - bend) * scale, &terms);
    }
}
