//! Estimates the direction in space of an animal filmed from the side, over all frames together
//! (docs/explanation/algorithms.md, "Direction in space").
//!
//! The two extents of one silhouette (Nakajima et al.) fail for a foreshortened, pitched or bent animal. This
//! module fits one body shape (`shape`) to the second moments of all silhouettes: an ellipsoid with a swaying
//! tail.
//!
//! 1. A histogram filter on the sphere of directions (`sphere`) decides head or tail, and toward or away.
//! 2. Gauss-Newton (`energy`, `solve`) finds the most probable depth, yaw, pitch, speed and sway.
//! 3. Each turn is also tried mirrored (`mirror`), because approaching and receding animals look alike.
//!
//! The body shape is estimated again between rounds.

mod banded;
mod body;
mod cells;
mod energy;
mod hidden_markov;
mod mirror;
mod observations;
mod shape;
mod solve;
mod sphere;
mod state;
#[cfg(test)]
mod tests;

use crate::geometry::Camera;
use crate::library::Animal;
use crate::order::percentile;

use body::BodyAxes;
use energy::Energy;
use observations::Observations;
use shape::Shape;

/// Measurements of the silhouette in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Centroid in the image (Nakajima et al., equation 2), pixels.
    pub centroid_px: [f64; 2],
    /// Second central moments over the area: xx, xy, yy, square pixels.
    pub covariance_px2: [f64; 3],
    /// Vertical extent from the topmost to the lowest solid pixel, pixels.
    pub vertical_px: f64,
    /// True where the image border cuts the silhouette. The estimate then uses the centroid only, not the
    /// moments.
    pub cut: bool,
    /// Vector in the image from the centroid to the head, pixels, from the user; `None` where the user gave
    /// none.
    pub given_head_px: Option<[f64; 2]>,
    /// Direction in the image in which the shape of the two ends suggests the head. Its length is half the
    /// logarithm of the odds; `None` without evidence.
    pub head_evidence: Option<[f64; 2]>,
}

/// Returns a camera with a horizontal field of view of 45 degrees, for footage from an uncalibrated camera.
pub fn typical_camera(width_px: u32, height_px: u32) -> Camera {
    Camera {
        z_min_m: 1.0,
        pane_px_per_m: 1.2 * f64::from(width_px),
        center_px: [width_px, height_px].map(|side| f64::from(side) / 2.0),
        medium_index: 1.0,
    }
}

/// Returns an animal with the proportions seen in the footage and a height of 1 m.
///
/// Directions computed with this animal are valid; depths and lengths are not in metres.
pub fn typical_animal(measured: &[Option<Measurement>]) -> Animal {
    let whole = (measured.iter().flatten()).filter(|m| !m.cut && m.vertical_px > 0.0);
    // A uniform ellipse is four standard deviations long; real bodies differ little from that.
    let mut ratios: Vec<f64> = whole
        .map(|m| 4.0 * m.covariance_px2[0].max(0.0).sqrt() / m.vertical_px)
        .collect();
    let length_m = percentile(&mut ratios, 0.9).unwrap_or(1.0);
    Animal {
        length_m,
        height_m: 1.0,
    }
}

/// The estimated direction and position in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Centroid in the image, pixels; interpolated linearly within a gap.
    pub centroid_px: [f64; 2],
    /// Apparent depth before the correction for refraction, metres.
    pub z_apparent_m: f64,
    /// Unit vector toward the head in the camera frame: x right, y down, z away from the camera.
    pub forward: [f64; 3],
    /// Posterior probability of the head's side in the image, 0.5..=1.
    pub head_confidence: f64,
    /// Posterior probability of the sign of `forward[2]`, 0.5..=1.
    pub depth_sign_confidence: f64,
}

/// Number of final rounds: shape estimate, fit, mirrored turns, fit. Free choice.
const N_ROUNDS: usize = 2;

/// Returns the direction in every frame with a detection or in a gap of at most 0.5 s.
///
/// All entries are `None` when the footage has uncut silhouettes for less than one second or fewer than 8
/// frames.
pub fn estimate(
    measured: &[Option<Measurement>],
    camera: &Camera,
    animal: &Animal,
    fps: f64,
) -> Vec<Option<Direction>> {
    let estimated = Observations::new(measured, camera, fps).and_then(|observations| {
        let shape = Shape::initial(&observations, animal)?;
        Some(estimate_observed(
            measured.len(),
            &observations,
            shape,
            camera,
        ))
    });
    estimated.unwrap_or_else(|| vec![None; measured.len()])
}

fn estimate_observed(
    n_frames: usize,
    observations: &Observations,
    mut shape: Shape,
    camera: &Camera,
) -> Vec<Option<Direction>> {
    // The first pass only learns the shape of the body. The second decoding uses that shape.
    let mut states = sphere::decode(observations, &shape).initial_states(observations, &shape);
    let energy = Energy {
        observations,
        shape: &shape,
    };
    solve::minimize(&energy, &mut states);
    shape = shape.refined(observations, &states);
    let course = sphere::decode(observations, &shape);
    states = course.initial_states(observations, &shape);
    for round in 0..N_ROUNDS {
        if round > 0 {
            shape = shape.refined(observations, &states);
        }
        let energy = Energy {
            observations,
            shape: &shape,
        };
        solve::minimize(&energy, &mut states);
        mirror::improve(&energy, &mut states);
        solve::minimize(&energy, &mut states);
    }
    (0..n_frames)
        .map(|k| {
            let idx = k.checked_sub(observations.first)?;
            let state = states.get(idx).filter(|_| observations.bridged[idx])?;
            let forward = BodyAxes::new(state.yaw, state.pitch).forward;
            let [head_confidence, depth_sign_confidence] = course.confidence(idx, forward);
            let slope = observations.frames[idx].slope;
            Some(Direction {
                centroid_px: [0, 1].map(|c| camera.center_px[c] + slope[c] * observations.focal_px),
                z_apparent_m: libm::exp(state.log_z),
                forward,
                head_confidence,
                depth_sign_confidence,
            })
        })
        .collect()
}
