//! Tank: the convex region in which a flock swims, an intersection of half-spaces
//! (docs/explanation/algorithms.md, "Boids"). Its side walls are lines in the image. In side view it has a
//! depth too. All lengths are in body lengths.

mod floor;
mod from_library;

use super::OVERLAP_BL;
use super::vector::{Vec3, add_scaled, dot, minus, scaled};

/// Side of the square that a boid needs to keep the usual distances, body lengths. Free choice.
const SPACE_SIDE_BL: f64 = 1.2;
/// Side of the square that an animal in top view needs to overlap others only seldom, body lengths. Free
/// choice. docs/measurements.md lists the overlap of flocks of that size.
const TOP_VIEW_SPACE_SIDE_BL: f64 = 1.6;
/// Share of the distance in an even arrangement that boids can keep while they swim. At a larger share a
/// dense flock is pushed about. In depth boids get past each other more easily than in a plane. Free choices.
const KEPT_SPACING: f64 = 0.45;
const KEPT_SPACING_IN_DEPTH: f64 = 0.62;
/// Samples per side by which the section of the tank is measured. Free choice.
const N_SAMPLES: usize = 48;

/// A line in the image and the side of it on which the tank lies: positions p with `outward . p <= offset_px`.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// Unit vector in the image, out of the tank.
    outward: [f64; 2],
    /// Distance of the line from the corner of the image along `outward`, pixels.
    offset_px: f64,
}

impl Line {
    /// Returns the distance of a point from the corner of the image along `outward`, pixels.
    fn along_px(&self, [x, y]: [f64; 2]) -> f64 {
        self.outward[0] * x + self.outward[1] * y
    }

    fn contains(&self, point_px: [f64; 2]) -> bool {
        self.along_px(point_px) <= self.offset_px
    }
}

/// A convex tank.
#[derive(Clone, Debug, PartialEq)]
pub struct Tank {
    walls: Vec<Wall>,
    /// Least and greatest corner of the bounding box.
    pub corners: [Vec3; 2],
    /// Center of the section at half the depth.
    pub center: Vec3,
    /// Approximate half width, half height and half depth.
    pub half_extent_bl: Vec3,
    section_bl2: f64,
}

/// A half-space. A position p is inside if `outward . p <= offset_bl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Unit vector out of the tank.
    pub outward: Vec3,
    /// Distance of the wall from the origin along `outward`, body lengths.
    pub offset_bl: f64,
}

impl Tank {
    /// Returns a box. It is flat if it has no depth.
    pub fn new(least: Vec3, greatest: Vec3) -> Tank {
        Tank::cut_box([least, greatest], Vec::new())
    }

    /// Returns a box that is cut by further walls. The result must not be empty.
    fn cut_box(corners: [Vec3; 2], mut walls: Vec<Wall>) -> Tank {
        for (axis, (least, greatest)) in corners[0].into_iter().zip(corners[1]).enumerate() {
            for (sign, offset_bl) in [(1.0, greatest), (-1.0, -least)] {
                let mut outward = [0.0; 3];
                outward[axis] = sign;
                walls.push(Wall { outward, offset_bl });
            }
        }
        let mut tank = Tank {
            walls,
            corners,
            center: [0.0; 3],
            half_extent_bl: [0.0; 3],
            section_bl2: 0.0,
        };
        tank.measure();
        tank
    }

    /// Measures the section at half the depth: its center, extent and area.
    fn measure(&mut self) {
        let [least, greatest] = self.corners;
        let depth = 0.5 * (least[2] + greatest[2]);
        let at = |axis: usize, k: usize| {
            let share = (k as f64 + 0.5) / N_SAMPLES as f64;
            least[axis] + share * (greatest[axis] - least[axis])
        };
        let (mut sum, mut squares, mut n) = ([0.0; 3], [0.0; 3], 0.0);
        for k in 0..N_SAMPLES * N_SAMPLES {
            let place = [at(0, k % N_SAMPLES), at(1, k / N_SAMPLES), depth];
            if self.contains(place) {
                sum = add_scaled(sum, 1.0, place);
                squares = add_scaled(squares, 1.0, place.map(|x| x * x));
                n += 1.0;
            }
        }
        let area = (greatest[0] - least[0]) * (greatest[1] - least[1]);
        self.section_bl2 = area * n / (N_SAMPLES * N_SAMPLES) as f64;
        self.center = if n > 0.0 {
            scaled(1.0 / n, sum)
        } else {
            [at(0, N_SAMPLES / 2), at(1, N_SAMPLES / 2), depth]
        };
        // Half the span of a uniform distribution is the root of three times its variance.
        let half = |axis: usize| {
            let variance = squares[axis] / f64::max(n, 1.0) - self.center[axis] * self.center[axis];
            (3.0 * variance.max(0.0)).sqrt()
        };
        self.half_extent_bl = [half(0), half(1), 0.5 * (greatest[2] - least[2])];
    }

    /// Returns whether the tank has no depth, so that boids move in the image plane.
    pub fn is_flat(&self) -> bool {
        self.corners[1][2] <= self.corners[0][2]
    }

    /// Returns the axis about which boids turn: the normal of the image plane in a flat tank, else the
    /// vertical.
    pub fn up(&self) -> Vec3 {
        if self.is_flat() {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0]
        }
    }

    /// Returns the factor on all radii with which `n` boids fit into the tank, 0.05..=1. It is 1 if each boid
    /// has a square of side `SPACE_SIDE_BL`. In a tank so deep that boids swim one behind another, each needs a
    /// cube.
    pub fn radius_scale(&self, n: usize) -> f64 {
        (self.even_spacing_bl(n) / SPACE_SIDE_BL).clamp(0.05, 1.0)
    }

    /// Returns the least distance between `n` boids, body lengths: `OVERLAP_BL` if boids can keep it while
    /// they swim, else `OVERLAP_BL` times `radius_scale`.
    pub fn overlap_bl(&self, n: usize) -> f64 {
        let kept = if self.is_deep_for(n) {
            KEPT_SPACING_IN_DEPTH
        } else {
            KEPT_SPACING
        };
        if kept * self.even_spacing_bl(n) >= OVERLAP_BL {
            OVERLAP_BL
        } else {
            OVERLAP_BL * self.radius_scale(n)
        }
    }

    /// Returns the distance between `n` boids that share the tank evenly.
    fn even_spacing_bl(&self, n: usize) -> f64 {
        let (side_bl, depth_bl) = (self.spacing_in_plane_bl(n), 2.0 * self.half_extent_bl[2]);
        if self.is_deep_for(n) {
            libm::cbrt(side_bl * side_bl * depth_bl)
        } else {
            side_bl
        }
    }

    /// Returns whether `n` boids would swim one behind another, not only side by side.
    fn is_deep_for(&self, n: usize) -> bool {
        2.0 * self.half_extent_bl[2] > self.spacing_in_plane_bl(n)
    }

    /// Returns whether `n` boids can keep the usual distances side by side.
    pub fn fits_in_plane(&self, n: usize) -> bool {
        self.spacing_in_plane_bl(n) >= SPACE_SIDE_BL
    }

    /// Returns the distance between `n` boids that share the tank evenly side by side.
    fn spacing_in_plane_bl(&self, n: usize) -> f64 {
        (self.section_bl2 / n as f64).sqrt()
    }

    /// Returns the number of animals for which the tank has space. In side view, neighbors are `OVERLAP_BL`
    /// apart, side by side and one behind another. In top view, each animal has a square of side
    /// `TOP_VIEW_SPACE_SIDE_BL`.
    pub fn capacity(&self) -> u32 {
        let n = if self.is_flat() {
            self.section_bl2 / (TOP_VIEW_SPACE_SIDE_BL * TOP_VIEW_SPACE_SIDE_BL)
        } else {
            let layers = (2.0 * self.half_extent_bl[2]).max(1.0);
            self.section_bl2 / (OVERLAP_BL * OVERLAP_BL) * layers
        };
        n.max(1.0) as u32
    }

    /// Returns the inward push for a boid that would pass walls within `horizon_s`. A push grows to 1 at the
    /// wall.
    pub fn avoidance(&self, position: Vec3, velocity: Vec3, horizon_s: f64) -> Vec3 {
        let mut push = [0.0; 3];
        for wall in &self.walls {
            // In a flat tank all boids are at the front and at the back.
            if self.is_flat() && wall.outward[2] != 0.0 {
                continue;
            }
            let distance = (wall.offset_bl - dot(wall.outward, position)).max(0.0);
            let approach = dot(wall.outward, velocity) * horizon_s;
            if distance < approach {
                push = add_scaled(push, -((approach - distance) / approach), wall.outward);
            }
        }
        push
    }

    /// Moves a position into the tank and reflects the part of the velocity that leads out. If that part were
    /// only removed, boids would be caught in corners. Returns whether the position was beyond a wall.
    pub fn keep_inside(&self, position: &mut Vec3, velocity: &mut Vec3) -> bool {
        let mut was_outside = false;
        // A few rounds settle most corners. A round without a wall ends the loop.
        for _ in 0..3 {
            let mut is_outside = false;
            for wall in &self.walls {
                let beyond = dot(wall.outward, *position) - wall.offset_bl;
                if beyond > 0.0 {
                    let outward_speed = dot(wall.outward, *velocity).max(0.0);
                    *position = add_scaled(*position, -beyond, wall.outward);
                    *velocity = add_scaled(*velocity, -2.0 * outward_speed, wall.outward);
                    is_outside = true;
                }
            }
            if !is_outside {
                break;
            }
            was_outside = true;
        }
        if was_outside {
            *position = self.clip_segment(self.center, *position);
        }
        was_outside
    }

    /// Returns `to`, or the point at which the line from `from`, a position inside, to `to` leaves the tank.
    pub fn clip_segment(&self, from: Vec3, to: Vec3) -> Vec3 {
        let path = minus(to, from);
        let mut share = 1.0f64;
        for wall in &self.walls {
            let along = dot(wall.outward, path);
            let distance = (wall.offset_bl - dot(wall.outward, from)).max(0.0);
            if along > distance {
                share = share.min(distance / along);
            }
        }
        if share < 1.0 {
            add_scaled(from, share, path)
        } else {
            to
        }
    }

    /// Returns whether a position is inside, within rounding.
    pub fn contains(&self, position: Vec3) -> bool {
        let beyond = |wall: &Wall| dot(wall.outward, position) - wall.offset_bl;
        self.walls.iter().all(|wall| beyond(wall) < 1e-9)
    }

    /// Returns all walls.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn boids_are_pushed_inward_only_when_they_approach_a_wall() {
        let tank = Tank::new([0.0; 3], [6.0, 4.0, 2.0]);
        assert_eq!(
            tank.avoidance([3.0, 2.0, 1.0], [0.5, 0.0, 0.0], 1.0),
            [0.0; 3]
        );
        let push = tank.avoidance([5.8, 2.0, 1.0], [0.5, 0.0, 0.0], 1.0);
        assert!(push[0] < 0.0 && push[1..] == [0.0; 2], "{push:?}");
    }

    #[test]
    fn overlap_distance_shrinks_only_in_full_tanks() {
        let overlap = |n| Tank::new([0.0; 3], [4.0, 4.0, 0.0]).overlap_bl(n);
        assert_eq!([1, 5, 12].map(overlap), [0.5; 3]);
        for n in [13, 400] {
            let wanted = 0.5 * (16.0 / n as f64).sqrt() / SPACE_SIDE_BL;
            assert!((overlap(n) - wanted).abs() < 1e-3, "{n}: {}", overlap(n));
        }
        let in_depth = |n| Tank::new([0.0; 3], [4.0, 4.0, 4.0]).overlap_bl(n);
        assert_eq!(in_depth(121), 0.5);
        assert!(in_depth(123) < 0.35);
    }

    #[test]
    fn deep_tanks_fit_more_boids_than_flat_ones() {
        let radius_scale =
            |depth_bl, n| Tank::new([0.0; 3], [12.0, 12.0, depth_bl]).radius_scale(n);
        for depth_bl in [0.0, 1.0, 14.4] {
            assert_eq!(radius_scale(depth_bl, 100), 1.0, "{depth_bl}");
        }
        for (depth_bl, wanted) in [(0.0, 0.316), (0.379, 0.316), (1.2, 0.464), (12.0, 1.0)] {
            let found = radius_scale(depth_bl, 1000);
            assert!((found - wanted).abs() < 1e-3, "{depth_bl}: {found}");
        }
    }

    proptest! {
        #[test]
        fn boids_outside_are_moved_in_and_stop_heading_out(
            p in prop::array::uniform3(-9.0..9.0f64), v in prop::array::uniform3(-3.0..3.0f64)
        ) {
            let tank = Tank::new([0.0; 3], [6.0, 4.0, 0.0]);
            let (mut position, mut velocity) = (p, v);
            let was_outside = tank.keep_inside(&mut position, &mut velocity);
            prop_assert!(tank.contains(position));
            prop_assert_eq!(was_outside, !tank.contains(p));
            if p[0] > 6.0 {
                prop_assert!(velocity[0] <= 0.0);
            }
        }
    }
}
