//! Sprites turned, mirrored and placed between pixels: Catmull-Rom interpolation of premultiplied
//! values (ALGORITHMS.md 8). Where a sprite lies on whole pixels and is not rotated, its pixels come
//! out as they are.

use crate::geometry::Rect;

/// Transparent pixels around a sprite, so that interpolation needs no edge cases.
const PAD: usize = 4;
/// Pixels beyond its own that a sprite reaches by interpolation.
const REACH: f64 = 2.0;

/// A sprite with each color times its alpha, 0..=255, and alpha, 0..=1, in a transparent border.
#[derive(Clone, Debug, Default)]
pub struct Premultiplied {
    width: usize,
    height: usize,
    /// Where alpha is not 0: left, top, right, bottom in the sprite's own pixels.
    bounds: [usize; 4],
    /// Per row of the padded bounds: the columns (of the sprite) between which interpolation finds
    /// anything; from above to when it finds nothing.
    spans: Vec<[f32; 2]>,
    /// The bounds and a border of `PAD`, by rows.
    pixels: Vec<[f32; 4]>,
}

/// Where a sprite goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Where the middle of the sprite comes to lie.
    pub center_px: [f64; 2],
    /// Rotation about it, clockwise as seen, after mirroring.
    pub rotation_rad: f64,
    /// Size of the result relative to the sprite, > 0.
    pub scale: f64,
    /// Left and right exchanged.
    pub mirrored: bool,
}

/// A placed sprite: premultiplied pixels of a box of the picture.
#[derive(Clone, Debug, Default)]
pub struct Resampled {
    /// The box.
    pub rect: Rect,
    /// Its pixels by rows: color times alpha, 0..=255, and alpha, 0..=1.
    pub pixels: Vec<[f32; 4]>,
}

impl Premultiplied {
    /// Takes a straight-alpha RGBA sprite, reusing memory. `bounds` as `bounds_of` found them.
    pub fn fill(&mut self, rgba: &[u8], [width, height]: [u32; 2], bounds: Rect) {
        (self.width, self.height) = (width as usize, height as usize);
        let edges = [bounds.x, bounds.y, bounds.right(), bounds.bottom()];
        self.bounds = edges.map(|edge| edge as usize);
        let [left, top, right, bottom] = self.bounds;
        let (stride, n_rows) = (right - left + 2 * PAD, bottom - top + 2 * PAD);
        self.pixels.clear();
        self.pixels.resize(stride * n_rows, [0.0; 4]);
        self.spans.clear();
        self.spans.resize(n_rows, [f32::MAX, f32::MIN]);
        for y in top..bottom {
            let row = &rgba[(y * self.width + left) * 4..(y * self.width + right) * 4];
            let padded = y - top + PAD;
            let out = &mut self.pixels[padded * stride + PAD..][..right - left];
            let mut seen = [f32::MAX, f32::MIN];
            for (x, (out, pixel)) in (left..).zip(out.iter_mut().zip(row.chunks_exact(4))) {
                if pixel[3] > 0 {
                    let alpha = f32::from(pixel[3]) / 255.0;
                    let color = |k: usize| f32::from(pixel[k]) * alpha;
                    *out = [color(0), color(1), color(2), alpha];
                    seen = [seen[0].min(x as f32), seen[1].max(x as f32)];
                }
            }
            // This row is a tap of the two rows before it, its own, and the one after.
            for span in &mut self.spans[padded - 2..padded + 2] {
                span[0] = span[0].min(seen[0] - REACH as f32);
                span[1] = span[1].max(seen[1] + REACH as f32);
            }
        }
    }

    /// Whether interpolation finds anything at sprite coordinates.
    #[inline]
    fn shows(&self, u: f32, v: f32) -> bool {
        let row = (floor(v) + PAD as i32 - self.bounds[1] as i32) as usize;
        let [from, to] = self.spans[row];
        u > from && u < to
    }

    /// Catmull-Rom at sprite coordinates (first pixel at 0, 0).
    #[inline]
    fn at(&self, u: f32, v: f32) -> [f32; 4] {
        let (x, y) = (floor(u), floor(v));
        let (wx, wy) = (weights(u - x as f32), weights(v - y as f32));
        let stride = self.bounds[2] - self.bounds[0] + 2 * PAD;
        let left = (x + PAD as i32 - 1 - self.bounds[0] as i32) as usize;
        let top = (y + PAD as i32 - 1 - self.bounds[1] as i32) as usize;
        let mut sum = [0.0f32; 4];
        for (row, wy) in wy.iter().enumerate() {
            let taps = &self.pixels[(top + row) * stride + left..][..4];
            let mut line = [0.0f32; 4];
            for (tap, wx) in taps.iter().zip(wx) {
                for channel in 0..4 {
                    line[channel] += wx * tap[channel];
                }
            }
            for channel in 0..4 {
                sum[channel] += wy * line[channel];
            }
        }
        // The curve may overshoot: no more than opaque, no color without its alpha.
        let alpha = sum[3].clamp(0.0, 1.0);
        let color = |k: usize| sum[k].clamp(0.0, 255.0 * alpha);
        [color(0), color(1), color(2), alpha]
    }
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

/// The floor of a sprite coordinate, which is above -REACH; without a call where the baseline
/// instructions have no rounding.
#[inline]
fn floor(coordinate: f32) -> i32 {
    (coordinate + 16.0) as i32 - 16
}

/// Catmull and Rom's four weights at `f` of the way from the second tap to the third.
#[inline]
fn weights(f: f32) -> [f32; 4] {
    let (f2, f3) = (f * f, f * f * f);
    [
        -0.5 * f + f2 - 0.5 * f3,
        1.0 - 2.5 * f2 + 1.5 * f3,
        0.5 * f + 2.0 * f2 - 1.5 * f3,
        0.5 * (f3 - f2),
    ]
}

impl Resampled {
    /// Draws a placed sprite, clipped to a picture of `size` pixels, reusing memory.
    pub fn draw(&mut self, sprite: &Premultiplied, place: &Placement, size: [u32; 2]) {
        let map = Map::new(sprite, place);
        self.rect = map.covered(sprite, size);
        self.pixels.clear();
        self.pixels.resize(self.rect.area() as usize, [0.0; 4]);
        if self.rect.is_empty() {
            return;
        }
        let limits = reach_of(sprite);
        let rows = self.pixels.chunks_exact_mut(self.rect.w as usize);
        for (row, y) in rows.zip(self.rect.y..) {
            let [u0, v0] = map.source(f64::from(self.rect.x) + 0.5, f64::from(y) + 0.5);
            let (from, to) = inside(row.len(), [u0, v0], map.per_column, limits);
            for (k, pixel) in row.iter_mut().enumerate().take(to).skip(from) {
                let u = u0 + map.per_column[0] * k as f64;
                let v = v0 + map.per_column[1] * k as f64;
                let (u, v) = (u as f32, v as f32);
                if sprite.shows(u, v) {
                    *pixel = sprite.at(u, v);
                }
            }
        }
    }
}

/// From picture to sprite: an affine map.
struct Map {
    origin: [f64; 2],
    per_column: [f64; 2],
    per_row: [f64; 2],
    place: Placement,
}

impl Map {
    fn new(sprite: &Premultiplied, place: &Placement) -> Map {
        let (cos, sin) = (
            libm::cos(place.rotation_rad) / place.scale,
            libm::sin(place.rotation_rad) / place.scale,
        );
        let flip = if place.mirrored { -1.0 } else { 1.0 };
        let (per_column, per_row) = ([flip * cos, -sin], [flip * sin, cos]);
        // Pixel k of the sprite has its center at k + 0.5.
        let half = [
            sprite.width as f64 / 2.0 - 0.5,
            sprite.height as f64 / 2.0 - 0.5,
        ];
        let [x, y] = place.center_px;
        let origin = std::array::from_fn(|k| half[k] - per_column[k] * x - per_row[k] * y);
        Map {
            origin,
            per_column,
            per_row,
            place: *place,
        }
    }

    fn source(&self, x: f64, y: f64) -> [f64; 2] {
        std::array::from_fn(|k| self.origin[k] + self.per_column[k] * x + self.per_row[k] * y)
    }

    /// The box of the picture that the sprite may touch.
    fn covered(&self, sprite: &Premultiplied, size: [u32; 2]) -> Rect {
        let [left, top, right, bottom] = sprite.bounds;
        if right == 0 {
            return Rect::default();
        }
        let (u0, u1) = (left as f64 - REACH, right as f64 + REACH);
        let (v0, v1) = (top as f64 - REACH, bottom as f64 + REACH);
        let (mut least, mut greatest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (u, v) in [(u0, v0), (u1, v0), (u0, v1), (u1, v1)] {
            let corner = self.forward(
                u - sprite.width as f64 / 2.0,
                v - sprite.height as f64 / 2.0,
            );
            for axis in 0..2 {
                least[axis] = least[axis].min(corner[axis]);
                greatest[axis] = greatest[axis].max(corner[axis]);
            }
        }
        let [w, h] = size;
        Rect::clipped(
            least[0].floor() as i64,
            least[1].floor() as i64,
            greatest[0].ceil() as i64,
            greatest[1].ceil() as i64,
            w,
            h,
        )
    }

    /// A point given from the sprite's middle, in the picture.
    fn forward(&self, u: f64, v: f64) -> [f64; 2] {
        let place = &self.place;
        let u = if place.mirrored { -u } else { u };
        let (cos, sin) = (
            libm::cos(place.rotation_rad) * place.scale,
            libm::sin(place.rotation_rad) * place.scale,
        );
        [
            place.center_px[0] + cos * u - sin * v,
            place.center_px[1] + sin * u + cos * v,
        ]
    }
}

/// The open ranges of sprite coordinates where anything can be seen.
fn reach_of(sprite: &Premultiplied) -> [[f64; 2]; 2] {
    let [left, top, right, bottom] = sprite.bounds.map(|bound| bound as f64);
    [
        [left - REACH, right - 1.0 + REACH],
        [top - REACH, bottom - 1.0 + REACH],
    ]
}

/// The columns `from..to` of a row whose source lies within the limits.
fn inside(
    n: usize,
    start: [f64; 2],
    per_column: [f64; 2],
    limits: [[f64; 2]; 2],
) -> (usize, usize) {
    let (mut from, mut to) = (0.0f64, n as f64);
    for axis in 0..2 {
        let [low, high] = limits[axis];
        let step = per_column[axis];
        if step.abs() < 1e-12 {
            if start[axis] <= low || start[axis] >= high {
                return (0, 0);
            }
            continue;
        }
        let (a, b) = ((low - start[axis]) / step, (high - start[axis]) / step);
        from = from.max(a.min(b).floor() + 1.0);
        to = to.min(a.max(b).ceil());
    }
    if from < to {
        (from as usize, to as usize)
    } else {
        (0, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkered(width: u32, height: u32) -> Vec<u8> {
        (0..width * height)
            .flat_map(|k| [(k * 7 % 256) as u8, (k * 13 % 256) as u8, 90, 255])
            .collect()
    }

    fn place(center_px: [f64; 2]) -> Placement {
        Placement {
            center_px,
            rotation_rad: 0.0,
            scale: 1.0,
            mirrored: false,
        }
    }

    fn drawn(rgba: &[u8], (w, h): (u32, u32), place: &Placement) -> Resampled {
        let mut sprite = Premultiplied::default();
        sprite.fill(rgba, [w, h], bounds_of(rgba, w));
        let mut resampled = Resampled::default();
        resampled.draw(&sprite, place, [40, 30]);
        resampled
    }

    fn pixel(resampled: &Resampled, x: u32, y: u32) -> [u8; 4] {
        let rect = resampled.rect;
        if !rect.contains(x, y) {
            return [0; 4];
        }
        let at = ((y - rect.y) * rect.w + x - rect.x) as usize;
        let [r, g, b, a] = resampled.pixels[at];
        [r, g, b, 255.0 * a].map(|v| v.round() as u8)
    }

    #[test]
    fn on_whole_pixels_every_pixel_comes_out_as_it_is() {
        let rgba = checkered(6, 4);
        let plain = drawn(&rgba, (6, 4), &place([13.0, 12.0]));
        let mirrored = Placement {
            mirrored: true,
            ..place([13.0, 12.0])
        };
        let mirrored = drawn(&rgba, (6, 4), &mirrored);
        for y in 0..4 {
            for x in 0..6 {
                let want: [u8; 4] = rgba[((y * 6 + x) * 4) as usize..][..4].try_into().unwrap();
                assert_eq!(pixel(&plain, 10 + x, 10 + y), want);
                assert_eq!(pixel(&mirrored, 15 - x, 10 + y), want);
            }
        }
        let sum: f32 = plain.pixels.iter().map(|p| p[3]).sum();
        assert_eq!(sum, 24.0, "nothing is drawn outside");
    }

    #[test]
    fn a_quarter_turn_clockwise_leads_right_to_down() {
        let mut rgba = vec![0; 8 * 8 * 4];
        // One opaque pixel to the right of the middle.
        rgba[(4 * 8 + 7) * 4..][..4].copy_from_slice(&[200, 100, 50, 255]);
        let turned = Placement {
            rotation_rad: std::f64::consts::FRAC_PI_2,
            ..place([20.0, 15.0])
        };
        let resampled = drawn(&rgba, (8, 8), &turned);
        assert_eq!(pixel(&resampled, 19, 18), [200, 100, 50, 255]);
    }

    #[test]
    fn half_a_pixel_and_any_turn_keep_the_amount_of_alpha() {
        let mut rgba = vec![0; 12 * 12 * 4];
        for k in 0..12 * 12 {
            let (x, y) = (k % 12, k / 12);
            if (3..9).contains(&x) && (3..9).contains(&y) {
                rgba[k * 4..][..4].copy_from_slice(&[255, 255, 255, 255]);
            }
        }
        for (center, rotation_rad) in [([20.5, 15.25], 0.0), ([20.1, 15.7], 0.6)] {
            let turned = Placement {
                rotation_rad,
                ..place(center)
            };
            let resampled = drawn(&rgba, (12, 12), &turned);
            let sum: f32 = resampled.pixels.iter().map(|p| p[3]).sum();
            assert!((sum - 36.0).abs() < 1.5, "{sum}");
        }
    }

    #[test]
    fn what_lies_outside_the_picture_is_not_drawn() {
        let rgba = checkered(6, 4);
        assert!(drawn(&rgba, (6, 4), &place([-30.0, 5.0])).rect.is_empty());
        let corner = drawn(&rgba, (6, 4), &place([0.0, 0.0]));
        assert_eq!((corner.rect.x, corner.rect.y), (0, 0));
    }
}
