//! Tank of a library: the area in which the centroid of the animal was seen
//! (docs/explanation/algorithms.md, "Boids").

use std::f64::consts::TAU;

use super::floor::Floor;
use super::{Line, Tank, Wall};
use crate::flock::boids::vector::norm;
use crate::flock::lens::Lens;
use crate::flock::motion::FrameMotion;
use crate::flock::params::{Params, TankExtent};
use crate::library::{Library, View};
use crate::order::{median, percentile};

/// Number of directions in which the seen area is bounded. Free choice.
const N_SIDES: usize = 16;
/// Share of the image up to which the tank of a large flock grows in side view. In top view it grows as far
/// as the floor. Free choice.
const MAX_IMAGE_SHARE: f64 = 0.7;
/// Distance by which the tank grows at a time, body lengths. Free choice.
const GROWTH_BL: f64 = 0.25;
/// Distance between a body and a wall, body lengths. Free choice.
const CLEARANCE_BL: f64 = 0.05;
/// Least and greatest depth of a tank without a requested depth, body lengths. Free choice.
const DEPTH_LIMITS_BL: [f64; 2] = [1.0, 6.0];
/// Share of frames that the range of depths leaves out at either end. Free choice.
const OUTLIER_SHARE: f64 = 0.01;

impl Tank {
    /// Returns the tank of a library: the convex area and the range of depths in which the centroid of the
    /// animal was seen. If the flock lacks space, the area grows, but only as far as an animal is wholly in
    /// the image.
    pub fn from_library(
        library: &Library,
        lens: &Lens,
        motion: &[FrameMotion],
        params: &Params,
    ) -> Tank {
        let [w, h] = library.poses.image_size_px.map(f64::from);
        let geometry = Geometry {
            library,
            lens,
            body: Body::new(library, lens.length_px),
            size_px: [w, h],
            depths_bl: depths(library, lens, motion, params),
        };
        let seen = match params.tank {
            TankExtent::Seen => seen_lines(library),
            TankExtent::Picture => Vec::new(),
        };
        // The bodies reach beyond the centroids. What grows is the area of the bodies.
        let margins_px: Vec<f64> = (seen.iter())
            .map(|line| lens.length_px * geometry.body.margin_bl(line.outward))
            .collect();
        let moved = |line: &Line, by_px: f64| Line {
            outward: line.outward,
            offset_px: line.offset_px + by_px,
        };
        let outer = seen.iter().zip(&margins_px);
        let mut bodies: Vec<Line> = outer.map(|(line, margin)| moved(line, *margin)).collect();
        let floor = (library.poses.view == View::Top).then(|| Floor::new(&library.background));
        let growth_px = GROWTH_BL * lens.length_px;
        loop {
            let inner = bodies.iter().zip(&margins_px);
            let lines: Vec<Line> = inner.map(|(line, margin)| moved(line, -margin)).collect();
            let tank = geometry.tank(&lines);
            if lines.is_empty() || tank.fits_in_plane(params.most_individuals() as usize) {
                return tank;
            }
            let has_moved = match &floor {
                Some(floor) => floor.widen(&mut bodies, growth_px),
                None => widen(&mut bodies, growth_px, MAX_IMAGE_SHARE * w * h),
            };
            if !has_moved {
                return tank;
            }
        }
    }
}

/// Moves all lines outward by `by_px`. Does nothing and returns false if they enclose at least
/// `max_area_px2`.
fn widen(lines: &mut [Line], by_px: f64, max_area_px2: f64) -> bool {
    if area_px2(lines) >= max_area_px2 {
        return false;
    }
    lines.iter_mut().for_each(|line| line.offset_px += by_px);
    true
}

/// Inputs that all tanks of one library share.
struct Geometry<'a> {
    library: &'a Library,
    lens: &'a Lens,
    body: Body,
    size_px: [f64; 2],
    depths_bl: [f64; 2],
}

impl Geometry<'_> {
    /// Returns the tank in which bodies stay within the image and within these lines.
    fn tank(&self, lines: &[Line]) -> Tank {
        let [w, h] = self.size_px;
        let edges = [
            ([1.0, 0.0], w),
            ([0.0, 1.0], h),
            ([-1.0, 0.0], 0.0),
            ([0.0, -1.0], 0.0),
        ];
        let edges = edges.map(|(outward, offset_px)| Line { outward, offset_px });
        let seen = lines.iter().map(|line| self.wall(*line, 0.0));
        let walls = self.edge_walls(&edges).chain(seen).collect();
        let [near, far] = self.depths_bl;
        let places = [
            ([0.0, 0.0], near),
            ([w, h], near),
            ([0.0, 0.0], far),
            ([w, h], far),
        ]
        .map(|(px, depth_bl)| self.lens.place_bl(px, depth_bl));
        let corners = [f64::min, f64::max].map(|extreme| {
            let [first, rest @ ..] = places;
            rest.iter().fold(first, |corner, place| {
                std::array::from_fn(|axis| extreme(corner[axis], place[axis]))
            })
        });
        Tank::cut_box(corners, walls)
    }

    /// Returns the walls along the edges of the image. A body keeps within the image, but its centroid may go
    /// as far as that of the filmed animal. The margin is at most a third of the image. Opposite edges are
    /// half the list apart.
    fn edge_walls(&self, edges: &[Line; 4]) -> impl Iterator<Item = Wall> {
        let px_per_bl = self.lens.px_per_bl(self.depths_bl[0]);
        (0..4).map(move |k| {
            let edge = edges[k];
            let across_bl = (edge.offset_px + edges[(k + 2) % 4].offset_px) / px_per_bl;
            let kept_bl = (edge.offset_px - farthest_px(self.library, edge.outward)) / px_per_bl;
            let margin_bl = self.body.margin_bl(edge.outward).min(across_bl / 3.0);
            self.wall(edge, margin_bl.min(kept_bl))
        })
    }

    fn wall(&self, Line { outward, offset_px }: Line, margin_bl: f64) -> Wall {
        self.lens.wall(outward, offset_px, margin_bl)
    }
}

/// Extent of a body around its centroid.
struct Body {
    view: View,
    half_height_bl: f64,
}

impl Body {
    fn new(library: &Library, length_px: f64) -> Body {
        let poses = library.poses.frames.iter();
        let median_px = median(poses.filter_map(|pose| pose.height_px)).unwrap_or(length_px);
        Body {
            view: library.poses.view,
            half_height_bl: 0.5 * (median_px / length_px).min(1.0),
        }
    }

    /// Returns the distance that a centroid keeps from a wall, body lengths. In top view a body may point at
    /// the wall. In side view it is level.
    fn margin_bl(&self, outward: [f64; 2]) -> f64 {
        let reach = match self.view {
            View::Top => 0.5,
            View::Side => norm([0.5 * outward[0], self.half_height_bl * outward[1], 0.0]),
        };
        reach + CLEARANCE_BL
    }
}

/// Returns the least and the greatest depth, body lengths from the camera; 0 for a flat lens.
fn depths(library: &Library, lens: &Lens, motion: &[FrameMotion], params: &Params) -> [f64; 2] {
    if lens.is_flat() {
        return [0.0; 2];
    }
    let frames = library.playback.component.iter();
    let depths = frames.map(|&frame| motion[frame as usize].depth_bl);
    let mut depths: Vec<f64> = depths.collect();
    let mut at = |share| percentile(&mut depths, share).unwrap_or(0.0);
    let (near, far) = (at(OUTLIER_SHARE), at(1.0 - OUTLIER_SHARE));
    let [min_depth, max_depth] = DEPTH_LIMITS_BL;
    let depth = (params.depth_bl).unwrap_or((far - near).clamp(min_depth, max_depth));
    // The front is never so near that a body has more than 1.5 times its usual size.
    let least = lens.depth_at_bl(1.5 * lens.length_px);
    let nearest = (0.5 * (near + far - depth)).max(least);
    [nearest, nearest + depth]
}

/// Returns the outer polygon of the centroids seen; empty if there are none.
fn seen_lines(library: &Library) -> Vec<Line> {
    let line = |k| {
        let angle = TAU * k as f64 / N_SIDES as f64;
        let outward = [libm::cos(angle), libm::sin(angle)];
        Line {
            outward,
            offset_px: farthest_px(library, outward),
        }
    };
    (0..N_SIDES).map(line).collect()
}

/// Returns how far the centroids seen reach in a direction, pixels from the corner of the image.
fn farthest_px(library: &Library, outward: [f64; 2]) -> f64 {
    library
        .places_px()
        .map(|[x, y]| outward[0] * x + outward[1] * y)
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Returns the area within lines of ascending angle, square pixels.
fn area_px2(lines: &[Line]) -> f64 {
    let n = lines.len();
    let corner = |k: usize| {
        let [(a, a_px), (b, b_px)] =
            [k, k + 1].map(|k| (lines[k % n].outward, lines[k % n].offset_px));
        let cross = a[0] * b[1] - a[1] * b[0];
        let [x, y] = [a_px * b[1] - b_px * a[1], b_px * a[0] - a_px * b[0]];
        [x / cross, y / cross]
    };
    let triangle = |k: usize| {
        let (p, q) = (corner(k), corner(k + 1));
        0.5 * (p[0] * q[1] - q[0] * p[1])
    };
    (0..n).map(triangle).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_of_four_lines_is_that_of_their_square() {
        let directions = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let lines = directions.map(|outward| Line {
            outward,
            offset_px: 2.0,
        });
        assert!((area_px2(&lines) - 16.0).abs() < 1e-12);
    }
}
