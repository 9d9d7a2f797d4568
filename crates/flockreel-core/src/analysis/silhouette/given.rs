//! Silhouettes from a mask that comes with the footage, in place of a comparison with the background.

use crate::geometry::Rect;
use crate::raster::runs::{self, Component};
use crate::raster::{GivenMask, Mask};

/// Least alpha of a silhouette pixel, 0..=255: half covered by the animal.
const MIN_ALPHA: u8 = 128;

/// Returns the connected components of a mask of the given size. Pixels inside the `ignored` boxes are left
/// out.
pub(super) fn components(
    mask: &GivenMask,
    [width, height]: [u32; 2],
    ignored: &[Rect],
) -> Vec<Component> {
    let mut inside = Mask {
        rect: Rect::of_size(width, height),
        bits: mask
            .alpha
            .iter()
            .map(|&alpha| u8::from(alpha >= MIN_ALPHA))
            .collect(),
    };
    for rect in ignored {
        for row in rect.y as usize..rect.bottom() as usize {
            let first = row * width as usize;
            inside.bits[first + rect.x as usize..first + rect.right() as usize].fill(0);
        }
    }
    runs::components(&inside)
}
