//! How unlike any two clips are: D(i, j), O (1) to (3), integer-exact (ALGORITHMS.md 5).
//!
//! d(i, j) is the sum over pixels and planes of |U_i - U_j|, D(i, j) its sum over the f frames of
//! two clips; the mirrored Dm compares i with j mirrored. Both are symmetric, so only j >= i is
//! computed. The rows stream by in order, in panels of 48: no N x N matrix is held here.

mod kernel;
mod matrix;
mod minima;
mod pixels;
mod upright;
mod window;

#[cfg(test)]
pub(crate) mod tests;

pub use matrix::{DistanceMatrix, PooledMatrix};
pub use minima::{ClipPair, LocalMinima};
pub use pixels::ComparedSprites;

use rayon::prelude::*;

use crate::cpu::Level;
use crate::progress::Progress;
use kernel::Tile;
use pixels::{GROUP, GroupMemory};
use window::WindowSums;

/// What is compared with clip i: clip j as it is, or clip j mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// D.
    Plain,
    /// Dm: j with its columns reversed in side view, mirrored across its own axis in top view.
    Mirrored,
}

/// The computation was cancelled by its listener.
#[derive(Debug, PartialEq, Eq)]
pub struct Cancelled;

/// The distances between the clips of a footage.
#[derive(Clone, Copy)]
pub struct Distances<'a> {
    /// The sprites compared.
    pub pixels: &'a ComparedSprites,
    /// f, at least 1.
    pub clip_frames: usize,
    /// Plain or mirrored.
    pub side: Side,
    /// The instructions to use; the result is the same with any.
    pub cpu: Level,
}

impl Distances<'_> {
    /// N - f + 1, or 0 where the footage is shorter than a clip.
    pub fn n_clips(&self) -> usize {
        (self.pixels.n_frames() + 1).saturating_sub(self.clip_frames)
    }

    /// Calls `on_row(i, D(i, i..))` for every clip i in order: entry k is D(i, i + k).
    ///
    /// Reports the stage `distances`; threads are those of the caller's rayon pool.
    pub fn for_each_row(
        &self,
        progress: &dyn Progress,
        mut on_row: impl FnMut(usize, &[u64]),
    ) -> Result<(), Cancelled> {
        let n_frames = self.pixels.n_frames();
        let mut window = WindowSums::new(self.clip_frames, n_frames);
        let mut row = vec![0; n_frames];
        for panel_idx in 0..self.pixels.n_groups() {
            if progress.cancelled() {
                return Err(Cancelled);
            }
            let first = panel_idx * GROUP;
            // Two rows from the bottom hold two distances: work done is that of the triangle above.
            let rest = 1.0 - first as f64 / n_frames as f64;
            progress.report("distances", 1.0 - rest * rest);
            let tiles = self.panel(panel_idx);
            for r in first..n_frames.min(first + GROUP) {
                let of_tiles = tiles.iter().flat_map(|tile| tile[r - first]);
                row.clear();
                row.extend(of_tiles.skip(r - first).take(n_frames - r));
                if let Some((clip_idx, sums)) = window.push(&row) {
                    on_row(clip_idx, sums);
                }
            }
        }
        progress.report("distances", 1.0);
        Ok(())
    }

    /// The tiles of a panel of 48 rows, from the diagonal to the right.
    fn panel(&self, panel_idx: usize) -> Vec<Box<kernel::SadTile>> {
        let mut memory = GroupMemory::default();
        let rows = match self.side {
            Side::Plain => self.pixels.group(panel_idx),
            Side::Mirrored => self.pixels.mirrored_group(panel_idx, &mut memory),
        };
        (panel_idx..self.pixels.n_groups())
            .into_par_iter()
            .map(|column_idx| {
                let tile = Tile {
                    rows,
                    columns: self.pixels.group(column_idx),
                    diagonal: column_idx == panel_idx,
                };
                kernel::sad_tile(self.cpu, tile)
            })
            .collect()
    }
}
