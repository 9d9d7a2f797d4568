//! Where a frame differs from the plate: components of foreground pixels (ALGORITHMS.md 2.4 to 2.6, 3).
//!
//! The means of 4 x 4 blocks propose boxes; only inside them is the frame converted to RGB and
//! compared pixel by pixel. A pixel differs for certain above the core threshold; pixels above half
//! of it count when they hang together with a certain one.

pub mod blocks;
mod given;
pub mod shadow;
pub mod tether;

pub use blocks::Blocks;

use super::scene::light::Light;
use super::scene::plate::Plate;
use crate::geometry::Rect;
use crate::raster::runs::{self, Component};
use crate::raster::{Frame, Mask, RgbImage};

/// How far a proposed box is widened before it is looked at.
pub const MARGIN_PX: u32 = 6;
/// How far a box grows when a component runs into its edge.
const GROWTH_PX: u32 = 16;

/// The components of foreground pixels of a frame, from the top left; raw: neither holes nor ragged edges mended
/// (`shaped` does). Nothing inside the `ignored` boxes counts.
///
/// Where a mask is given they are those of the mask.
pub fn components(frame: &Frame, plate: &Plate, light: &Light, ignored: &[Rect]) -> Vec<Component> {
    let (boxes, _) = plate.blocks.proposals(frame, light, MARGIN_PX);
    components_of(frame, plate, light, boxes, ignored)
}

/// The same in boxes already proposed.
pub fn components_of(
    frame: &Frame,
    plate: &Plate,
    light: &Light,
    boxes: Vec<Rect>,
    ignored: &[Rect],
) -> Vec<Component> {
    if let Some(mask) = &frame.mask {
        return given::components(mask, [frame.width, frame.height], ignored);
    }
    let mut found: Vec<Component> = Vec::new();
    for rect in boxes {
        for component in components_in(frame, plate, light, rect, ignored) {
            if !found.contains(&component) {
                found.push(component);
            }
        }
    }
    found.sort_by_key(|c| c.runs.first().map(|run| (run.y, run.x0)));
    found
}

/// A component as a silhouette: holes filled, edges smoothed by 3 x 3 majority; over its box and one
/// pixel more. Empty when nothing of it is left.
pub fn shaped(component: &Component, width: u32, height: u32) -> Mask {
    let mut mask = component.mask(component.rect.inflated(1, width, height));
    mask.fill_holes();
    mask.majority()
}

/// The difference of a box from the plate: the largest over R, G, B of |I / gain - B|; where something
/// sways, from the nearest color between the two that are seen there.
pub struct Difference {
    /// The box.
    pub rect: Rect,
    /// The frame's pixels in the plate's light.
    pub rgb: RgbImage,
    /// Largest channel difference of each pixel.
    pub levels: Vec<u8>,
}

impl Difference {
    /// Takes a box for no different, as far as it lies inside.
    fn clear(&mut self, ignored: Rect) {
        let common = self.rect.intersection(&ignored);
        if common.is_empty() {
            return;
        }
        let row_length = self.rect.w as usize;
        let rows = self.levels.chunks_exact_mut(row_length);
        let first = (common.x - self.rect.x) as usize;
        for row in rows
            .skip((common.y - self.rect.y) as usize)
            .take(common.h as usize)
        {
            row[first..first + common.w as usize].fill(0);
        }
    }
}

/// Compares a box of a frame with the plate.
pub fn difference(frame: &Frame, plate: &Plate, light: &Light, rect: Rect) -> Difference {
    let mut rgb = frame.rgb(rect);
    let factors = light.to_plate();
    if factors != [4096; 3] {
        for pixel in rgb.pixels.chunks_exact_mut(3) {
            for (value, factor) in pixel.iter_mut().zip(factors) {
                *value = ((i32::from(*value) * factor + 2048) >> 12).min(255) as u8;
            }
        }
    }
    if light.is_uneven() {
        for (k, pixel) in rgb.pixels.chunks_exact_mut(3).enumerate() {
            let (x, y) = (k % rect.w as usize, k / rect.w as usize);
            let factor = light.factor(rect.x as usize + x, rect.y as usize + y);
            for value in pixel {
                *value = (f32::from(*value) / factor + 0.5) as u8;
            }
        }
    }
    let width = plate.rgb.width as usize;
    let mut levels = Vec::with_capacity(rect.area() as usize);
    for (row, y) in rgb
        .pixels
        .chunks_exact(rect.w as usize * 3)
        .zip(rect.y as usize..)
    {
        let base = &plate.rgb.pixels[(y * width + rect.x as usize) * 3..][..row.len()];
        levels.extend(row.chunks_exact(3).zip(base.chunks_exact(3)).map(|(i, b)| {
            i[0].abs_diff(b[0])
                .max(i[1].abs_diff(b[1]))
                .max(i[2].abs_diff(b[2]))
        }));
    }
    if let Some(other) = &plate.other {
        for (k, level) in levels.iter_mut().enumerate() {
            let (x, y) = (k % rect.w as usize, k / rect.w as usize);
            let at = ((rect.y as usize + y) * width + rect.x as usize + x) * 3;
            let (base, other) = (&plate.rgb.pixels[at..at + 3], &other.pixels[at..at + 3]);
            if *level > 0 && base != other {
                *level = beside(&rgb.pixels[3 * k..3 * k + 3], base, other);
            }
        }
    }
    Difference { rect, rgb, levels }
}

/// The largest channel difference of a color from the nearest one between two: what sways across a
/// pixel covers a part of it.
fn beside(color: &[u8], base: &[u8], other: &[u8]) -> u8 {
    let gap = |a: &[u8], b: &[u8], c: usize| i32::from(a[c]) - i32::from(b[c]);
    let along: i32 = (0..3)
        .map(|c| gap(color, base, c) * gap(other, base, c))
        .sum();
    let length: i32 = (0..3).map(|c| gap(other, base, c).pow(2)).sum();
    let share = along.clamp(0, length);
    let off = |c: usize| {
        let nearest = i32::from(base[c]) + gap(other, base, c) * share / length.max(1);
        (i32::from(color[c]) - nearest).unsigned_abs() as u8
    };
    off(0).max(off(1)).max(off(2))
}

/// The components of one box, which grows to the sides where any of them runs into its edge, twice
/// as far each time.
fn components_in(
    frame: &Frame,
    plate: &Plate,
    light: &Light,
    rect: Rect,
    ignored: &[Rect],
) -> Vec<Component> {
    let mut rect = rect;
    let mut growth = i64::from(GROWTH_PX);
    loop {
        let mut difference = difference(frame, plate, light, rect);
        ignored
            .iter()
            .for_each(|ignored| difference.clear(*ignored));
        let found = hysteresis(&difference, plate);
        let grow = |runs_out: bool| if runs_out { growth } else { 0 };
        let grown = Rect::clipped(
            i64::from(rect.x) - grow(found.iter().any(|c| c.rect.x == rect.x)),
            i64::from(rect.y) - grow(found.iter().any(|c| c.rect.y == rect.y)),
            i64::from(rect.right()) + grow(found.iter().any(|c| c.rect.right() == rect.right())),
            i64::from(rect.bottom()) + grow(found.iter().any(|c| c.rect.bottom() == rect.bottom())),
            frame.width,
            frame.height,
        );
        if grown == rect {
            return found;
        }
        rect = grown;
        growth *= 2;
    }
}

/// Components of pixels above half the core threshold that hold a pixel above all of it.
fn hysteresis(difference: &Difference, plate: &Plate) -> Vec<Component> {
    let rect = difference.rect;
    let width = plate.frame.width as usize;
    let mut weak = Mask::new(rect);
    let mut core = Mask::new(rect);
    let row_length = rect.w as usize;
    for (k, &level) in difference.levels.iter().enumerate() {
        let px = (rect.y as usize + k / row_length) * width + rect.x as usize + k % row_length;
        weak.bits[k] = u8::from(level > plate.weak_threshold(px));
        core.bits[k] = u8::from(level > plate.core_threshold[px]);
    }
    shadow::remove(&mut weak, &core, difference, plate);
    let has_core = |component: &Component| {
        component.runs.iter().any(|run| {
            let row = (run.y - rect.y) as usize * row_length;
            let (x0, x1) = ((run.x0 - rect.x) as usize, (run.x1 - rect.x) as usize);
            core.bits[row + x0..row + x1].contains(&1)
        })
    };
    runs::components(&weak)
        .into_iter()
        .filter(has_core)
        .collect()
}
