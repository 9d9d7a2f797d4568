//! Who is near whom, in time proportional to the number of boids: cells a third as wide as the farthest rule
//! reaches, filled by a counting sort, positions laid out in cell order (ALGORITHMS.md 7). Rings of cells are
//! searched from the inside out, until no farther one can hold a nearer neighbor.
//!
//! Neighbors come nearest first, equal distances by id: an order that does not depend on the grid.

use super::vector::{Vec3, dot, minus};

/// Cells to the reach of the farthest rule.
const RINGS: f64 = 3.0;

/// Boids sorted by cell.
pub struct Grid {
    least: Vec3,
    /// The width of a cell along each axis.
    cell_bl: Vec3,
    /// The narrowest of them along an axis with more than one.
    ring_bl: f64,
    n_cells: [usize; 3],
    /// `first[c]..first[c + 1]` are the boids of cell c.
    first: Vec<u32>,
    ids: Vec<u32>,
    positions: Vec<Vec3>,
}

/// A boid near another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor {
    /// Its number.
    pub id: u32,
    /// From the one who looks to it, body lengths.
    pub offset: Vec3,
    /// |offset|^2.
    pub square_bl2: f64,
}

impl Grid {
    /// Sorts boids into cells for neighbors within `reach_bl`, no more cells than a few per boid.
    pub fn new(positions: &[Vec3], reach_bl: f64) -> Grid {
        let mut least = [f64::INFINITY; 3];
        let mut greatest = [f64::NEG_INFINITY; 3];
        for position in positions {
            for axis in 0..3 {
                least[axis] = least[axis].min(position[axis]);
                greatest[axis] = greatest[axis].max(position[axis]);
            }
        }
        let most = (positions.len() as f64).sqrt().ceil() as usize + 1;
        let n_cells = std::array::from_fn(|axis| {
            let span = (greatest[axis] - least[axis]).max(0.0);
            ((span * RINGS / reach_bl) as usize + 1).min(most)
        });
        let cell_bl: Vec3 = std::array::from_fn(|axis| {
            let span = (greatest[axis] - least[axis]).max(0.0);
            (span / n_cells[axis] as f64).max(1e-9)
        });
        let several = (0..3).filter(|&axis| n_cells[axis] > 1);
        let mut grid = Grid {
            least,
            cell_bl,
            ring_bl: several
                .map(|axis| cell_bl[axis])
                .fold(f64::INFINITY, f64::min),
            n_cells,
            first: Vec::new(),
            ids: Vec::new(),
            positions: Vec::new(),
        };
        grid.sort(positions);
        grid
    }

    /// The boids in the order of their cells: who follows whom here is near it.
    pub fn by_cell(&self) -> &[u32] {
        &self.ids
    }

    /// The `limit` nearest others within `radius_bl` of boid `id`, nearest first, in `found`.
    pub fn nearest(
        &self,
        id: u32,
        position: Vec3,
        radius_bl: f64,
        limit: usize,
        found: &mut Vec<Neighbor>,
    ) {
        found.clear();
        let center = self.cell_of(position);
        let square_bl2 = radius_bl * radius_bl;
        for ring in 0.. {
            self.search_ring(center, ring, |from, to| {
                for at in from..to {
                    let offset = minus(self.positions[at], position);
                    let neighbor = Neighbor {
                        id: self.ids[at],
                        offset,
                        square_bl2: dot(offset, offset),
                    };
                    if neighbor.square_bl2 < square_bl2 && neighbor.id != id {
                        keep_nearest(found, neighbor, limit);
                    }
                }
            });
            // Whoever is in a farther ring is at least so many cells away.
            let searched_bl = ring as f64 * self.ring_bl;
            let is_full = found.len() == limit;
            let farthest = found.last().filter(|_| is_full);
            let is_enough =
                farthest.is_some_and(|last| last.square_bl2 < searched_bl * searched_bl);
            if is_enough
                || searched_bl >= radius_bl
                || ring >= self.n_cells.into_iter().max().unwrap_or(0)
            {
                return;
            }
        }
    }

    /// Calls `visit` with the boids of every row of cells in a ring about a cell; ring 0 is the cell itself.
    fn search_ring(&self, center: [usize; 3], ring: usize, mut visit: impl FnMut(usize, usize)) {
        let span = |axis: usize| {
            let c = center[axis];
            c.saturating_sub(ring)..=(c + ring).min(self.n_cells[axis] - 1)
        };
        let mut row = |from: [usize; 3], n: usize| {
            let cell = self.index(from);
            visit(self.first[cell] as usize, self.first[cell + n] as usize);
        };
        let (x_from, x_to) = (*span(0).start(), *span(0).end());
        for z in span(2) {
            for y in span(1) {
                let is_rim = z.abs_diff(center[2]) == ring || y.abs_diff(center[1]) == ring;
                if is_rim {
                    row([x_from, y, z], x_to + 1 - x_from);
                    continue;
                }
                if center[0] >= ring {
                    row([center[0] - ring, y, z], 1);
                }
                if center[0] + ring < self.n_cells[0] {
                    row([center[0] + ring, y, z], 1);
                }
            }
        }
    }

    fn sort(&mut self, positions: &[Vec3]) {
        let cells: Vec<u32> = positions
            .iter()
            .map(|&position| self.index(self.cell_of(position)) as u32)
            .collect();
        let n = self.n_cells.iter().product::<usize>();
        self.first = vec![0; n + 1];
        for &cell in &cells {
            self.first[cell as usize + 1] += 1;
        }
        for cell in 0..n {
            self.first[cell + 1] += self.first[cell];
        }
        let mut next = self.first.clone();
        self.ids = vec![0; positions.len()];
        self.positions = vec![[0.0; 3]; positions.len()];
        for (id, (&cell, &position)) in cells.iter().zip(positions).enumerate() {
            let at = next[cell as usize] as usize;
            self.ids[at] = id as u32;
            self.positions[at] = position;
            next[cell as usize] += 1;
        }
    }

    fn cell_of(&self, position: Vec3) -> [usize; 3] {
        std::array::from_fn(|axis| {
            let cell = (position[axis] - self.least[axis]) / self.cell_bl[axis];
            (cell.max(0.0) as usize).min(self.n_cells[axis] - 1)
        })
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.n_cells[1] + y) * self.n_cells[0] + x
    }
}

/// Insertion into a short sorted list.
fn keep_nearest(found: &mut Vec<Neighbor>, neighbor: Neighbor, limit: usize) {
    let key = |n: &Neighbor| (n.square_bl2, n.id);
    if found.len() == limit {
        match found.last() {
            Some(last) if key(&neighbor) < key(last) => found.pop(),
            _ => return,
        };
    }
    let at = found.partition_point(|other| key(other) < key(&neighbor));
    found.insert(at, neighbor);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn all_by_brute_force(positions: &[Vec3], id: u32, radius: f64, limit: usize) -> Vec<Neighbor> {
        let mut all: Vec<Neighbor> = (0u32..)
            .zip(positions)
            .map(|(other, &p)| {
                let offset = minus(p, positions[id as usize]);
                Neighbor {
                    id: other,
                    offset,
                    square_bl2: dot(offset, offset),
                }
            })
            .filter(|n| n.id != id && n.square_bl2 < radius * radius)
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
        fn the_grid_finds_what_comparing_all_pairs_finds(
            positions in prop::collection::vec((0.0..30.0f64, 0.0..12.0f64, 0.0..5.0f64), 1..120),
            radius in 0.3..6.0f64, limit in 1usize..20, flat in any::<bool>()
        ) {
            let positions: Vec<Vec3> = positions
                .iter()
                .map(|&(x, y, z)| [x, y, if flat { 0.0 } else { z }])
                .collect();
            let grid = Grid::new(&positions, radius);
            let mut found = Vec::new();
            for id in 0..positions.len() as u32 {
                grid.nearest(id, positions[id as usize], radius, limit, &mut found);
                prop_assert_eq!(&found, &all_by_brute_force(&positions, id, radius, limit));
            }
        }
    }
}
