//! Sums of absolute differences of 48 x 48 sprites at a time, by the vector instructions asked for
//! (ALGORITHMS.md 5, distance engine). `scalar` is the definition; the others are only fast.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;
pub(super) mod scalar;

use std::ops::Range;

use super::group::{GROUP, Group};
use crate::cpu::Level;

/// d of each row sprite (first index) and each column sprite.
pub(super) type SadTile = [[u64; GROUP]; GROUP];

/// Which pairs are compared.
#[derive(Clone, Copy)]
pub(super) struct Tile<'a> {
    pub(super) rows: Group<'a>,
    pub(super) columns: Group<'a>,
    /// The columns asked for in each row, as bits.
    pub(super) wanted: &'a Wanted,
}

/// Values at a time of [`least_differences`].
pub(super) const LANES: usize = 16;

/// The sums of absolute differences of a row of values, each below 2^15, and each of many rows. All are
/// of the same length, a multiple of [`LANES`]; what exceeds 32 bits is cut off there.
pub(super) fn least_differences(cpu: Level, row: &[u16], others: &[u16], sums: &mut [u32]) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => avx2::least_differences(row, others, sums),
        _ => scalar::least_differences(row, others, sums),
    }
}

/// Which columns of a tile are asked for in each of its rows: bit k is column k.
pub(super) type Wanted = [u64; GROUP];

/// Every pair of two groups of so many sprites.
pub(super) fn all(rows: Group<'_>, columns: Group<'_>) -> Wanted {
    let bits = (1 << columns.n_sprites) - 1;
    std::array::from_fn(|row| if row < rows.n_sprites { bits } else { 0 })
}

/// The pairs with column >= row of one group with itself: a tile on the matrix's diagonal.
pub(super) fn upper(rows: Group<'_>, columns: Group<'_>) -> Wanted {
    let mut wanted = all(rows, columns);
    (0..)
        .zip(&mut wanted)
        .for_each(|(row, bits)| *bits &= u64::MAX << row);
    wanted
}

impl Tile<'_> {
    /// The corners of the blocks of `R` rows and `C` columns in which anything is asked for.
    fn corners<const R: usize, const C: usize>(&self) -> Vec<[usize; 2]> {
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

    /// Whether most pairs are asked for.
    #[cfg(target_arch = "x86_64")]
    fn is_dense(&self) -> bool {
        let n_wanted: u32 = self.wanted.iter().map(|bits| bits.count_ones()).sum();
        2 * n_wanted as usize > self.rows.n_sprites * self.columns.n_sprites
    }

    /// d of all pairs as if no two sprites had anything in the same block: |a - 0| is a, whose sum is known.
    fn apart(&self) -> SadTile {
        let (rows, columns) = (self.rows.totals(), self.columns.totals());
        rows.map(|row| columns.map(|column| row + column))
    }

    /// Whether some of these rows and some of these columns have anything in a block.
    #[inline]
    fn meet(&self, block: usize, [rows, columns]: [&Range<usize>; 2]) -> bool {
        let filled = |group: Group<'_>, sprites: &Range<usize>| {
            group.filled(block) >> sprites.start & ((1 << sprites.len()) - 1) != 0
        };
        filled(self.rows, rows) && filled(self.columns, columns)
    }

    /// Puts right what was summed as if apart: in a block a row and a column differ by `d`.
    #[inline]
    fn put(&self, block: usize, [row, column]: [usize; 2], d: u64, sums: &mut SadTile) {
        let apart = self.rows.sum(block, row) + self.columns.sum(block, column);
        sums[row][column] = sums[row][column] + d - u64::from(apart);
    }
}

/// The distances of a tile. Entries that were not asked for may hold anything.
///
/// `cpu` must be a level that this machine has; a level of another machine falls back to scalar.
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
