//! A histogram filter on the sphere of directions: decides the animal's direction in every frame over the
//! whole footage.
//!
//! The sphere is divided into cells of yaw and pitch relative to the line of sight. A cell is probable in a
//! frame if the projected body has the measured moments, for any sway, and the animal moves that way.
//! Successive frames must lie in neighboring cells. The most probable course (Viterbi) selects one of the
//! mirrored alternatives. The posterior around it (forward-backward) gives its mean and its confidence.
//!
//! One course decides head or tail and toward or away together. It replaces the two separate decisions of
//! docs/explanation/algorithms.md, "Pose".

use super::cells::Cells;
use super::hidden_markov;
use super::observations::Observations;
use super::shape::Shape;
use super::state::State;
use crate::geometry::wrap_rad;

/// Weight of one frame's cost at 30 frames per second. Below 1, because successive frames are not
/// independent.
const EVIDENCE: f64 = 0.35;
/// Cells below this probability do not count toward the confidence. Free choice.
const NEGLIGIBLE: f64 = 1e-6;
/// Cost of a direction away from a head given by the user. High enough to exclude it.
const GIVEN_HEAD_COST: f64 = 1e4;

/// The decoded course.
pub(super) struct Course {
    /// Mean direction of the posterior near the most probable course, unit vectors in the camera frame.
    forward: Vec<[f64; 3]>,
    /// Cells of each frame with a probability above `NEGLIGIBLE`, with that probability.
    posterior: Vec<Vec<(u16, f32)>>,
    cells: Cells,
    z_apparent_m: Vec<f64>,
    slopes: Vec<[f64; 2]>,
}

/// Decodes the course of the animal.
pub(super) fn decode(observations: &Observations, shape: &Shape) -> Course {
    let cells = Cells::new(shape);
    let z_apparent_m = rough_depth_m(observations, shape);
    let velocity = velocity_m_s(observations, &z_apparent_m);
    let slopes: Vec<[f64; 2]> = observations
        .frames
        .iter()
        .map(|frame| frame.slope)
        .collect();
    let evidence_weight = EVIDENCE * (30.0 * observations.dt).min(2.0);
    let cost = |k: usize| {
        let velocity = sight_from_camera(slopes[k], velocity[k]);
        let mut cost = cells.motion_costs(velocity, shape.length_m);
        if let Some(silhouette) = &observations.frames[k].silhouette {
            cells.add_moment_costs(silhouette, &mut cost);
        }
        let (given_head, head_evidence) = (
            observations.frames[k].given_head,
            observations.frames[k].head_evidence,
        );
        for (cost, axes) in cost.iter_mut().zip(&cells.axes) {
            let points_away = given_head.is_some_and(|[x, y]| {
                let forward = axes.forward;
                x * forward[0] + y * forward[1] < 0.0
            });
            if let Some([x, y]) = head_evidence {
                *cost -= x * axes.forward[0] + y * axes.forward[1];
            }
            *cost = *cost * evidence_weight + if points_away { GIVEN_HEAD_COST } else { 0.0 };
        }
        cost
    };
    let n = observations.frames.len();
    let mut forward = vec![[0.0; 3]; n];
    let mut posterior = vec![Vec::new(); n];
    hidden_markov::decode(n, cost, |k, cell, probability| {
        forward[k] = camera_from_sight(slopes[k], cells.mean_near(probability, cell));
        posterior[k] = (0..)
            .zip(probability)
            .filter(|(_, p)| **p > NEGLIGIBLE)
            .map(|(cell, &p)| (cell, p as f32))
            .collect();
    });
    Course {
        forward,
        posterior,
        cells,
        z_apparent_m,
        slopes,
    }
}

impl Course {
    /// Returns the initial states of the energy minimisation: one body length per second and no sway.
    pub(super) fn initial_states(&self, observations: &Observations, shape: &Shape) -> Vec<State> {
        let mut last_yaw = 0.0;
        (0..observations.frames.len())
            .map(|k| {
                let [x, y, z] = self.forward[k];
                let yaw = last_yaw + wrap_rad(libm::atan2(z, x) - last_yaw);
                last_yaw = yaw;
                let pitch = libm::asin(y.clamp(-1.0, 1.0));
                State {
                    log_z: libm::log(self.z_apparent_m[k]),
                    yaw,
                    pitch,
                    speed: shape.length_m,
                    sway: 0.0,
                }
            })
            .collect()
    }

    /// Returns the probability of the head's side in the image and of the sign of depth, both 0.5..=1, for a
    /// direction in one frame.
    pub(super) fn confidence(&self, idx: usize, forward: [f64; 3]) -> [f64; 2] {
        let along = sight_from_camera(self.slopes[idx], forward);
        let (mut head, mut depth, mut all) = (0.0, 0.0, 0.0);
        for &(cell, p) in &self.posterior[idx] {
            let (there, p) = (self.cells.axes[usize::from(cell)].forward, f64::from(p));
            all += p;
            if there[0] * along[0] + there[1] * along[1] > 0.0 {
                head += p;
            }
            if there[2] * along[2] > 0.0 {
                depth += p;
            }
        }
        [head, depth].map(|p| (p / all).clamp(0.5, 1.0))
    }
}

/// Rotates a vector from the camera frame to the line of sight with slope (tx, ty), to first order.
fn sight_from_camera([tx, ty]: [f64; 2], [x, y, z]: [f64; 3]) -> [f64; 3] {
    with_length_of([x, y, z], [x - tx * z, y - ty * z, z + tx * x + ty * y])
}

/// Rotates a vector from the line of sight to the camera frame; approximate inverse of [`sight_from_camera`].
fn camera_from_sight([tx, ty]: [f64; 2], [x, y, z]: [f64; 3]) -> [f64; 3] {
    with_length_of([x, y, z], [x + tx * z, y + ty * z, z - tx * x - ty * y])
}

/// Returns `b` scaled to the length of `a`.
fn with_length_of(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let norm = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let scale = if norm(b) > 0.0 {
        norm(a) / norm(b)
    } else {
        1.0
    };
    b.map(|c| c * scale)
}

/// Returns the apparent depth from the vertical extent, metres, averaged over 0.5 s. Frames without a
/// silhouette are interpolated.
fn rough_depth_m(observations: &Observations, shape: &Shape) -> Vec<f64> {
    let seen: Vec<(usize, f64)> = (observations.frames.iter().enumerate())
        .filter_map(|(k, frame)| {
            let silhouette = frame.silhouette.as_ref()?;
            Some((k, shape.level_depth_m(observations, silhouette)))
        })
        .collect();
    let mut depth = vec![seen[0].1; observations.frames.len()];
    for pair in seen.windows(2) {
        let [(a, from), (b, to)] = [pair[0], pair[1]];
        for k in a..=b {
            depth[k] = from + (to - from) * (k - a) as f64 / (b - a) as f64;
        }
    }
    if let Some(&(last, value)) = seen.last() {
        depth[last..].fill(value);
    }
    running_mean(&depth, observations, 0.5)
}

/// Returns the smoothed velocity in the camera frame, metres per second.
fn velocity_m_s(observations: &Observations, z_apparent_m: &[f64]) -> Vec<[f64; 3]> {
    let n = observations.frames.len();
    let component = |c: usize, over_s: f64| {
        let place = |k: usize| match c {
            2 => observations.medium_index * z_apparent_m[k],
            _ => observations.frames[k].slope[c] * z_apparent_m[k],
        };
        let rate: Vec<f64> = (0..n)
            .map(|k| {
                let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
                (place(b) - place(a)) / ((b - a).max(1) as f64 * observations.dt)
            })
            .collect();
        running_mean(&rate, observations, over_s)
    };
    let (x, y, z) = (component(0, 0.23), component(1, 0.23), component(2, 0.3));
    (0..n).map(|k| [x[k], y[k], z[k]]).collect()
}

/// Returns the mean over a window of `over_s` seconds around each value; the window is shorter at the ends.
fn running_mean(values: &[f64], observations: &Observations, over_s: f64) -> Vec<f64> {
    let half = (over_s / observations.dt / 2.0).round() as usize;
    (0..values.len())
        .map(|k| {
            let window = &values[k.saturating_sub(half)..(k + half + 1).min(values.len())];
            window.iter().sum::<f64>() / window.len() as f64
        })
        .collect()
}
