//! Search for the nearest neighbors of a boid (docs/explanation/algorithms.md, "Boids"). It looks within a
//! guessed radius, and within larger ones while there are too few boids. The guess affects the speed, not the
//! result.
//!
//! Neighbors come nearest first, equal distances by id: an order that does not depend on the grid.

use super::grid::Grid;
use super::vector::{Vec3, dot, minus};

/// Greatest number of boids that are sorted by counts. Counting takes quadratic time, but has no branches that
/// are mispredicted. It affects the speed, not the result. Free choice.
const MAX_COUNTED: usize = 48;
/// Factor on a radius that held too few boids. Free choice.
const RADIUS_GROWTH: f64 = 1.25;
/// Least first radius, as a share of the reach, so that it can grow. Free choice.
const MIN_GUESS_SHARE: f64 = 1e-3;

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
pub struct Query {
    /// Greatest number of neighbors.
    pub max_neighbors: usize,
    /// Distance that all neighbors are nearer than, body lengths.
    pub reach_bl: f64,
    /// Radius that holds about `max_neighbors` boids or a few more, body lengths.
    pub guess_bl: f64,
}

/// Searches for neighbors, one after another, in the same memory.
#[derive(Clone, Debug, Default)]
pub struct Search {
    candidates: Vec<Candidate>,
    /// Distances of `candidates`, body lengths squared.
    squares_bl2: Vec<f64>,
    /// `candidates` in order.
    sorted: Vec<Candidate>,
    neighbors: Vec<Neighbor>,
}

/// A boid within the radius.
#[derive(Clone, Copy, Debug, Default)]
struct Candidate {
    square_bl2: f64,
    slot: u32,
}

impl Search {
    /// Returns the nearest neighbors of the boid at `slot`, nearest first.
    pub fn nearest(&mut self, grid: &Grid, slot: usize, query: Query) -> &[Neighbor] {
        let reach_bl = query.reach_bl;
        let mut radius_bl = query.guess_bl.clamp(MIN_GUESS_SHARE * reach_bl, reach_bl);
        self.gather(grid, slot, radius_bl);
        while self.candidates.len() < query.max_neighbors && radius_bl < reach_bl {
            radius_bl = (RADIUS_GROWTH * radius_bl).min(reach_bl);
            self.gather(grid, slot, radius_bl);
        }
        if self.candidates.len() > MAX_COUNTED || !self.sort_by_counts() {
            self.sort_by_comparisons(grid);
        }
        self.sorted.truncate(query.max_neighbors);
        let position = grid.at(slot).position;
        self.neighbors.clear();
        self.neighbors.extend(self.sorted.iter().map(|candidate| {
            let other = grid.at(candidate.slot as usize);
            Neighbor {
                offset: minus(other.position, position),
                square_bl2: candidate.square_bl2,
                velocity: other.velocity,
            }
        }));
        &self.neighbors
    }

    /// Finds all boids nearer than `radius_bl` to the one at `slot`, in no particular order.
    fn gather(&mut self, grid: &Grid, slot: usize, radius_bl: f64) {
        let position = grid.at(slot).position;
        let radius_bl2 = radius_bl * radius_bl;
        let mut n = 0;
        grid.for_each_row(position, radius_bl, |slots| {
            self.candidates
                .resize(n + slots.len(), Candidate::default());
            for (other, boid) in slots.clone().zip(&grid.boids[slots]) {
                let offset = minus(boid.position, position);
                let square_bl2 = dot(offset, offset);
                // A branch on the distance would often be mispredicted.
                self.candidates[n] = Candidate {
                    square_bl2,
                    slot: other as u32,
                };
                n += usize::from((square_bl2 < radius_bl2) & (other != slot));
            }
        });
        self.candidates.truncate(n);
    }

    /// Sorts the boids found: the number of nearer ones is the index of a boid. Returns false if distances
    /// are equal, and leaves the order undefined.
    fn sort_by_counts(&mut self) -> bool {
        let n = self.candidates.len();
        self.squares_bl2.clear();
        (self.squares_bl2).extend(self.candidates.iter().map(|candidate| candidate.square_bl2));
        self.sorted.resize(n, Candidate::default());
        let mut sum = 0;
        for &candidate in &self.candidates {
            let is_nearer = |&other: &f64| u64::from(other < candidate.square_bl2);
            let rank = self.squares_bl2.iter().map(is_nearer).sum::<u64>() as usize;
            self.sorted[rank] = candidate;
            sum += rank;
        }
        2 * sum == n * n.saturating_sub(1)
    }

    /// Sorts the boids found, those at equal distances by id.
    fn sort_by_comparisons(&mut self, grid: &Grid) {
        let id = |candidate: &Candidate| grid.at(candidate.slot as usize).id;
        self.sorted.clone_from(&self.candidates);
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

    fn all_by_brute_force(positions: &[Vec3], id: u32, query: Query) -> Vec<Found> {
        let mut all: Vec<Found> = (0u32..)
            .zip(positions)
            .map(|(other, &p)| {
                let offset = minus(p, positions[id as usize]);
                (other, dot(offset, offset), p.map(|x| 2.0 * x))
            })
            .filter(|n| n.0 != id && n.1 < query.reach_bl * query.reach_bl)
            .collect();
        all.sort_by(|a, b| (a.1, a.0).partial_cmp(&(b.1, b.0)).unwrap());
        all.truncate(query.max_neighbors);
        all
    }

    proptest! {
        #[test]
        fn grid_search_equals_brute_force_for_any_guess(
            positions in prop::collection::vec((0.0..30.0f64, 0.0..12.0f64, 0.0..5.0f64), 1..160),
            reach_bl in 0.3..12.0f64, max_neighbors in 1usize..60,
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
            let query = Query { max_neighbors, reach_bl, guess_bl };
            let mut search = Search::default();
            for (id, &slot) in (0..).zip(&grid.slots) {
                let neighbors = search.nearest(&grid, slot as usize, query).to_vec();
                let ids = search.sorted.iter().map(|candidate| grid.at(candidate.slot as usize).id);
                let found: Vec<Found> =
                    ids.zip(neighbors).map(|(id, n)| (id, n.square_bl2, n.velocity)).collect();
                prop_assert_eq!(found, all_by_brute_force(&positions, id, query));
            }
        }
    }
}
