//! How much likelier a pixel shows the animal than the scene: colors learned over the whole film.
//!
//! The animal has a palette. A pixel of the scene has the color of its background, that color in a shadow, or
//! seldom any color of the scene, where something moved. All likelihoods are relative to even colors.

use super::ground::Ground;
use crate::analysis::palette::Palette;
use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::Difference;
use crate::analysis::track::body::THIN_SHARE;
use crate::order;
use crate::raster::Mask;

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
        let grounds: Vec<_> = (seen.iter())
            .map(|(difference, background, mask)| (Ground::new(difference, background), mask))
            .collect();
        let pixels = |side: u8| {
            grounds.iter().flat_map(move |(ground, mask)| {
                let pixels = (0..mask.bits.len()).filter(move |&k| mask.bits[k] == side);
                pixels.map(move |k| (ground, k))
            })
        };
        let half_widths = seen.iter().map(|(.., mask)| {
            let depth = mask.depth_px();
            depth.into_iter().max().map_or(0.0, f64::from)
        });
        let half_width = order::median(half_widths).unwrap_or(0.0);
        let beside_px = (THIN_SHARE * half_width) as i64 + 1;
        let weighted = pixels(1).map(|(ground, k)| {
            let scene = libm::expf(ground.log_light(k).max(ground.log_shadow(k)));
            (ground.color(k), COAT_DENSITY / (COAT_DENSITY + scene))
        });
        Coat {
            beside_px,
            animal: Palette::weighted(weighted),
            scene: Palette::new(pixels(0).map(|(ground, k)| ground.color(k))),
            grows,
        }
    }

    /// Returns the logarithm of the ratio of likelihoods that a pixel shows the animal, and that it shows the
    /// scene.
    pub(super) fn log_odds(&self, ground: &Ground, k: usize) -> f32 {
        let color = ground.color(k);
        let moved = self.scene.log_density(color) + libm::logf(MOVED_SHARE);
        let in_light = ground.log_light(k).max(moved);
        let scene = ground.log_soft_shadow_or(in_light, k, self.beside_px);
        self.animal.log_density(color) - scene
    }
}
