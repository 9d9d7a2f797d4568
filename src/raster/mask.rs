//! Binary masks over a rectangle, with the operations for silhouettes: filling holes, majority filter,
//! erosion, dilation and opening (docs/explanation/algorithms.md, "Silhouette").

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
        let mut open: Vec<usize> = Vec::new();
        let border = (0..w).flat_map(|x| [x, (h - 1) * w + x]);
        for at in border.chain((0..h).flat_map(|y| [y * w, y * w + w - 1])) {
            if self.bits[at] == 0 && !outside[at] {
                outside[at] = true;
                open.push(at);
            }
        }
        while let Some(at) = open.pop() {
            let (x, y) = (at % w, at / w);
            let mut visit = |next: usize| {
                if self.bits[next] == 0 && !outside[next] {
                    outside[next] = true;
                    open.push(next);
                }
            };
            if x > 0 {
                visit(at - 1);
            }
            if x + 1 < w {
                visit(at + 1);
            }
            if y > 0 {
                visit(at - w);
            }
            if y + 1 < h {
                visit(at + w);
            }
        }
        for (bit, outside) in self.bits.iter_mut().zip(outside) {
            *bit |= u8::from(!outside);
        }
    }

    /// Returns the majority of each 3 x 3 neighborhood: set if at least 5 of 9 pixels are.
    pub fn majority(&self) -> Mask {
        self.counted(|n, _| n >= 5)
    }

    /// Returns the pixels whose 3 x 3 neighborhood is completely set. Pixels outside `rect` count as clear.
    pub fn eroded(&self) -> Mask {
        self.counted(|n, _| n == 9)
    }

    /// Returns the pixels with any set pixel in their 3 x 3 neighborhood.
    pub fn dilated(&self) -> Mask {
        self.counted(|n, _| n > 0)
    }

    /// Returns the mask eroded `n_px` times.
    pub fn eroded_by(&self, n_px: u32) -> Mask {
        (0..n_px).fold(self.clone(), |mask, _| mask.eroded())
    }

    /// Returns the mask dilated `n_px` times.
    pub fn dilated_by(&self, n_px: u32) -> Mask {
        (0..n_px).fold(self.clone(), |mask, _| mask.dilated())
    }

    /// Returns the mask eroded, then dilated, which removes parts thinner than 3 pixels.
    pub fn opened(&self) -> Mask {
        self.eroded().dilated()
    }

    /// Returns, for each pixel, the number of erosions that clear it; 0 if it is clear. This is the
    /// chessboard distance to the nearest clear pixel, with pixels outside `rect` clear.
    pub fn depth_px(&self) -> Vec<u32> {
        let (w, h) = (self.width(), self.height());
        let mut depth = vec![0; w * h];
        let least = |depth: &[u32], x: usize, y: usize, around: [[isize; 2]; 4]| {
            let of = |[dx, dy]: [isize; 2]| {
                let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
                (x < w && y < h).then(|| depth[y * w + x])
            };
            around
                .into_iter()
                .map(|to| of(to).unwrap_or(0))
                .min()
                .unwrap_or(0)
        };
        for at in 0..w * h {
            if self.bits[at] == 1 {
                let around = [[-1, 0], [-1, -1], [0, -1], [1, -1]];
                depth[at] = 1 + least(&depth, at % w, at / w, around);
            }
        }
        for at in (0..w * h).rev() {
            if self.bits[at] == 1 {
                let around = [[1, 0], [1, 1], [0, 1], [-1, 1]];
                depth[at] = depth[at].min(1 + least(&depth, at % w, at / w, around));
            }
        }
        depth
    }

    /// Returns a mask computed from the number of set pixels in each 3 x 3 neighborhood and from the pixel
    /// itself.
    fn counted(&self, keep: impl Fn(u8, u8) -> bool) -> Mask {
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
        let bits = self.bits.chunks_exact(w);
        for (y, (kept, bits)) in result.bits.chunks_exact_mut(w).zip(bits).enumerate() {
            let around = rows[y * w..][..3 * w].split_at(w);
            let (above, (here, below)) = (around.0, around.1.split_at(w));
            let sums = above.iter().zip(here).zip(below);
            for ((kept, bit), ((a, b), c)) in kept.iter_mut().zip(bits).zip(sums) {
                *kept = u8::from(keep(a + b + c, *bit));
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

    #[test]
    fn opening_removes_what_is_thinner_than_three() {
        let thin = mask(&["........", ".###....", ".######.", ".###....", "........"]);
        assert_eq!(
            thin.opened(),
            mask(&["........", ".###....", ".###....", ".###....", "........"])
        );
    }
}
