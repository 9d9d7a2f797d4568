//! Lower bounds for the distance of two sprites: their pixel sums over squares
//! (docs/explanation/algorithms.md, "Distances").
//!
//! By the triangle inequality, |sum a - sum b| <= sum |a - b| over any set of pixels. The summed differences
//! of the square sums are therefore at most the distance.
//!
//! The squares are 8 and 16 pixels wide, with one sum per plane. The sums of 16-pixel squares are halved, so
//! that their differences fit signed 16-bit lanes. The bound then subtracts the largest possible rounding
//! error.

use super::super::kernel::{LANES, sad_u16};
use crate::cpu::Level;

/// Side of a fine square, pixels. Its sum is at most 64 * 255.
const FINE: usize = 8;

/// Square sums of all sprites, for one size of squares.
#[derive(Clone, Debug, Default)]
pub(super) struct SquareSums {
    /// Number of values per sprite: squares by rows, times 4 planes, padded to a multiple of `LANES`.
    n_values: usize,
    values: Vec<u16>,
    /// True if the values are half the sums, rounded down.
    halved: bool,
}

/// Square sums of both sizes, for plain or for mirrored sprites.
#[derive(Clone, Debug, Default)]
pub(super) struct Bounds {
    pub(super) coarse: SquareSums,
    pub(super) fine: SquareSums,
}

/// Square sums of one sprite.
pub(super) struct SpriteSums {
    fine: Vec<u16>,
    coarse: Vec<u16>,
}

impl SpriteSums {
    /// Computes the sums of a sprite with four bytes per pixel and `width` pixels per row.
    pub(super) fn new(bytes: &[u8], width: usize) -> SpriteSums {
        let height = bytes.len() / (4 * width).max(1);
        let (columns, rows) = (width.div_ceil(FINE), height.div_ceil(FINE));
        let mut fine = vec![[0u16; 4]; columns * rows];
        // Vertical sums come first, because they add whole rows.
        let mut column_sums = vec![0u16; width * 4];
        for row in 0..rows {
            let lines = row * FINE..height.min((row + 1) * FINE);
            column_sums.fill(0);
            for line in
                bytes[lines.start * width * 4..lines.end * width * 4].chunks_exact(width * 4)
            {
                let both = column_sums.iter_mut().zip(line);
                both.for_each(|(sum, byte)| *sum += u16::from(*byte));
            }
            for (x, pixel) in column_sums.as_chunks::<4>().0.iter().enumerate() {
                let square = &mut fine[row * columns + x / FINE];
                (0..4).for_each(|plane| square[plane] += pixel[plane]);
            }
        }
        let half = columns.div_ceil(2);
        let mut coarse = vec![[0u16; 4]; half * rows.div_ceil(2)];
        for (k, sums) in fine.iter().enumerate() {
            let (x, y) = (k % columns, k / columns);
            let square = &mut coarse[y / 2 * half + x / 2];
            (0..4).for_each(|plane| square[plane] += sums[plane]);
        }
        SpriteSums {
            fine: fine.into_flattened(),
            coarse: coarse.into_flattened(),
        }
    }
}

impl Bounds {
    /// Collects the sums of all sprites in order.
    pub(super) fn new(sums: &[SpriteSums]) -> Bounds {
        Bounds {
            coarse: SquareSums::new(sums.iter().map(|s| &s.coarse[..]), true),
            fine: SquareSums::new(sums.iter().map(|s| &s.fine[..]), false),
        }
    }
}

impl SquareSums {
    fn new<'a>(sprites: impl Iterator<Item = &'a [u16]> + Clone, halved: bool) -> SquareSums {
        let longest = sprites.clone().map(<[u16]>::len).max().unwrap_or(0);
        let n_values = longest.next_multiple_of(LANES);
        let mut values = Vec::with_capacity(n_values * sprites.clone().count());
        for sprite in sprites {
            values.extend(sprite.iter().map(|sum| sum >> u32::from(halved)));
            values.resize(values.len().next_multiple_of(n_values.max(1)), 0);
        }
        SquareSums {
            n_values,
            values,
            halved,
        }
    }

    /// Returns the values of one sprite, each below 2^15.
    fn row(&self, frame_idx: usize) -> &[u16] {
        &self.values[frame_idx * self.n_values..][..self.n_values]
    }

    /// Writes lower bounds of the distances between a row sprite and the column sprites from `first_column`
    /// on.
    ///
    /// The row sprite is from `self`. Bounds saturate at 32 bits.
    pub(super) fn write_bounds(
        &self,
        cpu: Level,
        row: usize,
        columns: &SquareSums,
        first_column: usize,
        bounds: &mut [u32],
    ) {
        let others = &columns.values[first_column * columns.n_values..];
        sad_u16(cpu, self.row(row), others, bounds);
        if self.halved {
            // Halves are rounded down, so each doubled difference may be too large by 1.
            let rounding = self.n_values as u32;
            for bound in bounds {
                *bound = bound.saturating_mul(2).saturating_sub(rounding);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_added_up_over_squares() {
        // 10 x 9 pixels. The first plane contains the column index, the second 1.
        let bytes: Vec<u8> = (0..90).flat_map(|k| [(k % 10) as u8, 1, 0, 0]).collect();
        let sums = SpriteSums::new(&bytes, 10);
        let squares = sums.fine.as_chunks::<4>().0.iter();
        let first: Vec<[u16; 2]> = squares.map(|s| [s[0], s[1]]).collect();
        assert_eq!(first, [[28 * 8, 64], [17 * 8, 16], [28, 8], [17, 2]]);
        assert_eq!(sums.coarse[..2], [45 * 9, 90]);
    }
}
