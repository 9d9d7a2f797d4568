//! Tank: the convex region in which a flock swims, an intersection of half-spaces
//! (docs/explanation/algorithms.md, "Boids"). Its side walls are lines in the image. In side view it has a
//! depth too. All lengths are in body lengths.

mod floor;
mod site;

use super::OVERLAP_BL;
use super::vector::{Vec3, add_scaled, dot, minus, scaled};

/// Side of the square that a boid needs to keep the usual distances, body lengths. Free choice.
const ROOM_BL: f64 = 1.2;
/// Side of the square that an animal in top view needs to overlap others only seldom, body lengths. Free
/// choice. docs/measurements.md lists the overlap of flocks of that size.
const ROAM_BL: f64 = 1.6;
/// Share of the distance in an even arrangement that boids can keep while they swim. At a larger share a
/// dense flock is pushed about. In depth boids get past each other more easily than in a plane. Free choices.
const KEPT: f64 = 0.45;
const KEPT_IN_DEPTH: f64 = 0.62;
/// Samples per side by which the section of the tank is measured. Free choice.
const N_SAMPLES: usize = 48;

/// A convex tank.
#[derive(Clone, Debug, PartialEq)]
pub struct Tank {
    walls: Vec<Wall>,
    /// Least and greatest corner of the bounding box.
    pub corners: [Vec3; 2],
    /// Center of the section at half the depth.
    pub middle: Vec3,
    /// Approximate half width, half height and half depth.
    pub reach_bl: Vec3,
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
        Tank::within([least, greatest], Vec::new())
    }

    /// Returns a box that is cut by further walls. The result must not be empty.
    fn within(corners: [Vec3; 2], mut walls: Vec<Wall>) -> Tank {
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
            middle: [0.0; 3],
            reach_bl: [0.0; 3],
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
            if self.holds(place) {
                sum = add_scaled(sum, 1.0, place);
                squares = add_scaled(squares, 1.0, place.map(|x| x * x));
                n += 1.0;
            }
        }
        let area = (greatest[0] - least[0]) * (greatest[1] - least[1]);
        self.section_bl2 = area * n / (N_SAMPLES * N_SAMPLES) as f64;
        self.middle = if n > 0.0 {
            scaled(1.0 / n, sum)
        } else {
            [at(0, N_SAMPLES / 2), at(1, N_SAMPLES / 2), depth]
        };
        // Half the span of a uniform distribution is the root of three times its variance.
        let half = |axis: usize| {
            let variance = squares[axis] / f64::max(n, 1.0) - self.middle[axis] * self.middle[axis];
            (3.0 * variance.max(0.0)).sqrt()
        };
        self.reach_bl = [half(0), half(1), 0.5 * (greatest[2] - least[2])];
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
    /// has a square of side `ROOM_BL`. In a tank so deep that boids swim one behind another, each needs a
    /// cube.
    pub fn closeness(&self, n: usize) -> f64 {
        (self.apart_bl(n) / ROOM_BL).clamp(0.05, 1.0)
    }

    /// Returns the least distance between `n` boids, body lengths: `OVERLAP_BL` if boids can keep it while
    /// they swim, else `OVERLAP_BL` times `closeness`.
    pub fn overlap_bl(&self, n: usize) -> f64 {
        let kept = if self.is_deep_for(n) {
            KEPT_IN_DEPTH
        } else {
            KEPT
        };
        if kept * self.apart_bl(n) >= OVERLAP_BL {
            OVERLAP_BL
        } else {
            OVERLAP_BL * self.closeness(n)
        }
    }

    /// Returns the distance between `n` boids that share the tank evenly.
    fn apart_bl(&self, n: usize) -> f64 {
        let (beside_bl, depth_bl) = (self.beside_bl(n), 2.0 * self.reach_bl[2]);
        if self.is_deep_for(n) {
            libm::cbrt(beside_bl * beside_bl * depth_bl)
        } else {
            beside_bl
        }
    }

    /// Returns whether `n` boids would swim one behind another, not only side by side.
    fn is_deep_for(&self, n: usize) -> bool {
        2.0 * self.reach_bl[2] > self.beside_bl(n)
    }

    /// Returns whether `n` boids can keep the usual distances side by side.
    pub fn has_room_beside(&self, n: usize) -> bool {
        self.beside_bl(n) >= ROOM_BL
    }

    /// Returns the distance between `n` boids that share the tank evenly side by side.
    fn beside_bl(&self, n: usize) -> f64 {
        (self.section_bl2 / n as f64).sqrt()
    }

    /// Returns the number of animals that the tank has room for. In side view, neighbors are `OVERLAP_BL`
    /// apart, side by side and one behind another. In top view, each animal has a square of side `ROAM_BL`.
    pub fn room_for(&self) -> u32 {
        let n = if self.is_flat() {
            self.section_bl2 / (ROAM_BL * ROAM_BL)
        } else {
            let layers = (2.0 * self.reach_bl[2]).max(1.0);
            self.section_bl2 / (OVERLAP_BL * OVERLAP_BL) * layers
        };
        n.max(1.0) as u32
    }

    /// Returns the inward push for a boid that would pass walls within `horizon_s`. A push grows to 1 at the
    /// wall.
    pub fn push(&self, position: Vec3, velocity: Vec3, horizon_s: f64) -> Vec3 {
        let mut push = [0.0; 3];
        for wall in self.upright_walls() {
            let room = (wall.offset_bl - dot(wall.outward, position)).max(0.0);
            let approach = dot(wall.outward, velocity) * horizon_s;
            if room < approach {
                push = add_scaled(push, -((approach - room) / approach), wall.outward);
            }
        }
        push
    }

    /// Moves a position into the tank and reflects the part of the velocity that leads out. If that part were
    /// only removed, boids would be caught in corners. Returns whether the position was beyond a wall.
    pub fn keep_inside(&self, position: &mut Vec3, velocity: &mut Vec3) -> bool {
        let mut met = false;
        // A few rounds settle most corners. A round without a wall ends the loop.
        for _ in 0..3 {
            let mut meets = false;
            for wall in &self.walls {
                let beyond = dot(wall.outward, *position) - wall.offset_bl;
                if beyond > 0.0 {
                    let outward_speed = dot(wall.outward, *velocity).max(0.0);
                    *position = add_scaled(*position, -beyond, wall.outward);
                    *velocity = add_scaled(*velocity, -2.0 * outward_speed, wall.outward);
                    meets = true;
                }
            }
            if !meets {
                break;
            }
            met = true;
        }
        if met {
            *position = self.on_the_way(self.middle, *position);
        }
        met
    }

    /// Returns `to`, or the point at which the line from `from`, a position inside, to `to` leaves the tank.
    pub fn on_the_way(&self, from: Vec3, to: Vec3) -> Vec3 {
        let way = minus(to, from);
        let share = self.walls.iter().fold(1.0f64, |share, wall| {
            let along = dot(wall.outward, way);
            let room = (wall.offset_bl - dot(wall.outward, from)).max(0.0);
            if along > room {
                share.min(room / along)
            } else {
                share
            }
        });
        if share < 1.0 {
            add_scaled(from, share, way)
        } else {
            to
        }
    }

    /// Returns whether a position is inside, within rounding.
    pub fn holds(&self, position: Vec3) -> bool {
        let beyond = |wall: &Wall| dot(wall.outward, position) - wall.offset_bl;
        self.walls.iter().all(|wall| beyond(wall) < 1e-9)
    }

    /// Returns all walls.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// Returns the walls that boids steer away from: in a flat tank, all but the front and the back.
    fn upright_walls(&self) -> impl Iterator<Item = &Wall> {
        let flat = self.is_flat();
        self.walls
            .iter()
            .filter(move |wall| !flat || wall.outward[2] == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_who_heads_for_a_wall_is_pushed_and_inward() {
        let tank = Tank::new([0.0; 3], [6.0, 4.0, 2.0]);
        assert_eq!(tank.push([3.0, 2.0, 1.0], [0.5, 0.0, 0.0], 1.0), [0.0; 3]);
        let push = tank.push([5.8, 2.0, 1.0], [0.5, 0.0, 0.0], 1.0);
        assert!(
            push[0] < 0.0 && push[1] == 0.0 && push[2] == 0.0,
            "{push:?}"
        );
    }

    #[test]
    fn half_a_length_is_kept_as_long_as_all_can_get_about() {
        let overlap = |n| Tank::new([0.0; 3], [4.0, 4.0, 0.0]).overlap_bl(n);
        assert_eq!([1, 5, 12].map(overlap), [0.5; 3]);
        for n in [13, 400] {
            let wanted = 0.5 * (16.0 / n as f64).sqrt() / ROOM_BL;
            assert!((overlap(n) - wanted).abs() < 1e-3, "{n}: {}", overlap(n));
        }
        let in_depth = |n| Tank::new([0.0; 3], [4.0, 4.0, 4.0]).overlap_bl(n);
        assert_eq!(in_depth(121), 0.5);
        assert!(in_depth(123) < 0.35);
    }

    #[test]
    fn a_deep_tank_has_room_for_a_crowd_that_a_flat_one_has_not() {
        let closeness = |depth_bl, n| Tank::new([0.0; 3], [12.0, 12.0, depth_bl]).closeness(n);
        for depth_bl in [0.0, 1.0, 14.4] {
            assert_eq!(closeness(depth_bl, 100), 1.0, "{depth_bl}");
        }
        for (depth_bl, wanted) in [(0.0, 0.316), (0.379, 0.316), (1.2, 0.464), (12.0, 1.0)] {
            let found = closeness(depth_bl, 1000);
            assert!((found - wanted).abs() < 1e-3, "{depth_bl}: {found}");
        }
    }

    proptest! {
        #[test]
        fn whoever_leaves_is_put_back_and_leads_out_no_more(
            p in prop::array::uniform3(-9.0..9.0f64), v in prop::array::uniform3(-3.0..3.0f64)
        ) {
            let tank = Tank::new([0.0; 3], [6.0, 4.0, 0.0]);
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
