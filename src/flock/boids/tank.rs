//! Where the flock may go: half-planes in the picture and, in side view, a depth (ALGORITHMS.md 7).
//! All in body lengths. Inside the tank always.

use super::vector::{Vec3, dot};
use crate::flock::params::{Params, TankExtent};
use crate::library::{Library, View};

/// Directions in which the seen area is bounded.
const N_SIDES: usize = 16;
/// The seen area counts when it is at least this share of the picture.
const LEAST_SEEN_SHARE: f64 = 0.2;
/// The side of the square that a boid needs to keep the usual distances.
const ROOM_BL: f64 = 1.2;
/// How far beyond the centroids seen it reaches.
const BEYOND_SEEN_BL: f64 = 0.25;

/// A convex tank.
#[derive(Clone, Debug, PartialEq)]
pub struct Tank {
    walls: Vec<Wall>,
    /// The box around it: least and greatest corner.
    pub corners: [Vec3; 2],
}

/// Inside is where `outward . p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Unit vector out of the tank.
    pub outward: Vec3,
    /// Distance from the origin along it.
    pub offset_bl: f64,
}

impl Tank {
    /// The tank of a library: its picture less half a body at each side, what was seen of it, and a
    /// depth in side view.
    pub fn of(library: &Library, length_px: f64, params: &Params) -> Tank {
        let [w, h] = library
            .poses
            .image_size_px
            .map(|px| f64::from(px) / length_px);
        let seen = match params.tank {
            TankExtent::Seen => seen_walls(library, length_px, w * h),
            TankExtent::Picture => Vec::new(),
        };
        let [margin_x, margin_y] = match seen.is_empty() {
            true => margins(library, length_px, w, h),
            // Where the animal itself was seen is far enough inside.
            false => margins(library, length_px, w, h).map(|margin| margin.min(0.3)),
        };
        let depth = match (library.poses.view, params.depth_bl) {
            (View::Top, _) => 0.0,
            (View::Side, Some(depth_bl)) => depth_bl,
            (View::Side, None) => (0.5 * w).min(3.0),
        };
        Tank::new(
            [margin_x, margin_y, 0.0],
            [w - margin_x, h - margin_y, depth],
            seen,
        )
    }

    /// A box, cut by further walls.
    pub fn new(least: Vec3, greatest: Vec3, further: Vec<Wall>) -> Tank {
        let mut walls = further;
        for axis in 0..3 {
            let mut outward = [0.0; 3];
            outward[axis] = 1.0;
            walls.push(Wall {
                outward,
                offset_bl: greatest[axis],
            });
            outward[axis] = -1.0;
            walls.push(Wall {
                outward,
                offset_bl: -least[axis],
            });
        }
        Tank {
            walls,
            corners: [least, greatest],
        }
    }

    /// Whether it has no depth: everything happens in the picture's plane.
    pub fn is_flat(&self) -> bool {
        self.corners[1][2] <= self.corners[0][2]
    }

    /// The share of the usual distances at which `n` boids fit in: 1 with room for all, less where
    /// each has less than a square of `ROOM_BL` in the picture.
    pub fn closeness(&self, n: usize) -> f64 {
        let [least, greatest] = self.corners;
        let area = (greatest[0] - least[0]) * (greatest[1] - least[1]);
        ((area / n as f64).sqrt() / ROOM_BL).min(1.0)
    }

    /// The middle of its box.
    pub fn middle(&self) -> Vec3 {
        std::array::from_fn(|axis| 0.5 * (self.corners[0][axis] + self.corners[1][axis]))
    }

    /// Inward pushes for whoever would pass a wall within `horizon_s`, growing to 1 at the wall.
    pub fn push(&self, position: Vec3, velocity: Vec3, horizon_s: f64) -> Vec3 {
        let mut push = [0.0; 3];
        for wall in self.upright_walls() {
            let room = wall.offset_bl - dot(wall.outward, position);
            let approach = dot(wall.outward, velocity) * horizon_s;
            if approach > room.max(0.0) {
                let strength = (approach - room.max(0.0)) / approach;
                for (push, outward) in push.iter_mut().zip(wall.outward) {
                    *push -= strength * outward;
                }
            }
        }
        push
    }

    /// Puts a position inside and reflects the part of the velocity that leads out: who only lost it
    /// would be caught in corners, never getting round. True when a wall was met.
    pub fn keep_inside(&self, position: &mut Vec3, velocity: &mut Vec3) -> bool {
        let mut met = false;
        // A few rounds settle corners of the seen area; the box's own walls come last and hold.
        for _ in 0..3 {
            for wall in &self.walls {
                let beyond = dot(wall.outward, *position) - wall.offset_bl;
                if beyond > 0.0 {
                    let outward_speed = dot(wall.outward, *velocity).max(0.0);
                    for axis in 0..3 {
                        position[axis] -= beyond * wall.outward[axis];
                        velocity[axis] -= 2.0 * outward_speed * wall.outward[axis];
                    }
                    met = true;
                }
            }
        }
        if met {
            *position = std::array::from_fn(|axis| {
                position[axis].clamp(self.corners[0][axis], self.corners[1][axis])
            });
        }
        met
    }

    /// Whether a position lies inside its box, to rounding.
    pub fn holds(&self, position: Vec3) -> bool {
        (0..3).all(|axis| {
            position[axis] >= self.corners[0][axis] - 1e-9
                && position[axis] <= self.corners[1][axis] + 1e-9
        })
    }

    /// The walls that steer: a flat tank has no front and back.
    fn upright_walls(&self) -> impl Iterator<Item = &Wall> {
        let flat = self.is_flat();
        self.walls
            .iter()
            .filter(move |wall| !flat || wall.outward[2] == 0.0)
    }
}

/// How near the picture's border the centroid may come: half a body, or in side view half a height
/// above and below; never more than a third of the picture.
fn margins(library: &Library, length_px: f64, w: f64, h: f64) -> [f64; 2] {
    let mut heights: Vec<f64> = library
        .poses
        .frames
        .iter()
        .filter_map(|pose| pose.height_px)
        .collect();
    heights.sort_unstable_by(f64::total_cmp);
    let height_bl = heights
        .get(heights.len() / 2)
        .map_or(1.0, |px| px / length_px);
    let vertical = match library.poses.view {
        View::Top => 0.55,
        View::Side => 0.55 * height_bl.min(1.0),
    };
    [(0.55f64).min(w / 3.0), vertical.min(h / 3.0)]
}

/// The outer polygon of the centroids seen; empty when that is a small part of the picture.
fn seen_walls(library: &Library, length_px: f64, picture_bl2: f64) -> Vec<Wall> {
    let seen: Vec<[f64; 2]> = library
        .poses
        .frames
        .iter()
        .filter_map(|pose| pose.centroid_px)
        .map(|c| c.map(|px| px / length_px))
        .collect();
    let walls: Vec<Wall> = (0..N_SIDES)
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / N_SIDES as f64;
            let outward = [libm::cos(angle), libm::sin(angle), 0.0];
            let reach = seen
                .iter()
                .map(|p| outward[0] * p[0] + outward[1] * p[1])
                .fold(f64::NEG_INFINITY, f64::max);
            Wall {
                outward,
                offset_bl: reach + BEYOND_SEEN_BL,
            }
        })
        .collect();
    if seen.is_empty() || area(&walls) < LEAST_SEEN_SHARE * picture_bl2 {
        return Vec::new();
    }
    walls
}

/// The area within walls of rising angle, by their corners.
fn area(walls: &[Wall]) -> f64 {
    let corner = |k: usize| {
        let (a, b) = (&walls[k], &walls[(k + 1) % walls.len()]);
        let cross = a.outward[0] * b.outward[1] - a.outward[1] * b.outward[0];
        [
            (a.offset_bl * b.outward[1] - b.offset_bl * a.outward[1]) / cross,
            (b.offset_bl * a.outward[0] - a.offset_bl * b.outward[0]) / cross,
        ]
    };
    (0..walls.len())
        .map(|k| {
            let (p, q) = (corner(k), corner((k + 1) % walls.len()));
            0.5 * (p[0] * q[1] - q[0] * p[1])
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_square_of_walls_has_the_area_of_a_square() {
        let wall = |x: f64, y: f64| Wall {
            outward: [x, y, 0.0],
            offset_bl: 2.0,
        };
        let walls = [
            wall(1.0, 0.0),
            wall(0.0, 1.0),
            wall(-1.0, 0.0),
            wall(0.0, -1.0),
        ];
        assert!((area(&walls) - 16.0).abs() < 1e-12);
    }

    #[test]
    fn only_who_heads_for_a_wall_is_pushed_and_inward() {
        let tank = Tank::new([0.0; 3], [6.0, 4.0, 2.0], Vec::new());
        assert_eq!(tank.push([3.0, 2.0, 1.0], [0.5, 0.0, 0.0], 1.0), [0.0; 3]);
        let push = tank.push([5.8, 2.0, 1.0], [0.5, 0.0, 0.0], 1.0);
        assert!(
            push[0] < 0.0 && push[1] == 0.0 && push[2] == 0.0,
            "{push:?}"
        );
    }

    proptest! {
        #[test]
        fn whoever_leaves_is_put_back_and_leads_out_no_more(
            p in prop::array::uniform3(-9.0..9.0f64), v in prop::array::uniform3(-3.0..3.0f64)
        ) {
            let tank = Tank::new([0.0; 3], [6.0, 4.0, 0.0], Vec::new());
            let (mut position, mut velocity) = (p, v);
            let met = tank.keep_inside(&mut position, &mut velocity);
            prop_assert!(tank.holds(position));
            prop_assert_eq!(met, !tank.holds(p));
            if p[0] > 6.0 {
                prop_assert!(velocity[0] <= 0.0);
            }
        }
    }
}
