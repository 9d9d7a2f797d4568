//! Removes cast shadows from silhouettes.
//!
//! A shadow pixel is darker than the background, but has its color and its texture (Horprasert et al. 1999).
//! Only weak pixels are removed. See docs/explanation/algorithms.md, "Silhouette".

use std::ops::RangeInclusive;

use super::Difference;
use crate::analysis::scene::background::Background;
use crate::raster::Mask;
use crate::raster::runs::Component;

/// Brightness of a shadow as a share of the background's. Free choice.
const BRIGHTNESS: RangeInclusive<f32> = 0.45..=0.95;
/// Half side of the square whose texture is compared, pixels. Free choice.
const RADIUS: i64 = 2;
/// Least correlation of a shadow's texture with the background's. Free choice.
const MIN_CORRELATION: f32 = 0.9;

/// Clears the weak pixels that are shadow. Core pixels stay set.
pub fn remove(weak: &mut Mask, core: &Mask, difference: &Difference, background: &Background) {
    for k in 0..weak.bits.len() {
        if weak.bits[k] == 1 && core.bits[k] == 0 && is_shadow(difference, background, k) {
            weak.bits[k] = 0;
        }
    }
}

/// Returns whether at least 70 % of a component's pixels have the color of a shadow. `difference` covers its
/// box.
pub fn is_all_shadow(
    difference: &Difference,
    background: &Background,
    component: &Component,
) -> bool {
    let mask = component.mask(component.rect);
    let like = (0..mask.bits.len())
        .filter(|&k| mask.bits[k] == 1 && has_shadow_color(difference, background, k));
    10 * like.count() as u64 >= 7 * component.area
}

fn is_shadow(difference: &Difference, background: &Background, k: usize) -> bool {
    has_shadow_color(difference, background, k)
        && correlation(difference, background, k) > MIN_CORRELATION
}

/// Returns whether a pixel has the background's color at a brightness that a shadow may have.
fn has_shadow_color(difference: &Difference, background: &Background, k: usize) -> bool {
    has_darker_color(difference, background, k, BRIGHTNESS)
}

/// Returns whether a pixel has the background's color, at a share of its brightness within `ratios`.
pub fn has_darker_color(
    difference: &Difference,
    background: &Background,
    k: usize,
    ratios: RangeInclusive<f32>,
) -> bool {
    let px = background.px_in(difference.rect, k);
    let i = [0, 1, 2].map(|c| f32::from(difference.rgb.pixels[3 * k + c]));
    let b = background.color(px);
    let dot = |p: [f32; 3], q: [f32; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let ratio = dot(i, b) / dot(b, b).max(1.0);
    if !ratios.contains(&ratio) {
        return false;
    }
    let gap = [0, 1, 2].map(|c| i[c] - ratio * b[c]);
    dot(gap, gap) < (3.0 * background.sigma[px]).powi(2)
}

/// Returns the normalized correlation of the green channel with the background's around a pixel, -1..=1.
///
/// Returns 1 where both are flat: a shadow on an even wall has no texture to compare.
fn correlation(difference: &Difference, background: &Background, k: usize) -> f32 {
    let rect = difference.rect;
    let (x, y) = (k % rect.w as usize, k / rect.w as usize);
    let (mut n, mut i1, mut b1, mut ii, mut bb, mut ib) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for dy in -RADIUS..=RADIUS {
        for dx in -RADIUS..=RADIUS {
            let (sx, sy) = (x as i64 + dx, y as i64 + dy);
            if sx < 0 || sy < 0 || sx >= i64::from(rect.w) || sy >= i64::from(rect.h) {
                continue;
            }
            let (sx, sy) = (sx as u32, sy as u32);
            let i = f32::from(difference.rgb.pixel(sx, sy)[1]);
            let b = f32::from(background.rgb.pixel(rect.x + sx, rect.y + sy)[1]);
            n += 1.0;
            i1 += i;
            b1 += b;
            ii += i * i;
            bb += b * b;
            ib += i * b;
        }
    }
    let (vi, vb) = (ii - i1 * i1 / n, bb - b1 * b1 / n);
    let flat = n * 2.0 * 2.0;
    if vi < flat && vb < flat {
        return 1.0;
    }
    (ib - i1 * b1 / n) / (vi * vb).sqrt().max(1e-6)
}
