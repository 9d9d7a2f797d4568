//! The nearest neighbors of a boid (ALGORITHMS.md 7): whoever is within a guessed radius, and only if those are too
//! few within a greater one. The guess decides how long it takes and never what is found.
//!
//! Neighbors come nearest first, equal distances by id: an order that does not depend on the grid.

use super::grid::{BLOCK, Grid};
use super::vector::{Vec3, dot, minus};

/// So many are put in order by counting who is nearer, which knows no branch; more are sorted.
const MOST_COUNTED: usize = 48;
/// By how much a guess that was too small grows.
const GROWTH: f64 = 1.25;

/// A boid near another.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Squared distances of whoever is within the radius, and where they stand.
    squares_bl2: Vec<f64>,
    slots: Vec<u32>,
    order: Vec<u32>,
    found: Vec<Neighbor>,
}

impl Search {
    /// The `limit` nearest others within `reach_bl` of whoever stands at `slot`, nearest first. `guess_bl`: within
    /// it there are about so many, or a little more.
    #[inline(always)]
    pub fn nearest(
        &mut self,
        grid: &Grid,
        slot: usize,
        (limit, reach_bl): (usize, f64),
        guess_bl: f64,
    ) -> &[Neighbor] {
        let place = grid.at(slot).position;
        let mut radius_bl = guess_bl.min(reach_bl);
        let n = loop {
            let n = match grid.is_flat() {
                true => self.gather::<true>(grid, slot, place, radius_bl),
                false => self.gather::<false>(grid, slot, place, radius_bl),
            };
            if n >= limit || radius_bl >= reach_bl {
                break n;
            }
            radius_bl = (GROWTH * radius_bl).min(reach_bl);
        };
        self.put_in_order(grid, n);
        self.found.clear();
        for &at in &self.order[..n.min(limit)] {
            let other = grid.at(self.slots[at as usize] as usize);
            self.found.push(Neighbor {
                id: other.id,
                offset: minus(other.position, place),
                square_bl2: self.squares_bl2[at as usize],
                velocity: other.velocity,
            });
        }
        &self.found
    }

    /// All others nearer than `radius_bl`: how many.
    #[inline(always)]
    fn gather<const FLAT: bool>(
        &mut self,
        grid: &Grid,
        slot: usize,
        place: Vec3,
        radius_bl: f64,
    ) -> usize {
        let most_bl2 = radius_bl * radius_bl;
        let mut n = 0;
        for (from, to) in grid.rows(place, radius_bl) {
            if self.slots.len() < n + to - from + BLOCK {
                self.slots.resize(2 * (n + to - from + BLOCK), 0);
                self.squares_bl2.resize(self.slots.len(), 0.0);
            }
            let (x, _) = grid.along(0)[from..].as_chunks::<BLOCK>();
            let (y, _) = grid.along(1)[from..].as_chunks::<BLOCK>();
            let (z, _) = grid.along(2)[from..].as_chunks::<BLOCK>();
            let (mut k, mut at) = (n, from);
            for ((x, y), z) in x.iter().zip(y).zip(z) {
                if at >= to {
                    break;
                }
                let mut squares = [0.0; BLOCK];
                for lane in 0..BLOCK {
                    let depth = if FLAT { 0.0 } else { z[lane] - place[2] };
                    let offset = [x[lane] - place[0], y[lane] - place[1], depth];
                    squares[lane] = dot(offset, offset);
                }
                let (kept, slots) = (&mut self.squares_bl2[..], &mut self.slots[..]);
                for (lane, square_bl2) in squares.into_iter().enumerate() {
                    // Written in any case, kept when near: nothing to be guessed wrong.
                    (kept[k], slots[k]) = (square_bl2, (at + lane) as u32);
                    let is_near = (square_bl2 < most_bl2) & (at + lane != slot);
                    k += usize::from(is_near & (at + lane < to));
                }
                at += BLOCK;
            }
            n = k;
        }
        n
    }

    /// `order`: the first `n` gathered by distance, equal ones by id.
    #[inline(always)]
    fn put_in_order(&mut self, grid: &Grid, n: usize) {
        self.order.clear();
        if n <= MOST_COUNTED && self.count_nearer(n) {
            return;
        }
        self.order.clear();
        self.order.extend(0..n as u32);
        let (squares, slots, ids) = (&self.squares_bl2, &self.slots, grid.by_cell());
        self.order.sort_unstable_by(|&a, &b| {
            let id = |at: u32| ids[slots[at as usize] as usize];
            let [near, far] = [a, b].map(|at| squares[at as usize]);
            near.total_cmp(&far).then_with(|| id(a).cmp(&id(b)))
        });
    }

    /// Each one's place is the number of those nearer; false when some are equally far.
    #[inline(always)]
    fn count_nearer(&mut self, n: usize) -> bool {
        const NOBODY: u32 = u32::MAX;
        let n_padded = n.next_multiple_of(BLOCK);
        if self.squares_bl2.len() < n_padded {
            return n == 0;
        }
        self.squares_bl2[n..n_padded].fill(f64::INFINITY);
        self.order.resize(n, NOBODY);
        let (chunks, _) = self.squares_bl2[..n_padded].as_chunks::<BLOCK>();
        for (at, &square) in (0..).zip(&self.squares_bl2[..n]) {
            let mut nearer = [0.0; BLOCK];
            for chunk in chunks {
                for lane in 0..BLOCK {
                    nearer[lane] += if chunk[lane] < square { 1.0 } else { 0.0 };
                }
            }
            let nearer = (nearer[0] + nearer[1]) + (nearer[2] + nearer[3]);
            self.order[small_whole(nearer)] = at;
        }
        self.order.iter().all(|&at| at != NOBODY)
    }
}

/// What a small whole number is: the last bits of it and 2^52, where a conversion would first ask whether it is one.
#[inline(always)]
fn small_whole(number: f64) -> usize {
    const SHIFT: f64 = (1u64 << 52) as f64;
    (number + SHIFT).to_bits() as u32 as usize
}

#[cfg(test)]
mod tests {
    use super::*;
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
            let velocities: Vec<Vec3> = positions.iter().map(|p| p.map(|x| 2.0 * x)).collect();
            let mut grid = Grid::default();
            grid.sort(&positions, &velocities, reach);
            let mut search = Search::default();
            for (id, &slot) in (0..).zip(grid.slots()) {
                let found = search.nearest(&grid, slot as usize, (limit, reach), guess);
                prop_assert_eq!(found, all_by_brute_force(&positions, id, (limit, reach)));
            }
        }
    }
}
