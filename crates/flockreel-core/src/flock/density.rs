//! Density of a flock in the image.
//!
//! This module scales the separation radii until the animals keep the requested spacing. It also measures how
//! often animals cross and how much they cover each other.

use std::collections::HashSet;
use std::f64::consts::PI;

use rayon::prelude::*;

use super::boids::measures::nearest_bl;
use super::error::Error;
use super::individual::Individual;
use super::params::Params;
use crate::geometry::rounded;
use crate::library::Library;

/// Largest number of corrections of the separation radii. Free choice.
const MAX_ROUNDS: usize = 5;
/// Least improvement of a correction, in the logarithm of measured over requested spacing. A smaller
/// improvement ends the corrections. Free choice.
const MIN_IMPROVEMENT: f64 = 0.03;
/// Largest factor by which the separation radii grow or shrink. Free choice.
const MAX_FACTOR: f64 = 8.0;
/// Separation radius in the image before the first correction, in requested spacings. Free choice.
const START_RADIUS: f64 = 1.5;
/// Length of the trial on which the spacing is measured, seconds. A loop is measured in full. Free choice.
const TRIAL_S: f64 = 4.0;

/// Returns the parameters with separation radii scaled to reach the spacing `params.spacing_bl`, as far as
/// the tank has room. Spacing is the mean distance to the nearest neighbor in the image.
///
/// Each round makes a trial flock with `spacing_of`, which returns its spacing in body lengths. The radii are
/// then multiplied by requested over measured spacing. The best round counts. Without a requested spacing, or
/// for a single animal, the parameters are returned unchanged.
pub(super) fn with_spacing(
    params: &Params,
    fps: f64,
    spacing_of: impl Fn(&Params) -> Result<f64, Error>,
) -> Result<Params, Error> {
    let Some(wanted_bl) = params.spacing_bl.filter(|_| params.most_individuals() > 1) else {
        return Ok(params.clone());
    };
    let trial_frames = if params.is_loop {
        params.frames
    } else {
        params.frames.min((TRIAL_S * fps).ceil() as u32)
    };
    let mut share = 1.0;
    let mut best = (params.rules.clone(), f64::INFINITY);
    for _ in 0..MAX_ROUNDS {
        let mut rules = params.rules.clone();
        rules.separation_bl *= share;
        rules.picture_separation_bl = START_RADIUS * wanted_bl * share;
        if let Some(zones) = &mut rules.zones {
            zones.repulsion_bl *= share;
        }
        let trial = Params {
            rules: rules.clone(),
            frames: trial_frames,
            ..params.clone()
        };
        let off = libm::log(spacing_of(&trial)?.max(1e-3) / wanted_bl);
        if off.abs() > best.1 - MIN_IMPROVEMENT {
            break;
        }
        best = (rules, off.abs());
        share = (share * libm::exp(-off)).clamp(1.0 / MAX_FACTOR, MAX_FACTOR);
    }
    Ok(Params {
        rules: best.0,
        ..params.clone()
    })
}

/// Returns the distance to the nearest neighbor in the image, body lengths, mean over animals and frames.
/// Returns 0 for a single animal.
pub(super) fn spacing_bl<'a>(
    places_px: impl Iterator<Item = &'a [[f64; 2]]> + Clone,
    length_px: f64,
) -> f64 {
    let n_frames = places_px.clone().next().map_or(0, <[_]>::len);
    let of_frame = |t: usize| {
        let places = places_px
            .clone()
            .map(|all| [all[t][0] / length_px, all[t][1] / length_px, 0.0]);
        nearest_bl(&places.collect::<Vec<_>>())
    };
    let mean = (0..n_frames).map(of_frame).sum::<f64>() / n_frames.max(1) as f64;
    rounded(mean, 4)
}

/// Crossings and visibility of the animals of a flock.
pub(super) struct Crowding {
    /// Number of times per minute that two animals come nearer than half a body length in the image.
    pub(super) crossings_per_min: f64,
    /// Share of an animal that no nearer animal covers, mean over animals and frames, 0..=1. Bodies are
    /// modeled as ellipses.
    pub(super) visible_share: f64,
}

/// Distance between centroids below which two animals cross, body lengths. Free choice.
const CROSSING_BL: f64 = 0.5;
/// Interval at which the visible share is measured, frames. Free choice.
const VISIBILITY_INTERVAL: usize = 5;

/// Returns crossings and visibility of a flock of the animal of `library`. `length_px` is its body length.
pub(super) fn crowding(individuals: &[Individual], library: &Library, length_px: f64) -> Crowding {
    let n_frames = individuals.first().map_or(0, |one| one.centroid_px.len());
    let crossed = |t: usize| -> HashSet<(usize, usize)> {
        let places: Vec<[f64; 2]> = individuals.iter().map(|one| one.centroid_px[t]).collect();
        let pairs = pairs_within(&places, CROSSING_BL * length_px);
        pairs.into_iter().collect()
    };
    let n_crossings: usize = (1..n_frames)
        .into_par_iter()
        .map(|t| crossed(t).difference(&crossed(t - 1)).count())
        .sum();
    let looked_at: Vec<usize> = (0..n_frames).step_by(VISIBILITY_INTERVAL).collect();
    let visible_share = |&t: &usize| {
        let bodies = individuals.iter().map(|one| Body::new(one, t, library));
        visible_share(&bodies.collect::<Vec<_>>())
    };
    let visible: Vec<f64> = looked_at.par_iter().map(visible_share).collect();
    let visible: f64 = visible.iter().sum();
    let minutes = n_frames as f64 / library.poses.fps / 60.0;
    Crowding {
        crossings_per_min: rounded(n_crossings as f64 / minutes.max(1e-9), 4),
        visible_share: rounded(visible / looked_at.len().max(1) as f64, 4),
    }
}

/// Returns the pairs of positions nearer to each other than `reach_px`, the smaller index first.
fn pairs_within(places: &[[f64; 2]], reach_px: f64) -> Vec<(usize, usize)> {
    let mut by_x: Vec<usize> = (0..places.len()).collect();
    by_x.sort_by(|&a, &b| places[a][0].total_cmp(&places[b][0]));
    let mut pairs = Vec::new();
    for (k, &a) in by_x.iter().enumerate() {
        let near = by_x[k + 1..]
            .iter()
            .take_while(|&&b| places[b][0] - places[a][0] < reach_px);
        for &b in near {
            let [dx, dy] = [0, 1].map(|axis| places[a][axis] - places[b][axis]);
            if libm::hypot(dx, dy) < reach_px {
                pairs.push((a.min(b), a.max(b)));
            }
        }
    }
    pairs
}

/// An animal in one frame: an ellipse with the length and the area of its silhouette.
#[derive(Clone, Copy)]
struct Body {
    center_px: [f64; 2],
    cos_sin: [f64; 2],
    half_px: [f64; 2],
    depth: f64,
}

impl Body {
    fn new(one: &Individual, t: usize, library: &Library) -> Body {
        let pose = &library.poses.frames[one.source_frame[t] as usize];
        let half_length = pose.length_px.unwrap_or(1.0).max(1.0) / 2.0;
        let half_height = pose.area_px.unwrap_or(1.0).max(1.0) / (PI * half_length);
        let angle = one.heading_rad[t];
        Body {
            center_px: one.centroid_px[t],
            cos_sin: [libm::cos(angle), libm::sin(angle)],
            half_px: [half_length, half_height].map(|px| px * one.scale[t]),
            depth: one.boid.position_px[t][2],
        }
    }

    /// Maps a point of the unit disk to the image, pixels.
    fn at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [along, across] = [u * self.half_px[0], v * self.half_px[1]];
        let [cos, sin] = self.cos_sin;
        [
            self.center_px[0] + along * cos - across * sin,
            self.center_px[1] + along * sin + across * cos,
        ]
    }

    fn covers(&self, [x, y]: [f64; 2]) -> bool {
        let [dx, dy] = [x - self.center_px[0], y - self.center_px[1]];
        let [cos, sin] = self.cos_sin;
        let along = (dx * cos + dy * sin) / self.half_px[0];
        let across = (dy * cos - dx * sin) / self.half_px[1];
        along * along + across * across <= 1.0
    }
}

/// Returns the mean share of the bodies that no nearer body covers, sampled at points of a spiral on each.
fn visible_share(bodies: &[Body]) -> f64 {
    const N_POINTS: usize = 24;
    /// Golden angle, radians. Points at multiples of it spread evenly over a disk.
    const GOLDEN_RAD: f64 = 2.399_963;
    let place = |k: usize| {
        let (radius, angle) = (
            ((k as f64 + 0.5) / N_POINTS as f64).sqrt(),
            GOLDEN_RAD * k as f64,
        );
        [radius * libm::cos(angle), radius * libm::sin(angle)]
    };
    let lengths = bodies
        .iter()
        .map(|body| body.half_px[0].max(body.half_px[1]));
    let reach_px = 2.0 * lengths.fold(0.0, f64::max);
    let centers: Vec<[f64; 2]> = bodies.iter().map(|body| body.center_px).collect();
    let mut nearer: Vec<Vec<&Body>> = vec![Vec::new(); bodies.len()];
    for (a, b) in pairs_within(&centers, reach_px) {
        // As in drawing: at equal depth the greater id is nearer.
        let (near, far) = if bodies[a].depth < bodies[b].depth {
            (a, b)
        } else {
            (b, a)
        };
        nearer[far].push(&bodies[near]);
    }
    let visible = |(body, nearer): (&Body, &Vec<&Body>)| {
        let is_seen = |k: &usize| !nearer.iter().any(|other| other.covers(body.at(place(*k))));
        (0..N_POINTS).filter(is_seen).count()
    };
    let n_seen: usize = bodies.iter().zip(&nearer).map(visible).sum();
    n_seen as f64 / (N_POINTS * bodies.len().max(1)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::params::TankExtent;
    use crate::flock::{plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;

    #[test]
    fn requested_spacing_is_reached_where_there_is_room() {
        let library = synthetic::library(View::Side);
        let stats = |spacing_bl, count| {
            let params = Params {
                count: Some(count),
                frames: 240,
                spacing_bl,
                tank: TankExtent::Picture,
                ..Params::default()
            };
            plan_flock(&library, &params, &Silent)
                .expect("a good library")
                .stats
        };
        let usual = stats(None, 5);
        let wanted = 1.5 * usual.spacing_bl;
        let sparse = stats(Some(wanted), 5);
        assert!(
            (sparse.spacing_bl / wanted - 1.0).abs() < 0.2,
            "{} instead of {wanted}",
            sparse.spacing_bl
        );
        assert!(sparse.visible_share >= usual.visible_share);
        assert!(sparse.crossings_per_min <= usual.crossings_per_min);
        // Twelve animals have no room for ten body lengths, but their spacing does not shrink.
        assert!(stats(Some(10.0), 12).spacing_bl >= stats(None, 12).spacing_bl);
    }

    #[test]
    fn body_half_covered_by_a_nearer_one_is_half_visible() {
        let body = |x, depth| Body {
            center_px: [x, 0.0],
            cos_sin: [1.0, 0.0],
            half_px: [10.0, 4.0],
            depth,
        };
        assert_eq!(visible_share(&[body(0.0, 0.0), body(21.0, 1.0)]), 1.0);
        assert_eq!(visible_share(&[body(0.0, 0.0), body(0.0, 1.0)]), 0.5);
        // Two ellipses whose centers are 2/3 of a half length apart share 0.58 of their area.
        let share = visible_share(&[body(0.0, 0.0), body(6.67, 1.0)]);
        assert!((share - 0.71).abs() < 0.04, "{share}");
    }

    #[test]
    fn pairs_equal_those_of_all_comparisons() {
        let places: Vec<[f64; 2]> = (0..60)
            .map(|k| [f64::from(k * 37 % 101), f64::from(k * 53 % 97)])
            .collect();
        let mut pairs = pairs_within(&places, 15.0);
        pairs.sort_unstable();
        let mut expected = Vec::new();
        for (a, b) in (0..60).flat_map(|a| (a + 1..60).map(move |b| (a, b))) {
            if libm::hypot(places[a][0] - places[b][0], places[a][1] - places[b][1]) < 15.0 {
                expected.push((a, b));
            }
        }
        assert_eq!(pairs, expected);
    }
}
