//! Binary masks over a rectangle, with the operations for silhouettes: filling holes, majority filter,
//! erosion and dilation (docs/explanation/algorithms.md, "Silhouette").

use crate::geometry::Rect;

/// The set pixels of `rect`. Pixels outside `rect` count as clear.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Mask {
    /// The part of the image that the mask covers.
    pub rect: Rect,
    /// One byte per pixel, row by row: 0 or 1.
    pub bits: Vec<u8>,
}

impl Mask {
    /// Returns a clear mask.
    pub fn new(rect: Rect) -> Mask {
        Mask {
            rect,
            bits: vec![0; rect.area() as usize],
        }
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.rect.w as usize
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.rect.h as usize
    }

    /// Returns whether the pixel in column `x` and row `y` of the image is set.
    pub fn is_set(&self, x: u32, y: u32) -> bool {
        let at = || (y - self.rect.y) as usize * self.width() + (x - self.rect.x) as usize;
        self.rect.contains(x, y) && self.bits[at()] == 1
    }

    /// Sets the pixels that are set in another mask, within this mask's rectangle.
    pub fn add(&mut self, other: &Mask) {
        let both = self.rect.intersection(&other.rect);
        for y in both.y..both.bottom() {
            let row = |mask: &Mask| {
                let first =
                    (y - mask.rect.y) as usize * mask.width() + (both.x - mask.rect.x) as usize;
                first..first + both.w as usize
            };
            let (to, from) = (row(self), row(other));
            for (bit, &other) in self.bits[to].iter_mut().zip(&other.bits[from]) {
                *bit |= other;
            }
        }
    }

    /// Returns the number of set pixels.
    pub fn area(&self) -> usize {
        self.bits.iter().map(|&bit| bit as usize).sum()
    }

    /// Sets every clear pixel that is not connected to the mask's border through clear pixels (4-connected).
    pub fn fill_holes(&mut self) {
        let (w, h) = (self.width(), self.height());
        if w == 0 || h == 0 {
            return;
        }
        let mut outside = vec![false; self.bits.len()];
        let border = (0..w).flat_map(|x| [x, (h - 1) * w + x]);
        let border = border.chain((0..h).flat_map(|y| [y * w, y * w + w - 1]));
        let mut open: Vec<usize> = border.collect();
        while let Some(at) = open.pop() {
            if self.bits[at] != 0 || std::mem::replace(&mut outside[at], true) {
                continue;
            }
            let (x, y) = (at % w, at / w);
            open.extend((x > 0).then(|| at - 1));
            open.extend((x + 1 < w).then(|| at + 1));
            open.extend((y > 0).then(|| at - w));
            open.extend((y + 1 < h).then(|| at + w));
        }
        for (bit, outside) in self.bits.iter_mut().zip(outside) {
            *bit |= u8::from(!outside);
        }
    }

    /// Returns the majority of each 3 x 3 neighborhood: set if at least 5 of 9 pixels are.
    pub fn majority(&self) -> Mask {
        self.by_count(|n| n >= 5)
    }

    /// Returns the pixels whose 3 x 3 neighborhood is completely set. Pixels outside `rect` count as clear.
    pub fn eroded(&self) -> Mask {
        self.by_count(|n| n == 9)
    }

    /// Returns the pixels with any set pixel in their 3 x 3 neighborhood.
    pub fn dilated(&self) -> Mask {
        self.by_count(|n| n > 0)
    }

    /// Returns the mask eroded `n_px` times.
    pub fn eroded_by(&self, n_px: u32) -> Mask {
        (0..n_px).fold(self.clone(), |mask, _| mask.eroded())
    }

    /// Returns the mask dilated `n_px` times.
    pub fn dilated_by(&self, n_px: u32) -> Mask {
        (0..n_px).fold(self.clone(), |mask, _| mask.dilated())
    }

    /// Returns, for each pixel, the number of erosions that clear it; 0 if it is clear. This is the
    /// chessboard distance to the nearest clear pixel, with pixels outside `rect` clear.
    pub fn depth_px(&self) -> Vec<u32> {
        let (w, h) = (self.width(), self.height());
        // A border of zeros surrounds the depths.
        let stride = w + 2;
        let index = |at: usize| (at / w + 1) * stride + at % w + 1;
        let set_pixels = (0..w * h).filter(|&at| self.bits[at] == 1);
        let set_pixels: Vec<usize> = set_pixels.map(index).collect();
        let mut depth = vec![0u32; stride * (h + 2)];
        let least = |depth: &[u32], around: [usize; 4]| {
            around
                .iter()
                .fold(u32::MAX, |least, &k| least.min(depth[k]))
        };
        for &k in &set_pixels {
            let above = k - stride;
            depth[k] = 1 + least(&depth, [k - 1, above - 1, above, above + 1]);
        }
        for &k in set_pixels.iter().rev() {
            let below = k + stride;
            depth[k] = depth[k].min(1 + least(&depth, [k + 1, below + 1, below, below - 1]));
        }
        (0..w * h).map(|at| depth[index(at)]).collect()
    }

    /// Returns the pixels for which `keep` holds, given the number of set pixels in their 3 x 3 neighborhood.
    fn by_count(&self, keep: impl Fn(u8) -> bool) -> Mask {
        let (w, h) = (self.width(), self.height());
        let mut result = Mask::new(self.rect);
        if w == 0 {
            return result;
        }
        // Sums of three along rows first, then along columns, with a row of zeros above and below.
        let mut rows = vec![0u8; (h + 2) * w];
        for (sums, bits) in rows[w..].chunks_exact_mut(w).zip(self.bits.chunks_exact(w)) {
            sums.copy_from_slice(bits);
            for (sum, left) in sums[1..].iter_mut().zip(bits) {
                *sum += left;
            }
            for (sum, right) in sums.iter_mut().zip(&bits[1..]) {
                *sum += right;
            }
        }
        for (y, kept) in result.bits.chunks_exact_mut(w).enumerate() {
            let (above, rest) = rows[y * w..].split_at(w);
            let (here, below) = rest.split_at(w);
            for (kept, ((a, b), c)) in kept.iter_mut().zip(above.iter().zip(here).zip(below)) {
                *kept = u8::from(keep(a + b + c));
            }
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(rows: &[&str]) -> Mask {
        let rect = Rect::of_size(rows[0].len() as u32, rows.len() as u32);
        Mask {
            rect,
            bits: rows
                .iter()
                .flat_map(|r| r.bytes().map(|b| u8::from(b == b'#')))
                .collect(),
        }
    }

    #[test]
    fn holes_are_filled_but_bays_are_not() {
        let mut ring = mask(&["......", ".####.", ".#..#.", ".####.", ".#...."]);
        ring.fill_holes();
        assert_eq!(
            ring,
            mask(&["......", ".####.", ".####.", ".####.", ".#...."])
        );
    }

    #[test]
    fn majority_drops_a_speck_and_closes_a_notch() {
        let ragged = mask(&["#......", "...###.", "...#.#.", "...###.", "...###."]);
        assert_eq!(
            ragged.majority(),
            mask(&[".......", "....#..", "...###.", "...###.", "....#.."])
        );
    }

    #[test]
    fn depth_is_the_number_of_erosions_that_clear_a_pixel() {
        let blot = mask(&[
            "#######.", "#######.", "#######.", "#######.", "####.##.", "........",
        ]);
        let depth = blot.depth_px();
        for n in 0..4 {
            let eroded = blot.eroded_by(n);
            let deeper = depth.iter().map(|&depth| u8::from(depth > n));
            assert!(deeper.eq(eroded.bits.iter().copied()), "{n}");
        }
    }
}
