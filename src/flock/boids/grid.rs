//! Who is near whom, in time proportional to the number of boids: cells as wide as the farthest rule,
//! filled by a counting sort, positions and velocities laid out in cell order (ALGORITHMS.md 7).
//!
//! Neighbors come nearest first, equal distances by id: an order that does not depend on the grid.

use super::vector::{Vec3, dot, minus};

/// Boids sorted by cell.
pub struct Grid {
    least: Vec3,
    cell_bl: f64,
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
    /// Sorts boids into cells of at least `cell_bl`, and no more cells than a few per boid.
    pub fn new(positions: &[Vec3], cell_bl: f64) -> Grid {
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
            ((span / cell_bl) as usize + 1).min(most)
        });
        let span = (0..3).map(|a| (greatest[a] - least[a]) / n_cells[a] as f64);
        let mut grid = Grid {
            least,
            cell_bl: span.fold(cell_bl, f64::max),
            n_cells,
            first: Vec::new(),
            ids: Vec::new(),
            positions: Vec::new(),
        };
        grid.sort(positions);
        grid
    }

    /// The `limit` nearest others within `radius_bl` of boid `id`, nearest first, in `found`.
    ///
    /// `radius_bl` must not be above the cell's width.
    pub fn nearest(
        &self,
        id: u32,
        position: Vec3,
        radius_bl: f64,
        limit: usize,
        found: &mut Vec<Neighbor>,
    ) {
        debug_assert!(radius_bl <= self.cell_bl, "a neighbor may be two cells off");
        found.clear();
        let center = self.cell_of(position);
        let around = |axis: usize| {
            let c = center[axis];
            c.saturating_sub(1)..=(c + 1).min(self.n_cells[axis] - 1)
        };
        for z in around(2) {
            for y in around(1) {
                // Cells along x lie one behind the other.
                let row = (z * self.n_cells[1] + y) * self.n_cells[0];
                let (from, to) = (row + around(0).start(), row + around(0).end() + 1);
                for at in self.first[from] as usize..self.first[to] as usize {
                    let offset = minus(self.positions[at], position);
                    let square_bl2 = dot(offset, offset);
                    if square_bl2 < radius_bl * radius_bl && self.ids[at] != id {
                        let neighbor = Neighbor {
                            id: self.ids[at],
                            offset,
                            square_bl2,
                        };
                        keep_nearest(found, neighbor, limit);
                    }
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
            let cell = (position[axis] - self.least[axis]) / self.cell_bl;
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
