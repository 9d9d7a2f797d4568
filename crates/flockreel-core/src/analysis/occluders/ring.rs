//! Sums over the ring of pixels around a pixel, in constant time by summed-area tables (Crow 1984).

use crate::geometry::Rect;

/// Outer radius of a ring in rows and columns, pixels. Free choice.
pub(super) const OUTER_PX: usize = 4;
/// Radius of the square left out in the middle, pixels: blur spreads the center pixel over its neighbors.
const INNER_PX: usize = 1;

/// A summed-area table: the sum over any box takes four look-ups.
pub(super) struct SummedArea {
    width: usize,
    height: usize,
    /// Table with one row and one column more than the plane. Entries may wrap around; ring sums are small
    /// and exact.
    sums: Vec<i32>,
}

impl SummedArea {
    /// Builds the table of a plane of the size of `rect`, with `value(k)` at index k.
    pub(super) fn new(rect: Rect, value: impl Fn(usize) -> i32) -> SummedArea {
        let (width, height) = (rect.w as usize, rect.h as usize);
        let mut sums = vec![0i32; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0i32;
            for x in 0..width {
                row = row.wrapping_add(value(y * width + x));
                let above = sums[y * (width + 1) + x + 1];
                sums[(y + 1) * (width + 1) + x + 1] = above.wrapping_add(row);
            }
        }
        SummedArea {
            width,
            height,
            sums,
        }
    }

    /// Returns the sum over the ring around a pixel. Pixels beyond the plane count as 0.
    pub(super) fn ring(&self, x: usize, y: usize) -> i32 {
        self.square(x, y, OUTER_PX)
            .wrapping_sub(self.square(x, y, INNER_PX))
    }

    fn square(&self, x: usize, y: usize, reach: usize) -> i32 {
        let (left, top) = (x.saturating_sub(reach), y.saturating_sub(reach));
        let right = (x + reach + 1).min(self.width);
        let bottom = (y + reach + 1).min(self.height);
        let sum = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        sum(right, bottom)
            .wrapping_sub(sum(left, bottom))
            .wrapping_sub(sum(right, top))
            .wrapping_add(sum(left, top))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ring_sums_near_pixels_without_the_center() {
        let rect = Rect::of_size(13, 11);
        let value = |k: usize| (k as i32 * 7919) % 511 - 255;
        let plane = SummedArea::new(rect, value);
        for (x, y) in [(0, 0), (6, 5), (12, 10), (2, 9)] {
            let mut wanted = 0;
            for (u, v) in (0..11usize).flat_map(|v| (0..13usize).map(move |u| (u, v))) {
                let away = u.abs_diff(x).max(v.abs_diff(y));
                if (2..=4).contains(&away) {
                    wanted += value(v * 13 + u);
                }
            }
            assert_eq!(plane.ring(x, y), wanted, "{x}, {y}");
        }
    }
}
