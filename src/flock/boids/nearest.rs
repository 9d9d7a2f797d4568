//! Search for the nearest neighbors of a boid (docs/explanation/algorithms.md, "Boids"). It looks within a
//! guessed radius, and within larger ones while there are too few boids. The guess affects the speed, not the
//! result.
//!
//! Neighbors come nearest first, equal distances by id: an order that does not depend on the grid.

use super::grid::Grid;
use super::vector::{Vec3, dot, minus};

/// Greatest number of boids that are sorted by counts. Counting takes quadratic time, but has no branches that
/// are mispredicted. It affects the speed, not the result. Free choice.
const MOST_COUNTED: usize = 48;
/// Factor on a radius that held too few boids. Free choice.
const GROWTH: f64 = 1.25;
/// Least first radius, as a share of the reach, so that it can grow. Free choice.
const LEAST_GUESS: f64 = 1e-3;

/// A neighbor of a boid.
#[derive(Clone, Copy, Debug)]
pub struct Neighbor {
    /// Vector from the boid to the neighbor, body lengths.
    pub offset: Vec3,
    /// |offset|^2
    pub square_bl2: f64,
    /// Velocity of the neighbor, body lengths per second.
    pub velocity: Vec3,
}

/// Extent of a search.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Greatest number of neighbors.
    pub limit: usize,
    /// Distance that all neighbors are nearer than, body lengths.
    pub reach_bl: f64,
    /// Radius that holds about `limit` boids or a few more, body lengths.
    pub guess_bl: f64,
}

/// Searches for neighbors, one after another, in the same memory.
#[derive(Clone, Debug, Default)]
pub struct Search {
    near: Vec<Near>,
    /// Distances of `near`, body lengths squared.
    squares_bl2: Vec<f64>,
    /// `near` in order.
    sorted: Vec<Near>,
    neighbors: Vec<Neighbor>,
}

/// A boid within the radius.
#[derive(Clone, Copy, Debug, Default)]
struct Near {
    square_bl2: f64,
    slot: u32,
}

impl Search {
    /// Returns the nearest neighbors of the boid at `slot`, nearest first.
    pub fn nearest(&mut self, grid: &Grid, slot: usize, extent: Extent) -> &[Neighbor] {
        let reach_bl = extent.reach_bl;
        let mut radius_bl = extent.guess_bl.clamp(LEAST_GUESS * reach_bl, reach_bl);
        self.gather(grid, slot, radius_bl);
        while self.near.len() < extent.limit && radius_bl < reach_bl {
            radius_bl = (GROWTH * radius_bl).min(reach_bl);
            self.gather(grid, slot, radius_bl);
        }
        if self.near.len() > MOST_COUNTED || !self.sort_by_counts() {
            self.sort_by_comparisons(grid);
        }
        self.sorted.truncate(extent.limit);
        let place = grid.at(slot).position;
        self.neighbors.clear();
        for near in &self.sorted {
            let other = grid.at(near.slot as usize);
            self.neighbors.push(Neighbor {
                offset: minus(other.position, place),
                square_bl2: near.square_bl2,
                velocity: other.velocity,
            });
        }
        &self.neighbors
    }

    /// Finds all boids nearer than `radius_bl` to the one at `slot`, in no particular order.
    fn gather(&mut self, grid: &Grid, slot: usize, radius_bl: f64) {
        let place = grid.at(slot).position;
        let most_bl2 = radius_bl * radius_bl;
        let mut n = 0;
        for (from, to) in grid.rows(place, radius_bl) {
            self.near.resize(n + to - from, Near::default());
            for (other, boid) in (from..to).zip(&grid.boids()[from..to]) {
                let offset = minus(boid.position, place);
                let square_bl2 = dot(offset, offset);
                // A branch on the distance would often be mispredicted.
                self.near[n] = Near {
                    square_bl2,
                    slot: other as u32,
                };
                n += usize::from((square_bl2 < most_bl2) & (other != slot));
            }
        }
        self.near.truncate(n);
    }

    /// Sorts the boids found: the number of nearer ones is the index of a boid. Returns false if distances
    /// are equal, and leaves the order undefined.
    fn sort_by_counts(&mut self) -> bool {
        let n = self.near.len();
        self.squares_bl2.clear();
        (self.squares_bl2).extend(self.near.iter().map(|near| near.square_bl2));
        self.sorted.resize(n, Near::default());
        let mut sum = 0;
        for &near in &self.near {
            let is_nearer = |&other: &f64| u64::from(other < near.square_bl2);
            let rank = self.squares_bl2.iter().map(is_nearer).sum::<u64>() as usize;
            self.sorted[rank] = near;
            sum += rank;
        }
        2 * sum == n * n.saturating_sub(1)
    }

    /// Sorts the boids found, those at equal distances by id.
    fn sort_by_comparisons(&mut self, grid: &Grid) {
        let id = |near: &Near| grid.at(near.slot as usize).id;
        self.sorted.clone_from(&self.near);
        self.sorted.sort_unstable_by(|a, b| {
            let by_distance = a.square_bl2.total_cmp(&b.square_bl2);
            by_distance.then_with(|| id(a).cmp(&id(b)))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::boids::grid::Boid;
    use proptest::prelude::*;

    /// Id, squared distance and velocity of a neighbor.
    type Found = (u32, f64, Vec3);

    fn all_by_brute_force(positions: &[Vec3], id: u32, extent: Extent) -> Vec<Found> {
        let mut all: Vec<Found> = (0u32..)
            .zip(positions)
            .map(|(other, &p)| {
                let offset = minus(p, positions[id as usize]);
                (other, dot(offset, offset), p.map(|x| 2.0 * x))
            })
            .filter(|n| n.0 != id && n.1 < extent.reach_bl * extent.reach_bl)
            .collect();
        all.sort_by(|a, b| (a.1, a.0).partial_cmp(&(b.1, b.0)).unwrap());
        all.truncate(extent.limit);
        all
    }

    proptest! {
        #[test]
        fn grid_search_equals_brute_force_for_any_guess(
            positions in prop::collection::vec((0.0..30.0f64, 0.0..12.0f64, 0.0..5.0f64), 1..160),
            reach_bl in 0.3..12.0f64, limit in 1usize..60,
            guess_bl in prop_oneof![Just(0.0), 0.1..12.0f64],
            flat in any::<bool>(), whole in any::<bool>()
        ) {
            // Whole numbers give equal distances.
            let at = |x: f64| if whole { x.floor() } else { x };
            let positions: Vec<Vec3> = positions
                .iter()
                .map(|&(x, y, z)| [at(x), at(y), if flat { 0.0 } else { at(z) }])
                .collect();
            let boids: Vec<Boid> = (0..)
                .zip(&positions)
                .map(|(id, &position)| Boid { position, velocity: position.map(|x| 2.0 * x), id })
                .collect();
            let mut grid = Grid::default();
            grid.sort(&boids, reach_bl);
            let extent = Extent { limit, reach_bl, guess_bl };
            let mut search = Search::default();
            for (id, &slot) in (0..).zip(grid.slots()) {
                let neighbors = search.nearest(&grid, slot as usize, extent).to_vec();
                let ids = search.sorted.iter().map(|near| grid.at(near.slot as usize).id);
                let found: Vec<Found> =
                    ids.zip(neighbors).map(|(id, n)| (id, n.square_bl2, n.velocity)).collect();
                prop_assert_eq!(found, all_by_brute_force(&positions, id, extent));
            }
        }
    }
}
