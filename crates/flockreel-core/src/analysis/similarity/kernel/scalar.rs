//! The sum of absolute differences in plain Rust: the definition that every other kernel must equal.

use super::{SadTile, Tile};
use crate::analysis::similarity::group::Block;

/// Adds d of every needed pair to `sums`.
pub(super) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    let subtiles = tile.subtiles::<1, 1>();
    for block in 0..tile.rows.n_blocks() {
        for &[row, column] in &subtiles {
            let (a, b) = (
                tile.rows.block(block, row),
                tile.columns.block(block, column),
            );
            sums[row][column] += sad_block(a, b);
        }
    }
}

/// Returns the sum of |a - b| over a block. Chunks of sixteen let the compiler vectorise it.
pub(super) fn sad_block(a: &Block, b: &Block) -> u64 {
    let sixteens = a.0.as_chunks::<16>().0.iter().zip(b.0.as_chunks::<16>().0);
    let sums = sixteens.map(|(a, b)| (0..16).map(|k| u32::from(a[k].abs_diff(b[k]))).sum::<u32>());
    u64::from(sums.sum::<u32>())
}

/// Writes the sums of |a - b| between one row of values and each of many rows.
pub(super) fn sad_u16(row: &[u16], others: &[u16], sums: &mut [u32]) {
    for (sum, other) in sums.iter_mut().zip(others.chunks_exact(row.len().max(1))) {
        let differences = row.iter().zip(other).map(|(a, b)| a.abs_diff(*b));
        *sum = differences.fold(0, |sum, d| sum.saturating_add(d.into()));
    }
}
