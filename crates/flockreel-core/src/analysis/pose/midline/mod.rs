//! Computes the midline of the animal and its bend (docs/explanation/algorithms.md, "Midline and tail beat").
//!
//! The method walks both sides of the outline from head to tail and pairs opposite points (after Walter &
//! Couzin, TRex, eLife 2021). If that fails, the means of cross-sections replace it. In side view the body
//! bends along the line of sight, where the outline does not show it. Only an animal much longer than high
//! gets a midline in side view.

pub mod tail_beat;

mod ends;
mod sections;
mod walk;

use rayon::prelude::*;

use crate::analysis::track::Track;
use crate::analysis::track::sighting::Sighting;
use crate::geometry::wrap_rad;
use crate::library::{Pose, Poses, View};
use crate::order::median;
use crate::raster::{RgbaImage, outline};

/// Number of points in a midline, including head and tail tip. Free choice.
pub const N_POINTS: usize = 11;
/// Median ratio of length to height above which an animal in side view gets a midline. Free choice.
const MIN_ELONGATION: f64 = 3.0;
/// Smallest length of a midline, as a share of the length of the silhouette. Free choice.
const MIN_LENGTH_SHARE: f64 = 0.8;
/// Below this cosine between the heading and the line from end to end, the previous frame decides which end
/// is the head. Free choice.
const MIN_LEAD_COSINE: f64 = 0.25;

/// Sets the midline, from head to tail, and the bend of every pose with a known heading.
pub fn trace(poses: &mut Poses, track: &Track) {
    if poses.view == View::Side && !is_long(&poses.frames) {
        return;
    }
    let midlines: Vec<Option<Midline>> = poses
        .frames
        .par_iter()
        .zip(&track.frames)
        .map(|(pose, tracked)| {
            let sighting = tracked.sighting.as_ref()?;
            extract(sighting, &track.image(sighting), pose)
        })
        .collect();
    let mut last: Option<[f64; 2]> = None;
    for (pose, midline) in poses.frames.iter_mut().zip(midlines) {
        let Some(mut midline) = midline else {
            last = None;
            continue;
        };
        if let Some(head) = last
            && midline.is_head_uncertain
            && distance(midline.points[N_POINTS - 1], head) < distance(midline.points[0], head)
        {
            midline.points.reverse();
        }
        last = Some(midline.points[0]);
        pose.bend_rad = Some(bend_rad(&midline.points));
        pose.midline_px = Some(midline.points);
    }
}

/// Returns the angle from the first third of a midline to the last, in (-pi, pi], clockwise in the image.
pub fn bend_rad(midline: &[[f64; 2]]) -> f64 {
    let thirds = resampled(midline, 4);
    if thirds.len() < 4 {
        return 0.0;
    }
    let angle = |from: [f64; 2], to: [f64; 2]| libm::atan2(to[1] - from[1], to[0] - from[0]);
    wrap_rad(angle(thirds[2], thirds[3]) - angle(thirds[0], thirds[1]))
}

fn is_long(frames: &[Pose]) -> bool {
    let ratios = frames
        .iter()
        .filter_map(|pose| Some(pose.length_px? / pose.height_px?.max(1.0)));
    median(ratios).is_some_and(|ratio| ratio > MIN_ELONGATION)
}

struct Midline {
    /// Points from head to tail, pixels.
    points: Vec<[f64; 2]>,
    /// True where the heading is nearly perpendicular to the line from end to end, so that it may name the
    /// wrong head.
    is_head_uncertain: bool,
}

fn extract(sighting: &Sighting, image: &RgbaImage, pose: &Pose) -> Option<Midline> {
    let heading = pose.heading_rad?;
    let toward = [libm::cos(heading), libm::sin(heading)];
    let alpha: Vec<u8> = image.pixels.chunks_exact(4).map(|rgba| rgba[3]).collect();
    let rect = sighting.rect;
    let outline = outline::outline(rect, &alpha)?;
    let [one, other] = ends::ends(&outline);
    let span = [0, 1].map(|c| outline[one][c] - outline[other][c]);
    let lead = span[0] * toward[0] + span[1] * toward[1];
    let is_head_uncertain = lead.abs() < MIN_LEAD_COSINE * libm::hypot(span[0], span[1]);
    let (head, tail) = if lead >= 0.0 {
        // An eye may be sharper than the tail. The head is then the end opposite the tail.
        (ends::opposite_end(&outline, other), other)
    } else {
        (other, one)
    };
    let points = resampled(&walk::midpoints(&outline, head, tail), N_POINTS);
    if is_plausible(&points, pose) {
        return Some(Midline {
            points,
            is_head_uncertain,
        });
    }
    let points = resampled(&sections::section_means(rect, &alpha, toward), N_POINTS);
    (points.len() == N_POINTS).then_some(Midline {
        points,
        is_head_uncertain: false,
    })
}

/// Returns whether a midline is as long as the animal and does not double back.
fn is_plausible(points: &[[f64; 2]], pose: &Pose) -> bool {
    let length_px: f64 = points.windows(2).map(|p| distance(p[0], p[1])).sum();
    let doubles_back = points.windows(3).any(|p| {
        let along = |c: usize| (p[1][c] - p[0][c]) * (p[2][c] - p[1][c]);
        along(0) + along(1) <= 0.0
    });
    points.len() == N_POINTS
        && !doubles_back
        && length_px >= MIN_LENGTH_SHARE * pose.length_px.unwrap_or(0.0)
}

/// Returns `n` points at equal distances along a line, including its ends; empty for a line without length.
fn resampled(line: &[[f64; 2]], n: usize) -> Vec<[f64; 2]> {
    let mut along_px = vec![0.0];
    for pair in line.windows(2) {
        along_px.push(along_px[along_px.len() - 1] + distance(pair[0], pair[1]));
    }
    let total_px = along_px[along_px.len() - 1];
    if line.len() < 2 || total_px <= 0.0 {
        return Vec::new();
    }
    (0..n)
        .map(|k| {
            let target = total_px * k as f64 / (n - 1) as f64;
            let next = along_px
                .partition_point(|&a| a < target)
                .clamp(1, line.len() - 1);
            let step = along_px[next] - along_px[next - 1];
            let share = ((target - along_px[next - 1]) / step.max(1e-12)).clamp(0.0, 1.0);
            [0, 1].map(|c| line[next - 1][c] + share * (line[next][c] - line[next - 1][c]))
        })
        .collect()
}

fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    libm::hypot(q[0] - p[0], q[1] - p[1])
}

#[cfg(test)]
mod tests;
