//! The sum of absolute differences in plain Rust: the definition that every other kernel equals.

use super::{SadTile, Tile};
use crate::analysis::distance::pixels::Line;

/// Adds d of every pair of the tile.
pub(in crate::analysis::distance) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    for block in 0..tile.rows.n_blocks() {
        for (row, sums) in sums.iter_mut().enumerate().take(tile.rows.n_sprites) {
            let a = tile.rows.strip(block, row);
            for column in tile.columns_of(row) {
                let b = tile.columns.strip(block, column);
                sums[column] += a.iter().zip(b).map(|(a, b)| sad_line(a, b)).sum::<u64>();
            }
        }
    }
}

/// The sum over 64 bytes of |a - b|.
pub(in crate::analysis::distance) fn sad_line(a: &Line, b: &Line) -> u64 {
    let differences = a.0.iter().zip(&b.0).map(|(a, b)| u32::from(a.abs_diff(*b)));
    u64::from(differences.sum::<u32>())
}
