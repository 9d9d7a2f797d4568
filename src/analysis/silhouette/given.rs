//! The silhouettes of a mask that is given with the footage.

use crate::geometry::Rect;
use crate::raster::runs::{self, Component};
use crate::raster::{GivenMask, Mask};

/// Pixels that are the animal by this much are its silhouette, 0..=255: a half.
const INSIDE: u8 = 128;

/// The components of a mask of the given size; nothing inside the `ignored` boxes counts.
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
            .map(|&alpha| u8::from(alpha >= INSIDE))
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
