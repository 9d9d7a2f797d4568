//! Sums of absolute differences for 48 x 48 pairs of sprites, with the given instruction level
//! (docs/explanation/algorithms.md, "Distances"). `scalar` is the definition. The other kernels are faster
//! and give the same results.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;
mod scalar;

use std::ops::Range;

use super::group::{GROUP, Group};
use crate::cpu::Level;

/// d of each row sprite (first index) and each column sprite.
pub(super) type SadTile = [[u64; GROUP]; GROUP];

/// Two groups of sprites and the pairs to compare.
#[derive(Clone, Copy)]
pub(super) struct Tile<'a> {
    pub(super) rows: Group<'a>,
    pub(super) columns: Group<'a>,
    /// The needed columns of each row, as bits.
    pub(super) wanted: &'a Wanted,
}

/// Number of values that [`sad_u16`] processes at a time.
pub(super) const LANES: usize = 16;

/// Writes the sums of absolute differences between one row of values and each of many rows.
///
/// Values are below 2^15. All rows have the same length, a multiple of [`LANES`]. Sums saturate at 32 bits.
pub(super) fn sad_u16(cpu: Level, row: &[u16], others: &[u16], sums: &mut [u32]) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => avx2::sad_u16(row, others, sums),
        _ => scalar::sad_u16(row, others, sums),
    }
}

/// The needed columns in each row of a tile: bit k is column k.
pub(super) type Wanted = [u64; GROUP];

/// Returns all pairs of two groups.
pub(super) fn all_pairs(rows: Group<'_>, columns: Group<'_>) -> Wanted {
    let bits = (1 << columns.n_sprites) - 1;
    std::array::from_fn(|row| if row < rows.n_sprites { bits } else { 0 })
}

/// Returns the pairs with column >= row of a group with itself, for a tile on the diagonal.
pub(super) fn upper_triangle(rows: Group<'_>, columns: Group<'_>) -> Wanted {
    let mut wanted = all_pairs(rows, columns);
    (0..)
        .zip(&mut wanted)
        .for_each(|(row, bits)| *bits &= u64::MAX << row);
    wanted
}

impl Tile<'_> {
    /// Returns the corners of the subtiles of `R` rows and `C` columns that contain a needed pair.
    fn subtiles<const R: usize, const C: usize>(&self) -> Vec<[usize; 2]> {
        let rows = (0..self.rows.n_sprites).step_by(R);
        rows.flat_map(|row| {
            let wanted = self.wanted[row..row + R].iter().fold(0, |a, b| a | b);
            (0..self.columns.n_sprites)
                .step_by(C)
                .filter(move |column| wanted >> column & ((1 << C) - 1) != 0)
                .map(move |column| [row, column])
        })
        .collect()
    }

    /// Returns whether most pairs are needed.
    #[cfg(target_arch = "x86_64")]
    fn is_dense(&self) -> bool {
        let n_wanted: u32 = self.wanted.iter().map(|bits| bits.count_ones()).sum();
        2 * n_wanted as usize > self.rows.n_sprites * self.columns.n_sprites
    }

    /// Returns d of all pairs as if no two sprites had content in the same block. d is then the sum of both
    /// totals.
    fn disjoint_sums(&self) -> SadTile {
        let (rows, columns) = (self.rows.totals(), self.columns.totals());
        rows.map(|row| columns.map(|column| row + column))
    }

    /// Returns whether a block has content in some of the given rows and in some of the given columns.
    #[inline]
    fn overlap(&self, block: usize, [rows, columns]: [&Range<usize>; 2]) -> bool {
        let filled = |group: Group<'_>, sprites: &Range<usize>| {
            group.filled(block) >> sprites.start & ((1 << sprites.len()) - 1) != 0
        };
        filled(self.rows, rows) && filled(self.columns, columns)
    }

    /// Replaces the contribution of one block to a pair, computed by `disjoint_sums`, by its actual
    /// difference `d`.
    #[inline]
    fn correct(&self, block: usize, [row, column]: [usize; 2], d: u64, sums: &mut SadTile) {
        let disjoint = self.rows.sum(block, row) + self.columns.sum(block, column);
        sums[row][column] = sums[row][column] + d - u64::from(disjoint);
    }
}

/// Returns the distances of a tile. Entries that are not needed are unspecified.
///
/// `cpu` must be a level of this machine. A level of another architecture falls back to scalar.
pub(super) fn sad_tile(cpu: Level, tile: Tile<'_>) -> Box<SadTile> {
    let mut sums = Box::new([[0; GROUP]; GROUP]);
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 if tile.is_dense() => avx512::sad_tile(tile, &mut sums),
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => avx2::sad_tile(tile, &mut sums),
        #[cfg(target_arch = "aarch64")]
        Level::Neon => neon::sad_tile(tile, &mut sums),
        _ => scalar::sad_tile(tile, &mut sums),
    }
    sums
}
