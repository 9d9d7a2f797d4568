//! The nearest neighbors of a boid (ALGORITHMS.md 7): whoever is within a guessed radius, and only if those are too
//! few within a greater one. The guess decides how long it takes and never what is found.
//!
//! Neighbors come nearest first, equal distances by id: an order that does not depend on the grid.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod scalar;

use super::grid::{BLOCK, Grid};
use super::vector::{Vec3, minus};
use crate::cpu::Level;

/// So many are put in order by counting who is nearer, which knows no branch; more are sorted.
const MOST_COUNTED: usize = 48;
/// By how much a guess that was too small grows.
const GROWTH: f64 = 1.25;

/// A boid near another.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Neighbor {
    /// Its number.
    pub id: u32,
    /// From the one who looks to it, body lengths.
    pub offset: Vec3,
    /// |offset|^2.
    pub square_bl2: f64,
    /// Its velocity, body lengths a second.
    pub velocity: Vec3,
}

/// A search, with its memory.
#[derive(Clone, Debug, Default)]
pub struct Search {
    near: Near,
    order: Vec<u32>,
    found: Vec<Neighbor>,
}

/// Whoever is within the radius: the first `n` of all three.
#[derive(Clone, Debug, Default)]
struct Near {
    n: usize,
    squares_bl2: Vec<f64>,
    slots: Vec<u64>,
    /// How many are nearer.
    ranks: Vec<u64>,
}

impl Near {
    /// So many can be added, and a block more be written.
    #[inline(always)]
    fn make_room(&mut self, more: usize) {
        let least = (self.n + more + BLOCK).max(MOST_COUNTED);
        if self.slots.len() < least {
            self.squares_bl2.resize(2 * least, 0.0);
            self.slots.resize(2 * least, 0);
            self.ranks.resize(2 * least, 0);
        }
    }
}

impl Search {
    /// The `limit` nearest others within `reach_bl` of whoever stands at `slot`, nearest first. `guess_bl`: within
    /// it there are about so many, or a little more. `cpu` decides how fast it goes.
    #[inline(always)]
    pub fn nearest(
        &mut self,
        (grid, slot): (&Grid, usize),
        (limit, reach_bl): (usize, f64),
        guess_bl: f64,
        cpu: Level,
    ) -> &[Neighbor] {
        let mut radius_bl = guess_bl.min(reach_bl);
        loop {
            gather(cpu, grid, (slot, radius_bl), &mut self.near);
            if self.near.n >= limit || radius_bl >= reach_bl {
                break;
            }
            radius_bl = (GROWTH * radius_bl).min(reach_bl);
        }
        let n = self.near.n;
        if self.found.len() < limit.max(MOST_COUNTED) {
            (self.found).resize(limit.max(MOST_COUNTED), Neighbor::default());
        }
        let place = grid.at(slot).position;
        if n > MOST_COUNTED || !self.find_by_rank(grid, place, cpu) {
            self.find_by_order(grid, place, limit);
        }
        &self.found[..n.min(limit)]
    }

    /// Each one at the place that its rank is; false when some are equally far, so that the ranks are too few.
    #[inline(always)]
    fn find_by_rank(&mut self, grid: &Grid, place: Vec3, cpu: Level) -> bool {
        let n = self.near.n;
        self.near.make_room(0);
        rank(cpu, &mut self.near);
        let (near, found) = (&self.near, &mut self.found[..]);
        let all = near.squares_bl2.iter().zip(&near.slots).zip(&near.ranks);
        let mut sum = 0;
        for ((&square_bl2, &slot), &rank) in all.take(n) {
            found[rank as usize].set(grid, place, (square_bl2, slot));
            sum += rank as usize;
        }
        2 * sum == n * n.saturating_sub(1)
    }

    /// Sorted, equally far ones by id.
    fn find_by_order(&mut self, grid: &Grid, place: Vec3, limit: usize) {
        let (order, near) = (&mut self.order, &self.near);
        order.clear();
        order.extend(0..near.n as u32);
        order.sort_unstable_by(|&a, &b| {
            let id = |at: u32| grid.at(near.slots[at as usize] as usize).id;
            let [nearer, farther] = [a, b].map(|at| near.squares_bl2[at as usize]);
            nearer.total_cmp(&farther).then_with(|| id(a).cmp(&id(b)))
        });
        for (found, &at) in self.found.iter_mut().zip(order.iter().take(limit)) {
            let at = at as usize;
            found.set(grid, place, (near.squares_bl2[at], near.slots[at]));
        }
    }
}

impl Neighbor {
    /// Whoever stands at a slot, seen from a place.
    #[inline(always)]
    fn set(&mut self, grid: &Grid, place: Vec3, (square_bl2, slot): (f64, u64)) {
        let other = grid.at(slot as usize);
        self.id = other.id;
        self.offset = minus(other.position, place);
        self.square_bl2 = square_bl2;
        self.velocity = other.velocity;
    }
}

/// All others nearer than `radius_bl` to whoever stands at `slot`; whoever was gathered before is forgotten.
#[inline(always)]
fn gather(cpu: Level, grid: &Grid, (slot, radius_bl): (usize, f64), near: &mut Near) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => avx2::gather(grid, (slot, radius_bl), near),
        _ => scalar::gather(grid, (slot, radius_bl), near),
    }
}

/// The ranks of at most `MOST_COUNTED`.
#[inline(always)]
fn rank(cpu: Level, near: &mut Near) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => avx2::rank(near),
        _ => scalar::rank(near),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::boids::grid::Boid;
    use crate::flock::boids::vector::dot;
    use proptest::prelude::*;

    fn all_by_brute_force(
        positions: &[Vec3],
        id: u32,
        (limit, reach): (usize, f64),
    ) -> Vec<Neighbor> {
        let mut all: Vec<Neighbor> = (0u32..)
            .zip(positions)
            .map(|(other, &p)| {
                let offset = minus(p, positions[id as usize]);
                Neighbor {
                    id: other,
                    offset,
                    square_bl2: dot(offset, offset),
                    velocity: p.map(|x| 2.0 * x),
                }
            })
            .filter(|n| n.id != id && n.square_bl2 < reach * reach)
            .collect();
        all.sort_by(|a, b| {
            (a.square_bl2, a.id)
                .partial_cmp(&(b.square_bl2, b.id))
                .unwrap()
        });
        all.truncate(limit);
        all
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_comparing_all_pairs_finds_whatever_was_guessed(
            positions in prop::collection::vec((0.0..30.0f64, 0.0..12.0f64, 0.0..5.0f64), 1..160),
            reach in 0.3..12.0f64, limit in 1usize..60, guess in 0.1..12.0f64,
            flat in any::<bool>(), whole in any::<bool>()
        ) {
            // Whole numbers are often equally far.
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
            grid.sort(&boids, reach);
            let mut search = Search::default();
            for (id, &slot) in (0..).zip(grid.slots()) {
                let all = all_by_brute_force(&positions, id, (limit, reach));
                for cpu in Level::available() {
                    let near = (&grid, slot as usize);
                    let found = search.nearest(near, (limit, reach), guess, cpu);
                    prop_assert_eq!(found, &all[..], "{:?}", cpu);
                }
            }
        }
    }
}
