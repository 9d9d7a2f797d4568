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

use super::pixels::{GROUP, Group};
use crate::cpu::Level;

/// d of each row sprite (first index) and each column sprite.
pub(super) type SadTile = [[u64; GROUP]; GROUP];

/// Which pairs are compared.
#[derive(Clone, Copy)]
pub(super) struct Tile<'a> {
    pub(super) rows: Group<'a>,
    pub(super) columns: Group<'a>,
    /// Only pairs with column >= row are asked for: the tile lies on the matrix's diagonal.
    pub(super) diagonal: bool,
}

impl Tile<'_> {
    /// The columns asked for in a row.
    fn columns_of(&self, row: usize) -> Range<usize> {
        let first = if self.diagonal { row } else { 0 };
        first..self.columns.n_sprites
    }

    /// Adds d of `R` rows and `C` columns in a block that is blank in all those rows or in all those
    /// columns: |a - 0| is a, whose sum is known. Returns false, and adds nothing, when it is neither.
    #[inline]
    fn add_blank<const R: usize, const C: usize>(
        &self,
        [block, row, column]: [usize; 3],
        sums: &mut SadTile,
    ) -> bool {
        let a: [u32; R] = std::array::from_fn(|r| self.rows.sum(block, row + r));
        let b: [u32; C] = std::array::from_fn(|c| self.columns.sum(block, column + c));
        if a != [0; R] && b != [0; C] {
            return false;
        }
        for (r, a) in a.into_iter().enumerate() {
            for (c, b) in b.into_iter().enumerate() {
                sums[row + r][column + c] += u64::from(a + b);
            }
        }
        true
    }
}

/// The distances of a tile. Entries that were not asked for may hold anything.
///
/// `cpu` must be a level that this machine has; a level of another machine falls back to scalar.
pub(super) fn sad_tile(cpu: Level, tile: Tile<'_>) -> Box<SadTile> {
    let mut sums = Box::new([[0; GROUP]; GROUP]);
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => avx2::sad_tile(tile, &mut sums),
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => avx512::sad_tile(tile, &mut sums),
        #[cfg(target_arch = "aarch64")]
        Level::Neon => neon::sad_tile(tile, &mut sums),
        _ => scalar::sad_tile(tile, &mut sums),
    }
    sums
}
