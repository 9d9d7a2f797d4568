//! How likely a pixel has its color if it shows the background, in light or in shadow.
//!
//! A shadow dims the background evenly and has soft edges. A tail may be as gray, but it is a dark line.

use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::Difference;

/// Deviation of a frame from its background beside the noise of the pixel, such as that of a codec around a
/// moving animal, levels of 255. Free choice.
const CODEC_NOISE: f32 = 3.0;
/// Least brightness of a shadow as a share of the background's. Free choice.
const MIN_SHADOW: f32 = 0.3;
/// Share of the scene near an animal that lies in shadow. Free choice.
const SHADOW_SHARE: f32 = 0.1;
/// Standard deviation of how much darker a shadow is in its middle than beside it, as far away as a thin part of
/// the animal is wide, as a share of the background's brightness. Free choice.
const SHADOW_DEPTH: f32 = 0.07;

/// A frame and its background in a box.
pub(super) struct Ground<'a> {
    pub(super) difference: &'a Difference,
    pub(super) background: &'a Background,
    /// Brightness of each pixel as a share of the background's.
    brightness: Vec<f32>,
}

impl<'a> Ground<'a> {
    pub(super) fn new(difference: &'a Difference, background: &'a Background) -> Ground<'a> {
        let share = |k: usize| {
            let back = background.color(background.px_in(difference.rect, k));
            dot(color(difference, k), back) / dot(back, back).max(1.0)
        };
        Ground {
            difference,
            background,
            brightness: (0..difference.levels.len()).map(share).collect(),
        }
    }

    /// Returns the color of a pixel, levels of 255.
    pub(super) fn color(&self, k: usize) -> [f32; 3] {
        color(self.difference, k)
    }

    /// Returns the logarithm of the likelihood of a pixel's color in a soft shadow, or `other` if that is greater.
    ///
    /// `beside_px` is the distance from a pixel to both sides of a thin part of the animal.
    pub(super) fn log_soft_shadow_or(&self, other: f32, k: usize, beside_px: i64) -> f32 {
        let shadow = self.log_shadow(k);
        // Hard shadows are found by their place (`cast_shadow`).
        if shadow <= other || self.background.cast_shadow.is_some() {
            return shadow.max(other);
        }
        other.max(shadow - self.line(k, beside_px))
    }

    fn variance(&self, px: usize) -> f32 {
        self.background.sigma[px].powi(2) + CODEC_NOISE.powi(2)
    }

    /// Returns the width of the distribution of a channel as a share of all levels.
    fn width(&self, px: usize) -> f32 {
        (std::f32::consts::TAU * self.variance(px)).sqrt() / 256.0
    }

    /// Returns the logarithm of the likelihood of a pixel's color in the light of its background.
    pub(super) fn log_light(&self, k: usize) -> f32 {
        let px = self.background.px_in(self.difference.rect, k);
        let back = self.background.color(px);
        let other = self.background.other.as_ref();
        let sway = other.map_or([0.0; 3], |other| {
            let at = &other.pixels[3 * px..3 * px + 3];
            [0, 1, 2].map(|c| f32::from(at[c]) - back[c])
        });
        let sway_squared = dot(sway, sway);
        let off = minus(self.color(k), back);
        let share = (dot(off, sway) / sway_squared.max(1.0)).clamp(0.0, 1.0);
        let off = minus(off, sway.map(|c| share * c));
        let length = self.width(px) + sway_squared.sqrt() / 256.0;
        -0.5 * dot(off, off) / self.variance(px) - libm::logf(self.width(px).powi(2) * length)
    }

    /// Returns the logarithm of the likelihood of a pixel's color in a shadow.
    pub(super) fn log_shadow(&self, k: usize) -> f32 {
        let px = self.background.px_in(self.difference.rect, k);
        let back = self.background.color(px);
        let light = dot(back, back).sqrt();
        let ratio = self.brightness[k].clamp(MIN_SHADOW, 1.0);
        let off = minus(self.color(k), back.map(|c| ratio * c));
        let length = self.width(px).max((1.0 - MIN_SHADOW) * light / 256.0);
        -0.5 * dot(off, off) / self.variance(px)
            - libm::logf(self.width(px).powi(2) * length / SHADOW_SHARE)
    }

    /// Returns how unlikely a pixel is in a shadow because it lies on a dark line: the loss of log-likelihood.
    ///
    /// On a line, a pixel is darker than both sides, and the line goes on at one end. A shadow has soft edges, so it
    /// is seldom a line.
    fn line(&self, k: usize, beside_px: i64) -> f32 {
        let rect = self.difference.rect;
        let (width, height) = (i64::from(rect.w), i64::from(rect.h));
        let (x, y) = (k as i64 % width, k as i64 / width);
        let own = self.brightness[k];
        let at = |px: i64, [dx, dy]: [i64; 2]| {
            let (x, y) = (x + px * dx, y + px * dy);
            let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
            is_inside.then(|| self.brightness[(y * width + x) as usize].min(1.0))
        };
        let pair = |px: i64, along: [i64; 2]| at(px, along).zip(at(-px, along));
        let near_px = (beside_px + 1) / 2;
        let depth = |across: [i64; 2]| {
            let along = pair(near_px, [-across[1], across[0]]);
            let goes_on = along.map(|(a, b)| (a - own).abs().min((b - own).abs()))?;
            let sides = [near_px, beside_px]
                .into_iter()
                .filter_map(|px| pair(px, across));
            let darker = sides.map(|(a, b)| a.min(b)).fold(0.0, f32::max);
            // On an even slope, twice the change over half the distance.
            Some(darker - own - 2.0 * goes_on)
        };
        let across = [[1, 0], [0, 1], [1, 1], [1, -1]].into_iter();
        let depth = across.filter_map(depth).fold(0.0, f32::max);
        let back = self.background.color(self.background.px_in(rect, k));
        let noise = self.variance(self.background.px_in(rect, k)) / dot(back, back).max(1.0);
        0.5 * depth.powi(2) / (SHADOW_DEPTH.powi(2) + noise)
    }
}

/// Returns the color of a pixel of the box, levels of 255.
fn color(difference: &Difference, k: usize) -> [f32; 3] {
    [0, 1, 2].map(|c| f32::from(difference.rgb.pixels[3 * k + c]))
}

pub(super) fn minus(p: [f32; 3], q: [f32; 3]) -> [f32; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

pub(super) fn dot(p: [f32; 3], q: [f32; 3]) -> f32 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}
