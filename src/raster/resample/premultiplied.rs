//! A sprite as interpolation takes it: premultiplied, in a transparent border so that no edge is a
//! special case, halved as often as its scale asks (ALGORITHMS.md 8).

use std::ops::Range;

use super::catmull_rom::HALF_PLACE;
use super::map::Way;
use super::{ONE, Quad};
use crate::geometry::Rect;

/// Transparent pixels around a sprite.
pub(super) const PAD: usize = 4;
/// From so many pixels beyond a sprite's own nothing shows: there only negative weights meet, and where they meet in both
/// directions interpolation would leave a ghost, a sixty-fourth of a pixel at most.
pub(super) const REACH: usize = 1;
/// Below this scale a sprite is halved first.
const LEAST_SCALE: f64 = 0.6;
/// A sprite is a dot by then.
const MOST_HALVED: u32 = 8;

/// A sprite, premultiplied.
#[derive(Clone, Debug, Default)]
pub struct Premultiplied {
    /// Its middle, which a placement places, from its upper left corner; pixels before halving.
    pub(super) middle_px: [f64; 2],
    /// How often it has been halved.
    pub(super) level: u32,
    /// Columns and rows of the level.
    pub(super) size: [usize; 2],
    /// These and a border of `PAD`, by rows.
    pub(super) pixels: Vec<Quad>,
    /// Per row: the columns, in 65536ths, between which a place lies beside a pixel that shows; from above to when
    /// none does.
    pub(super) spans: Vec<[i32; 2]>,
}

impl Premultiplied {
    /// Takes a straight-alpha RGBA sprite of `size` pixels, for being drawn at `scale` about `middle_px`, which is told
    /// from its upper left corner and may lie between pixels.
    pub fn of(rgba: &[u8], size: [u32; 2], middle_px: [f64; 2], scale: f64) -> Premultiplied {
        let mut sprite = Premultiplied {
            middle_px,
            size: size.map(|side| side as usize),
            ..Premultiplied::default()
        };
        sprite.fill(rgba);
        if !sprite.is_empty() {
            (0..Premultiplied::level_for(scale)).for_each(|_| sprite.halve());
        }
        sprite.find_spans();
        sprite
    }

    /// How often a sprite that is drawn at `scale` is halved.
    pub fn level_for(scale: f64) -> u32 {
        let mut level = 0;
        while level < MOST_HALVED && scale * f64::from(1u32 << level) < LEAST_SCALE {
            level += 1;
        }
        level
    }

    /// Which of `n` places on a way that begins at `start` lie between the first and the last that find
    /// anything; empty where none does.
    #[inline(always)]
    pub(super) fn seen(&self, start: [i32; 2], way: &Way, n: usize) -> Range<usize> {
        let first = self.n_blank(start, way, n);
        let last = way.along(start, n as i32 - 1);
        let n_after = self.n_blank(last, &way.back(), n - first);
        first..n - n_after
    }

    /// How many of `n` places find nothing before one does. Goes from row to row of the sprite, in each to
    /// where its span begins.
    #[inline(always)]
    fn n_blank(&self, start: [i32; 2], way: &Way, n: usize) -> usize {
        let mut at = 0;
        while at < n {
            let [u, v] = way.along(start, at as i32).map(|place| place + HALF_PLACE);
            let [from, to] = self.spans[(v >> 16) as usize];
            if u > from && u < to {
                break;
            }
            let in_row = v as u32 & 0xffff;
            let [row_left, before_span] = [
                if way.step[1] > 0 {
                    0xffff - in_row
                } else {
                    in_row
                },
                (if way.step[0] > 0 { from - u } else { u - to }) as u32,
            ];
            let n_in_row = way.n_beyond(row_left, 1);
            // Behind the span there is nothing more in this row.
            at += match before_span as i32 >= 0 {
                true => n_in_row.min(way.n_beyond(before_span, 0)),
                false => n_in_row,
            };
        }
        at.min(n)
    }

    /// Memory that it takes.
    pub fn n_bytes(&self) -> usize {
        size_of_val(&*self.pixels) + size_of_val(&*self.spans)
    }

    /// Whether it has no pixels.
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

    /// Columns of `pixels`.
    pub(super) fn stride(&self) -> usize {
        self.size[0] + 2 * PAD
    }

    fn clear(&mut self) {
        let n_rows = self.size[1] + 2 * PAD;
        self.pixels.clear();
        self.pixels.resize(self.stride() * n_rows, [0; 4]);
    }

    /// The next level: means of two by two pixels.
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
                // The border takes in what an odd edge lacks.
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

    fn find_spans(&mut self) {
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
            // Places of the row before it and of its own lie beside it.
            for span in &mut self.spans[y - 1..=y] {
                *span = [span[0].min(first << 16), span[1].max(last << 16)];
            }
        }
    }
}

/// A straight-alpha pixel of 8 bits a channel.
fn premultiplied(pixel: &[u8]) -> Quad {
    // Most pixels are opaque or clear.
    match pixel[3] {
        0 => return [0; 4],
        255 => return crate::raster::canvas::opaque([pixel[0], pixel[1], pixel[2]]),
        _ => {}
    }
    let alpha = u32::from(pixel[3]);
    let one = ONE as u32;
    let color = |k: usize| ((u32::from(pixel[k]) * alpha * one + 32512) / 65025) as i16;
    [
        color(0),
        color(1),
        color(2),
        ((alpha * one + 127) / 255) as i16,
    ]
}

/// Where a straight-alpha RGBA sprite of `width` columns has any alpha; empty when it has none.
pub fn bounds_of(rgba: &[u8], width: u32) -> Rect {
    let mut bounds = [usize::MAX, usize::MAX, 0, 0];
    for (y, row) in rgba.chunks_exact(width.max(1) as usize * 4).enumerate() {
        let opaque = |pixel: &[u8]| pixel[3] > 0;
        let first = row.chunks_exact(4).position(opaque);
        let last = row.chunks_exact(4).rposition(opaque);
        if let (Some(first), Some(last)) = (first, last) {
            bounds[0] = bounds[0].min(first);
            bounds[1] = bounds[1].min(y);
            bounds[2] = bounds[2].max(last + 1);
            bounds[3] = y + 1;
        }
    }
    let [left, top, right, bottom] = bounds.map(|edge| edge as i64);
    match bounds[2] {
        0 => Rect::default(),
        _ => Rect::clipped(left, top, right, bottom, u32::MAX, u32::MAX),
    }
}
