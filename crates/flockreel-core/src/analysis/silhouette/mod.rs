//! Silhouettes: connected components of the pixels of a frame that differ from the background.
//!
//! Block sums propose boxes (`blocks`). Only inside them, the frame is converted to RGB and compared pixel by
//! pixel. A pixel above the core threshold belongs to a component. A pixel above the weak threshold (usually
//! half of it) belongs only to a component with a core pixel.
//! See docs/explanation/algorithms.md, "Silhouette".

pub mod blocks;
pub mod cast_shadow;
mod given;
pub mod shadow;
pub mod tether;

pub use blocks::Blocks;

use super::scene::background::Background;
use super::scene::light::Light;
use crate::geometry::Rect;
use crate::raster::runs::{self, Component};
use crate::raster::{Frame, Mask, RgbImage};

/// Margin added around a proposed box before the comparison, pixels. Free choice.
pub const MARGIN_PX: u32 = 6;
/// First growth of a box whose edge a component touches, pixels. Free choice; each further growth is twice as
/// far.
const GROWTH_PX: u32 = 16;

/// Returns the connected components of foreground pixels of a frame, in reading order of their first pixel.
///
/// Pixels inside the `ignored` boxes are left out. When the frame has a given mask, the components are those
/// of the mask. Holes and ragged edges remain; [`smoothed`] mends them.
pub fn components(
    frame: &Frame,
    background: &Background,
    light: &Light,
    ignored: &[Rect],
) -> Vec<Component> {
    let boxes = background.blocks.proposals(frame, light, MARGIN_PX).boxes;
    components_in_boxes(frame, background, light, boxes, ignored)
}

/// Returns the components of foreground pixels as [`components`] does, from boxes that are already proposed.
pub fn components_in_boxes(
    frame: &Frame,
    background: &Background,
    light: &Light,
    boxes: Vec<Rect>,
    ignored: &[Rect],
) -> Vec<Component> {
    if let Some(mask) = &frame.mask {
        return given::components(mask, [frame.width, frame.height], ignored);
    }
    let mut found: Vec<Component> = Vec::new();
    for rect in boxes {
        for component in components_in_box(frame, background, light, rect, ignored) {
            if !found.contains(&component) {
                found.push(component);
            }
        }
    }
    found.sort_by_key(|c| c.runs.first().map(|run| (run.y, run.x0)));
    found
}

/// Returns the silhouette of a component: holes filled, edges smoothed by a 3 x 3 majority.
///
/// The mask covers the component's box and one pixel around it. It is empty when no pixel passes the
/// majority.
pub fn smoothed(component: &Component, width: u32, height: u32) -> Mask {
    let mut mask = component.mask(component.rect.inflated(1, width, height));
    mask.fill_holes();
    mask.majority()
}

/// Difference of a box of a frame from the background.
///
/// A level is the largest of |I / gain - B| over R, G and B. Where something sways in the background, B is
/// the nearest color between the two background colors of the pixel.
pub struct Difference {
    /// The box, in pixels of the frame.
    pub rect: Rect,
    /// The frame's pixels, divided by the light of the frame relative to the background.
    pub rgb: RgbImage,
    /// Largest channel difference of each pixel, row by row, 0..=255.
    pub levels: Vec<u8>,
}

impl Difference {
    /// Sets the levels inside `ignored` to 0.
    pub(super) fn clear(&mut self, ignored: Rect) {
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

/// Compares a box of a frame with the background.
pub fn difference(frame: &Frame, background: &Background, light: &Light, rect: Rect) -> Difference {
    let mut rgb = frame.rgb(rect);
    let factors = light.inverse_gains();
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
    let width = background.rgb.width as usize;
    let mut levels = Vec::with_capacity(rect.area() as usize);
    for (row, y) in rgb
        .pixels
        .chunks_exact(rect.w as usize * 3)
        .zip(rect.y as usize..)
    {
        let base = &background.rgb.pixels[(y * width + rect.x as usize) * 3..][..row.len()];
        levels.extend(row.chunks_exact(3).zip(base.chunks_exact(3)).map(|(i, b)| {
            i[0].abs_diff(b[0])
                .max(i[1].abs_diff(b[1]))
                .max(i[2].abs_diff(b[2]))
        }));
    }
    if let Some(other) = &background.other {
        for (k, level) in levels.iter_mut().enumerate() {
            let at = 3 * background.px_in(rect, k);
            let (base, other) = (
                &background.rgb.pixels[at..at + 3],
                &other.pixels[at..at + 3],
            );
            if *level > 0 && base != other {
                *level = distance_from_segment(&rgb.pixels[3 * k..3 * k + 3], base, other);
            }
        }
    }
    Difference { rect, rgb, levels }
}

/// Returns the largest channel difference of a color from the nearest color on the line between two colors.
///
/// A swaying thing covers a pixel in part, so its pixel takes any color between the two.
fn distance_from_segment(color: &[u8], base: &[u8], other: &[u8]) -> u8 {
    let gap = |a: &[u8], b: &[u8], c: usize| i32::from(a[c]) - i32::from(b[c]);
    let along: i32 = (0..3)
        .map(|c| gap(color, base, c) * gap(other, base, c))
        .sum();
    let length: i32 = (0..3).map(|c| gap(other, base, c).pow(2)).sum();
    let share = along.clamp(0, length);
    let deviation = |c: usize| {
        let nearest = i32::from(base[c]) + gap(other, base, c) * share / length.max(1);
        (i32::from(color[c]) - nearest).unsigned_abs() as u8
    };
    deviation(0).max(deviation(1)).max(deviation(2))
}

/// Returns the components of one box. The box grows on each side that a component touches, by twice as many
/// pixels each time.
fn components_in_box(
    frame: &Frame,
    background: &Background,
    light: &Light,
    rect: Rect,
    ignored: &[Rect],
) -> Vec<Component> {
    let mut rect = rect;
    let mut growth = i64::from(GROWTH_PX);
    loop {
        let mut difference = difference(frame, background, light, rect);
        ignored
            .iter()
            .for_each(|ignored| difference.clear(*ignored));
        let found = hysteresis(&difference, background);
        let growth_if = |runs_out: bool| if runs_out { growth } else { 0 };
        let grown = Rect::clipped(
            i64::from(rect.x) - growth_if(found.iter().any(|c| c.rect.x == rect.x)),
            i64::from(rect.y) - growth_if(found.iter().any(|c| c.rect.y == rect.y)),
            i64::from(rect.right())
                + growth_if(found.iter().any(|c| c.rect.right() == rect.right())),
            i64::from(rect.bottom())
                + growth_if(found.iter().any(|c| c.rect.bottom() == rect.bottom())),
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

/// Returns the components of pixels above the weak threshold that contain a pixel above the core threshold.
fn hysteresis(difference: &Difference, background: &Background) -> Vec<Component> {
    let rect = difference.rect;
    let mut weak = Mask::new(rect);
    let mut core = Mask::new(rect);
    let row_length = rect.w as usize;
    for (k, &level) in difference.levels.iter().enumerate() {
        let px = background.px_in(rect, k);
        weak.bits[k] = u8::from(level > background.weak_threshold(px));
        core.bits[k] = u8::from(level > background.core_threshold[px]);
    }
    shadow::remove(&mut weak, &core, difference, background);
    if let Some(usual) = background.cast_shadow {
        cast_shadow::remove(&mut weak, difference, background, usual);
        core.bits
            .iter_mut()
            .zip(&weak.bits)
            .for_each(|(core, weak)| *core &= weak);
    }
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
