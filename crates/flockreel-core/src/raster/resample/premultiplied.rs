//! A sprite prepared for interpolation (docs/explanation/algorithms.md, "Compositing"). Its pixels are
//! premultiplied and surrounded by a transparent border, so that edges need no special case. For small scales
//! it is halved.

use std::ops::Range;

use super::catmull_rom::HALF_PHASE;
use super::step::Step;
use super::{ONE, Quad};
use crate::geometry::Rect;

/// Width of the transparent border, pixels.
pub(super) const PAD: usize = 4;
/// Distance beyond the sprite, pixels, from which nothing is drawn. Only negative weights of the kernel reach
/// that far. In two dimensions their product would leave a ghost of at most 1/64 of a pixel.
pub(super) const REACH: usize = 1;
/// Scale below which a sprite is halved. Free choice.
const MIN_SCALE: f64 = 0.6;
/// Maximum number of halvings. The sprite is then a dot.
const MAX_HALVINGS: u32 = 8;

/// A premultiplied sprite.
#[derive(Clone, Debug, Default)]
pub struct Premultiplied {
    /// The sprite's reference point for placement, from its upper left corner, in pixels before halving.
    pub(super) middle_px: [f64; 2],
    /// Number of halvings.
    pub(super) level: u32,
    /// Width and height of the halved sprite, pixels.
    pub(super) size: [usize; 2],
    /// Pixels with a border of `PAD` on each side, row by row.
    pub(super) pixels: Vec<Quad>,
    /// For each row, the open interval of positions, in 1/65536 of a pixel, that are next to a pixel with
    /// alpha. If there is none, the start exceeds the end.
    pub(super) spans: Vec<[i32; 2]>,
}

impl Premultiplied {
    /// Prepares a straight-alpha RGBA sprite of `size` pixels for drawing at `scale`. `middle_px` is the
    /// point to be placed, from the upper left corner; it may lie between pixels.
    pub fn new(rgba: &[u8], size: [u32; 2], middle_px: [f64; 2], scale: f64) -> Premultiplied {
        let mut sprite = Premultiplied {
            middle_px,
            size: size.map(|side| side as usize),
            ..Premultiplied::default()
        };
        sprite.fill(rgba);
        if !sprite.is_empty() {
            (0..Premultiplied::mip_level(scale)).for_each(|_| sprite.halve());
        }
        sprite.measure_spans();
        sprite
    }

    /// Returns the number of halvings for drawing at `scale`.
    pub fn mip_level(scale: f64) -> u32 {
        let mut level = 0;
        while level < MAX_HALVINGS && scale * f64::from(1u32 << level) < MIN_SCALE {
            level += 1;
        }
        level
    }

    /// Returns the range of steps between the first and the last position next to a pixel with alpha, out of
    /// `n` steps from `start`. The range is empty if there is no such position.
    #[inline(always)]
    pub(super) fn visible_steps(&self, start: [i32; 2], step: &Step, n: usize) -> Range<usize> {
        let first = self.n_transparent(start, step, n);
        let last = step.position_after(start, n as i32 - 1);
        let n_after = self.n_transparent(last, &step.reversed(), n - first);
        first..n - n_after
    }

    /// Returns the number of steps, at most `n`, before a position next to a pixel with alpha. The search
    /// skips from one sprite row to the next, and in each row to the start of its span.
    #[inline(always)]
    fn n_transparent(&self, start: [i32; 2], step: &Step, n: usize) -> usize {
        let mut at = 0;
        while at < n {
            let [u, v] = step
                .position_after(start, at as i32)
                .map(|place| place + HALF_PHASE);
            let [from, to] = self.spans[(v >> 16) as usize];
            if u > from && u < to {
                break;
            }
            let in_row = v as u32 & 0xffff;
            let [across, down] = step.per_column;
            let row_left = if down > 0 { 0xffff - in_row } else { in_row };
            let before_span = if across > 0 { from - u } else { u - to };
            let n_in_row = step.n_steps_beyond(row_left, 1);
            // Past the span, the rest of this row is empty.
            at += if before_span >= 0 {
                n_in_row.min(step.n_steps_beyond(before_span as u32, 0))
            } else {
                n_in_row
            };
        }
        at.min(n)
    }

    /// Returns the memory used, bytes.
    pub fn n_bytes(&self) -> usize {
        size_of_val(&*self.pixels) + size_of_val(&*self.spans)
    }

    /// Returns whether the sprite has no pixels.
    pub(super) fn is_empty(&self) -> bool {
        self.size.contains(&0)
    }

    fn fill(&mut self, rgba: &[u8]) {
        self.clear();
        let (stride, width) = (self.stride(), self.size[0]);
        let rows = rgba.chunks_exact(width.max(1) * 4);
        for (row, y) in rows.zip(PAD..) {
            let out = &mut self.pixels[y * stride + PAD..][..width];
            for (out, pixel) in out.iter_mut().zip(row.chunks_exact(4)) {
                *out = premultiplied(pixel);
            }
        }
    }

    /// Returns the number of columns of `pixels`, border included.
    pub(super) fn stride(&self) -> usize {
        self.size[0] + 2 * PAD
    }

    fn clear(&mut self) {
        let n_rows = self.size[1] + 2 * PAD;
        self.pixels.clear();
        self.pixels.resize(self.stride() * n_rows, [0; 4]);
    }

    /// Halves the sprite: each pixel becomes the mean of 2 x 2 pixels.
    fn halve(&mut self) {
        let finer = std::mem::take(&mut self.pixels);
        let stride_before = self.stride();
        self.size = self.size.map(|side| side.div_ceil(2));
        self.level += 1;
        self.clear();
        let stride = self.stride();
        let [width, height] = self.size;
        for y in 0..height {
            for x in 0..width {
                // At an odd edge the missing pixels come from the border.
                let at = (2 * y + PAD) * stride_before + 2 * x + PAD;
                let block = [at, at + 1, at + stride_before, at + stride_before + 1];
                let mut sum = [2i32; 4];
                for pixel in block.map(|at| finer[at]) {
                    for (sum, value) in sum.iter_mut().zip(pixel) {
                        *sum += i32::from(value);
                    }
                }
                self.pixels[(y + PAD) * stride + x + PAD] = sum.map(|sum| (sum / 4) as i16);
            }
        }
    }

    fn measure_spans(&mut self) {
        let stride = self.stride();
        let n_rows = self.pixels.len() / stride;
        self.spans.clear();
        self.spans.resize(n_rows, [i32::MAX, 0]);
        for (y, row) in self.pixels.chunks_exact(stride).enumerate() {
            let shows = |pixel: &Quad| pixel[3] > 0;
            let (Some(first), Some(last)) =
                (row.iter().position(shows), row.iter().rposition(shows))
            else {
                continue;
            };
            let (first, last) = ((first - REACH) as i32, (last + REACH) as i32);
            // Positions are rounded down to a row, so this row's pixels also reach into the row before it.
            for span in &mut self.spans[y - 1..=y] {
                *span = [span[0].min(first << 16), span[1].max(last << 16)];
            }
        }
    }
}

/// Converts a straight-alpha RGBA pixel.
fn premultiplied(pixel: &[u8]) -> Quad {
    // Most pixels are opaque or transparent.
    match pixel[3] {
        0 => return [0; 4],
        255 => return crate::raster::canvas::opaque([pixel[0], pixel[1], pixel[2]]),
        _ => {}
    }
    let alpha = u32::from(pixel[3]);
    let one = ONE as u32;
    let color = |k: usize| ((u32::from(pixel[k]) * alpha * one + 32512) / 65025) as i16;
    let alpha = ((alpha * one + 127) / 255) as i16;
    [color(0), color(1), color(2), alpha]
}

/// Returns the bounding box of the pixels with alpha in a straight-alpha RGBA sprite of `width` columns;
/// empty if there are none.
pub fn bounds_of(rgba: &[u8], width: u32) -> Rect {
    let mut bounds = Rect::default();
    for (y, row) in (0..).zip(rgba.chunks_exact(width.max(1) as usize * 4)) {
        let shows = |pixel: &[u8]| pixel[3] > 0;
        let first = row.chunks_exact(4).position(shows);
        let last = row.chunks_exact(4).rposition(shows);
        if let (Some(first), Some(last)) = (first, last) {
            let run = Rect::from_edges(first as u32, y, last as u32 + 1, y + 1);
            bounds = bounds.union(&run);
        }
    }
    bounds
}
