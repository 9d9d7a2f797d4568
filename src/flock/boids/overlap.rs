//! Nobody lies upon another: one pass of pushing apart after each step (ALGORITHMS.md 7).

use rayon::prelude::*;

use super::grid::{Grid, Neighbor};
use super::vector::{Vec3, add_scaled, scaled};
use super::{Boids, CHUNK};

impl Boids<'_> {
    /// One relaxation: each pair that overlaps moves apart by half of what is missing.
    pub(super) fn push_apart(&mut self) {
        let grid = Grid::new(&self.positions, self.overlap_bl);
        let moved: Vec<(u32, Vec3, Vec3)> = grid
            .by_cell()
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let mut neighbors = Vec::new();
                let mut moved = Vec::new();
                for &id in chunk {
                    let position = self.positions[id as usize];
                    grid.nearest(id, position, self.overlap_bl, 16, &mut neighbors);
                    if !neighbors.is_empty() {
                        let (position, velocity) = self.apart(id, &neighbors);
                        moved.push((id, position, velocity));
                    }
                }
                moved
            })
            .collect();
        for (id, position, velocity) in moved {
            self.positions[id as usize] = position;
            self.velocities[id as usize] = velocity;
        }
    }

    /// Where one goes that others are too near to.
    fn apart(&self, id: u32, neighbors: &[Neighbor]) -> (Vec3, Vec3) {
        let mut position = self.positions[id as usize];
        let mut velocity = self.velocities[id as usize];
        for neighbor in neighbors {
            let distance = neighbor.square_bl2.sqrt();
            let away = match distance > 1e-9 {
                true => scaled(-1.0 / distance, neighbor.offset),
                // In one place: apart along x, by id.
                false => [if id < neighbor.id { -1.0 } else { 1.0 }, 0.0, 0.0],
            };
            position = add_scaled(position, 0.5 * (self.overlap_bl - distance), away);
        }
        self.habitat.keep_out(&mut position, &mut velocity);
        let along = self.velocities[id as usize];
        (position, self.within_limits(velocity, position, along))
    }
}
