//! Sprites drawn with rotation, mirroring, scale and sub-pixel position (docs/explanation/algorithms.md,
//! "Compositing").
//!
//! Pixels are interpolated (Catmull-Rom) in premultiplied alpha. Below scale 0.6 the source is a mipmap level
//! of the sprite. At whole pixels, scale 1 and rotation 0 the result is an exact copy.
//!
//! All arithmetic is in integers, with 16384 for alpha 1 and for a full color, so results are identical on
//! every machine. With AVX2 sixteen values are computed at a time.

#[cfg(target_arch = "x86_64")]
mod avx2; // AVX2 kernel
mod catmull_rom; // interpolation of a row of pixels
mod map; // affine map from picture to sprite
mod premultiplied; // sprite prepared for interpolation
mod step; // step from pixel to pixel

use std::ops::Range;

pub(super) use catmull_rom::scaled;
pub use premultiplied::{Premultiplied, bounds_of};

use self::map::{Map, fixed};
use super::canvas::Coverage;
use crate::cpu::Level;
use crate::geometry::Rect;

/// Number of rows by which the prefetch of sprite pixels is ahead of drawing. Sprites are used rarely, so
/// they are usually not in the cache. Free choice.
const ROWS_AHEAD: u32 = 8;

/// The value of alpha 1 and of a full color at alpha 1.
pub const ONE: i16 = 1 << 14;

/// One pixel: three premultiplied colors and alpha, each 0..=[`ONE`].
pub type Quad = [i16; 4];

/// Position and transformation of a sprite in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Position of the sprite's middle in the picture, pixels.
    pub center_px: [f64; 2],
    /// Rotation about the middle, radians, clockwise in the picture, applied after mirroring.
    pub rotation_rad: f64,
    /// Size of the drawn sprite relative to the sprite, > 0.
    pub scale: f64,
    /// Whether left and right are exchanged.
    pub mirrored: bool,
}

impl Placement {
    /// Returns the position in the picture of a point given from the sprite's middle.
    pub fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let x = if self.mirrored { -x } else { x };
        let cos = libm::cos(self.rotation_rad) * self.scale;
        let sin = libm::sin(self.rotation_rad) * self.scale;
        [
            self.center_px[0] + cos * x - sin * y,
            self.center_px[1] + sin * x + cos * y,
        ]
    }
}

/// The picture into which a sprite is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Viewport<'a> {
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Coverage by nearer objects, in a picture of that size. Opaque parts hide the sprite and are skipped.
    pub nearer: Option<&'a Coverage>,
}

/// A drawn sprite: premultiplied pixels of a box of the picture.
#[derive(Clone, Debug, Default)]
pub struct Resampled {
    /// The box in the picture.
    pub rect: Rect,
    /// Pixels of the box, row by row. The vector may be longer than the box.
    pub pixels: Vec<Quad>,
    /// Runs that may be visible, from top to bottom: row, first column, end column, in picture coordinates.
    /// Pixels outside the runs are unspecified.
    pub runs: Vec<[u32; 3]>,
}

impl Resampled {
    /// Draws a placed sprite, clipped to the viewport, into this layer, whose memory is reused. The sprite must
    /// have been prepared for the placement's scale.
    pub fn draw(
        &mut self,
        sprite: &Premultiplied,
        place: &Placement,
        viewport: Viewport,
        cpu: Level,
    ) {
        let map = Map::new(sprite, place);
        let rect = map.bounding_box(viewport.size);
        self.begin(rect);
        let mut layer = Layer {
            layer: self,
            nearer: viewport.nearer,
        };
        draw_rows(&mut layer, rect, &map, cpu);
    }

    /// Starts an empty layer with the given box. The pixels are unspecified.
    pub fn begin(&mut self, rect: Rect) {
        self.rect = rect;
        self.runs.clear();
        let area = rect.area() as usize;
        if self.pixels.len() < area {
            self.pixels.resize(area, [0; 4]);
        }
    }

    /// Marks the whole box as visible.
    pub fn show_whole(&mut self) {
        let Rect { x, y, w, h } = self.rect;
        self.runs.clear();
        self.runs.extend((y..y + h).map(|y| [y, x, x + w]));
    }

    /// Yields, for each run, its first pixel (column, row) in the picture and its pixels.
    pub fn shown(&self) -> impl Iterator<Item = ([u32; 2], &[Quad])> {
        self.runs.iter().map(|&[y, from, to]| {
            let first = ((y - self.rect.y) * self.rect.w + from - self.rect.x) as usize;
            ([from, y], &self.pixels[first..first + (to - from) as usize])
        })
    }

    /// Returns the alpha of the whole box, row by row, 0..=16384.
    pub fn alpha(&self) -> Vec<u16> {
        let mut alpha = vec![0; self.rect.area() as usize];
        for ([x, y], row) in self.shown() {
            let first = ((y - self.rect.y) * self.rect.w + x - self.rect.x) as usize;
            for (alpha, pixel) in alpha[first..].iter_mut().zip(row) {
                *alpha = pixel[3] as u16;
            }
        }
        alpha
    }

    /// Returns a layer of one color, visible in its whole box.
    #[cfg(test)]
    pub(super) fn uniform(rect: Rect, pixel: Quad) -> Resampled {
        let mut layer = Resampled {
            rect,
            pixels: vec![pixel; rect.area() as usize],
            runs: Vec::new(),
        };
        layer.show_whole();
        layer
    }
}

/// The target on which rows of a placed sprite are drawn.
pub(super) trait Surface {
    /// Returns the first columns of `within`, in row `y`, that are not hidden; empty if there are none.
    fn next_visible(&self, y: u32, within: Range<u32>) -> Range<u32>;

    /// Stores the pixels that `draw` writes for a run of columns of row `y`.
    fn draw_run(&mut self, y: u32, columns: Range<u32>, draw: impl FnOnce(&mut [Quad]));
}

/// A layer that has been started with `begin`.
struct Layer<'a> {
    layer: &'a mut Resampled,
    nearer: Option<&'a Coverage>,
}

impl Surface for Layer<'_> {
    #[inline(always)]
    fn next_visible(&self, y: u32, within: Range<u32>) -> Range<u32> {
        match self.nearer {
            Some(nearer) => nearer.next_visible(y, within),
            None => within,
        }
    }

    #[inline(always)]
    fn draw_run(&mut self, y: u32, columns: Range<u32>, draw: impl FnOnce(&mut [Quad])) {
        let Resampled { rect, pixels, runs } = self.layer;
        let first = ((y - rect.y) * rect.w + columns.start - rect.x) as usize;
        draw(&mut pixels[first..first + columns.len()]);
        runs.push([y, columns.start, columns.end]);
    }
}

/// Draws a placed sprite on a surface of `size` pixels and returns its bounding box. The sprite must have
/// been prepared for the placement's scale.
pub(super) fn draw_on(
    surface: &mut impl Surface,
    size: [u32; 2],
    sprite: &Premultiplied,
    place: &Placement,
    cpu: Level,
) -> Rect {
    let map = Map::new(sprite, place);
    let rect = map.bounding_box(size);
    draw_rows(surface, rect, &map, cpu);
    rect
}

fn draw_rows(surface: &mut impl Surface, rect: Rect, map: &Map, cpu: Level) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
            #[expect(unsafe_code, reason = "a kernel for AVX2")]
            // SAFETY: the match guard checked AVX2, the only feature that the callee requires.
            unsafe {
                avx2::draw_rows(surface, rect, map);
            }
        }
        _ => {
            let no_prefetch = |_: &_, _, _, _| {};
            draw_rows_with(surface, rect, map, Premultiplied::interpolate, no_prefetch);
        }
    }
}

/// Draws with the given kernel functions. Inlined, so that it is compiled for the kernel's instruction set.
#[inline(always)]
fn draw_rows_with(
    surface: &mut impl Surface,
    rect: Rect,
    map: &Map,
    interpolate: impl Fn(&Premultiplied, &mut [Quad], [i32; 2], [i32; 2]),
    prefetch: impl Fn(&Premultiplied, [i32; 2], [i32; 2], usize),
) {
    let (sprite, step) = (map.sprite, map.step());
    let (left, width) = (rect.x, rect.w as usize);
    let ahead = map.offset_of_rows(f64::from(ROWS_AHEAD));
    let source = |y: u32| map.source(f64::from(left) + 0.5, f64::from(y) + 0.5);
    for y in rect.y..rect.bottom().min(rect.y + ROWS_AHEAD) {
        prefetch(sprite, source(y).map(fixed), step.per_column, width);
    }
    for y in rect.y..rect.bottom() {
        let open = |surface: &_, from: usize, to: usize| {
            Surface::next_visible(surface, y, left + from as u32..left + to as u32)
        };
        if open(surface, 0, width).is_empty() {
            continue;
        }
        let start = source(y);
        let columns = map.columns_within(width, start);
        let from = columns.start;
        let first: [f64; 2] = std::array::from_fn(|k| start[k] + map.per_column[k] * from as f64);
        let first = first.map(fixed);
        let visible = sprite.visible_steps(first, &step, columns.len());
        let to = from + visible.end;
        let soon = step.position_after(first, visible.start as i32);
        let soon = [soon[0] + ahead[0], soon[1] + ahead[1]];
        prefetch(sprite, soon, step.per_column, visible.len());
        let mut run = open(surface, from + visible.start, to);
        while !run.is_empty() {
            let [start, end] = [run.start, run.end].map(|x| (x - left) as usize);
            let position = step.position_after(first, (start - from) as i32);
            surface.draw_run(y, run, |row| {
                interpolate(sprite, row, position, step.per_column);
            });
            run = open(surface, end, to);
        }
    }
}

#[cfg(test)]
mod tests;
