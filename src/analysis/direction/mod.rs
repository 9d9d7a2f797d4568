//! The direction in space of an animal seen from the side, from all frames together (ALGORITHMS.md 4,
//! best estimate).
//!
//! N measures direction from two extents of one silhouette, and stops being able to where the animal is
//! foreshortened, pitched or bent. Here the second moments of every silhouette are read as those of a
//! body that is the same in all frames (`shape`): an ellipsoid whose outline under projection has
//! exactly the projected moments, with a tail that sways sideways. Three steps: a histogram filter on
//! the sphere of directions decides head or tail and toward or away over the whole footage
//! (`sphere`); Gauss-Newton over all frames finds the likeliest depth, yaw, pitch, speed and sway
//! (`energy`, `solve`); and every turn that could also have gone the mirrored way is tried that way
//! (`mirror`). The body's shape is learned from the footage itself between two such rounds.

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

/// What the silhouette of one frame says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// N (2), pixels.
    pub centroid_px: [f64; 2],
    /// Second central moments over the area: xx, xy, yy, square pixels.
    pub covariance_px2: [f64; 3],
    /// Extent from the topmost to the lowest solid pixel.
    pub upright_px: f64,
    /// The border of the image cuts the silhouette: only its place is used, not its shape.
    pub cut: bool,
    /// Where the head is known to be, from the centroid in the picture.
    pub toward: Option<[f64; 2]>,
    /// Where the head seems to be by the look of both ends: a direction in the picture, as long as half the logarithm of the
    /// odds.
    pub ends: Option<[f64; 2]>,
}

/// A camera like most, for films whose camera is not known: it sees 45 degrees across.
pub fn usual_camera(width_px: u32, height_px: u32) -> Camera {
    Camera {
        z_min_m: 1.0,
        pane_px_per_m: 1.2 * f64::from(width_px),
        center_px: [width_px, height_px].map(|side| f64::from(side) / 2.0),
        medium_index: 1.0,
    }
}

/// An animal of the seen proportions whose height is a metre: only directions can be had with it.
pub fn usual_animal(seen: &[Option<Seen>]) -> Animal {
    let whole = seen
        .iter()
        .flatten()
        .filter(|s| !s.cut && s.upright_px > 0.0);
    // A uniform ellipse is four standard deviations long; bodies hardly differ.
    let mut ratios: Vec<f64> = whole
        .map(|s| 4.0 * s.covariance_px2[0].max(0.0).sqrt() / s.upright_px)
        .collect();
    let length_m = percentile(&mut ratios, 0.9).unwrap_or(1.0);
    Animal {
        length_m,
        height_m: 1.0,
    }
}

/// The direction of one frame, and what belongs to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Where the centroid is in the picture; between its neighbors in a gap.
    pub centroid_px: [f64; 2],
    /// Apparent depth (before refraction is taken out), metres.
    pub z_apparent_m: f64,
    /// The unit vector in which the head points: x right, y down, z away.
    pub forward: [f64; 3],
    /// Posterior probability of the head's side in the image, 0.5..=1.
    pub head_confidence: f64,
    /// Posterior probability of the sign of `forward[2]`, 0.5..=1.
    pub depth_sign_confidence: f64,
}

/// Rounds of mirroring and learning anew, after a first look.
const ROUNDS: usize = 2;
/// Longest gap between sightings that is bridged, seconds.
const BRIDGE_S: f64 = 0.5;

/// The direction of every frame that was seen, or lies in a gap of at most half a second.
///
/// `None` for all where fewer than a second's worth of whole silhouettes was seen.
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
    // The first round learns what the animal looks like; the second knows where to look.
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

/// What is seen, from the first sighting to the last, made ready: gaps have interpolated places.
struct Views {
    /// The frame of the footage that `frames[0]` is.
    first: usize,
    frames: Vec<View>,
    /// Seen, or in a gap short enough.
    bridged: Vec<bool>,
    dt: f64,
    focal_px: f64,
    medium_index: f64,
}

/// One frame made ready.
#[derive(Clone, Copy)]
struct View {
    /// The centroid's slope in the picture: (centroid - center) / focal length.
    slope: [f64; 2],
    seen: bool,
    /// Unit vector in the picture toward the head, where that is known.
    toward: Option<[f64; 2]>,
    /// Where the head seems to be by the look of both ends.
    ends: Option<[f64; 2]>,
    /// Moments and upright extent of a whole silhouette.
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

    /// Frames a second count as at most thirty independent looks.
    fn evidence(&self) -> f64 {
        (30.0 * self.dt).min(1.0)
    }
}

/// The states of all frames.
type States = Vec<State>;

#[cfg(test)]
mod tests;
