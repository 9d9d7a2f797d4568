//! How much likelier a pixel shows the animal than the scene: colors learned over the whole film.
//!
//! The animal has a palette. A pixel of the scene has the color of its background, that color in a shadow, or
//! seldom any color of the scene, where something moved. All likelihoods are relative to even colors.

use crate::analysis::palette::Palette;
use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::Difference;
use crate::analysis::track::body::THIN_SHARE;
use crate::order;
use crate::raster::Mask;

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
/// Share of the scene near an animal that moved. Free choice.
const MOVED_SHARE: f32 = 0.01;

/// Density of the animal's colors, relative to even colors, until they are learned. Free choice: a
/// balance between gray animals, which a shadow may explain, and shadows, which are no animal.
const COAT_DENSITY: f32 = 20.0;

/// Colors of the animal and of the scene around it.
pub struct Coat {
    animal: Palette,
    scene: Palette,
    /// Distance from a pixel to both sides of a thin part of the animal, pixels.
    beside_px: i64,
    /// Whether the animal may extend beyond its silhouette. It may not where a part of the silhouette was cut
    /// off, such as a tether or a mirror image.
    pub grows: bool,
}

impl Coat {
    /// Learns the colors from frames around the animal, each with its background and the animal's silhouette
    /// in the same box.
    ///
    /// A pixel of a silhouette counts by the probability that it shows the animal rather than the background or
    /// its shadow, where nothing but `COAT_DENSITY` is known of the animal's colors.
    pub fn learn(seen: &[(Difference, &Background, Mask)], grows: bool) -> Coat {
        let pixels = |side: u8| {
            seen.iter().flat_map(move |(difference, background, mask)| {
                let pixels = (0..mask.bits.len()).filter(move |&k| mask.bits[k] == side);
                pixels.map(move |k| (difference, background, k))
            })
        };
        let half_widths = seen.iter().map(|(.., mask)| {
            let depth = mask.depth_px();
            depth.into_iter().max().map_or(0.0, f64::from)
        });
        let half_width = order::median(half_widths).unwrap_or(0.0);
        let beside_px = (THIN_SHARE * half_width) as i64 + 1;
        let weighted = pixels(1).map(|(difference, background, k)| {
            let scene = SceneAt {
                difference,
                background,
            };
            let scene = libm::expf(scene.log_light(k).max(scene.log_shadow(k)));
            (color(difference, k), COAT_DENSITY / (COAT_DENSITY + scene))
        });
        Coat {
            beside_px,
            animal: Palette::weighted(weighted),
            scene: Palette::new(pixels(0).map(|(difference, _, k)| color(difference, k))),
            grows,
        }
    }

    /// Returns the logarithm of the ratio of likelihoods that a pixel shows the animal, and that it shows the
    /// scene.
    pub(super) fn log_odds(
        &self,
        difference: &Difference,
        background: &Background,
        k: usize,
    ) -> f32 {
        let color = color(difference, k);
        let moved = self.scene.log_density(color) + libm::logf(MOVED_SHARE);
        let scene = SceneAt {
            difference,
            background,
        };
        let scene = scene.log_density(k, self.beside_px).max(moved);
        self.animal.log_density(color) - scene
    }
}

/// The scene at the pixels of a box.
struct SceneAt<'a> {
    difference: &'a Difference,
    background: &'a Background,
}

impl SceneAt<'_> {
    /// Returns the logarithm of the likelihood of a pixel's color under its background, in light or in soft shadow.
    fn log_density(&self, k: usize, beside_px: i64) -> f32 {
        let (light, shadow) = (self.log_light(k), self.log_shadow(k));
        // Hard shadows are found by their place (`cast_shadow`).
        let may_be_line = shadow > light && self.background.cast_shadow.is_none();
        let line = may_be_line.then(|| self.line(k, beside_px));
        light.max(shadow - line.unwrap_or(0.0))
    }

    fn variance(&self, px: usize) -> f32 {
        self.background.sigma[px].powi(2) + CODEC_NOISE.powi(2)
    }

    /// Returns the width of the distribution of a channel as a share of all levels.
    fn width(&self, px: usize) -> f32 {
        (std::f32::consts::TAU * self.variance(px)).sqrt() / 256.0
    }

    /// Returns the logarithm of the likelihood of a pixel's color in the light of its background.
    fn log_light(&self, k: usize) -> f32 {
        let px = self.background.px_in(self.difference.rect, k);
        let back = self.background.color(px);
        let other = self.background.other.as_ref();
        let sway = other.map_or([0.0; 3], |other| {
            let at = &other.pixels[3 * px..3 * px + 3];
            [0, 1, 2].map(|c| f32::from(at[c]) - back[c])
        });
        let sway_squared = dot(sway, sway);
        let off = minus(color(self.difference, k), back);
        let share = (dot(off, sway) / sway_squared.max(1.0)).clamp(0.0, 1.0);
        let off = minus(off, sway.map(|c| share * c));
        let length = self.width(px) + sway_squared.sqrt() / 256.0;
        -0.5 * dot(off, off) / self.variance(px) - libm::logf(self.width(px).powi(2) * length)
    }

    /// Returns the logarithm of the likelihood of a pixel's color in a shadow.
    fn log_shadow(&self, k: usize) -> f32 {
        let px = self.background.px_in(self.difference.rect, k);
        let back = self.background.color(px);
        let light = dot(back, back).sqrt();
        let ratio = self.brightness(k).clamp(MIN_SHADOW, 1.0);
        let off = minus(color(self.difference, k), back.map(|c| ratio * c));
        let length = self.width(px).max((1.0 - MIN_SHADOW) * light / 256.0);
        -0.5 * dot(off, off) / self.variance(px)
            - libm::logf(self.width(px).powi(2) * length / SHADOW_SHARE)
    }

    /// Returns the brightness of a pixel as a share of the background's.
    fn brightness(&self, k: usize) -> f32 {
        let px = self.background.px_in(self.difference.rect, k);
        let back = self.background.color(px);
        dot(color(self.difference, k), back) / dot(back, back).max(1.0)
    }

    /// Returns how unlikely a pixel is in a shadow because it lies on a dark line: the loss of log-likelihood.
    ///
    /// On a line, a pixel is darker than both sides, and the line goes on at one end. A shadow has soft edges, so it
    /// is seldom a line.
    fn line(&self, k: usize, beside_px: i64) -> f32 {
        let rect = self.difference.rect;
        let (width, height) = (i64::from(rect.w), i64::from(rect.h));
        let (x, y) = (k as i64 % width, k as i64 / width);
        let own = self.brightness(k);
        let at = |px: i64, [dx, dy]: [i64; 2]| {
            let (x, y) = (x + px * dx, y + px * dy);
            let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
            is_inside.then(|| self.brightness((y * width + x) as usize).min(1.0))
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
