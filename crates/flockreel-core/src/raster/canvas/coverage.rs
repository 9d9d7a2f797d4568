//! Records, for a canvas, which tiles were drawn on and which pixels are opaque
//! (docs/explanation/algorithms.md, "Compositing").
//!
//! Tiles are the dirty rectangles: each is converted and cleared once per frame, however many sprites overlap
//! there. Opacity is one bit for 8 pixels, so hidden parts are skipped 512 pixels at a time and short gaps
//! are ignored.

use std::ops::Range;

use crate::geometry::Rect;
use crate::raster::resample::{ONE, Quad};

/// Width and height of a tile, pixels. Even, so that no chroma block is divided between tiles.
const TILE: usize = 16;
/// Least alpha of an opaque pixel. What shows through is then less than half an 8-bit level. Overlapping fins
/// and soft edges reach it; what lies behind them is skipped.
const OPAQUE: i16 = ONE - ONE / 512;
/// Number of columns of a block.
const BLOCK: usize = 8;

/// The drawn tiles and opaque blocks of a canvas.
#[derive(Clone, Debug)]
pub struct Coverage {
    size: [u32; 2],
    /// For each tile, row by row: whether anything was drawn there.
    touched: Vec<bool>,
    /// For each row of pixels: one bit per block, set if all its pixels are opaque. Each row starts a new
    /// word.
    opaque: Vec<u64>,
}

impl Coverage {
    /// Returns the record of an empty canvas of `size` pixels.
    pub fn new(size: [u32; 2]) -> Coverage {
        let [width, height] = size.map(|side| side as usize);
        Coverage {
            size,
            touched: vec![false; width.div_ceil(TILE) * height.div_ceil(TILE)],
            opaque: vec![0; words_of(width) * height],
        }
    }

    /// Marks every tile as drawn on.
    pub fn mark_all_drawn(&mut self) {
        self.touched.fill(true);
    }

    /// Records that columns of row `y` were drawn on. `drawn` is the whole row afterwards.
    #[inline(always)]
    pub(super) fn add_run(&mut self, y: u32, columns: Range<u32>, drawn: &[Quad]) {
        let [y, x, to] = [y, columns.start, columns.end].map(|at| at as usize);
        let width = self.size[0] as usize;
        let (n_tiles, n_words) = (width.div_ceil(TILE), words_of(width));
        let line = y / TILE * n_tiles;
        self.touched[line + x / TILE..line + to.div_ceil(TILE)].fill(true);
        let words = &mut self.opaque[y * n_words..][..n_words];
        for block in x / BLOCK..to.div_ceil(BLOCK) {
            let rest = &drawn[block * BLOCK..];
            let is_opaque = match rest.first_chunk::<BLOCK>() {
                Some(pixels) => are_opaque(pixels),
                None => are_opaque(rest),
            };
            words[block / 64] |= u64::from(is_opaque) << (block % 64);
        }
    }

    /// Returns the first columns of `within`, in row `y`, that may not be opaque; empty if there are none.
    /// The columns skipped are opaque.
    #[inline]
    pub fn next_visible(&self, y: u32, within: Range<u32>) -> Range<u32> {
        let n_words = words_of(self.size[0] as usize);
        let row = &self.opaque[y as usize * n_words..][..n_words];
        let columns = |block: u32| (block * BLOCK as u32).clamp(within.start, within.end);
        let last = within.end.div_ceil(BLOCK as u32);
        let start = find(within.start / BLOCK as u32..last, |word| !row[word]);
        columns(start)..columns(find(start..last, |word| row[word]))
    }

    /// Yields disjoint boxes that contain everything drawn, and resets the record.
    pub fn take_drawn_boxes(&mut self) -> impl Iterator<Item = Rect> {
        self.opaque.fill(0);
        let [width, height] = self.size;
        let lines = self
            .touched
            .chunks_exact_mut(width.div_ceil(TILE as u32) as usize);
        lines.enumerate().flat_map(move |(line, tiles)| {
            let mut at = 0;
            std::iter::from_fn(move || {
                let from = at + tiles[at..].iter().position(|&touched| touched)?;
                at = from + tiles[from..].iter().take_while(|&&touched| touched).count();
                tiles[from..at].fill(false);
                let [left, top, right, bottom] =
                    [from, line, at, line + 1].map(|tile| (tile * TILE) as i64);
                Some(Rect::clipped(left, top, right, bottom, width, height))
            })
        })
    }
}

/// Returns whether all pixels are opaque.
#[inline(always)]
fn are_opaque(pixels: &[Quad]) -> bool {
    // Takes the minimum of all four channels, which vectorizes; colors never exceed alpha.
    let least = |a: Quad, b: &Quad| std::array::from_fn(|k| a[k].min(b[k]));
    pixels.iter().fold([ONE; 4], least)[3] >= OPAQUE
}

/// Returns the number of words for the blocks of a row.
fn words_of(width: usize) -> usize {
    width.div_ceil(BLOCK * 64)
}

/// Returns the first index of a range whose bit is set in `words`; the end of the range if there is none.
fn find(within: Range<u32>, words: impl Fn(usize) -> u64) -> u32 {
    let mut at = within.start;
    while at < within.end {
        let rest = words(at as usize / 64) >> (at % 64);
        if rest != 0 {
            return (at + rest.trailing_zeros()).min(within.end);
        }
        at = at / 64 * 64 + 64;
    }
    within.end
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Level;
    use crate::raster::canvas::straight;
    use crate::raster::resample::Resampled;
    use crate::raster::{Canvas, RgbImage};

    #[test]
    fn every_tile_drawn_on_is_taken_once() {
        let (mut coverage, mut canvas) = (Coverage::new([50, 40]), Canvas::new(50, 40));
        let mut layer = Resampled {
            rect: Rect::new(10, 15, 8, 3),
            pixels: vec![[1; 4]; 24],
            // Up to the edge of a tile, and across one.
            runs: vec![[15, 10, 16], [17, 15, 18]],
        };
        canvas.draw_layer_under(&layer, &mut coverage, Level::Scalar);
        canvas.draw_layer_under(&layer, &mut coverage, Level::Scalar);
        let boxes: Vec<Rect> = coverage.take_drawn_boxes().collect();
        assert_eq!(boxes, [Rect::new(0, 0, 16, 16), Rect::new(0, 16, 32, 16)]);
        assert_eq!(coverage.take_drawn_boxes().count(), 0);
        layer.rect.x = 42;
        layer.show_whole();
        canvas.draw_layer_under(&layer, &mut coverage, Level::Scalar);
        let boxes: Vec<Rect> = coverage.take_drawn_boxes().collect();
        assert_eq!(boxes, [Rect::new(32, 0, 18, 16), Rect::new(32, 16, 18, 16)]);
        coverage.mark_all_drawn();
        assert_eq!(coverage.take_drawn_boxes().count(), 3);
    }

    #[test]
    fn visible_columns_lie_between_opaque_blocks() {
        let (mut coverage, mut canvas) = (Coverage::new([200, 2]), Canvas::new(200, 2));
        for (columns, alpha) in [
            (0..3, ONE),
            (14..25, ONE),
            (60..70, OPAQUE),
            (70..75, OPAQUE - 1),
            (130..200, OPAQUE),
        ] {
            let n = columns.len();
            let layer = Resampled {
                rect: Rect::new(columns.start, 1, n as u32, 1),
                pixels: vec![[0, 0, 0, alpha]; n],
                runs: vec![[1, columns.start, columns.end]],
            };
            canvas.draw_layer_under(&layer, &mut coverage, Level::Scalar);
        }
        let open = |y, within: Range<u32>| coverage.next_visible(y, within);
        // Only whole blocks count: 16..24 and 136..200.
        assert_eq!(open(1, 0..200), 0..16);
        assert_eq!(open(1, 3..10), 3..10);
        assert_eq!(open(1, 17..200), 24..136);
        assert_eq!(open(1, 50..130), 50..130);
        assert!(open(1, 140..200).is_empty() && open(1, 17..23).is_empty());
        assert_eq!(open(0, 0..200), 0..200);
        assert!(coverage.take_drawn_boxes().count() > 0);
        assert_eq!(coverage.next_visible(1, 0..200), 0..200);
    }

    #[test]
    fn skipped_contributions_are_below_half_a_level() {
        let row = |pixel| Resampled {
            rect: Rect::new(0, 0, 8, 1),
            pixels: vec![pixel; 8],
            runs: vec![[0, 0, 8]],
        };
        let behind = |alpha: i16, color| {
            let (mut coverage, mut canvas) = (Coverage::new([8, 1]), Canvas::new(8, 1));
            for pixel in [[0, 0, 0, alpha], [color, color, color, ONE]] {
                canvas.draw_layer_under(&row(pixel), &mut coverage, Level::Scalar);
            }
            // Black behind everything.
            canvas.draw_box_under(
                &Canvas::from_rgb(&RgbImage::new(8, 1)),
                Rect::new(0, 0, 8, 1),
                Level::Scalar,
            );
            canvas.pixels[0]
        };
        assert_eq!(behind(OPAQUE, ONE), behind(OPAQUE, 0));
        let [seen, unseen] = [ONE, 0].map(|color| behind(OPAQUE - 1, color)[0]);
        assert!(
            seen - unseen <= ONE / 255 / 2 + 1 && seen > unseen,
            "{seen}"
        );
        assert_eq!(straight(behind(OPAQUE, ONE))[3], 255);
    }
}
