//! What of a silhouette is the animal itself, and what is shadow around it.

use std::ops::RangeInclusive;

use crate::analysis::scene::plate::Plate;
use crate::analysis::silhouette::{Difference, shadow};
use crate::order::{median, percentile};
use crate::raster::Mask;

/// A pixel that differs by less than this part of what the starkest ones do is faint.
const FAINT: f64 = 0.3;
/// What is of the coat is off its color by less than this share of what it is off the plate.
const MATCH: f64 = 0.25;
/// How much of its light a place in the shadow has.
const SHADOW: RangeInclusive<f32> = 0.45..=1.0;

/// What the animal looks like where it differs most from the plate.
pub(super) struct Coat<'a> {
    difference: &'a Difference,
    plate: &'a Plate,
    /// What its starkest quarter differs by, at least, in levels: a mean would sink with the shadow around it.
    starkest: f64,
    /// The same as a share of the light.
    starkest_share: f64,
    /// The median of R, G and B there.
    color: [f64; 3],
}

impl Coat<'_> {
    pub(super) fn of<'a>(mask: &Mask, difference: &'a Difference, plate: &'a Plate) -> Coat<'a> {
        let mut coat = Coat {
            difference,
            plate,
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

    /// The one that differs more from the plate: in the other there is too much of an image in a dark wall, or of shadows
    /// on a floor that is brighter there.
    pub(super) fn or_starker(self, other: Self) -> Self {
        match other.starkest > self.starkest {
            true => other,
            false => self,
        }
    }

    /// How far a pixel lies from the plate.
    fn level(&self, k: usize) -> f64 {
        f64::from(self.difference.levels[k])
    }

    /// The same as a share of the brighter of the two, 0 to 1: the one shadow is more levels where the floor is brighter.
    fn share(&self, k: usize) -> f64 {
        let (rect, width) = (self.difference.rect, self.difference.rect.w as usize);
        let (x, y) = ((k % width) as u32, (k / width) as u32);
        let seen = self.difference.rgb.pixel(x, y);
        let back = self.plate.rgb.pixel(rect.x + x, rect.y + y);
        let brightest = seen.into_iter().chain(back).fold(1, u8::max);
        self.level(k) / f64::from(brightest)
    }

    /// Whether a pixel differs by little of what the starkest ones do.
    pub(super) fn is_faint(&self, k: usize) -> bool {
        self.level(k) < FAINT * self.starkest || self.share(k) < FAINT * self.starkest_share
    }

    /// Whether a pixel has its color: it is much nearer to it than to the plate.
    pub(super) fn matches(&self, k: usize) -> bool {
        let seen = &self.difference.rgb.pixels[3 * k..3 * k + 3];
        let off = seen.iter().zip(self.color);
        let most_off = off.fold(0.0, |most, (&seen, color)| {
            f64::max(most, (f64::from(seen) - color).abs())
        });
        most_off < MATCH * self.level(k)
    }

    /// Whether a pixel that is faint looks like the plate, only darker.
    pub(super) fn is_shadow(&self, k: usize) -> bool {
        let width = self.difference.rect.w as usize;
        self.is_faint(k)
            && !self.matches(k)
            && shadow::has_darker_color(self.difference, self.plate, k % width, k / width, SHADOW)
    }

    /// Whether a pixel that is faint is as good as the plate.
    fn is_floor(&self, k: usize) -> bool {
        let (rect, width) = (self.difference.rect, self.difference.rect.w as usize);
        let (x, y) = (rect.x as usize + k % width, rect.y as usize + k / width);
        let at = y * self.plate.frame.width as usize + x;
        self.is_faint(k)
            && !self.matches(k)
            && self.difference.levels[k] <= self.plate.weak_threshold(at)
    }

    /// The mask less the soft shadow around the animal, and less the floor that shows between its parts. So a shadow on the
    /// floor stays a shadow. What of this lies in the midst of the animal is a patch of its own that looks so, as a white
    /// belly over a white floor: solid all the same; and so is what has the coat's color, as black fur before a dark wall.
    pub(super) fn without_halo(&self, mask: &Mask, band_px: u32) -> Mask {
        let mut solid = mask.clone();
        for (k, bit) in solid.bits.iter_mut().enumerate() {
            *bit &= u8::from(!self.is_shadow(k) && !self.is_floor(k));
        }
        add_midst(&mut solid, 2 * band_px);
        solid.majority()
    }
}

/// Adds what walls enclose that are more than twice `reach_px` thick. Thinner ones, as a tail and its shadow that meet,
/// enclose nothing.
fn add_midst(solid: &mut Mask, reach_px: u32) {
    let mut filled = solid.clone();
    filled.fill_holes();
    if filled == *solid {
        return;
    }
    let mut midst = solid.eroded_by(reach_px);
    midst.fill_holes();
    for (bit, within) in solid.bits.iter_mut().zip(midst.dilated_by(reach_px).bits) {
        *bit |= within;
    }
}
