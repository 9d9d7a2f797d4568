//! The picture on which sprites are composited: premultiplied pixels, 16384 for alpha 1, opaque or not. It
//! converts to encoder planes and to straight alpha (docs/explanation/algorithms.md, "Compositing").

#[cfg(target_arch = "x86_64")]
mod avx2; // AVX2 kernels
mod coverage; // dirty tiles and opaque pixels
mod planes; // conversion to encoder planes

pub use coverage::Coverage;

use std::ops::Range;

use super::RgbImage;
use super::resample::{ONE, Placement, Premultiplied, Quad, Resampled, Surface, draw_on, scaled};
use crate::cpu::Level;
use crate::geometry::Rect;

/// A picture of premultiplied pixels.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Canvas {
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Pixels, row by row.
    pub pixels: Vec<Quad>,
}

impl Canvas {
    /// Returns a fully transparent canvas.
    pub fn new(width: u32, height: u32) -> Canvas {
        Canvas {
            width,
            height,
            pixels: vec![[0; 4]; width as usize * height as usize],
        }
    }

    /// Converts an RGB image to an opaque canvas.
    pub fn from_rgb(image: &RgbImage) -> Canvas {
        let pixels = image.pixels.chunks_exact(3);
        Canvas {
            width: image.width,
            height: image.height,
            pixels: pixels.map(|rgb| opaque([rgb[0], rgb[1], rgb[2]])).collect(),
        }
    }

    /// Copies a canvas of the box's size into the box.
    pub fn copy_box(&mut self, from: &Canvas, rect: Rect) {
        let from_rows = from.pixels.chunks_exact(from.width.max(1) as usize);
        for (row, from) in self.rows(rect).zip(from_rows) {
            self.pixels[row].copy_from_slice(from);
        }
    }

    /// Makes a box fully transparent.
    pub fn clear_box(&mut self, rect: Rect) {
        for row in self.rows(rect) {
            self.pixels[row].fill([0; 4]);
        }
    }

    /// Draws a layer under the existing pixels, where they are not opaque. Layers are therefore drawn front
    /// to back.
    pub fn draw_layer_under(&mut self, layer: &Resampled, coverage: &mut Coverage, cpu: Level) {
        let mut surface = UnderSurface::new(self, coverage, cpu);
        for ([x, y], pixels) in layer.shown() {
            let to = x + pixels.len() as u32;
            let mut open = surface.next_visible(y, x..to);
            while !open.is_empty() {
                let run = (open.start - x) as usize..(open.end - x) as usize;
                surface.draw_pixels(y, open.clone(), &pixels[run]);
                open = surface.next_visible(y, open.end..to);
            }
        }
    }

    /// Draws a placed sprite under the existing pixels, without an intermediate layer. Returns its bounding
    /// box.
    pub fn draw_sprite_under(
        &mut self,
        sprite: &Premultiplied,
        place: &Placement,
        coverage: &mut Coverage,
        cpu: Level,
    ) -> Rect {
        let size = [self.width, self.height];
        let mut surface = UnderSurface::new(self, coverage, cpu);
        draw_on(&mut surface, size, sprite, place, cpu)
    }

    /// Draws a box of another canvas of the same size under the existing pixels.
    pub fn draw_box_under(&mut self, below: &Canvas, rect: Rect, cpu: Level) {
        for row in self.rows(rect) {
            put_under(&mut self.pixels[row.clone()], &below.pixels[row], cpu);
        }
    }

    /// Draws a box of another canvas of the same size over the existing pixels.
    pub fn draw_box_over(&mut self, above: &Canvas, rect: Rect) {
        for row in self.rows(rect) {
            let here = self.pixels[row.clone()].iter_mut();
            for (below, above) in here.zip(&above.pixels[row]) {
                if above[3] > 0 {
                    *below = one_over(*above, *below);
                }
            }
        }
    }

    /// Writes the box as straight-alpha RGBA into a picture of the canvas's size. A pixel with alpha 0 keeps
    /// the color that it has in the picture.
    pub fn write_straight(&self, rect: Rect, rgba: &mut [u8]) {
        for row in self.rows(rect) {
            let out = &mut rgba[row.start * 4..row.end * 4];
            for (out, pixel) in out.chunks_exact_mut(4).zip(&self.pixels[row]) {
                match pixel[3] {
                    0 => out[3] = 0,
                    _ => out.copy_from_slice(&straight(*pixel)),
                }
            }
        }
    }

    #[inline(always)]
    fn row_mut(&mut self, y: u32) -> &mut [Quad] {
        let width = self.width as usize;
        &mut self.pixels[y as usize * width..][..width]
    }

    /// Returns the index range of each row of a box among the pixels.
    fn rows(&self, rect: Rect) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let width = self.width as usize;
        (rect.y..rect.bottom()).map(move |y| {
            let first = y as usize * width + rect.x as usize;
            first..first + rect.w as usize
        })
    }
}

/// Surface that draws below everything already on a canvas.
struct UnderSurface<'a> {
    canvas: &'a mut Canvas,
    coverage: &'a mut Coverage,
    /// Buffer for a run of pixels.
    row: Vec<Quad>,
    cpu: Level,
}

impl<'a> UnderSurface<'a> {
    fn new(canvas: &'a mut Canvas, coverage: &'a mut Coverage, cpu: Level) -> UnderSurface<'a> {
        UnderSurface {
            canvas,
            coverage,
            row: Vec::new(),
            cpu,
        }
    }

    /// Draws pixels under the columns of row `y` and updates the coverage.
    #[inline(always)]
    fn draw_pixels(&mut self, y: u32, columns: Range<u32>, pixels: &[Quad]) {
        let drawn = self.canvas.row_mut(y);
        let above = &mut drawn[columns.start as usize..columns.end as usize];
        put_under(above, pixels, self.cpu);
        self.coverage.add_run(y, columns, drawn);
    }
}

impl Surface for UnderSurface<'_> {
    #[inline(always)]
    fn next_visible(&self, y: u32, within: Range<u32>) -> Range<u32> {
        self.coverage.next_visible(y, within)
    }

    #[inline(always)]
    fn draw_run(&mut self, y: u32, columns: Range<u32>, draw: impl FnOnce(&mut [Quad])) {
        let n = columns.len();
        let mut row = std::mem::take(&mut self.row);
        if row.len() < n {
            row.resize(n, [0; 4]);
        }
        let above = &self.canvas.row_mut(y)[columns.start as usize..columns.end as usize];
        prefetch(above, self.cpu);
        draw(&mut row[..n]);
        self.draw_pixels(y, columns, &row[..n]);
        self.row = row;
    }
}

/// Converts an opaque color.
pub fn opaque(rgb: [u8; 3]) -> Quad {
    let [r, g, b] = rgb.map(|value| QUAD_LEVELS[usize::from(value)]);
    [r, g, b, ONE]
}

/// The 8-bit values scaled to 0..=16384.
static QUAD_LEVELS: [i16; 256] = {
    let mut levels = [0; 256];
    let mut value = 0;
    while value < 256 {
        levels[value] = ((value * ONE as usize + 127) / 255) as i16;
        value += 1;
    }
    levels
};

/// Converts a pixel to 8-bit straight alpha. A pixel with alpha 0 becomes all zero.
pub fn straight([r, g, b, a]: Quad) -> [u8; 4] {
    if a <= 0 {
        return [0; 4];
    }
    let whole = i32::from(a);
    let color = |value: i16| ((i32::from(value) * 255 + whole / 2) / whole).min(255) as u8;
    let alpha = ((whole * 255 + 8192) >> 14) as u8;
    [color(r), color(g), color(b), alpha]
}

/// Prefetches pixels that are needed soon.
#[inline(always)]
#[cfg_attr(
    not(target_arch = "x86_64"),
    expect(unused_variables, reason = "there is no kernel that fetches")
)]
fn prefetch(row: &[Quad], cpu: Level) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
            #[expect(unsafe_code, reason = "a kernel for AVX2")]
            // SAFETY: the match guard checked AVX2, the only feature that the callee requires.
            unsafe {
                avx2::prefetch(row);
            }
        }
        _ => {}
    }
}

fn put_under(row: &mut [Quad], below: &[Quad], cpu: Level) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
            #[expect(unsafe_code, reason = "a kernel for AVX2")]
            // SAFETY: the match guard checked AVX2, the only feature that the callee requires.
            unsafe {
                avx2::under_row(row, below);
            }
        }
        _ => under_row(row, below),
    }
}

/// Defines the result of the vector kernels.
fn under_row(row: &mut [Quad], below: &[Quad]) {
    for (above, below) in row.iter_mut().zip(below) {
        *above = one_over(*above, *below);
    }
}

fn one_over(above: Quad, below: Quad) -> Quad {
    // The doubled value 32768 does not fit; 32767/32768 leaves every value unchanged.
    let through = (2 * (i32::from(ONE) - i32::from(above[3]))).min(32767) as i16;
    std::array::from_fn(|channel| above[channel] + scaled(below[channel], through))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::{ColorSpec, Frame};
    use proptest::prelude::*;

    #[test]
    fn opaque_hides_half_mixes_and_transparent_shows() {
        let rect = Rect::of_size(1, 1);
        let [r, g, b, _] = opaque([50, 25, 0]);
        for (pixel, want) in [
            (opaque([10, 20, 30]), [10, 20, 30, 255]),
            ([r, g, b, ONE / 2], [100, 75, 50, 255]),
            ([0; 4], [100, 100, 100, 255]),
        ] {
            for cpu in Level::available() {
                let mut canvas = Canvas::new(1, 1);
                let mut coverage = Coverage::new([1, 1]);
                canvas.draw_layer_under(&Resampled::uniform(rect, pixel), &mut coverage, cpu);
                let mut shown = canvas.clone();
                let mut behind = Canvas::new(1, 1);
                behind.pixels[0] = opaque([100; 3]);
                shown.draw_box_under(&behind, rect, cpu);
                assert_eq!(straight(shown.pixels[0]), want, "{}", cpu.name());
                let gray = Resampled::uniform(rect, opaque([100; 3]));
                canvas.draw_layer_under(&gray, &mut coverage, cpu);
                assert_eq!(straight(canvas.pixels[0]), want, "{}", cpu.name());
            }
        }
    }

    #[test]
    fn sprite_on_an_empty_canvas_keeps_alpha_and_color() {
        let mut canvas = Canvas::new(2, 1);
        let [r, g, b, a] = opaque([200, 100, 40]);
        let quarter = Resampled::uniform(Rect::of_size(1, 1), [r / 4, g / 4, b / 4, a / 4]);
        canvas.draw_layer_under(&quarter, &mut Coverage::new([2, 1]), Level::detect());
        let mut rgba = vec![9; 8];
        canvas.write_straight(Rect::of_size(2, 1), &mut rgba);
        assert_eq!(rgba, [200, 100, 40, 64, 9, 9, 9, 0]);
    }

    proptest! {
        #[test]
        fn opaque_colors_survive_and_have_the_planes_of_their_rgb(
            rgb in prop::array::uniform3(any::<u8>()),
        ) {
            let [r, g, b] = rgb;
            prop_assert_eq!(straight(opaque(rgb)), [r, g, b, 255]);
            let mut image = RgbImage::new(3, 3);
            image.pixels = rgb.repeat(9);
            let mut ours = Frame::new(3, 3, ColorSpec::default());
            let mut known = ours.clone();
            let whole = Rect::of_size(3, 3);
            ours.draw_canvas(&Canvas::from_rgb(&image), whole, Level::Scalar);
            known.draw_rgb(&image, whole);
            for (a, b) in ours.planes.iter().zip(&known.planes) {
                prop_assert!(a.abs_diff(*b) <= 1, "{:?} {:?}", ours.planes, known.planes);
            }
        }
    }

    /// Returns a canvas of random colors and alphas.
    fn random_canvas(seed: u32, width: u32, height: u32) -> Canvas {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 17) as i16 & 0x3fff
        };
        let mut canvas = Canvas::new(width, height);
        for (k, pixel) in canvas.pixels.iter_mut().enumerate() {
            let alpha = if k % 3 == 0 { ONE } else { next() };
            *pixel = [
                next().min(alpha),
                next().min(alpha),
                next().min(alpha),
                alpha,
            ];
        }
        canvas
    }

    #[test]
    fn every_instruction_set_draws_and_converts_the_same() {
        for (seed, width, height) in [(1, 37, 21), (2, 64, 16), (3, 5, 7), (4, 23, 2)] {
            let base = random_canvas(seed, width, height);
            let rect = Rect::clipped(1, 1, i64::from(width) - 1, i64::from(height), width, height);
            let mut sprite = Resampled::uniform(rect, [0; 4]);
            let other = random_canvas(seed + 9, rect.w, rect.h);
            sprite.pixels = other.pixels;
            let with = |cpu: Level| {
                let mut canvas = base.clone();
                canvas.draw_layer_under(&sprite, &mut Coverage::new([width, height]), cpu);
                canvas.draw_box_under(&random_canvas(seed + 5, width, height), rect, cpu);
                let mut frame = Frame::new(width, height, ColorSpec::default());
                frame.draw_canvas(&canvas, rect, cpu);
                (canvas, frame)
            };
            for cpu in Level::available() {
                assert!(with(Level::Scalar) == with(cpu), "{} {width}", cpu.name());
            }
        }
    }
}
