//! Lower bounds for the distance of two sprites: their pixel sums over squares
//! (docs/explanation/algorithms.md, "Distances").
//!
//! By the triangle inequality, |sum a - sum b| <= sum |a - b| over any set of pixels. The summed differences
//! of the square sums are therefore at most the distance.
//!
//! The squares are 8 and 16 pixels wide, with one sum per plane. The squares of a mirrored sprite are counted
//! from the opposite edge. The sums of 16-pixel squares are halved, so that their differences fit signed
//! 16-bit lanes. The bound then subtracts the largest possible rounding error.

use super::kernel::{LANES, least_differences};
use super::page::Flip;
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
pub(super) struct Sums {
    fine: Vec<u16>,
    coarse: Vec<u16>,
}

impl Sums {
    /// Computes the sums of a sprite with four bytes per pixel and `width` pixels per row.
    pub(super) fn of(bytes: &[u8], width: usize) -> Sums {
        Sums::placed(bytes, width, [0, 0])
    }

    /// Computes the sums of the mirrored sprite.
    pub(super) fn of_mirrored(bytes: &[u8], width: usize, flip: Flip) -> Sums {
        let height = bytes.len() / (4 * width).max(1);
        let room = |side: usize| side.next_multiple_of(FINE) - side;
        // The squares begin at the opposite edge and are in reverse order.
        let (mut sums, size) = match flip {
            Flip::Columns => (fine(bytes, width, [room(width), 0]), squares(width, height)),
            Flip::Rows => (
                fine(bytes, width, [0, room(height)]),
                squares(width, height),
            ),
        };
        let [columns, _] = size;
        let rows = sums.as_chunks_mut::<4>().0.chunks_exact_mut(columns.max(1));
        match flip {
            Flip::Columns => rows.for_each(|row| row.reverse()),
            Flip::Rows => {
                sums = sums
                    .rchunks(columns.max(1) * 4)
                    .flatten()
                    .copied()
                    .collect()
            }
        }
        Sums::with_coarse(sums, size)
    }

    fn placed(bytes: &[u8], width: usize, offset: [usize; 2]) -> Sums {
        let height = bytes.len() / (4 * width).max(1);
        Sums::with_coarse(fine(bytes, width, offset), squares(width, height))
    }

    fn with_coarse(fine: Vec<u16>, [columns, rows]: [usize; 2]) -> Sums {
        let half = columns.div_ceil(2);
        let mut coarse = vec![[0u16; 4]; half * rows.div_ceil(2)];
        for (k, sums) in fine.as_chunks::<4>().0.iter().enumerate() {
            let (x, y) = (k % columns, k / columns);
            let square = &mut coarse[y / 2 * half + x / 2];
            (0..4).for_each(|plane| square[plane] += sums[plane]);
        }
        let coarse = coarse.into_flattened();
        Sums { fine, coarse }
    }
}

/// Returns the number of columns and rows of fine squares.
fn squares(width: usize, height: usize) -> [usize; 2] {
    [width.div_ceil(FINE), height.div_ceil(FINE)]
}

/// Returns the sums over fine squares of an image that starts `[left, top]` pixels from the corner of the
/// grid.
fn fine(bytes: &[u8], width: usize, [left, top]: [usize; 2]) -> Vec<u16> {
    let height = bytes.len() / (4 * width).max(1);
    let [columns, rows] = squares(width, height);
    let mut sums = vec![[0u16; 4]; columns * rows];
    // Vertical sums come first, because they add whole rows.
    let mut band = vec![0u16; width * 4];
    for row in 0..rows {
        let first = (row * FINE).saturating_sub(top);
        let last = ((row + 1) * FINE - top).min(height);
        band.fill(0);
        for line in bytes[first * width * 4..last * width * 4].chunks_exact(width * 4) {
            let both = band.iter_mut().zip(line);
            both.for_each(|(sum, byte)| *sum += u16::from(*byte));
        }
        for (x, pixel) in band.as_chunks::<4>().0.iter().enumerate() {
            let square = &mut sums[row * columns + (x + left) / FINE];
            (0..4).for_each(|plane| square[plane] += pixel[plane]);
        }
    }
    sums.into_flattened()
}

impl Bounds {
    /// Collects the sums of all sprites in order.
    pub(super) fn of(sums: &[Sums]) -> Bounds {
        Bounds {
            coarse: SquareSums::of(sums.iter().map(|s| &s.coarse[..]), true),
            fine: SquareSums::of(sums.iter().map(|s| &s.fine[..]), false),
        }
    }
}

impl SquareSums {
    fn of<'a>(sprites: impl Iterator<Item = &'a [u16]> + Clone, halved: bool) -> SquareSums {
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
    pub(super) fn row(&self, frame_idx: usize) -> &[u16] {
        &self.values[frame_idx * self.n_values..][..self.n_values]
    }

    /// Writes lower bounds of the distances between a row sprite and the column sprites from `first_column`
    /// on.
    ///
    /// The row sprite is from `self`. Bounds saturate at 32 bits.
    pub(super) fn against(
        &self,
        cpu: Level,
        row: usize,
        columns: &SquareSums,
        first_column: usize,
        least: &mut [u32],
    ) {
        let others = &columns.values[first_column * columns.n_values..];
        least_differences(cpu, self.row(row), others, least);
        if self.halved {
            // Halves are rounded down, so each doubled difference may be too large by 1.
            let rounding = self.n_values as u32;
            for sum in least {
                *sum = sum.saturating_mul(2).saturating_sub(rounding);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_added_up_and_mirrored_from_the_other_edge() {
        // 10 x 9 pixels. The first plane contains the column index, the second 1.
        let bytes: Vec<u8> = (0..90).flat_map(|k| [(k % 10) as u8, 1, 0, 0]).collect();
        let plain = Sums::of(&bytes, 10);
        let first: Vec<[u16; 2]> = plain
            .fine
            .as_chunks::<4>()
            .0
            .iter()
            .map(|s| [s[0], s[1]])
            .collect();
        assert_eq!(first, [[28 * 8, 64], [17 * 8, 16], [28, 8], [17, 2]]);
        assert_eq!(plain.coarse[..2], [45 * 9, 90]);
        let mirrored = Sums::of_mirrored(&bytes, 10, Flip::Columns);
        let flipped: Vec<u8> = bytes
            .chunks_exact(40)
            .flat_map(|row| row.rchunks_exact(4).flatten().copied())
            .collect();
        assert_eq!(mirrored.fine, Sums::of(&flipped, 10).fine);
        let upside_down: Vec<u8> = bytes.rchunks_exact(40).flatten().copied().collect();
        let mirrored = Sums::of_mirrored(&bytes, 10, Flip::Rows);
        assert_eq!(mirrored.fine, Sums::of(&upside_down, 10).fine);
    }
}
