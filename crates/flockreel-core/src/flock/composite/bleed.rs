//! Color of transparent pixels next to visible ones.
//!
//! Transparent pixels near a visible pixel take its color. Without that, a codec that shares or smooths
//! color among neighboring pixels would draw a dark rim (docs/explanation/algorithms.md, "Compositing").

use crate::geometry::Rect;

/// Distance that color spreads, in pixels: half of the largest chroma block plus the range of a smoothing
/// codec.
const REACH: usize = 8;

/// Spreads color from the visible pixels in a box of a straight-alpha picture, first along columns, then
/// along rows. Alpha stays the same.
pub(super) fn bleed(rgba: &mut [u8], [width, height]: [u32; 2], rect: Rect) {
    let rect = rect.inflated(REACH as u32, width, height);
    let width = width as usize;
    let (x, y) = (rect.x as usize, rect.y as usize);
    let (w, h) = (rect.w as usize, rect.h as usize);
    for column in x..x + w {
        let first = y * width + column;
        along(rgba, (0..h).map(|k| first + k * width));
        along(rgba, (0..h).rev().map(|k| first + k * width));
    }
    for row in y..y + h {
        let first = row * width + x;
        along(rgba, first..first + w);
        along(rgba, (first..first + w).rev());
    }
}

/// Copies the color of the last visible pixel to the transparent pixels that follow it, in the given order.
fn along(rgba: &mut [u8], pixels: impl Iterator<Item = usize>) {
    let mut color = [0; 3];
    let mut left = 0;
    for at in pixels.map(|pixel| pixel * 4) {
        if rgba[at + 3] > 0 {
            color.copy_from_slice(&rgba[at..at + 3]);
            left = REACH;
        } else if left > 0 {
            rgba[at..at + 3].copy_from_slice(&color);
            left -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn color_spreads_on_all_sides_and_alpha_does_not() {
        let mut rgba = [7, 7, 7, 0].repeat(21 * 21);
        let at = |x: usize, y: usize| (y * 21 + x) * 4;
        rgba[at(10, 10)..at(10, 10) + 4].copy_from_slice(&[200, 100, 50, 255]);
        let (x, y, w, h) = (10, 10, 1, 1);
        bleed(&mut rgba, [21, 21], Rect { x, y, w, h });
        for (x, y) in [(2, 10), (18, 10), (10, 2), (10, 18)] {
            assert_eq!(rgba[at(x, y)..at(x, y) + 4], [200, 100, 50, 0]);
        }
        assert_eq!(rgba[at(1, 10)..at(1, 10) + 4], [7, 7, 7, 0]);
        assert_eq!(rgba.chunks_exact(4).filter(|p| p[3] > 0).count(), 1);
    }
}
