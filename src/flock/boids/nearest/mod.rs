//! The nearest neighbors of a boid (docs/explanation/algorithms.md, "Boids"): those within a guessed radius, and
//! within a larger one if they are too few. The guess affects the time only, not the result.
//!
//! Neighbors are sorted by distance, then by id, so their order does not depend on the grid.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod scalar;

use super::grid::{BLOCK, Boid, Grid};
use super::lanes::{self, Lanes, in_lane, select3};
use super::vector::{Vec3, dot, minus};
use crate::cpu::Level;

/// So many are put in order by counting who is nearer, which knows no branch; more are sorted.
const MOST_COUNTED: usize = 48;
/// By how much a guess that was too small grows.
const GROWTH: f64 = 1.25;
/// The least guess, as a share of the reach: from nothing nothing grows.
const LEAST_GUESS: f64 = 1e-3;

/// Who is near each of some boids, one to each.
#[derive(Clone, Copy, Debug)]
pub struct Neighbor<L> {
    /// From the one who looks to it, body lengths; 0 where there is nobody.
    pub offset: [L; 3],
    /// |offset|^2, infinite where there is nobody.
    pub square_bl2: L,
    /// Its velocity, body lengths a second; 0 where there is nobody.
    pub velocity: [L; 3],
}

/// A search for the neighbors of as many boids as are steered at a time, with its memory.
#[derive(Clone, Debug)]
pub struct Search<L> {
    near: Near,
    order: Vec<u32>,
    /// The slots of those found, rank by rank, `L::N` to a rank.
    slots: Vec<u32>,
    neighbors: Vec<Neighbor<L>>,
}

impl<L> Default for Search<L> {
    fn default() -> Search<L> {
        Search {
            near: Near::default(),
            order: Vec::new(),
            slots: Vec::new(),
            neighbors: Vec::new(),
        }
    }
}

impl<L: Lanes> Neighbor<L> {
    /// Where there is somebody.
    #[inline(always)]
    pub fn is_there(&self) -> L::Mask {
        self.square_bl2.less(L::splat(f64::INFINITY))
    }

    /// From the one who looks in this lane to it, if there is one.
    pub fn offset_in(&self, lane: usize) -> Option<Vec3> {
        let is_there = self.square_bl2.numbers()[lane] < f64::INFINITY;
        is_there.then(|| in_lane(self.offset, lane))
    }
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

impl<L: Lanes> Search<L> {
    /// The `limit` nearest others within `reach_bl` of those who stand at `slots`, `L::N` of them; nearest first, as many
    /// as anybody has. `guesses_bl`: within them there are about so many, or a little more. `cpu` decides how fast it
    /// goes.
    #[inline(always)]
    pub fn nearest(
        &mut self,
        (grid, slots): (&Grid, &[u32]),
        (limit, reach_bl): (usize, f64),
        guesses_bl: &[f64],
        cpu: Level,
    ) -> &[Neighbor<L>] {
        let n_ranks = limit.max(MOST_COUNTED);
        if self.slots.len() < n_ranks * L::N {
            self.slots.resize(n_ranks * L::N, 0);
        }
        let (mut counts, mut most) = ([0; lanes::MOST], 0);
        for lane in 0..L::N {
            let n = self.find(
                grid,
                (lane, slots[lane]),
                (limit, reach_bl),
                (guesses_bl[lane], cpu),
            );
            // Somebody must stand there for those who have so many.
            for rank in n..limit {
                self.slots[rank * L::N + lane] = slots[lane];
            }
            (counts[lane], most) = (n, most.max(n));
        }
        let (places, _) = L::gather(grid.boids(), slots);
        let counts = L::from_fn(|lane| counts[lane] as f64);
        self.neighbors.clear();
        for rank in 0..most {
            let slots = &self.slots[rank * L::N..(rank + 1) * L::N];
            let (positions, velocity) = L::gather(grid.boids(), slots);
            let nobody = [L::splat(0.0); 3];
            let is_there = L::splat(rank as f64).less(counts);
            let offset = select3::<L>(is_there, minus(positions, places), nobody);
            self.neighbors.push(Neighbor {
                offset,
                square_bl2: L::select(is_there, dot(offset, offset), L::splat(f64::INFINITY)),
                velocity: select3::<L>(is_there, velocity, nobody),
            });
        }
        &self.neighbors
    }

    /// Puts into its lane the slots of the nearest of whoever stands at `slot`, nearest first; how many they are.
    #[inline(always)]
    fn find(
        &mut self,
        grid: &Grid,
        (lane, slot): (usize, u32),
        (limit, reach_bl): (usize, f64),
        (guess_bl, cpu): (f64, Level),
    ) -> usize {
        let mut radius_bl = guess_bl.clamp(LEAST_GUESS * reach_bl, reach_bl);
        loop {
            gather(cpu, grid, (slot as usize, radius_bl), &mut self.near);
            if self.near.n >= limit || radius_bl >= reach_bl {
                break;
            }
            radius_bl = (GROWTH * radius_bl).min(reach_bl);
        }
        let n = self.near.n;
        if n > MOST_COUNTED || !self.find_by_rank(grid, lane, cpu) {
            self.find_by_order(grid, lane, limit);
        }
        n.min(limit)
    }

    /// Each one at the place that its rank is; false when some are equally far, so that the ranks are too few.
    #[inline(always)]
    fn find_by_rank(&mut self, grid: &Grid, lane: usize, cpu: Level) -> bool {
        let n = self.near.n;
        self.near.make_room(0);
        rank(cpu, &mut self.near);
        let mut sum = 0;
        for (&slot, &rank) in self.near.slots.iter().zip(&self.near.ranks).take(n) {
            self.slots[rank as usize * L::N + lane] = slot as u32;
            prefetch(cpu, grid.at(slot as usize));
            sum += rank as usize;
        }
        2 * sum == n * n.saturating_sub(1)
    }

    /// Sorted, equally far ones by id.
    fn find_by_order(&mut self, grid: &Grid, lane: usize, limit: usize) {
        let (order, near) = (&mut self.order, &self.near);
        order.clear();
        order.extend(0..near.n as u32);
        order.sort_unstable_by(|&a, &b| {
            let id = |at: u32| grid.at(near.slots[at as usize] as usize).id;
            let [nearer, farther] = [a, b].map(|at| near.squares_bl2[at as usize]);
            nearer.total_cmp(&farther).then_with(|| id(a).cmp(&id(b)))
        });
        for (rank, &at) in order.iter().take(limit).enumerate() {
            self.slots[rank * L::N + lane] = near.slots[at as usize] as u32;
        }
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

/// Has the memory fetch a boid that is looked at soon.
#[inline(always)]
#[cfg_attr(
    not(target_arch = "x86_64"),
    expect(unused_variables, reason = "there is no kernel that fetches")
)]
fn prefetch(cpu: Level, boid: &Boid) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => avx2::prefetch(boid),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::boids::vector::dot;
    use proptest::prelude::*;

    /// Id, square of the distance, and velocity of the nearest.
    type Found = (u32, f64, Vec3);

    fn all_by_brute_force(positions: &[Vec3], id: u32, (limit, reach): (usize, f64)) -> Vec<Found> {
        let mut all: Vec<Found> = (0u32..)
            .zip(positions)
            .map(|(other, &p)| {
                let offset = minus(p, positions[id as usize]);
                (other, dot(offset, offset), p.map(|x| 2.0 * x))
            })
            .filter(|n| n.0 != id && n.1 < reach * reach)
            .collect();
        all.sort_by(|a, b| (a.1, a.0).partial_cmp(&(b.1, b.0)).unwrap());
        all.truncate(limit);
        all
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_comparing_all_pairs_finds_whatever_was_guessed(
            positions in prop::collection::vec((0.0..30.0f64, 0.0..12.0f64, 0.0..5.0f64), 1..160),
            reach in 0.3..12.0f64, limit in 1usize..60, guess in prop_oneof![Just(0.0), 0.1..12.0f64],
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
            let mut search = Search::<f64>::default();
            for (id, &slot) in (0..).zip(grid.slots()) {
                let all = all_by_brute_force(&positions, id, (limit, reach));
                for cpu in Level::available() {
                    let near = search.nearest((&grid, &[slot]), (limit, reach), &[guess], cpu);
                    let near: Vec<_> = near.iter().map(|n| (n.square_bl2, n.velocity)).collect();
                    let found = search.slots.iter().map(|&slot| grid.at(slot as usize).id);
                    let found: Vec<Found> =
                        found.zip(near).map(|(id, (square, velocity))| (id, square, velocity)).collect();
                    prop_assert_eq!(&found, &all, "{:?}", cpu);
                }
            }
        }
    }
}
