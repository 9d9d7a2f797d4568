//! A histogram filter on the sphere of directions: which way the animal points in every frame, decided
//! over the whole footage.
//!
//! The sphere is cut into cells of yaw and pitch about the line of sight. A cell is likely in a frame when
//! the body's projected moments are those seen there, whatever the sway, and when the animal moves that way;
//! neighbors in time must be neighbors on the sphere. The likeliest course (Viterbi) picks one of the
//! mirrored ways; the posterior about it (forward-backward) gives its mean and its certainty. This replaces
//! the two separate decisions of ALGORITHMS.md 4 (head or tail, toward or away) where a camera is calibrated:
//! one course must satisfy both at once.

use std::f64::consts::{PI, TAU};

use super::body::{Axes, form};
use super::energy::State;
use super::shape::Shape;
use super::{Outline, States, Views};
use crate::geometry::wrap_rad;

const N_YAW: usize = 36;
const N_PITCH: usize = 13;
const N_CELL: usize = N_YAW * N_PITCH;
const CELL_RAD: f64 = TAU / N_YAW as f64;
/// The steepest pitch.
const STEEPEST_RAD: f64 = PI / 3.0;
/// Cells that the yaw, and the pitch, may go in one frame.
const YAW_REACH: usize = 4;
const PITCH_REACH: usize = 2;
/// Cost of turning, per radian.
const TURN_COST: f64 = 5.8;
/// What a frame says counts this much at 30 frames a second: neighbors say nearly the same.
const EVIDENCE: f64 = 0.35;
/// Noise of the motion in the picture and in depth, lengths a second.
const MOTION_BL: [f64; 3] = [0.25, 0.25, 0.6];
/// Cost of pointing away from where the head is known to be.
const PINNED: f64 = 1e4;
/// Usual pitch, radians.
const PITCH: f64 = 0.4;
/// Squared deviations beyond nine count linearly.
const ROBUST: f64 = 3.0;

/// The decoded course.
pub(super) struct Course {
    /// Mean direction of the posterior near the likeliest course, in the camera frame.
    forward: Vec<[f64; 3]>,
    posterior: Vec<Vec<f32>>,
    cells: Cells,
    z_apparent_m: Vec<f64>,
    slopes: Vec<[f64; 2]>,
}

/// Decodes the course of the animal.
pub(super) fn decode(views: &Views, shape: &Shape) -> Course {
    let cells = Cells::of(shape);
    let z_apparent_m = rough_depth_m(views, shape);
    let velocity = velocity_m_s(views, &z_apparent_m);
    let slopes: Vec<[f64; 2]> = views.frames.iter().map(|v| v.slope).collect();
    let tempered = EVIDENCE * (30.0 * views.dt).min(2.0);
    let costs: Vec<Vec<f64>> = (0..views.frames.len())
        .map(|k| {
            let along = about_sight(slopes[k], velocity[k]);
            let mut cost = cells.motion_costs(along, shape.length_m);
            if let Some(outline) = &views.frames[k].outline {
                cells.add_moment_costs(outline, &mut cost);
            }
            let toward = views.frames[k].toward;
            let pinned = |cell: usize| match toward {
                Some([x, y]) => {
                    let forward = cells.axes[cell].forward;
                    if x * forward[0] + y * forward[1] < 0.0 {
                        PINNED
                    } else {
                        0.0
                    }
                }
                None => 0.0,
            };
            let weighed = cost.iter().enumerate();
            weighed.map(|(k, c)| c * tempered + pinned(k)).collect()
        })
        .collect();
    let path = viterbi(&costs);
    let posterior = posterior(&costs);
    let forward = (0..costs.len())
        .map(|k| camera_frame(slopes[k], cells.mean_near(&posterior[k], path[k])))
        .collect();
    Course {
        forward,
        posterior,
        cells,
        z_apparent_m,
        slopes,
    }
}

impl Course {
    /// Where the best estimate starts.
    pub(super) fn states(&self, views: &Views, shape: &Shape) -> States {
        let mut last_yaw = 0.0;
        (0..views.frames.len())
            .map(|k| {
                let [x, y, z] = self.forward[k];
                let yaw = last_yaw + wrap_rad(libm::atan2(z, x) - last_yaw);
                last_yaw = yaw;
                let pitch = libm::asin(y.clamp(-1.0, 1.0));
                State([
                    libm::log(self.z_apparent_m[k]),
                    yaw,
                    pitch,
                    shape.length_m,
                    0.0,
                ])
            })
            .collect()
    }

    /// How sure the filter is of the head's side in the picture, and of the sign of depth, of a
    /// direction in a frame: 0.5..=1.
    pub(super) fn confidence(&self, idx: usize, forward: [f64; 3]) -> [f64; 2] {
        let along = about_sight(self.slopes[idx], forward);
        let (mut head, mut depth, mut all) = (0.0, 0.0, 0.0);
        for (cell, &p) in self.cells.axes.iter().zip(&self.posterior[idx]) {
            let (there, p) = (cell.forward, f64::from(p));
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

/// The cells of the sphere, and what the body looks like from each.
struct Cells {
    axes: Vec<Axes>,
    pitch: [f64; N_PITCH],
    /// Projected moments, square metres.
    moments: Vec<[f64; 3]>,
    /// Inverse of their covariance: xx, xy, xz, yy, yz, zz; and half the logarithm of its determinant.
    inverse: Vec<[f64; 6]>,
    half_log_det: Vec<f64>,
    /// The upright extent by pitch, metres.
    upright_m: [f64; N_PITCH],
}

impl Cells {
    fn of(shape: &Shape) -> Cells {
        let step = 2.0 * STEEPEST_RAD / (N_PITCH - 1) as f64;
        let pitch: [f64; N_PITCH] = std::array::from_fn(|j| -STEEPEST_RAD + step * j as f64);
        let mut cells = Cells {
            axes: Vec::with_capacity(N_CELL),
            pitch,
            moments: Vec::with_capacity(N_CELL),
            inverse: Vec::with_capacity(N_CELL),
            half_log_det: Vec::with_capacity(N_CELL),
            upright_m: pitch.map(|p| shape.upright_m(p).0),
        };
        let body = shape.body(0.0);
        for yaw in (0..N_YAW).map(|i| (i as f64 + 0.5) * CELL_RAD) {
            for pitch in pitch {
                let axes = Axes::of(yaw, pitch);
                let seen = axes.seen([0.0; 2], 1.0);
                let pairs = [(0, 0), (0, 1), (1, 1)];
                let moments = pairs.map(|(i, j)| form(&seen[i], &seen[j], &body));
                let sway = pairs
                    .map(|(i, j)| seen[i][0] * seen[j][2] + seen[i][2] * seen[j][0])
                    .map(|v| v * shape.sway_sd);
                let (inverse, half_log_det) = precision(moments, sway);
                cells.axes.push(axes);
                cells.moments.push(moments);
                cells.inverse.push(inverse);
                cells.half_log_det.push(half_log_det);
            }
        }
        cells
    }

    /// What the motion, metres a second about the line of sight, costs each cell.
    fn motion_costs(&self, velocity: [f64; 3], length_m: f64) -> Vec<f64> {
        let noise = MOTION_BL.map(|bl| bl * length_m);
        let moved: [f64; 3] = std::array::from_fn(|c| velocity[c] / noise[c]);
        let one = |(k, axes): (usize, &Axes)| {
            let along: [f64; 3] = std::array::from_fn(|c| axes.forward[c] / noise[c]);
            let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            // The speed that explains most of it; animals do not swim backward.
            let speed = (dot(&along, &moved) / dot(&along, &along)).max(0.0);
            let rest: [f64; 3] = std::array::from_fn(|c| moved[c] - speed * along[c]);
            let pitch = self.pitch[k % N_PITCH] / PITCH;
            0.5 * robust(dot(&rest, &rest)) + 0.5 * pitch * pitch
        };
        self.axes.iter().enumerate().map(one).collect()
    }

    /// What the silhouette's moments cost each cell, its scale being that of the upright extent.
    fn add_moment_costs(&self, outline: &Outline, costs: &mut [f64]) {
        let scale = self.upright_m.map(|m| (m / outline.upright_px).powi(2));
        for (k, cost) in costs.iter_mut().enumerate() {
            let r: [f64; 3] = std::array::from_fn(|c| {
                outline.covariance_px2[c] * scale[k % N_PITCH] - self.moments[k][c]
            });
            let [a, b, c, d, e, f] = self.inverse[k];
            let square = a * r[0] * r[0]
                + d * r[1] * r[1]
                + f * r[2] * r[2]
                + 2.0 * (b * r[0] * r[1] + c * r[0] * r[2] + e * r[1] * r[2]);
            *cost += 0.5 * robust(square) + self.half_log_det[k];
        }
    }

    /// The mean direction of the posterior within 50 degrees of a cell.
    fn mean_near(&self, posterior: &[f32], cell: usize) -> [f64; 3] {
        const COS_50: f64 = 0.642_787_609_686_539_4;
        let center = self.axes[cell].forward;
        let mut sum = [0.0; 3];
        for (axes, &p) in self.axes.iter().zip(posterior) {
            let f = axes.forward;
            if f[0] * center[0] + f[1] * center[1] + f[2] * center[2] > COS_50 {
                for c in 0..3 {
                    sum[c] += f64::from(p) * f[c];
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

/// The inverse covariance of measured moments about those of a cell, and half the logarithm of its
/// determinant: noise of each, of the common scale, and whatever the sway.
fn precision(m: [f64; 3], sway: [f64; 3]) -> ([f64; 6], f64) {
    let mean = (m[0] * m[2]).max(0.0).sqrt();
    let noise = [0.08 * m[0] + 0.04 * mean, 0.08 * mean, 0.08 * m[2]];
    let entry = |i: usize, j: usize| {
        let own = if i == j { noise[i] * noise[i] } else { 0.0 };
        own + 0.0025 * m[i] * m[j] + sway[i] * sway[j]
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

fn robust(square: f64) -> f64 {
    if square > ROBUST * ROBUST {
        ROBUST * (2.0 * square.sqrt() - ROBUST)
    } else {
        square
    }
}

/// A vector of the camera frame about the line of sight to a place of the picture.
fn about_sight([tx, ty]: [f64; 2], [x, y, z]: [f64; 3]) -> [f64; 3] {
    normalized_like([x, y, z], [x - tx * z, y - ty * z, z + tx * x + ty * y])
}

/// Back again.
fn camera_frame([tx, ty]: [f64; 2], [x, y, z]: [f64; 3]) -> [f64; 3] {
    normalized_like([x, y, z], [x + tx * z, y + ty * z, z - tx * x - ty * y])
}

/// `b` with the length of `a`.
fn normalized_like(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let norm = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let scale = if norm(b) > 0.0 {
        norm(a) / norm(b)
    } else {
        1.0
    };
    b.map(|c| c * scale)
}

/// The depth that the upright extent shows, over half a second, metres.
fn rough_depth_m(views: &Views, shape: &Shape) -> Vec<f64> {
    let seen: Vec<(usize, f64)> = views
        .frames
        .iter()
        .enumerate()
        .filter_map(|(k, v)| Some((k, shape.level_depth_m(views, v.outline.as_ref()?))))
        .collect();
    let mut depth = vec![seen[0].1; views.frames.len()];
    for pair in seen.windows(2) {
        let [(a, from), (b, to)] = [pair[0], pair[1]];
        for k in a..=b {
            depth[k] = from + (to - from) * (k - a) as f64 / (b - a) as f64;
        }
    }
    if let Some(&(last, value)) = seen.last() {
        depth[last..].fill(value);
    }
    running_mean(&depth, views, 0.5)
}

/// Metres a second in the camera frame.
fn velocity_m_s(views: &Views, z_apparent_m: &[f64]) -> Vec<[f64; 3]> {
    let n = views.frames.len();
    let part = |c: usize, over_s: f64| {
        let place = |k: usize| match c {
            2 => views.medium_index * z_apparent_m[k],
            _ => views.frames[k].slope[c] * z_apparent_m[k],
        };
        let rate: Vec<f64> = (0..n)
            .map(|k| {
                let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
                (place(b) - place(a)) / ((b - a).max(1) as f64 * views.dt)
            })
            .collect();
        running_mean(&rate, views, over_s)
    };
    let (x, y, z) = (part(0, 0.23), part(1, 0.23), part(2, 0.3));
    (0..n).map(|k| [x[k], y[k], z[k]]).collect()
}

/// The mean over a window of `over_s` seconds around each value; shorter at the ends.
fn running_mean(values: &[f64], views: &Views, over_s: f64) -> Vec<f64> {
    let half = (over_s / views.dt / 2.0).round() as usize;
    (0..values.len())
        .map(|k| {
            let window = &values[k.saturating_sub(half)..(k + half + 1).min(values.len())];
            window.iter().sum::<f64>() / window.len() as f64
        })
        .collect()
}

/// The likeliest cell of every frame.
fn viterbi(costs: &[Vec<f64>]) -> Vec<usize> {
    let mut best = costs[0].clone();
    let mut came_from: Vec<Vec<u16>> = Vec::with_capacity(costs.len());
    for cost in &costs[1..] {
        let mut from: Vec<u16> = (0..N_CELL as u16).collect();
        best = reach(&best, &mut from);
        best.iter_mut().zip(cost).for_each(|(b, c)| *b += c);
        came_from.push(from);
    }
    let mut cell = (0..N_CELL).fold(0, |a, b| if best[b] < best[a] { b } else { a });
    let mut path = vec![cell; costs.len()];
    for (k, from) in came_from.iter().enumerate().rev() {
        cell = usize::from(from[cell]);
        path[k] = cell;
    }
    path
}

/// The least cost of reaching each cell, and from which one: pitch after yaw.
fn reach(best: &[f64], from: &mut [u16]) -> Vec<f64> {
    let turned = shifted(
        best,
        from,
        YAW_REACH,
        TURN_COST * CELL_RAD,
        |cell, shift| {
            let yaw = (cell / N_PITCH + N_YAW).wrapping_add_signed(shift) % N_YAW;
            Some(yaw * N_PITCH + cell % N_PITCH)
        },
    );
    let step = TURN_COST * 2.0 * STEEPEST_RAD / (N_PITCH - 1) as f64;
    shifted(&turned, from, PITCH_REACH, step, |cell, shift| {
        let pitch = (cell % N_PITCH).checked_add_signed(shift)?;
        (pitch < N_PITCH).then_some(cell / N_PITCH * N_PITCH + pitch)
    })
}

fn shifted(
    best: &[f64],
    from: &mut [u16],
    reach: usize,
    step: f64,
    neighbor: impl Fn(usize, isize) -> Option<usize>,
) -> Vec<f64> {
    let old: Vec<u16> = from.to_vec();
    let reach = reach as isize;
    (0..N_CELL)
        .map(|cell| {
            let mut least = best[cell];
            from[cell] = old[cell];
            for shift in -reach..=reach {
                let Some(other) = neighbor(cell, shift) else {
                    continue;
                };
                let cost = best[other] + step * shift.unsigned_abs() as f64;
                if cost < least {
                    least = cost;
                    from[cell] = old[other];
                }
            }
            least
        })
        .collect()
}

/// The posterior of every cell in every frame.
fn posterior(costs: &[Vec<f64>]) -> Vec<Vec<f32>> {
    let likely: Vec<Vec<f64>> = costs
        .iter()
        .map(|cost| {
            let least = cost.iter().copied().fold(f64::INFINITY, f64::min);
            cost.iter().map(|c| libm::exp(least - c)).collect()
        })
        .collect();
    let mut ahead: Vec<Vec<f64>> = Vec::with_capacity(costs.len());
    for k in 0..costs.len() {
        let mut mass = match ahead.last() {
            Some(last) => spread(last),
            None => vec![1.0; N_CELL],
        };
        mass.iter_mut().zip(&likely[k]).for_each(|(m, l)| *m *= l);
        scale_to_one(&mut mass);
        ahead.push(mass);
    }
    let mut behind = vec![1.0; N_CELL];
    let mut posterior = vec![Vec::new(); costs.len()];
    for k in (0..costs.len()).rev() {
        let mut mass: Vec<f64> = ahead[k].iter().zip(&behind).map(|(a, b)| a * b).collect();
        scale_to_one(&mut mass);
        posterior[k] = mass.iter().map(|&m| m as f32).collect();
        behind.iter_mut().zip(&likely[k]).for_each(|(b, l)| *b *= l);
        behind = spread(&behind);
        scale_to_one(&mut behind);
    }
    posterior
}

/// Probability carried to the neighbors of every cell.
fn spread(mass: &[f64]) -> Vec<f64> {
    let weight = |step: f64, k: usize| libm::exp(-TURN_COST * step * k as f64);
    let yaw: [f64; YAW_REACH + 1] = std::array::from_fn(|k| weight(CELL_RAD, k));
    let pitch_step = 2.0 * STEEPEST_RAD / (N_PITCH - 1) as f64;
    let pitch: [f64; PITCH_REACH + 1] = std::array::from_fn(|k| weight(pitch_step, k));
    let mut turned = vec![0.0; N_CELL];
    for i in 0..N_YAW {
        for shift in 0..=2 * YAW_REACH {
            let other = (i + N_YAW + shift - YAW_REACH) % N_YAW;
            let w = yaw[shift.abs_diff(YAW_REACH)];
            for j in 0..N_PITCH {
                turned[i * N_PITCH + j] += w * mass[other * N_PITCH + j];
            }
        }
    }
    let mut spread = vec![0.0; N_CELL];
    for i in 0..N_YAW {
        let row = &turned[i * N_PITCH..(i + 1) * N_PITCH];
        for j in 0..N_PITCH {
            let near = j.saturating_sub(PITCH_REACH)..(j + PITCH_REACH + 1).min(N_PITCH);
            spread[i * N_PITCH + j] = near.map(|m| pitch[m.abs_diff(j)] * row[m]).sum();
        }
    }
    spread
}

fn scale_to_one(mass: &mut [f64]) {
    let total: f64 = mass.iter().sum();
    if total > 0.0 {
        mass.iter_mut().for_each(|m| *m /= total);
    }
}
