//! The ground on which the animal stands, without things much darker than it, such as a wall.
//!
//! On a dark thing the animal stands out less, so the coat is also measured on the ground only (`coat`). Dark
//! things also show mirror images of the animal. A few levels are a large share of the little light there, so
//! an image in a matte would become a dark patch on any lighter background.

use super::coat::Coat;
use crate::analysis::scene::background::Background;
use crate::geometry::Rect;
use crate::order::percentile;
use crate::raster::Mask;
use crate::raster::runs::{Component, components};

/// A thing is dark below this share of the ground's brightness. Free choice; a wall that showed an image
/// (mouse in a round arena) has a third of the floor's brightness.
const MAX_DARK_SHARE: f32 = 0.65;
/// Brightness added to both sides of a comparison, sum of R, G and B: near black no thing is darker. Free
/// choice.
const BLACK_OFFSET: f32 = 48.0;
/// Percentile of the brightness behind the animal that counts as its ground; half the animal may be over dark
/// things.
const GROUND_PERCENTILE: f64 = 0.75;
/// Erosions that a dark region must survive; thinner ones, such as wires, show no image. Free choice.
const MIN_HALF_WIDTH_PX: u32 = 3;
/// A limb is smaller than the body by more than this factor. Free choice.
const MIN_BODY_TO_LIMB: u64 = 8;

/// The ground of an animal.
pub(super) struct Ground<'a> {
    background: &'a Background,
    rect: Rect,
    /// Brightness of the ground, sum of R, G and B.
    brightness: f32,
}

impl Ground<'_> {
    /// Measures the ground behind an animal.
    pub(super) fn behind<'a>(animal: &Mask, background: &'a Background) -> Ground<'a> {
        let mut ground = Ground {
            background,
            rect: animal.rect,
            brightness: 0.0,
        };
        let covered = (0..animal.bits.len()).filter(|&k| animal.bits[k] == 1);
        let mut behind: Vec<f64> = covered
            .map(|k| f64::from(ground.brightness_at(k)))
            .collect();
        ground.brightness = percentile(&mut behind, GROUND_PERCENTILE).unwrap_or(0.0) as f32;
        ground
    }

    fn brightness_at(&self, k: usize) -> f32 {
        let color = self.background.color(self.background.px_in(self.rect, k));
        color.iter().sum::<f32>()
    }

    /// Returns whether a pixel of the box shows a thing much darker than the ground.
    fn is_dark(&self, k: usize) -> bool {
        let limit = MAX_DARK_SHARE * (self.brightness + BLACK_OFFSET);
        self.brightness_at(k) + BLACK_OFFSET < limit
    }

    /// Returns the part of a mask that lies on the ground and not on darker things.
    pub(super) fn part_of(&self, mask: &Mask) -> Mask {
        let mut on_ground = mask.clone();
        for (k, bit) in on_ground.bits.iter_mut().enumerate() {
            *bit &= u8::from(!self.is_dark(k));
        }
        on_ground
    }

    /// Clears the faint pixels of mirror images in `solid`, and returns the mask of the images.
    ///
    /// An image is a broad region of `mask` on darker things where most pixels do not have the coat's color.
    /// Its middle may be as dark as the animal, but it fades toward its edges.
    pub(super) fn clear_fading_images(&self, solid: &mut Mask, mask: &Mask, coat: &Coat) -> Mask {
        let mut on_dark = mask.clone();
        for (bit, on_ground) in on_dark.bits.iter_mut().zip(self.part_of(mask).bits) {
            *bit &= 1 - on_ground;
        }
        let broad = on_dark.eroded_by(MIN_HALF_WIDTH_PX);
        let mut images = Mask::new(self.rect);
        for region in components(&on_dark) {
            let pixels = pixel_indices(&region, self.rect);
            if pixels.iter().all(|&k| broad.bits[k] == 0) {
                continue;
            }
            let n_matching = pixels.iter().filter(|&&k| coat.matches(k)).count();
            if 2 * n_matching < pixels.len() {
                let faint = pixels.into_iter().filter(|&k| coat.is_faint(k));
                faint.for_each(|k| solid.bits[k] = 0);
                images.add(&region.mask(region.rect));
            }
        }
        images
    }

    /// Clears pieces apart from the largest one that lie mostly on darker things: they are mirror images.
    ///
    /// A limb with a hidden part stays. It is small, has mostly the coat's color, is separated by dark things
    /// only, and does not overlap `images`.
    pub(super) fn clear_separate_images(&self, solid: &mut Mask, images: &Mask, coat: &Coat) {
        let mut pieces = components(solid);
        pieces.sort_by_key(|piece| std::cmp::Reverse(piece.area));
        let is_apart = pieces.len() > 1;
        let Some(body) = pieces.first().filter(|_| is_apart) else {
            return;
        };
        let mut passable = solid.clone();
        for (k, bit) in passable.bits.iter_mut().enumerate() {
            *bit |= u8::from(self.is_dark(k));
        }
        let body_px = pixel_indices(body, self.rect)[0];
        let reached = (components(&passable)
            .iter()
            .map(|part| part.mask(self.rect)))
        .find(|part| part.bits[body_px] == 1);
        for piece in &pieces[1..] {
            let pixels = pixel_indices(piece, self.rect);
            let n_dark = pixels.iter().filter(|&&k| self.is_dark(k)).count() as u64;
            let n_matching = pixels.iter().filter(|&&k| coat.matches(k)).count() as u64;
            let part = reached.as_ref();
            let is_reached = part.is_some_and(|part| part.bits[pixels[0]] == 1);
            let is_image = pixels.iter().any(|&k| images.bits[k] == 1);
            let is_small = MIN_BODY_TO_LIMB * piece.area < body.area;
            let is_limb = !is_image && is_small && is_reached && 2 * n_matching >= piece.area;
            if 2 * n_dark > piece.area && !is_limb {
                pixels.iter().for_each(|&k| solid.bits[k] = 0);
            }
        }
    }
}

/// Returns the indices of a component's pixels in a mask over `rect`.
fn pixel_indices(component: &Component, rect: Rect) -> Vec<usize> {
    let runs = component.runs.iter();
    let pixels = runs.flat_map(|run| (run.x0..run.x1).map(|x| (x, run.y)));
    let index = |(x, y): (u32, u32)| ((y - rect.y) * rect.w + x - rect.x) as usize;
    pixels.map(index).collect()
}
