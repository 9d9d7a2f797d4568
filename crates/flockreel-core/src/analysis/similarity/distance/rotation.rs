//! Rotates top-view sprites to heading 0 before they are compared. In top view any heading can be shown by
//! rotation, so similarity must not depend on it.
//!
//! The rotation is defined exactly, so that others can reproduce it. All divisions round down. Let t be the
//! heading as `geometry::Turns` (round(heading * 65536 / 2 pi)), c = round(65536 cos(t)), s = round(65536
//! sin(t)), P the premultiplied sprite of w x h, and W x H the canvas, both even. For output pixel (x, y):
//!
//! ```text
//! u = (w << 16) + c (2x + 1 - W) - s (2y + 1 - H) - 65536      v = (h << 16) + s (..) + c (..) - 65536
//! x0 = u >> 17, a = (u >> 9) & 255      y0 = v >> 17, b = (v >> 9) & 255      (131072ths of a pixel)
//! out = ((256-a)(256-b) P[y0][x0] + a (256-b) P[y0][x0+1] + (256-a) b P[y0+1][x0] + a b P[y0+1][x0+1] + 32768) >> 16
//! ```
//!
//! P is 0 outside the sprite. The size of the canvas does not change D: a larger one only adds zeros.

use rayon::prelude::*;

use crate::geometry::Turns;
use crate::library::{Pose, Poses, Sprites};

/// The common image into which all sprites are rotated, around its center.
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    source_width: usize,
    source_height: usize,
}

impl Canvas {
    /// Returns the smallest canvas, in multiples of 8 pixels, that fits every sprite with a known heading.
    pub(super) fn new(sprites: &Sprites, poses: &Poses) -> Canvas {
        let (w, h) = (sprites.width() as usize, sprites.height() as usize);
        let most = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].max(b[1])];
        let halves = |(frame_idx, pose): (usize, &Pose)| {
            let Some(heading) = pose.heading_rad else {
                return [0.0; 2];
            };
            let (c, s) = (libm::cos(heading), libm::sin(heading));
            let corners = row_corners(&sprites.sprite(frame_idx), w).into_iter();
            let turned = corners.map(|corner| {
                let (x, y) = (corner[0] - w as f64 / 2.0, corner[1] - h as f64 / 2.0);
                [(c * x + s * y).abs(), (c * y - s * x).abs()]
            });
            turned.fold([0.0; 2], most)
        };
        let frames = poses.frames.par_iter().enumerate();
        let [half_width, half_height] = frames.map(halves).reduce(|| [0.0; 2], most);
        // One pixel for the interpolation and one for the rounding of the heading.
        let side = |half: f64| ((half + 2.0) * 2.0).ceil() as usize;
        Canvas {
            width: side(half_width).next_multiple_of(8),
            height: side(half_height).next_multiple_of(8),
            source_width: w,
            source_height: h,
        }
    }

    /// Rotates a premultiplied sprite to heading 0. Writes a blank sprite when the heading is unknown.
    pub(super) fn rotate(&self, sprite: &[u8], heading_rad: Option<f64>, out: &mut [u8]) {
        let Some(heading_rad) = heading_rad else {
            out.fill(0);
            return;
        };
        let heading = Turns::from_rad(heading_rad).to_rad();
        let c = (libm::cos(heading) * 65536.0).round() as i64;
        let s = (libm::sin(heading) * 65536.0).round() as i64;
        let source = sprite.as_chunks::<4>().0;
        let rows = out.as_chunks_mut::<4>().0.chunks_exact_mut(self.width);
        for (row, y) in rows.zip(0i64..) {
            let dy = 2 * y + 1 - self.height as i64;
            for (pixel, x) in row.iter_mut().zip(0i64..) {
                let dx = 2 * x + 1 - self.width as i64;
                let u = ((self.source_width as i64) << 16) + c * dx - s * dy - 65536;
                let v = ((self.source_height as i64) << 16) + s * dx + c * dy - 65536;
                *pixel = self.sample(source, u, v);
            }
        }
    }

    fn sample(&self, source: &[[u8; 4]], u: i64, v: i64) -> [u8; 4] {
        let (x0, y0) = (u >> 17, v >> 17);
        let (a, b) = ((u >> 9 & 255) as u32, (v >> 9 & 255) as u32);
        let mut sum = [32768u32; 4];
        let corners = [
            (x0, y0, (256 - a) * (256 - b)),
            (x0 + 1, y0, a * (256 - b)),
            (x0, y0 + 1, (256 - a) * b),
            (x0 + 1, y0 + 1, a * b),
        ];
        for (x, y, weight) in corners {
            let inside = (0..self.source_width as i64).contains(&x)
                && (0..self.source_height as i64).contains(&y);
            if inside {
                let pixel = source[y as usize * self.source_width + x as usize];
                for (sum, value) in sum.iter_mut().zip(pixel) {
                    *sum += weight * u32::from(value);
                }
            }
        }
        sum.map(|value| (value >> 16) as u8)
    }
}

/// Returns the outer corners of the opaque pixels in each row. Their convex hull covers all opaque pixels.
fn row_corners(sprite: &[u8], width: usize) -> Vec<[f64; 2]> {
    let mut corners = Vec::new();
    for (y, row) in sprite.as_chunks::<4>().0.chunks_exact(width).enumerate() {
        let first = row.iter().position(|pixel| pixel[3] > 0);
        let last = row.iter().rposition(|pixel| pixel[3] > 0);
        if let (Some(first), Some(last)) = (first, last) {
            for y in [y, y + 1] {
                corners.push([first as f64, y as f64]);
                corners.push([(last + 1) as f64, y as f64]);
            }
        }
    }
    corners
}
