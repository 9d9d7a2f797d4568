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
mod energy;
mod mirror;
mod shape;
mod solve;
mod sphere;

use crate::geometry::Camera;
use crate::library::Animal;
use crate::order::percentile;

use energy::{Energy, State};
use shape::Shape;

/// Measurements of the silhouette in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Centroid in the image (Nakajima et al., equation 2), pixels.
    pub centroid_px: [f64; 2],
    /// Second central moments over the area: xx, xy, yy, square pixels.
    pub covariance_px2: [f64; 3],
    /// Vertical extent from the topmost to the lowest solid pixel, pixels.
    pub upright_px: f64,
    /// True where the image border cuts the silhouette. The estimate then uses the centroid only, not the
    /// moments.
    pub cut: bool,
    /// Vector in the image from the centroid to the head, pixels, from the user; `None` where the user gave
    /// none.
    pub toward: Option<[f64; 2]>,
    /// Direction in the image in which the shape of the two ends suggests the head. Its length is half the
    /// logarithm of the odds; `None` without evidence.
    pub ends: Option<[f64; 2]>,
}

/// Returns a camera with a horizontal field of view of 45 degrees, for footage from an uncalibrated camera.
pub fn usual_camera(width_px: u32, height_px: u32) -> Camera {
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
pub fn usual_animal(seen: &[Option<Seen>]) -> Animal {
    let whole = seen
        .iter()
        .flatten()
        .filter(|s| !s.cut && s.upright_px > 0.0);
    // A uniform ellipse is four standard deviations long; real bodies differ little from that.
    let mut ratios: Vec<f64> = whole
        .map(|s| 4.0 * s.covariance_px2[0].max(0.0).sqrt() / s.upright_px)
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
const ROUNDS: usize = 2;
/// Longest gap between detections that is interpolated, seconds. Free choice.
const BRIDGE_S: f64 = 0.5;

/// Returns the direction in every frame with a detection or in a gap of at most 0.5 s.
///
/// All entries are `None` when the footage has uncut silhouettes for less than one second or fewer than 8
/// frames.
pub fn estimate(
    seen: &[Option<Seen>],
    camera: &Camera,
    animal: &Animal,
    fps: f64,
) -> Vec<Option<Direction>> {
    let nothing = || vec![None; seen.len()];
    let Some(views) = Views::of(seen, camera, fps) else {
        return nothing();
    };
    let Some(mut shape) = Shape::first(&views, animal) else {
        return nothing();
    };
    // The first pass only learns the shape of the body. The second decoding uses that shape.
    let mut states = sphere::decode(&views, &shape).states(&views, &shape);
    solve::whole(&Energy::new(&views, &shape), &mut states);
    shape = shape.learned(&views, &states);
    let course = sphere::decode(&views, &shape);
    states = course.states(&views, &shape);
    for round in 0..ROUNDS {
        if round > 0 {
            shape = shape.learned(&views, &states);
        }
        let energy = Energy::new(&views, &shape);
        solve::whole(&energy, &mut states);
        mirror::improve(&energy, &mut states);
        solve::whole(&energy, &mut states);
    }
    (0..seen.len())
        .map(|k| {
            let idx = k.checked_sub(views.first)?;
            let state = states.get(idx).filter(|_| views.bridged[idx])?;
            let forward = body::Axes::of(state.yaw(), state.pitch()).forward;
            let [head, depth] = course.confidence(idx, forward);
            let slope = views.frames[idx].slope;
            Some(Direction {
                centroid_px: [0, 1].map(|c| camera.center_px[c] + slope[c] * views.focal_px),
                z_apparent_m: libm::exp(state.log_z()),
                forward,
                head_confidence: head,
                depth_sign_confidence: depth,
            })
        })
        .collect()
}

/// The measurements from the first detection to the last, with interpolated centroids in the gaps.
struct Views {
    /// Frame number in the footage of `frames[0]`.
    first: usize,
    frames: Vec<View>,
    /// True for frames with a detection and for frames in a gap of at most `BRIDGE_S`.
    bridged: Vec<bool>,
    dt: f64,
    focal_px: f64,
    medium_index: f64,
}

/// The measurements of one frame in the form the estimate uses.
#[derive(Clone, Copy)]
struct View {
    /// Slope of the line of sight to the centroid: (centroid - image center) / focal length.
    slope: [f64; 2],
    seen: bool,
    /// Unit vector in the image toward the head, from the user.
    toward: Option<[f64; 2]>,
    /// Evidence for the head's side from the shape of the ends, as in [`Seen::ends`].
    ends: Option<[f64; 2]>,
    /// Moments and vertical extent; `None` without a detection or where the image border cuts the silhouette.
    outline: Option<Outline>,
}

#[derive(Clone, Copy)]
struct Outline {
    covariance_px2: [f64; 3],
    upright_px: f64,
}

impl Views {
    fn of(seen: &[Option<Seen>], camera: &Camera, fps: f64) -> Option<Views> {
        let first = seen.iter().position(Option::is_some)?;
        let last = seen.iter().rposition(Option::is_some)?;
        let focal_px = camera.focal_px();
        let slope = |s: &Seen| [0, 1].map(|k| (s.centroid_px[k] - camera.center_px[k]) / focal_px);
        let mut frames: Vec<View> = Vec::with_capacity(last + 1 - first);
        let mut bridged = Vec::with_capacity(last + 1 - first);
        let mut known = first;
        for k in first..=last {
            let Some(one) = &seen[k] else { continue };
            if let Some(from) = frames.last().map(|v| v.slope) {
                let (gap, to) = (k - known, slope(one));
                for step in 1..gap {
                    let share = step as f64 / gap as f64;
                    frames.push(View {
                        slope: [0, 1].map(|c| from[c] + (to[c] - from[c]) * share),
                        seen: false,
                        toward: None,
                        ends: None,
                        outline: None,
                    });
                    bridged.push((gap - 1) as f64 <= BRIDGE_S * fps);
                }
            }
            known = k;
            let whole = !one.cut && one.upright_px > 0.0 && one.covariance_px2[0] > 0.0;
            frames.push(View {
                slope: slope(one),
                seen: true,
                toward: one.toward.and_then(|[x, y]| {
                    let length = libm::hypot(x, y);
                    (length > 0.0).then(|| [x / length, y / length])
                }),
                ends: one.ends.filter(|_| whole),
                outline: whole.then_some(Outline {
                    covariance_px2: one.covariance_px2,
                    upright_px: one.upright_px,
                }),
            });
            bridged.push(true);
        }
        let n_whole = frames.iter().filter(|v| v.outline.is_some()).count();
        (n_whole as f64 >= fps && n_whole >= 8).then_some(Views {
            first,
            frames,
            bridged,
            dt: 1.0 / fps,
            focal_px,
            medium_index: camera.medium_index,
        })
    }

    /// Returns the weight of one frame, 0..=1. Above 30 frames a second, neighboring frames are not
    /// independent: all frames of one second together weigh at most 30.
    fn evidence(&self) -> f64 {
        (30.0 * self.dt).min(1.0)
    }
}

/// One state per frame.
type States = Vec<State>;

#[cfg(test)]
mod tests;
