//! Sprites turned, mirrored, scaled and placed between pixels: Catmull-Rom interpolation of
//! premultiplied values, of a level of halved pictures where a sprite shrinks below 0.6 (ALGORITHMS.md
//! 8). Where a sprite lies on whole pixels at its own size, its pixels come out as they are.
//!
//! Everything is done in integers, 16384 for alpha 1 and for a full color: the same on every machine,
//! and sixteen values at a time where it has AVX2.

#[cfg(target_arch = "x86_64")]
mod avx2; // the same with vector instructions
mod catmull_rom; // the interpolation of one row
mod map; // from picture to sprite
mod premultiplied; // a sprite as it is interpolated

use std::ops::Range;

pub(super) use catmull_rom::scaled;
pub use premultiplied::{Premultiplied, bounds_of};

use self::map::{Map, fixed};
use super::canvas::Cover;
use crate::cpu::Level;
use crate::geometry::Rect;

/// So many rows of the picture before it is needed a sprite's row is fetched: sprites are shown once in a while and lie
/// far off in memory.
const ROWS_AHEAD: u32 = 8;

/// Alpha 1, or a full color of alpha 1.
pub const ONE: i16 = 1 << 14;

/// One pixel: each color times its alpha, and alpha, all 0..=[`ONE`].
pub type Quad = [i16; 4];

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

/// What a sprite is drawn into.
#[derive(Clone, Copy, Debug)]
pub struct Room<'a> {
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// What is nearer, in a picture of that size: what lets nothing through there hides the sprite.
    pub nearer: Option<&'a Cover>,
}

/// A placed sprite: premultiplied pixels of a box of the picture.
#[derive(Clone, Debug, Default)]
pub struct Resampled {
    /// The box.
    pub rect: Rect,
    /// Its pixels by rows, and perhaps more behind them.
    pub pixels: Vec<Quad>,
    /// Where it may show, from top to bottom: a row of the picture and its columns, from and to. Pixels
    /// elsewhere mean nothing.
    pub runs: Vec<[u32; 3]>,
}

impl Resampled {
    /// Draws a placed sprite, clipped to its room, reusing memory. The sprite must have been made for the
    /// placement's scale.
    pub fn draw(&mut self, sprite: &Premultiplied, place: &Placement, room: Room, cpu: Level) {
        let map = Map::new(sprite, place);
        let rect = map.covered(sprite, room.size);
        self.begin(rect);
        let nearer = room.nearer;
        draw_rows(
            &mut Layer {
                layer: self,
                nearer,
            },
            rect,
            (sprite, &map),
            cpu,
        );
    }

    /// Nothing yet, in a box, whose pixels mean nothing.
    pub fn begin(&mut self, rect: Rect) {
        self.rect = rect;
        self.runs.clear();
        let area = rect.area() as usize;
        if self.pixels.len() < area {
            self.pixels.resize(area, [0; 4]);
        }
    }

    /// Lets all of the box show.
    pub fn show_whole(&mut self) {
        let Rect { x, y, w, h } = self.rect;
        self.runs.clear();
        self.runs.extend((y..y + h).map(|y| [y, x, x + w]));
    }

    /// Where it may show: the first place of each run in the picture, and its pixels.
    pub fn shown(&self) -> impl Iterator<Item = ([u32; 2], &[Quad])> {
        self.runs.iter().map(|&[y, from, to]| {
            let first = ((y - self.rect.y) * self.rect.w + from - self.rect.x) as usize;
            ([from, y], &self.pixels[first..first + (to - from) as usize])
        })
    }

    /// The alpha of the whole box, by rows, in 16384ths.
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
}

/// What the rows of a placed sprite are drawn on.
pub(super) trait Surface {
    /// The first columns of `within`, in row `y`, where anything may show; empty when there are none.
    fn next_open(&self, y: u32, within: Range<u32>) -> Range<u32>;

    /// Takes what `draw` makes of a run of columns of row `y`.
    fn take(&mut self, y: u32, columns: Range<u32>, draw: impl FnOnce(&mut [Quad]));
}

/// A layer that is begun.
struct Layer<'a> {
    layer: &'a mut Resampled,
    nearer: Option<&'a Cover>,
}

impl Surface for Layer<'_> {
    #[inline(always)]
    fn next_open(&self, y: u32, within: Range<u32>) -> Range<u32> {
        match self.nearer {
            Some(nearer) => nearer.next_open(y, within),
            None => within,
        }
    }

    #[inline(always)]
    fn take(&mut self, y: u32, columns: Range<u32>, draw: impl FnOnce(&mut [Quad])) {
        let Resampled { rect, pixels, runs } = self.layer;
        let first = ((y - rect.y) * rect.w + columns.start - rect.x) as usize;
        draw(&mut pixels[first..first + columns.len()]);
        runs.push([y, columns.start, columns.end]);
    }
}

/// Draws a placed sprite straight on a surface of `size` pixels; returns the box that it lies in. The sprite must
/// have been made for the placement's scale.
pub(super) fn draw_on(
    surface: &mut impl Surface,
    size: [u32; 2],
    sprite: &Premultiplied,
    place: &Placement,
    cpu: Level,
) -> Rect {
    let map = Map::new(sprite, place);
    let rect = map.covered(sprite, size);
    draw_rows(surface, rect, (sprite, &map), cpu);
    rect
}

fn draw_rows(surface: &mut impl Surface, rect: Rect, from: (&Premultiplied, &Map), cpu: Level) {
    match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
            #[expect(unsafe_code, reason = "a kernel for AVX2")]
            // SAFETY: the line above made sure of AVX2, which is all that the callee asks for.
            unsafe {
                avx2::draw_rows(surface, rect, from);
            }
        }
        _ => draw_rows_with(
            surface,
            rect,
            from,
            (Premultiplied::interpolate, |_, _, _, _| {}),
        ),
    }
}

/// Draws with a kernel, for whose instructions this is compiled too.
#[inline(always)]
fn draw_rows_with(
    surface: &mut impl Surface,
    rect: Rect,
    (sprite, map): (&Premultiplied, &Map),
    (interpolate, prefetch): (
        impl Fn(&Premultiplied, &mut [Quad], [i32; 2], [i32; 2]),
        impl Fn(&Premultiplied, [i32; 2], [i32; 2], usize),
    ),
) {
    let (left, width, way) = (rect.x, rect.w as usize, map.way());
    let ahead = map.rows_on(f64::from(ROWS_AHEAD));
    let source = |y: u32| map.source(f64::from(left) + 0.5, f64::from(y) + 0.5);
    for y in rect.y..rect.bottom().min(rect.y + ROWS_AHEAD) {
        prefetch(sprite, source(y).map(fixed), way.step, width);
    }
    for y in rect.y..rect.bottom() {
        let open = |surface: &_, from: usize, to: usize| {
            Surface::next_open(surface, y, left + from as u32..left + to as u32)
        };
        if open(surface, 0, width).is_empty() {
            continue;
        }
        let start = source(y);
        let (from, to) = map.columns_within(sprite, width, start);
        let first: [f64; 2] = std::array::from_fn(|k| start[k] + map.per_column[k] * from as f64);
        let first = first.map(fixed);
        let seen = sprite.seen(first, &way, to - from);
        let to = from + seen.end;
        let soon = way.along(first, seen.start as i32);
        let soon = [soon[0] + ahead[0], soon[1] + ahead[1]];
        prefetch(sprite, soon, way.step, seen.len());
        let mut run = open(surface, from + seen.start, to);
        while !run.is_empty() {
            let [start, end] = [run.start, run.end].map(|x| (x - left) as usize);
            let place = way.along(first, (start - from) as i32);
            surface.take(y, run, |row| interpolate(sprite, row, place, way.step));
            run = open(surface, end, to);
        }
    }
}

#[cfg(test)]
mod tests;
