//! Grid for neighbor searches in time proportional to the number of boids
//! (docs/explanation/algorithms.md, "Boids"). A counting sort brings positions and velocities into the order
//! of small cells, so that a row of cells is one run of memory.

use std::ops::Range;

use rayon::prelude::*;

use super::CHUNK;
use super::vector::Vec3;

/// Cells per reach of the farthest rule, if there are enough boids to fill them. Free choice.
const CELLS_PER_REACH: f64 = 6.0;
/// Largest number of cells per boid. Free choice.
const MAX_CELLS_PER_BOID: f64 = 0.6;

/// Boids sorted by cell. A slot is an index in this order.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    /// Least corner of the box around all boids.
    origin: Vec3,
    /// Cells per body length along each axis; 0 along an axis in which all boids are equal.
    cells_per_bl: Vec3,
    n_cells: [usize; 3],
    /// The boids of cell c have the slots `cell_starts[c]..cell_starts[c + 1]`.
    cell_starts: Vec<u32>,
    /// Slot of each boid, in the order given. During the sort, its cell.
    pub slots: Vec<u32>,
    /// Index in the order given, by slot. Boids in successive slots are near each other.
    pub input_indices: Vec<u32>,
    /// All boids, by slot.
    pub boids: Vec<Boid>,
}

/// A boid in one cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Boid {
    /// Position, body lengths.
    pub position: Vec3,
    /// Velocity, body lengths per second.
    pub velocity: Vec3,
    /// Id.
    pub id: u32,
}

impl Grid {
    /// Sorts boids into cells for rules of this reach. The sort is faster if boids that are near each other
    /// are given one after another.
    pub fn sort(&mut self, boids: &[Boid], reach_bl: f64) {
        self.choose_cells(boids, reach_bl);
        self.assign_slots(boids);
        self.input_indices.resize(boids.len(), 0);
        for (input, &slot) in (0..).zip(&self.slots) {
            self.input_indices[slot as usize] = input;
        }
        let inputs = self.input_indices.par_iter().with_min_len(CHUNK);
        (inputs.map(|&input| boids[input as usize])).collect_into_vec(&mut self.boids);
    }

    /// Returns the boid at `slot`.
    #[inline]
    pub fn at(&self, slot: usize) -> &Boid {
        &self.boids[slot]
    }

    /// Calls `visit` with the slots of each row of cells that may hold a boid within `radius_bl` of
    /// `position`. The rows may hold farther boids too.
    #[inline]
    pub fn for_each_row(
        &self,
        position: Vec3,
        radius_bl: f64,
        mut visit: impl FnMut(Range<usize>),
    ) {
        // The margin covers rounding.
        let margin_bl = radius_bl * (1.0 + 1e-9) + 1e-9;
        let from = self.cell_of(position.map(|x| x - margin_bl));
        let to = self.cell_of(position.map(|x| x + margin_bl));
        for z in from[2]..=to[2] {
            for y in from[1]..=to[1] {
                let first = self.cell_starts[self.index([from[0], y, z])];
                let end = self.cell_starts[self.index([to[0], y, z]) + 1];
                visit(first as usize..end as usize);
            }
        }
    }

    /// Chooses cubic cells, as small as the reach asks for and the number of boids allows.
    fn choose_cells(&mut self, boids: &[Boid], reach_bl: f64) {
        let empty = || [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let union = |a: [Vec3; 2], b: [Vec3; 2]| {
            let least = [0, 1, 2].map(|axis| a[0][axis].min(b[0][axis]));
            let greatest = [0, 1, 2].map(|axis| a[1][axis].max(b[1][axis]));
            [least, greatest]
        };
        let corners = boids.par_iter().with_min_len(CHUNK);
        let [least, greatest] = (corners.map(|boid| [boid.position; 2])).reduce(empty, union);
        let span = [0, 1, 2].map(|axis| (greatest[axis] - least[axis]).max(0.0));
        let max_cells = MAX_CELLS_PER_BOID * boids.len() as f64 + 8.0;
        let cells = |cell_bl: f64| span.map(|bl| (bl / cell_bl).floor() + 1.0);
        let mut cell_bl = reach_bl / CELLS_PER_REACH;
        while cells(cell_bl).iter().product::<f64>() > max_cells {
            cell_bl *= 1.05;
        }
        self.origin = least;
        self.n_cells = cells(cell_bl).map(|n| n as usize);
        self.cells_per_bl = span.map(|bl| if bl > 0.0 { 1.0 / cell_bl } else { 0.0 });
    }

    /// Computes the slot of each boid and the first slot of each cell.
    fn assign_slots(&mut self, boids: &[Boid]) {
        let mut slots = std::mem::take(&mut self.slots);
        let cell = |boid: &Boid| self.index(self.cell_of(boid.position)) as u32;
        (boids.par_iter().with_min_len(CHUNK).map(cell)).collect_into_vec(&mut slots);
        let n = self.n_cells.iter().product::<usize>();
        self.cell_starts.clear();
        self.cell_starts.resize(n + 1, 0);
        for &cell in &slots {
            self.cell_starts[cell as usize] += 1;
        }
        let mut sum = 0;
        for end in &mut self.cell_starts {
            sum += *end;
            *end = sum;
        }
        // Each cell is filled from its last slot to its first, so that its end becomes its start.
        for slot in slots.iter_mut().rev() {
            let next = &mut self.cell_starts[*slot as usize];
            *next -= 1;
            *slot = *next;
        }
        self.slots = slots;
    }

    #[inline]
    fn cell_of(&self, position: Vec3) -> [usize; 3] {
        let mut cell = [0; 3];
        for axis in 0..3 {
            let at = (position[axis] - self.origin[axis]) * self.cells_per_bl[axis];
            cell[axis] = (at.max(0.0) as u32 as usize).min(self.n_cells[axis] - 1);
        }
        cell
    }

    #[inline]
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.n_cells[1] + y) * self.n_cells[0] + x
    }
}
