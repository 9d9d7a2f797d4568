//! Where the flock may go: half-spaces, seen in the picture as lines, and in side view a depth
//! (ALGORITHMS.md 7). All in body lengths. Inside the tank always.

use super::vector::{Vec3, add_scaled, dot, minus, norm, scaled};
use crate::flock::lens::Lens;
use crate::flock::motion::FrameMotion;
use crate::flock::params::{Params, TankExtent};
use crate::library::{Library, Pose, View};

/// Directions in which the seen area is bounded.
const N_SIDES: usize = 16;
/// A flock without room gets it farther out until the tank is this share of the picture. From above, what
/// bounds the animal is mostly a wall; from the side, mostly its whim.
const MOST_OF_ARENA: f64 = 0.35;
const MOST_OF_TANK: f64 = 0.7;
/// By so much at a time.
const FARTHER_BL: f64 = 0.25;
/// The side of the square that a boid needs to keep the usual distances.
const ROOM_BL: f64 = 1.2;
/// Between a body and a wall.
const CLEARANCE_BL: f64 = 0.05;
/// How deep a tank is whose depth is not asked for: as deep as the animal was seen to be, within these.
const DEPTHS_BL: [f64; 2] = [1.0, 6.0];
/// Share of the frames, and of the bodies, that what was seen leaves out at either end.
const OUTLIERS: f64 = 0.01;
/// Points a side by which the tank's section is measured.
const N_SAMPLES: usize = 48;

/// A convex tank.
#[derive(Clone, Debug, PartialEq)]
pub struct Tank {
    walls: Vec<Wall>,
    /// The box around it: least and greatest corner.
    pub corners: [Vec3; 2],
    /// A place well inside.
    pub middle: Vec3,
    /// How far it reaches from there, about: half its width, height and depth.
    pub reach_bl: Vec3,
    section_bl2: f64,
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
    /// The tank of a library: where the animal was seen, as deep as it was seen to be. Where a flock has no room
    /// there, it reaches farther, but not beyond where the animal is wholly in the picture.
    pub fn of(library: &Library, lens: &Lens, motion: &[FrameMotion], params: &Params) -> Tank {
        let [w, h] = library.poses.image_size_px.map(f64::from);
        let site = Site {
            lens,
            body: Body::of(library, lens.length_px),
            size_px: [w, h],
            depths_bl: depths(library, lens, motion, params),
        };
        let seen = match params.tank {
            TankExtent::Seen => seen_lines(library),
            TankExtent::Picture => Vec::new(),
        };
        if seen.is_empty() {
            return site.tank(&[]);
        }
        let most_px2 = w
            * h
            * if library.poses.view == View::Top {
                MOST_OF_ARENA
            } else {
                MOST_OF_TANK
            };
        let mut farther_px = 0.0;
        loop {
            let lines: Vec<Line> = seen.iter().map(|&(u, px)| (u, px + farther_px)).collect();
            let tank = site.tank(&lines);
            let has_room = tank.closeness(params.count as usize) >= 1.0;
            if has_room || area(&lines) >= most_px2 || farther_px > w + h {
                return tank;
            }
            farther_px += FARTHER_BL * lens.length_px;
        }
    }

    /// A box; flat when it has no depth.
    pub fn new(least: Vec3, greatest: Vec3) -> Tank {
        Tank::within([least, greatest], Vec::new())
    }

    /// A box, cut by further walls; there must be something left.
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

    /// The middle of the places inside at half its depth, how far they reach, and their area.
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
        self.middle = match n > 0.0 {
            true => scaled(1.0 / n, sum),
            false => [at(0, N_SAMPLES / 2), at(1, N_SAMPLES / 2), depth],
        };
        // The half of a span is the root of three times its variance.
        let half = |axis: usize| {
            let variance = squares[axis] / f64::max(n, 1.0) - self.middle[axis] * self.middle[axis];
            (3.0 * variance.max(0.0)).sqrt()
        };
        self.reach_bl = [half(0), half(1), 0.5 * (greatest[2] - least[2])];
    }

    /// Whether it has no depth: everything happens in the picture's plane.
    pub fn is_flat(&self) -> bool {
        self.corners[1][2] <= self.corners[0][2]
    }

    /// The axis about which boids turn: out of the picture when flat, the vertical otherwise.
    pub fn up(&self) -> Vec3 {
        match self.is_flat() {
            true => [0.0, 0.0, 1.0],
            false => [0.0, 1.0, 0.0],
        }
    }

    /// The share of the usual distances at which `n` boids fit in: 1 with room for all, less where
    /// each has less than a square of `ROOM_BL` in the picture.
    pub fn closeness(&self, n: usize) -> f64 {
        ((self.section_bl2 / n as f64).sqrt() / ROOM_BL).clamp(0.05, 1.0)
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
        // A few rounds settle most corners.
        for _ in 0..3 {
            for wall in &self.walls {
                let beyond = dot(wall.outward, *position) - wall.offset_bl;
                if beyond > 0.0 {
                    let outward_speed = dot(wall.outward, *velocity).max(0.0);
                    *position = add_scaled(*position, -beyond, wall.outward);
                    *velocity = add_scaled(*velocity, -2.0 * outward_speed, wall.outward);
                    met = true;
                }
            }
        }
        if met {
            *position = self.on_the_way(self.middle, *position);
        }
        met
    }

    /// As far on the way from a place inside to another as the tank goes: it is convex.
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
        match share < 1.0 {
            true => add_scaled(from, share, way),
            false => to,
        }
    }

    /// Whether a position lies inside, to rounding.
    pub fn holds(&self, position: Vec3) -> bool {
        let beyond = |wall: &Wall| dot(wall.outward, position) - wall.offset_bl;
        self.walls.iter().all(|wall| beyond(wall) < 1e-9)
    }

    /// The walls that steer: a flat tank has no front and back.
    fn upright_walls(&self) -> impl Iterator<Item = &Wall> {
        let flat = self.is_flat();
        self.walls
            .iter()
            .filter(move |wall| !flat || wall.outward[2] == 0.0)
    }
}

/// A unit vector in the picture and how far it may be gone along it from the picture's corner, pixels.
type Line = ([f64; 2], f64);

/// What tanks of one library have in common.
struct Site<'a> {
    lens: &'a Lens,
    body: Body,
    size_px: [f64; 2],
    depths_bl: [f64; 2],
}

impl Site<'_> {
    /// The tank in which bodies stay within the picture and these lines.
    fn tank(&self, lines: &[Line]) -> Tank {
        let [w, h] = self.size_px;
        let picture = [
            ([1.0, 0.0], w),
            ([0.0, 1.0], h),
            ([-1.0, 0.0], 0.0),
            ([0.0, -1.0], 0.0),
        ];
        let walls = self.walls(&picture).chain(self.walls(lines)).collect();
        let places = self
            .depths_bl
            .map(|z| [[0.0, 0.0], [w, h]].map(|px| self.lens.place_bl(px, z)));
        let extreme = |axis: usize, of: fn(f64, f64) -> f64| {
            places
                .iter()
                .flatten()
                .map(|p| p[axis])
                .reduce(of)
                .unwrap_or(0.0)
        };
        let corners = [f64::min, f64::max].map(|of| std::array::from_fn(|axis| extreme(axis, of)));
        Tank::within(corners, walls)
    }

    /// A body's margin within lines, each of which has its opposite half the way round; never more than
    /// a third of the way between them.
    fn walls(&self, lines: &[Line]) -> impl Iterator<Item = Wall> {
        let px_per_bl = self.lens.px_per_bl(self.depths_bl[0]);
        (0..lines.len()).map(move |k| {
            let (outward, offset_px) = lines[k];
            let opposite_px = lines[(k + lines.len() / 2) % lines.len()].1;
            let across_bl = (offset_px + opposite_px) / px_per_bl;
            let margin_bl = self.body.margin_bl(outward).min(across_bl / 3.0);
            self.lens.wall(outward, offset_px, margin_bl)
        })
    }
}

/// How far a body reaches from its centroid.
struct Body {
    view: View,
    half_height_bl: f64,
}

impl Body {
    fn of(library: &Library, length_px: f64) -> Body {
        let heights = library
            .poses
            .frames
            .iter()
            .filter_map(|pose| pose.height_px);
        let median_px = quantile(heights.collect(), 0.5).unwrap_or(length_px);
        Body {
            view: library.poses.view,
            half_height_bl: 0.5 * (median_px / length_px).min(1.0),
        }
    }

    /// What it needs between its centroid and a wall: in top view it may point to any, in side view it is level.
    fn margin_bl(&self, outward: [f64; 2]) -> f64 {
        let reach = match self.view {
            View::Top => 0.5,
            View::Side => norm([0.5 * outward[0], self.half_height_bl * outward[1], 0.0]),
        };
        reach + CLEARANCE_BL
    }
}

/// The nearest and the farthest place, from the camera; nowhere when the lens is flat.
fn depths(library: &Library, lens: &Lens, motion: &[FrameMotion], params: &Params) -> [f64; 2] {
    if lens.is_flat() {
        return [0.0; 2];
    }
    let seen = || {
        let shown = library.playback.component.iter();
        shown
            .map(|&frame| motion[frame as usize].depth_bl)
            .collect()
    };
    let at = |share: f64| quantile(seen(), share).unwrap_or(0.0);
    let (near, far) = (at(OUTLIERS), at(1.0 - OUTLIERS));
    let depth = params
        .depth_bl
        .unwrap_or((far - near).clamp(DEPTHS_BL[0], DEPTHS_BL[1]));
    // Never so near that a body fills the picture.
    let least = lens.depth_at_bl(1.5 * lens.length_px);
    let nearest = (0.5 * (near + far - depth)).max(least);
    [nearest, nearest + depth]
}

/// The outer polygon of the bodies seen; empty when there are none.
fn seen_lines(library: &Library) -> Vec<Line> {
    (0..N_SIDES)
        .filter_map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / N_SIDES as f64;
            let outward = [libm::cos(angle), libm::sin(angle)];
            let bodies = library
                .poses
                .frames
                .iter()
                .filter_map(|pose| reach_px(pose, outward));
            Some((outward, quantile(bodies.collect(), 1.0 - OUTLIERS)?))
        })
        .collect()
}

/// How far a body reaches in a direction: an ellipse of its length and height.
fn reach_px(pose: &Pose, outward: [f64; 2]) -> Option<f64> {
    let [x, y] = pose.centroid_px?;
    let axis = pose.heading_rad?;
    let (cos, sin) = (libm::cos(axis), libm::sin(axis));
    let along = 0.5 * pose.length_px? * (outward[0] * cos + outward[1] * sin);
    let across = 0.5 * pose.height_px? * (outward[1] * cos - outward[0] * sin);
    Some(outward[0] * x + outward[1] * y + along.hypot(across))
}

/// The area within lines of rising angle, by their corners.
fn area(lines: &[Line]) -> f64 {
    let corner = |k: usize| {
        let (a, b) = (&lines[k], &lines[(k + 1) % lines.len()]);
        let cross = a.0[0] * b.0[1] - a.0[1] * b.0[0];
        [
            (a.1 * b.0[1] - b.1 * a.0[1]) / cross,
            (b.1 * a.0[0] - a.1 * b.0[0]) / cross,
        ]
    };
    (0..lines.len())
        .map(|k| {
            let (p, q) = (corner(k), corner((k + 1) % lines.len()));
            0.5 * (p[0] * q[1] - q[0] * p[1])
        })
        .sum()
}

fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let rank = values.len().saturating_sub(1) as f64 * share;
    values.get(rank.round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_square_of_walls_has_the_area_of_a_square() {
        let lines = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].map(|u| (u, 2.0));
        assert!((area(&lines) - 16.0).abs() < 1e-12);
    }

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
