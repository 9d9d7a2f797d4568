//! Costs of the places at which an individual shows its frames.
//!
//! The world of a flock is what the film shows: the area and the places where the animal was, how often it was
//! where, and what carried it. A place costs the more, the less the filmed animal would have been there. It
//! also costs to be in another animal or far from the boid.

use super::support::Support;
use crate::flock::boids::vector::dot;
use crate::flock::lens::Lens;
use crate::flock::placement::Placer;
use crate::library::{Library, View};

/// Distance below which another animal is too near, body lengths. Free choice.
pub(in crate::flock) const CLEAR_BL: f64 = 0.9;
/// Cost of a frame at the same place as another animal, from the side, where one may be behind the other, and from
/// above, radians. Free choices.
const COSTS_OF_OVERLAP: [f64; 2] = [1.0, 2.0];
/// Distance from the boid that costs nothing, body lengths, and cost of a frame for each body length beyond,
/// radians. Free choices.
const SLACK_BL: f64 = 1.0;
const COST_OF_GAP: f64 = 0.1;
/// Cost of a frame for each body length beyond a wall, radians. Free choice.
const COST_BEYOND: f64 = 4.0;
/// Distance beyond a wall at which an animal stops, body lengths. Free choice.
pub(super) const MAX_BEYOND_BL: f64 = 0.3;
/// Cost of a frame for each body length from the filmed place, radians, of an animal that is carried. Free
/// choice.
const COST_AWAY: f64 = 0.3;
/// Cost of a frame in which nothing carries an animal that should be carried, radians. Free choice.
const COST_OF_AIR: f64 = 6.0;
/// Distances from a ledge up to which it carries an animal well, and beyond which not at all, body lengths.
/// Free choices.
const ON_LEDGE_BL: [f64; 2] = [0.05, 0.25];
/// Side of a cell of the home range, and standard deviation of the kernel around each filmed place, body
/// lengths. Free choices.
const CELL_BL: f64 = 0.25;
const KERNEL_BL: f64 = 0.4;
/// Cost of a frame at a place where the animal was e times more seldom than at its favorite place, radians.
/// Free choice.
const COST_OF_RARITY: f64 = 0.03;
/// Least density of the home range, as a share of the greatest. Free choice.
const MIN_DENSITY: f64 = 0.002;

/// Home range: how often the filmed animal was where (a kernel estimate).
#[derive(Clone, Debug)]
pub(super) struct HomeRange {
    cell_px: f64,
    size: [usize; 2],
    /// Cost of each cell, radians, row by row.
    costs: Vec<f64>,
}

impl HomeRange {
    pub(super) fn new(library: &Library, lens: &Lens) -> HomeRange {
        let cell_px = CELL_BL * lens.length_px;
        let cells = |side: u32| (f64::from(side) / cell_px).ceil() as usize + 1;
        let [width, height] = library.poses.image_size_px.map(cells);
        let reach = 3.0 * KERNEL_BL / CELL_BL;
        let around = |at: f64, n: usize| {
            let first = ((at - reach).max(0.0) as usize).min(n);
            first..((at + reach) as usize + 1).clamp(first, n)
        };
        let mut density = vec![0.0f64; width * height];
        for [x, y] in library.places_px() {
            let [x, y] = [x, y].map(|px| px / cell_px - 0.5);
            for row in around(y, height) {
                for column in around(x, width) {
                    let square = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                    let spread = KERNEL_BL / CELL_BL;
                    density[row * width + column] += libm::exp(-0.5 * square / (spread * spread));
                }
            }
        }
        let most = density.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let cost = |density: &f64| -COST_OF_RARITY * libm::log((density / most).max(MIN_DENSITY));
        HomeRange {
            cell_px,
            size: [width, height],
            costs: density.iter().map(cost).collect(),
        }
    }

    /// Returns the cost of showing an animal at a place for a frame, radians.
    fn cost(&self, place_px: [f64; 2]) -> f64 {
        let [x, y] = [0, 1].map(|k| ((place_px[k] / self.cell_px) as usize).min(self.size[k] - 1));
        self.costs[y * self.size[0] + x]
    }
}

/// Half-plane of the image. A point p is inside if `outward . p <= offset`; all in body lengths of the depth.
#[derive(Clone, Copy, Debug)]
struct Edge {
    outward_per_px: [f64; 2],
    offset: f64,
}

/// Boid, walls and other animals near an individual at a frame.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    /// Position of the boid.
    pub(super) goal_px: [f64; 2],
    /// Walls at the depth of the boid.
    edges: Vec<Edge>,
    /// Positions of the animals nearby.
    near_px: Vec<[f64; 2]>,
}

/// Place of an individual, to be judged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) frame: u32,
    pub(super) centroid_px: [f64; 2],
    pub(super) scale: f64,
}

/// World of one individual.
pub(super) struct World<'a> {
    pub(super) placer: &'a Placer<'a>,
    pub(super) home_range: &'a HomeRange,
    /// Perches and floors that carry the animal; `None` if it swims or flies.
    pub(super) support: Option<&'a Support>,
    /// Distance to the right that an individual keeps from the filmed places if it is carried, pixels.
    pub(super) aside_px: f64,
    /// Factor on distances in a flock for which the tank is small.
    pub(super) radius_scale: f64,
}

impl World<'_> {
    /// Returns what lies around the boid at `goal_px` and `depth_bl` among other animals.
    pub(super) fn around(
        &self,
        goal_px: [f64; 2],
        depth_bl: f64,
        others: impl Iterator<Item = [f64; 2]>,
    ) -> Surroundings {
        let reach_px = (SLACK_BL + 2.0 * CLEAR_BL) * self.placer.lens.length_px;
        let is_near = |other: &[f64; 2]| (0..2).all(|k| (other[k] - goal_px[k]).abs() < reach_px);
        let lens = self.placer.lens;
        let [corner, right, down] =
            [[0.0; 2], [1.0, 0.0], [0.0, 1.0]].map(|px| lens.place_bl(px, depth_bl));
        let walls = self.placer.tank.walls().iter();
        let edges = walls.filter_map(|wall| {
            let along = |place| dot(wall.outward, place);
            let at_corner = along(corner);
            let outward_per_px = [along(right) - at_corner, along(down) - at_corner];
            let is_side = outward_per_px != [0.0; 2];
            is_side.then_some(Edge {
                outward_per_px,
                offset: wall.offset_bl - at_corner,
            })
        });
        Surroundings {
            goal_px,
            edges: edges.collect(),
            near_px: others.filter(is_near).collect(),
        }
    }

    /// Returns the cost of a place that is `beyond_bl` beyond the walls, radians.
    pub(super) fn cost(&self, place: Place, beyond_bl: f64, around: &Surroundings) -> f64 {
        let length_px = self.placer.lens.length_px;
        let [x, y] = place.centroid_px;
        let distance_bl = |[px, py]: [f64; 2]| (x - px).hypot(y - py) / length_px;
        let clear_bl = CLEAR_BL * self.radius_scale;
        let overlaps = around
            .near_px
            .iter()
            .map(|&other| (1.0 - distance_bl(other) / clear_bl).max(0.0));
        let own = match self.home_px(place.frame, place.scale) {
            Some(home) => COST_AWAY * distance_bl(home) + COST_OF_AIR * self.in_air(place),
            None => COST_OF_GAP * (distance_bl(around.goal_px) - SLACK_BL).max(0.0),
        };
        let is_top = self.placer.library.poses.view == View::Top;
        own + COSTS_OF_OVERLAP[usize::from(is_top)] * overlaps.sum::<f64>()
            + COST_BEYOND * beyond_bl.max(0.0)
            + self.home_range.cost(place.centroid_px)
    }

    /// Returns how far nothing carries an individual, 0..=1; 0 if the animal is not carried in its frame.
    fn in_air(&self, place: Place) -> f64 {
        let foot_px = self
            .support
            .and_then(|support| Some((support, support.foot_px(place.frame)?)));
        let Some((support, foot_px)) = foot_px else {
            return 0.0;
        };
        let [x, y] = place.centroid_px;
        let [dx, dy] = support.way_px([x, y + place.scale * foot_px]);
        let [well, not] = ON_LEDGE_BL.map(|bl| bl * self.placer.lens.length_px);
        ((dx.hypot(dy) - well) / (not - well)).clamp(0.0, 1.0)
    }

    /// Returns the cost of a frame in the air or beyond the walls in which an individual would end, if it
    /// went on for `ahead_s` after a place, radians.
    pub(super) fn cost_ahead(&self, end: Place, ahead_px: [f64; 2], around: &Surroundings) -> f64 {
        let Some(support) = self.support else {
            let place = [0, 1].map(|k| end.centroid_px[k] + ahead_px[k]);
            return COST_BEYOND * around.beyond_bl(place).max(0.0);
        };
        let frames = &self.placer.library.poses.frames;
        let landing = support.landing(end.frame);
        let landed = landing.and_then(|frame| {
            let [from, to] = [end.frame, frame].map(|frame| frames[frame as usize].centroid_px);
            let (from, to) = from.zip(to)?;
            let centroid_px = [0, 1].map(|k| end.centroid_px[k] + end.scale * (to[k] - from[k]));
            Some(Place {
                frame,
                centroid_px,
                ..end
            })
        });
        COST_OF_AIR * landed.map_or(0.0, |place| self.in_air(place))
    }

    /// Returns the place at which an individual that is carried shows a frame: the filmed one, moved sideways
    /// as far as the ledge goes on, with the foot at its height. `None` if the animal is not carried.
    pub(super) fn home_px(&self, frame: u32, scale: f64) -> Option<[f64; 2]> {
        let support = self.support?;
        let [x, y] = self.placer.library.poses.frames[frame as usize].centroid_px?;
        let x = x + self.aside_px;
        let Some(foot_px) = support.foot_px(frame) else {
            return Some([x, y]);
        };
        let [aside, down] = support.way_px([x, y + foot_px]);
        Some([x + aside, y + down + (1.0 - scale) * foot_px])
    }
}

impl Surroundings {
    /// Returns how far a place is beyond the walls, body lengths; negative inside.
    pub(super) fn beyond_bl(&self, [x, y]: [f64; 2]) -> f64 {
        let beyond =
            |edge: &Edge| edge.outward_per_px[0] * x + edge.outward_per_px[1] * y - edge.offset;
        self.edges
            .iter()
            .map(beyond)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::Params;
    use crate::flock::synthetic;

    #[test]
    fn the_home_range_costs_least_where_the_animal_was() {
        let mut library = synthetic::library(View::Top);
        for (k, pose) in library.poses.frames.iter_mut().enumerate() {
            // Most of the time on the left, sometimes on the right.
            let x = if k % 10 == 0 { 260.0 } else { 60.0 };
            pose.centroid_px = Some([x, 120.0]);
        }
        let lens = Lens::new(&library, &Params::default());
        let home_range = HomeRange::new(&library, &lens);
        let [often, seldom, never, outside] =
            [[60.0, 120.0], [260.0, 120.0], [160.0, 30.0], [-50.0, 9e4]]
                .map(|p| home_range.cost(p));
        assert!(often < 0.2 * COST_OF_RARITY, "{often}");
        let rarer = (seldom - often) / COST_OF_RARITY;
        assert!((rarer - libm::log(9.0)).abs() < 0.3, "{rarer}");
        assert!(never > seldom && outside >= never, "{never} {outside}");
    }
}
