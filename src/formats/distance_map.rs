//! `distance.png`: the distance matrix as a picture, near = black, far = white (O's figure 2).
//!
//! At most 1024 x 1024; a longer footage is min-pooled, so that a single like moment still shows.
//! Gray levels are round(255 D / largest D drawn): whoever wants numbers takes `distance.npy`.

use super::picture;
use crate::analysis::distance::{Cancelled, Distances, PooledMatrix};
use crate::progress::Progress;

/// Rows and columns at most.
pub const LARGEST_SIDE: usize = 1024;

/// Computes and draws the distances, as the bytes of a PNG. A footage shorter than a clip gives a
/// single white pixel.
pub fn draw(distances: &Distances<'_>, progress: &dyn Progress) -> Result<Vec<u8>, Cancelled> {
    let matrix = PooledMatrix::of(distances, LARGEST_SIDE, progress)?;
    let side = matrix.side as u32;
    Ok(match side {
        0 => picture::write_gray(1, 1, &[255]),
        _ => picture::write_gray(side, side, &levels(&matrix.cells)),
    })
}

fn levels(cells: &[u64]) -> Vec<u8> {
    let largest = cells.iter().copied().max().unwrap_or(0).max(1);
    let level = |&distance: &u64| (255.0 * distance as f64 / largest as f64).round() as u8;
    cells.iter().map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_black_and_far_is_white() {
        assert_eq!(levels(&[0, 50, 200, 100]), [0, 64, 255, 128]);
        assert_eq!(levels(&[0, 0]), [0, 0]);
    }
}
