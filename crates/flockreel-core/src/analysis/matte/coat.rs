//! How much likelier a pixel shows the animal than the scene: colors learned over the whole film.
//!
//! The animal has a palette. A pixel of the scene has the color of its background, that color in a shadow, or
//! seldom any color of the scene, where something moved. All likelihoods are relative to even colors.

use crate::analysis::palette::Palette;
use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::Difference;
use crate::raster::Mask;

/// Deviation of a frame from its background beside the noise of the pixel, such as that of a codec around a
/// moving animal, levels of 255. Free choice.
const CODEC_NOISE: f32 = 3.0;
/// Least brightness of a shadow as a share of the background's. Free choice.
const MIN_SHADOW: f32 = 0.3;
/// Share of the scene near an animal that lies in shadow. Free choice.
const SHADOW_SHARE: f32 = 0.1;
/// Share of the scene near an animal that moved. Free choice.
const MOVED_SHARE: f32 = 0.01;

/// Density of the animal's colors, relative to even colors, until they are learned. Free choice: a
/// balance between gray animals, which a shadow may explain, and shadows, which are no animal.
const COAT_DENSITY: f32 = 20.0;

/// Colors of the animal and of the scene around it.
pub struct Coat {
    animal: Palette,
    scene: Palette,
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
        let weighted = pixels(1).map(|(difference, background, k)| {
            let scene = libm::expf(log_background(difference, background, k));
            (color(difference, k), COAT_DENSITY / (COAT_DENSITY + scene))
        });
        Coat {
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
        self.animal.log_density(color) - log_background(difference, background, k).max(moved)
    }
}

/// Returns the logarithm of the likelihood of a pixel's color under its background, in light or in shadow.
fn log_background(difference: &Difference, background: &Background, k: usize) -> f32 {
    let px = background.px_in(difference.rect, k);
    let (seen, back) = (color(difference, k), background.color(px));
    let variance = background.sigma[px].powi(2) + CODEC_NOISE.powi(2);
    // Width of the distribution of a channel as a share of all levels.
    let width = (std::f32::consts::TAU * variance).sqrt() / 256.0;
    let log_density =
        |off_squared: f32, volume: f32| -0.5 * off_squared / variance - libm::logf(volume);
    let other = background.other.as_ref();
    let sway = other.map_or([0.0; 3], |other| {
        let at = &other.pixels[3 * px..3 * px + 3];
        [0, 1, 2].map(|c| f32::from(at[c]) - back[c])
    });
    let sway_squared = dot(sway, sway);
    let off = minus(seen, back);
    let share = (dot(off, sway) / sway_squared.max(1.0)).clamp(0.0, 1.0);
    let off = minus(off, sway.map(|c| share * c));
    let length = width + sway_squared.sqrt() / 256.0;
    let in_light = log_density(dot(off, off), width * width * length);
    let light = dot(back, back);
    let ratio = (dot(seen, back) / light.max(1.0)).clamp(MIN_SHADOW, 1.0);
    let off = minus(seen, back.map(|c| ratio * c));
    let length = width.max((1.0 - MIN_SHADOW) * light.sqrt() / 256.0);
    let in_shadow = log_density(dot(off, off), width * width * length / SHADOW_SHARE);
    in_light.max(in_shadow)
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
