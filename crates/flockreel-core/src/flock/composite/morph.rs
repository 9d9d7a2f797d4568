//! Morphing at a jump (`"cut": "morph"`): both sprites are warped toward each other before they are mixed.
//!
//! Blocks of one sprite are searched in the other at half size, in both directions. Where the two
//! directions agree, each sprite is warped by its share of the displacement, so that no body part appears
//! twice. Where they disagree, the pixels stay in place and only fade
//! (docs/explanation/algorithms.md, "Compositing").

use crate::geometry::Rect;
use crate::raster::resample::{Quad, Resampled};

/// Side of a block, in pixels of the half-size picture. Free choice.
const BLOCK: i32 = 6;
/// Search range of a block along each axis, in pixels of the half-size picture. Free choice.
const SEARCH_RANGE: i32 = 4;
/// Maximum distance between the start and the end of a match forward and back, in pixels of the half-size
/// picture. Free choice.
const MAX_MISMATCH_PX: f64 = 1.5;

/// Displacement of each block of one picture to its match in the other, in full-size pixels.
struct Flow {
    columns: i32,
    rows: i32,
    shifts: Vec<[f32; 2]>,
}

/// Warps `main` toward `second` by the share `weight`, and `second` toward `main` by the rest. Both then
/// cover the same box. Does nothing if one of them is empty.
pub(super) fn warp_together(main: &mut Resampled, second: &mut Resampled, weight: f64) {
    let rect = main.rect.union(&second.rect);
    if main.rect.is_empty() || second.rect.is_empty() {
        return;
    }
    let (a, b) = (grown(main, rect), grown(second, rect));
    let (small_a, small_b) = (Half::new(&a, rect), Half::new(&b, rect));
    let (forth, back) = (
        Flow::between(&small_a, &small_b),
        Flow::between(&small_b, &small_a),
    );
    let (forth_sure, back_sure) = (forth.consistent(&back), back.consistent(&forth));
    // The pixel shown at x comes from x minus its share of the displacement.
    main.pixels = forth_sure.warped(&a, rect, weight as f32);
    second.pixels = back_sure.warped(&b, rect, 1.0 - weight as f32);
    for layer in [main, second] {
        layer.rect = rect;
        layer.show_whole();
    }
}

/// Returns a layer's pixels in a larger box. The added pixels are transparent.
fn grown(layer: &Resampled, rect: Rect) -> Vec<Quad> {
    let mut pixels = vec![[0; 4]; rect.area() as usize];
    for ([x, y], row) in layer.shown() {
        let at = ((y - rect.y) * rect.w + x - rect.x) as usize;
        pixels[at..at + row.len()].copy_from_slice(row);
    }
    pixels
}

/// Picture at half size: brightness and alpha of each pixel.
struct Half {
    width: i32,
    height: i32,
    values: Vec<[i32; 2]>,
}

impl Half {
    fn new(pixels: &[Quad], rect: Rect) -> Half {
        let (width, height) = (rect.w as usize / 2, rect.h as usize / 2);
        let stride = rect.w as usize;
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let at = 2 * y * stride + 2 * x;
                let mut sum = [0; 2];
                for pixel in [at, at + 1, at + stride, at + stride + 1].map(|at| pixels[at]) {
                    let [r, g, b, a] = pixel.map(i32::from);
                    sum[0] += (r + 2 * g + b) / 4;
                    sum[1] += a;
                }
                values.push(sum.map(|sum| sum / 256));
            }
        }
        Half {
            width: width as i32,
            height: height as i32,
            values,
        }
    }

    /// Returns the value at a pixel, or zero beyond the edges.
    fn at(&self, x: i32, y: i32) -> [i32; 2] {
        if (0..self.width).contains(&x) && (0..self.height).contains(&y) {
            self.values[(y * self.width + x) as usize]
        } else {
            [0; 2]
        }
    }
}

impl Flow {
    fn between(from: &Half, to: &Half) -> Flow {
        let (columns, rows) = (from.width / BLOCK + 1, from.height / BLOCK + 1);
        let mut shifts = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                shifts.push(best_match(from, to, column * BLOCK, row * BLOCK));
            }
        }
        Flow {
            columns,
            rows,
            shifts,
        }
    }

    /// Returns the flow with all displacements set to zero for which the way forward and back misses the
    /// start by more than `MAX_MISMATCH_PX`.
    fn consistent(&self, back: &Flow) -> Flow {
        let place = |column: i32, row: i32| (row * self.columns + column) as usize;
        let mut shifts = self.shifts.clone();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let [dx, dy] = self.shifts[place(column, row)];
                // Block of the other picture that contains the displaced middle of this block.
                let to = |at: i32, shift: f32, n: i32| {
                    let middle = at as f32 + 0.5 + shift / (2 * BLOCK) as f32;
                    (middle.floor() as i32).clamp(0, n - 1)
                };
                let [bx, by] =
                    back.shifts[place(to(column, dx, self.columns), to(row, dy, self.rows))];
                let miss = [dx + bx, dy + by].map(|px| f64::from(px) / 2.0);
                if (miss[0] * miss[0] + miss[1] * miss[1]).sqrt() > MAX_MISMATCH_PX {
                    shifts[place(column, row)] = [0.0; 2];
                }
            }
        }
        Flow { shifts, ..*self }
    }

    /// Returns the displacement at a pixel, interpolated between the middles of the four nearest blocks.
    fn at(&self, x: f32, y: f32) -> [f32; 2] {
        let side = (2 * BLOCK) as f32;
        let (u, v) = (x / side - 0.5, y / side - 0.5);
        let (column, row) = (u.floor(), v.floor());
        let (fu, fv) = (u - column, v - row);
        let mut sum = [0.0; 2];
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let weight =
                (if dx == 1 { fu } else { 1.0 - fu }) * (if dy == 1 { fv } else { 1.0 - fv });
            let near = [
                (column as i32 + dx).clamp(0, self.columns - 1),
                (row as i32 + dy).clamp(0, self.rows - 1),
            ];
            let shift = self.shifts[(near[1] * self.columns + near[0]) as usize];
            sum = [sum[0] + weight * shift[0], sum[1] + weight * shift[1]];
        }
        sum
    }

    /// Returns a picture moved by `share` of its flow.
    fn warped(&self, pixels: &[Quad], rect: Rect, share: f32) -> Vec<Quad> {
        let (width, height) = (rect.w as usize, rect.h as usize);
        let mut out = Vec::with_capacity(pixels.len());
        for y in 0..height {
            for x in 0..width {
                let (x, y) = (x as f32, y as f32);
                let [dx, dy] = self.at(x + 0.5, y + 0.5);
                let (u, v) = (x - share * dx, y - share * dy);
                out.push(bilinear(pixels, (width, height), u, v));
            }
        }
        out
    }
}

/// Returns the displacement, in full-size pixels, to the most similar block of the other picture. A cost
/// per pixel of displacement prefers near matches.
fn best_match(from: &Half, to: &Half, left: i32, top: i32) -> [f32; 2] {
    let mut best = (i32::MAX, [0, 0]);
    for dy in -SEARCH_RANGE..=SEARCH_RANGE {
        for dx in -SEARCH_RANGE..=SEARCH_RANGE {
            let mut cost = 24 * (dx.abs() + dy.abs());
            for y in top..top + BLOCK {
                for x in left..left + BLOCK {
                    let (a, b) = (from.at(x, y), to.at(x + dx, y + dy));
                    cost += (a[0] - b[0]).abs() + (a[1] - b[1]).abs();
                }
            }
            best = best.min((cost, [dx, dy]));
        }
    }
    best.1.map(|shift| (2 * shift) as f32)
}

/// Returns the bilinear interpolation at (u, v). Pixels beyond the edges are transparent.
fn bilinear(pixels: &[Quad], (width, height): (usize, usize), u: f32, v: f32) -> Quad {
    let (left, top) = (u.floor(), v.floor());
    let (fu, fv) = (u - left, v - top);
    let mut sum = [0.5f32; 4];
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let (x, y) = (left as i64 + dx, top as i64 + dy);
        if (0..width as i64).contains(&x) && (0..height as i64).contains(&y) {
            let weight =
                (if dx == 1 { fu } else { 1.0 - fu }) * (if dy == 1 { fv } else { 1.0 - fv });
            let pixel = pixels[y as usize * width + x as usize];
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += weight * f32::from(value);
            }
        }
    }
    sum.map(|value| value as i16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::resample::ONE;

    /// Returns a patterned disc around a point.
    fn disc(center: [f64; 2]) -> Resampled {
        let rect = Rect::of_size(64, 48);
        let pixels = (0..64 * 48)
            .map(|k| {
                let (x, y) = (f64::from(k % 64) - center[0], f64::from(k / 64) - center[1]);
                let alpha = ((15.0 - x.hypot(y)).clamp(0.0, 1.0) * f64::from(ONE)) as i16;
                let shade = 0.5 + 0.4 * libm::sin(0.5 * x) * libm::cos(0.4 * y);
                let color = (f64::from(alpha) * shade) as i16;
                [color, color / 2, alpha - color, alpha]
            })
            .collect();
        let mut disc = Resampled {
            rect,
            pixels,
            runs: Vec::new(),
        };
        disc.show_whole();
        disc
    }

    fn difference(a: &Resampled, b: &Resampled) -> f64 {
        let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        pairs.map(|(a, b)| f64::from(a.abs_diff(*b))).sum()
    }

    #[test]
    fn sprites_a_few_pixels_apart_meet_in_the_middle() {
        let (mut a, mut b) = (disc([28.0, 24.0]), disc([34.0, 22.0]));
        let (apart, middle) = (difference(&a, &b), disc([31.0, 23.0]));
        warp_together(&mut a, &mut b, 0.5);
        assert!(difference(&a, &b) < 0.25 * apart);
        assert!(
            difference(&a, &middle) < 0.25 * apart,
            "{}",
            difference(&a, &middle) / apart
        );
    }

    #[test]
    fn sprite_of_weight_zero_is_not_warped() {
        let (mut a, mut b) = (disc([28.0, 24.0]), disc([34.0, 22.0]));
        let before = a.clone();
        warp_together(&mut a, &mut b, 0.0);
        assert!(difference(&a, &before) < 1.0);
    }

    #[test]
    fn sprites_that_differ_only_fade() {
        let (mut a, mut b) = (disc([16.0, 24.0]), disc([48.0, 24.0]));
        let before = a.clone();
        let apart = difference(&a, &b);
        warp_together(&mut a, &mut b, 0.5);
        assert!(difference(&a, &before) < 0.15 * apart);
    }
}
