//! Grid for neighbor searches in time proportional to the number of boids
//! (docs/explanation/algorithms.md, "Boids"). A counting sort brings positions and velocities into the order
//! of small cells, so that a row of cells is one run of memory.

use rayon::prelude::*;

use super::CHUNK;
use super::vector::Vec3;

/// Cells per reach of the farthest rule, if there are enough boids to fill them. Free choice.
const FINEST: f64 = 6.0;
/// Largest number of cells per boid. Free choice.
const CELLS_PER_BOID: f64 = 0.6;

/// Boids sorted by cell. A slot is an index in this order.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    least: Vec3,
    /// Cells per body length along each axis; 0 along an axis in which all boids are equal.
    cells_per_bl: Vec3,
    n_cells: [usize; 3],
    /// The boids of cell c have the slots `first[c]..first[c + 1]`.
    first: Vec<u32>,
    /// Slot of each boid, in the order given. During the sort, its cell.
    slots: Vec<u32>,
    /// Index in the order given, by slot.
    given: Vec<u32>,
    boids: Vec<Boid>,
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

/// Iterator over the rows of cells in a box.
pub struct Rows<'a> {
    grid: &'a Grid,
    from: [usize; 3],
    to: [usize; 3],
    /// y and z of the next row.
    next: [usize; 2],
}

impl Iterator for Rows<'_> {
    type Item = (usize, usize);

    /// Returns the first slot of a row and one past its last.
    #[inline]
    fn next(&mut self) -> Option<(usize, usize)> {
        let [y, z] = self.next;
        if z > self.to[2] {
            return None;
        }
        self.next = if y < self.to[1] {
            [y + 1, z]
        } else {
            [self.from[1], z + 1]
        };
        let (start, end) = ([self.from[0], y, z], [self.to[0], y, z]);
        let (start, end) = (self.grid.index(start), self.grid.index(end));
        let first = &self.grid.first;
        Some((first[start] as usize, first[end + 1] as usize))
    }
}

impl Grid {
    /// Sorts boids into cells for rules of this reach. The sort is faster if boids that are near each other
    /// are given one after another.
    pub fn sort(&mut self, boids: &[Boid], reach_bl: f64) {
        self.lay_cells(boids, reach_bl);
        self.count(boids);
        self.given.resize(boids.len(), 0);
        for (given, &slot) in (0..).zip(&self.slots) {
            self.given[slot as usize] = given;
        }
        let given = self.given.par_iter().with_min_len(CHUNK);
        (given.map(|&given| boids[given as usize])).collect_into_vec(&mut self.boids);
    }

    /// Returns the index in the order given, by slot. Boids in successive slots are near each other.
    #[inline]
    pub fn given(&self) -> &[u32] {
        &self.given
    }

    /// Returns the slot of each boid, in the order given.
    pub fn slots(&self) -> &[u32] {
        &self.slots
    }

    /// Returns all boids, by slot.
    #[inline]
    pub fn boids(&self) -> &[Boid] {
        &self.boids
    }

    /// Returns the boid at `slot`.
    #[inline]
    pub fn at(&self, slot: usize) -> &Boid {
        &self.boids[slot]
    }

    /// Returns the slots of each row of cells that may hold a boid within `radius_bl` of `place`. The rows
    /// may hold farther boids too.
    #[inline]
    pub fn rows(&self, place: Vec3, radius_bl: f64) -> Rows<'_> {
        // The margin covers rounding.
        let out = radius_bl * (1.0 + 1e-9) + 1e-9;
        let from = self.cell_of([place[0] - out, place[1] - out, place[2] - out]);
        let to = self.cell_of([place[0] + out, place[1] + out, place[2] + out]);
        let next = [from[1], from[2]];
        Rows {
            grid: self,
            from,
            to,
            next,
        }
    }

    /// Chooses cubic cells, as small as the reach asks for and the number of boids allows.
    fn lay_cells(&mut self, boids: &[Boid], reach_bl: f64) {
        let nowhere = || ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let both = |a: (Vec3, Vec3), b: (Vec3, Vec3)| {
            let least = [0, 1, 2].map(|axis| a.0[axis].min(b.0[axis]));
            (least, [0, 1, 2].map(|axis| a.1[axis].max(b.1[axis])))
        };
        let place = |boid: &Boid| (boid.position, boid.position);
        let (least, greatest) =
            (boids.par_iter().with_min_len(CHUNK).map(place)).reduce(nowhere, both);
        let span: Vec3 = std::array::from_fn(|axis| (greatest[axis] - least[axis]).max(0.0));
        let most = CELLS_PER_BOID * boids.len() as f64 + 8.0;
        let cells = |cell_bl: f64| span.map(|bl| (bl / cell_bl).floor() + 1.0);
        let mut cell_bl = reach_bl / FINEST;
        while cells(cell_bl).iter().product::<f64>() > most {
            cell_bl *= 1.05;
        }
        self.least = least;
        self.n_cells = cells(cell_bl).map(|n| n as usize);
        self.cells_per_bl = span.map(|bl| if bl > 0.0 { 1.0 / cell_bl } else { 0.0 });
    }

    /// Computes the slot of each boid and the first slot of each cell.
    fn count(&mut self, boids: &[Boid]) {
        let mut slots = std::mem::take(&mut self.slots);
        let cell = |boid: &Boid| self.index(self.cell_of(boid.position)) as u32;
        (boids.par_iter().with_min_len(CHUNK).map(cell)).collect_into_vec(&mut slots);
        let n = self.n_cells.iter().product::<usize>();
        self.first.clear();
        self.first.resize(n + 1, 0);
        for &cell in &slots {
            self.first[cell as usize] += 1;
        }
        let mut sum = 0;
        for first in &mut self.first {
            sum += *first;
            *first = sum;
        }
        // Each cell is filled from its last slot to its first, so that `first` ends at the first one.
        for slot in slots.iter_mut().rev() {
            let next = &mut self.first[*slot as usize];
            *next -= 1;
            *slot = *next;
        }
        self.slots = slots;
    }

    #[inline]
    fn cell_of(&self, position: Vec3) -> [usize; 3] {
        let mut cell = [0; 3];
        for axis in 0..3 {
            let at = (position[axis] - self.least[axis]) * self.cells_per_bl[axis];
            cell[axis] = (at.max(0.0) as u32 as usize).min(self.n_cells[axis] - 1);
        }
        cell
    }

    #[inline]
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.n_cells[1] + y) * self.n_cells[0] + x
    }
}
