//! Separates the animal in a silhouette from the shadow and the floor around it.
//!
//! The coat is the color of the pixels that differ most from the background. Pixels that differ much less,
//! and are a darker background or within its noise, are no part of the animal.

use std::ops::RangeInclusive;

use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::{Difference, shadow};
use crate::order::{median, percentile};
use crate::raster::Mask;

/// A pixel is faint when it differs by less than this share of the difference of the starkest pixels. Free
/// choice.
const FAINT_SHARE: f64 = 0.3;
/// A pixel has the coat's color when it differs from it by less than this share of its difference from the
/// background. Free choice.
const MATCH_SHARE: f64 = 0.25;
/// Brightness of a shadow as a share of the background's. Free choice.
const SHADOW_BRIGHTNESS: RangeInclusive<f32> = 0.45..=1.0;

/// The animal's appearance where it differs most from the background.
pub(super) struct Coat<'a> {
    difference: &'a Difference,
    background: &'a Background,
    /// 75th percentile of the differences from the background, levels of 255. A mean would sink with the
    /// shadow.
    starkest: f64,
    /// 75th percentile of the differences as shares of the brightness, 0..=1.
    starkest_share: f64,
    /// Median R, G and B of the pixels that differ by at least `starkest`, levels of 255.
    color: [f64; 3],
}

impl Coat<'_> {
    pub(super) fn measure<'a>(
        mask: &Mask,
        difference: &'a Difference,
        background: &'a Background,
    ) -> Coat<'a> {
        let mut coat = Coat {
            difference,
            background,
            starkest: 0.0,
            starkest_share: 0.0,
            color: [0.0; 3],
        };
        let covered = || (0..mask.bits.len()).filter(|&k| mask.bits[k] == 1);
        let stark = |mut values: Vec<f64>| percentile(&mut values, 0.75).unwrap_or(0.0);
        coat.starkest = stark(covered().map(|k| coat.level(k)).collect());
        coat.starkest_share = stark(covered().map(|k| coat.share(k)).collect());
        coat.color = [0, 1, 2].map(|c| {
            let stark = covered().filter(|&k| coat.level(k) >= coat.starkest);
            median(stark.map(|k| f64::from(difference.rgb.pixels[3 * k + c]))).unwrap_or(0.0)
        });
        coat
    }

    /// Returns the coat that differs more from the background.
    ///
    /// The other one contains too much of a mirror image in a dark wall, or of a shadow on a brighter floor.
    pub(super) fn or_starker(self, other: Self) -> Self {
        if other.starkest > self.starkest {
            other
        } else {
            self
        }
    }

    /// Returns the difference of a pixel from the background, levels of 255.
    fn level(&self, k: usize) -> f64 {
        f64::from(self.difference.levels[k])
    }

    /// Returns the difference as a share of the brightest channel of pixel and background, 0..=1.
    ///
    /// A shadow differs by more levels where the floor is brighter; the share stays equal.
    fn share(&self, k: usize) -> f64 {
        let seen = &self.difference.rgb.pixels[3 * k..3 * k + 3];
        let px = self.background.px_in(self.difference.rect, k);
        let back = &self.background.rgb.pixels[3 * px..3 * px + 3];
        let brightest = seen
            .iter()
            .chain(back)
            .fold(1, |most, &value| value.max(most));
        self.level(k) / f64::from(brightest)
    }

    /// Returns whether a pixel differs much less from the background than the starkest pixels.
    pub(super) fn is_faint(&self, k: usize) -> bool {
        self.level(k) < FAINT_SHARE * self.starkest
            || self.share(k) < FAINT_SHARE * self.starkest_share
    }

    /// Returns whether a pixel has the coat's color: it is much nearer to it than to the background.
    pub(super) fn matches(&self, k: usize) -> bool {
        let seen = &self.difference.rgb.pixels[3 * k..3 * k + 3];
        let differences = seen.iter().zip(self.color);
        let max_difference = differences.fold(0.0, |most, (&seen, color)| {
            f64::max(most, (f64::from(seen) - color).abs())
        });
        max_difference < MATCH_SHARE * self.level(k)
    }

    /// Returns whether a faint pixel has the background's color, but darker.
    pub(super) fn is_shadow(&self, k: usize) -> bool {
        self.is_faint(k)
            && !self.matches(k)
            && shadow::has_darker_color(self.difference, self.background, k, SHADOW_BRIGHTNESS)
    }

    /// Returns whether a faint pixel cannot be told from the background.
    fn is_floor(&self, k: usize) -> bool {
        let px = self.background.px_in(self.difference.rect, k);
        self.is_faint(k)
            && !self.matches(k)
            && self.difference.levels[k] <= self.background.weak_threshold(px)
    }

    /// Returns the mask without the soft shadow around the animal and without the floor between its parts.
    ///
    /// Pixels that the animal encloses stay, such as a white belly over a white floor. Pixels of the coat's
    /// color stay too, such as black fur in front of a dark wall.
    pub(super) fn without_halo(&self, mask: &Mask, band_px: u32) -> Mask {
        let mut solid = mask.clone();
        for (k, bit) in solid.bits.iter_mut().enumerate() {
            *bit &= u8::from(!self.is_shadow(k) && !self.is_floor(k));
        }
        add_enclosed(&mut solid, 2 * band_px);
        solid.majority()
    }
}

/// Sets the pixels that are enclosed by parts more than twice `reach_px` thick.
///
/// Thinner parts enclose nothing: a tail and its shadow may meet around a patch of floor.
fn add_enclosed(solid: &mut Mask, reach_px: u32) {
    let mut filled = solid.clone();
    filled.fill_holes();
    if filled == *solid {
        return;
    }
    let mut thick = solid.eroded_by(reach_px);
    thick.fill_holes();
    for (bit, enclosed) in solid.bits.iter_mut().zip(thick.dilated_by(reach_px).bits) {
        *bit |= enclosed;
    }
}
