//! Who is near whom, in time proportional to the number of boids: small cells filled by a counting sort, positions
//! and velocities laid out in cell order (ALGORITHMS.md 7), so that a row of cells is one run of memory.
//! `nearest` searches it.

use rayon::prelude::*;

use super::CHUNK;
use super::vector::Vec3;

/// Cells to the reach of the farthest rule, where there are boids enough to fill them.
const FINEST: f64 = 6.0;
/// Cells to a boid, at most.
const CELLS_PER_BOID: f64 = 0.6;

/// So many positions can be looked at from any slot on.
pub const BLOCK: usize = 4;

/// Boids sorted by cell.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    least: Vec3,
    /// Cells to a body length along each axis.
    cells_per_bl: Vec3,
    n_cells: [usize; 3],
    /// `first[c]..first[c + 1]` are the boids of cell c.
    first: Vec<u32>,
    /// The cell of each boid as they were given; then where it stands in cell order.
    slots: Vec<u32>,
    /// The way back: whom of those given each slot holds.
    given: Vec<u32>,
    boids: Vec<Boid>,
    /// Their positions once more, axis by axis.
    axes: [Vec<f64>; 3],
}

/// A boid where its cell is, all in one line of the cache, position and velocity first.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub struct Boid {
    /// Body lengths.
    pub position: Vec3,
    /// Body lengths a second.
    pub velocity: Vec3,
    /// Its number.
    pub id: u32,
}

/// Rows of cells beside one another.
pub struct Rows<'a> {
    grid: &'a Grid,
    from: [usize; 3],
    to: [usize; 3],
    /// y and z of the next one.
    next: [usize; 2],
}

impl Iterator for Rows<'_> {
    type Item = (usize, usize);

    /// The first slot of a row and one past its last.
    #[inline(always)]
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
    /// Sorts boids into cells for rules that reach so far; what was sorted before is forgotten. It is the faster the
    /// nearer to one another they are given.
    pub fn sort(&mut self, boids: &[Boid], reach_bl: f64) {
        self.lay_cells(boids, reach_bl);
        self.count(boids);
        self.given.resize(boids.len(), 0);
        for (given, &slot) in (0..).zip(&self.slots) {
            self.given[slot as usize] = given;
        }
        for axis in &mut self.axes {
            axis.clear();
            axis.resize(boids.len() + BLOCK, f64::INFINITY);
        }
        self.boids.resize(boids.len(), Boid::default());
        let [x, y, z] = &mut self.axes;
        (&mut self.boids, &self.given, x, y, z)
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(boid, &given, x, y, z)| {
                *boid = boids[given as usize];
                [*x, *y, *z] = boid.position;
            });
    }

    /// Whom of those given each slot holds, in the order of cells: who follows whom here is near it.
    #[inline(always)]
    pub fn given(&self) -> &[u32] {
        &self.given
    }

    /// Where each boid stands in the order of cells, as they were given.
    pub fn slots(&self) -> &[u32] {
        &self.slots
    }

    /// Everybody, in the order of cells.
    #[inline(always)]
    pub fn boids(&self) -> &[Boid] {
        &self.boids
    }

    /// Whoever stands at `slot`.
    #[inline(always)]
    pub fn at(&self, slot: usize) -> &Boid {
        &self.boids[slot]
    }

    /// All positions along an axis, in the order of cells, and `BLOCK` infinite ones.
    #[inline(always)]
    pub fn along(&self, axis: usize) -> &[f64] {
        &self.axes[axis]
    }

    /// Whether all are in one plane across the third axis.
    #[inline(always)]
    pub fn is_flat(&self) -> bool {
        self.cells_per_bl[2] == 0.0
    }

    /// The slots of every row of cells that holds whoever may be within `radius_bl` of a place, and more.
    #[inline(always)]
    pub fn rows(&self, place: Vec3, radius_bl: f64) -> Rows<'_> {
        // Nobody is lost by rounding.
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

    /// Cells as wide along each axis, as small as the reach asks for and the number of boids allows.
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

    /// Where each boid stands, and where cells begin.
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
        // From the last boid of a cell to the first; then each cell begins where its first boid stands.
        for slot in slots.iter_mut().rev() {
            let next = &mut self.first[*slot as usize];
            *next -= 1;
            *slot = *next;
        }
        self.slots = slots;
    }

    #[inline(always)]
    fn cell_of(&self, position: Vec3) -> [usize; 3] {
        let mut cell = [0; 3];
        for axis in 0..3 {
            let at = (position[axis] - self.least[axis]) * self.cells_per_bl[axis];
            cell[axis] = (at.max(0.0) as u32 as usize).min(self.n_cells[axis] - 1);
        }
        cell
    }

    #[inline(always)]
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.n_cells[1] + y) * self.n_cells[0] + x
    }
}
