//! Computes the distance D(i, j) between any two clips exactly, in integers (Okabe et al., equations 1 to 3;
//! docs/explanation/algorithms.md, "Distances").
//!
//! d(i, j) is the sum over pixels and planes of |U_i - U_j|, where U is the premultiplied sprite. D(i, j) is
//! the weighted sum of d over the f frames of two clips. The mirrored Dm compares i with j mirrored. Both are
//! symmetric, so only j >= i is computed. The rows are streamed in order, in panels of 4 x 48 rows. The N x N
//! matrix is never held.

mod bounds;
mod marks;
mod matrix;
mod minima;
mod pair_filter;
mod pixels;
mod pruned;
mod rotation;
mod window;

#[cfg(test)]
pub(crate) mod tests;

pub use marks::Marks;
pub use matrix::DistanceMatrix;
pub use minima::{ClipPair, LocalMinima};
pub use pair_filter::{AllPairs, PairFilter};
pub use pixels::ComparedSprites;
pub use window::Clip;

use rayon::prelude::*;

use super::group::{GROUP, Group, GroupBuffer};
use super::kernel::{self, Tile};
use crate::cpu::Level;
use crate::progress::Progress;
use window::WindowSums;

/// Number of row groups in a panel. Each loaded column group serves this many tiles. Free choice.
const PANEL_GROUPS: usize = 4;

/// The version of clip j that is compared with clip i.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// D: clip j unmirrored.
    Plain,
    /// Dm: clip j with reversed columns in side view, mirrored across the body axis in top view.
    Mirrored,
}

/// The computation was cancelled through `progress`.
#[derive(Debug, PartialEq, Eq)]
pub struct Cancelled;

/// The distances between the clips of a footage.
#[derive(Clone, Copy)]
pub struct Distances<'a> {
    /// The compared sprites.
    pub pixels: &'a ComparedSprites,
    /// Length and weights of the clips.
    pub clip: Clip,
    /// Plain or mirrored.
    pub side: Side,
    /// Instruction level. The result is the same with any.
    pub cpu: Level,
}

impl Distances<'_> {
    /// Returns the number of clips, N - f + 1, or 0 for footage shorter than a clip.
    pub fn n_clips(&self) -> usize {
        (self.pixels.n_frames() + 1).saturating_sub(self.clip.frames)
    }

    /// Calls `on_row(i, D(i, i..))` for every clip i in order. Entry k of the row is D(i, i + k).
    ///
    /// Reports progress as stage `distances`. Uses the threads of the caller's rayon pool. Fails when
    /// cancelled.
    pub fn for_each_row(
        &self,
        progress: &dyn Progress,
        mut on_row: impl FnMut(usize, &[u64]),
    ) -> Result<(), Cancelled> {
        let n_frames = self.pixels.n_frames();
        let mut window = WindowSums::new(self.clip, n_frames);
        let mut row: Vec<u64> = Vec::with_capacity(n_frames);
        let mut buffers = <[GroupBuffer; PANEL_GROUPS]>::default();
        for panel_idx in (0..self.pixels.n_groups()).step_by(PANEL_GROUPS) {
            if progress.cancelled() {
                return Err(Cancelled);
            }
            let first = panel_idx * GROUP;
            // The remaining work is a triangle, so it shrinks with the square of the remaining rows.
            let rest = 1.0 - first as f64 / n_frames as f64;
            progress.report("distances", 1.0 - rest * rest);
            let tiles = self.panel(panel_idx, &mut buffers);
            for r in first..n_frames.min(first + PANEL_GROUPS * GROUP) {
                let (group, line) = ((r - first) / GROUP, (r - first) % GROUP);
                let sprite_sads = tiles[group..].iter().flat_map(|column| column[group][line]);
                row.clear();
                row.extend(sprite_sads.skip(line).take(n_frames - r));
                if let Some(sums) = window.push(&row) {
                    on_row(r + 1 - self.clip.frames, sums);
                }
            }
        }
        progress.report("distances", 1.0);
        Ok(())
    }

    /// Returns the tiles of a panel from the diagonal to the right: for every column group, one tile per row
    /// group not below the diagonal.
    fn panel(
        &self,
        first: usize,
        buffers: &mut [GroupBuffer; PANEL_GROUPS],
    ) -> Vec<Vec<Box<kernel::SadTile>>> {
        let n_groups = self.pixels.n_groups();
        let rows: Vec<Group<'_>> = (first..n_groups.min(first + PANEL_GROUPS))
            .zip(buffers)
            .map(|(group_idx, buffer)| self.row_group(group_idx, buffer))
            .collect();
        (first..n_groups)
            .into_par_iter()
            .map_init(GroupBuffer::default, |buffer, column_idx| {
                let columns = self.pixels.group(column_idx, buffer);
                let above = &rows[..rows.len().min(column_idx + 1 - first)];
                let tile = |(row_idx, &rows)| {
                    let wanted = if column_idx == row_idx {
                        kernel::upper_triangle(rows, columns)
                    } else {
                        kernel::all_pairs(rows, columns)
                    };
                    let tile = Tile {
                        rows,
                        columns,
                        wanted: &wanted,
                    };
                    kernel::sad_tile(self.cpu, tile)
                };
                (first..).zip(above).map(tile).collect()
            })
            .collect()
    }

    /// Returns a group of rows, mirrored if the distances are.
    fn row_group<'b>(&'b self, group_idx: usize, buffer: &'b mut GroupBuffer) -> Group<'b> {
        match self.side {
            Side::Plain => self.pixels.group(group_idx, buffer),
            Side::Mirrored => self.pixels.mirrored_group(group_idx, buffer),
        }
    }
}
