//! What the animal casts on things much darker than its ground, as its mirror image in a dark wall: it stays behind.
//! A few levels less are a large share of the little light there, and would be a dark patch on anything lighter.

use super::solid::Coat;
use crate::analysis::scene::plate::Plate;
use crate::geometry::Rect;
use crate::order::percentile;
use crate::raster::Mask;
use crate::raster::runs::{Component, components};

/// A thing is dark that has less than this share of the ground's light. A wall in which an image was seen (mouse in a round
/// arena) has a third of the floor's.
const DARK: f32 = 0.65;
/// So much light, the sum of R, G and B, is nothing: no thing is darker than black.
const BLACK: f32 = 48.0;
/// It may stand half on dark things: its ground is the lighter quarter of what is behind it.
const LIGHTER: f64 = 0.75;

/// What so many erosions wear away is thin.
const THIN_PX: u32 = 3;

/// A limb is smaller than the body by more than this factor.
const LIMB: u64 = 8;

/// What the animal stands on.
pub(super) struct Ground<'a> {
    plate: &'a Plate,
    /// How bright it is: the sum of R, G and B.
    brightness: f32,
}

impl Ground<'_> {
    pub(super) fn of<'a>(solid: &Mask, plate: &'a Plate) -> Ground<'a> {
        let (rect, width) = (solid.rect, solid.width());
        let covered = (0..solid.bits.len()).filter(|&k| solid.bits[k] == 1);
        let mut behind: Vec<f64> = covered
            .map(|k| {
                let (x, y) = (rect.x + (k % width) as u32, rect.y + (k / width) as u32);
                f64::from(brightness(plate, x, y))
            })
            .collect();
        Ground {
            plate,
            brightness: percentile(&mut behind, LIGHTER).unwrap_or(0.0) as f32,
        }
    }

    /// Whether a place of the frame shows something much darker than the ground.
    fn is_dark(&self, x: u32, y: u32) -> bool {
        brightness(self.plate, x, y) + BLACK < DARK * (self.brightness + BLACK)
    }

    /// What of a mask lies on the ground, and not on darker things.
    pub(super) fn on(&self, mask: &Mask) -> Mask {
        let (rect, width) = (mask.rect, mask.width());
        let mut on_ground = mask.clone();
        for (k, bit) in on_ground.bits.iter_mut().enumerate() {
            let (x, y) = (rect.x + (k % width) as u32, rect.y + (k / width) as u32);
            *bit &= u8::from(!self.is_dark(x, y));
        }
        on_ground
    }

    /// Clears what is faint where a mask lies on darker things and is mostly of another color than the coat there: an image
    /// may be as dark as the animal in its midst, but fades toward its edges. Lines of the scene, such as wires, are too thin
    /// to show one. Returns where images are.
    pub(super) fn clear_faded(&self, solid: &mut Mask, mask: &Mask, coat: &Coat) -> Mask {
        let rect = solid.rect;
        let mut on_dark = mask.clone();
        for (bit, on_ground) in on_dark.bits.iter_mut().zip(self.on(mask).bits) {
            *bit &= 1 - on_ground;
        }
        let broad = on_dark.eroded_by(THIN_PX);
        let mut images = Mask::new(rect);
        for region in components(&on_dark) {
            let pixels = numbers(&region, rect);
            if pixels.iter().all(|&k| broad.bits[k] == 0) {
                continue;
            }
            let n_own = pixels.iter().filter(|&&k| coat.matches(k)).count();
            if 2 * n_own < pixels.len() {
                let faint = pixels.into_iter().filter(|&k| coat.is_faint(k));
                faint.for_each(|k| solid.bits[k] = 0);
                images.add(&region.mask(region.rect));
            }
        }
        images
    }

    /// Clears what lies apart from the largest piece, mostly on darker things: images. But not a limb of which a part is
    /// hidden: it is small, mostly of the coat's color, only dark things lie between, and it is no part of `images`.
    pub(super) fn clear_images(&self, solid: &mut Mask, images: &Mask, coat: &Coat) {
        let (rect, width) = (solid.rect, solid.width());
        let is_dark =
            |k: usize| self.is_dark(rect.x + (k % width) as u32, rect.y + (k / width) as u32);
        let mut pieces = components(solid);
        pieces.sort_by_key(|piece| std::cmp::Reverse(piece.area));
        let is_apart = pieces.len() > 1;
        let Some(body) = pieces.first().filter(|_| is_apart) else {
            return;
        };
        let mut passable = solid.clone();
        for (k, bit) in passable.bits.iter_mut().enumerate() {
            *bit |= u8::from(is_dark(k));
        }
        let reached = (components(&passable).iter().map(|part| part.mask(rect)))
            .find(|part| part.bits[numbers(body, rect)[0]] == 1);
        for piece in &pieces[1..] {
            let pixels = numbers(piece, rect);
            let n_dark = pixels.iter().filter(|&&k| is_dark(k)).count() as u64;
            let n_own = pixels.iter().filter(|&&k| coat.matches(k)).count() as u64;
            let is_reached = reached
                .as_ref()
                .is_some_and(|part| part.bits[pixels[0]] == 1);
            let is_image = pixels.iter().any(|&k| images.bits[k] == 1);
            let is_limb =
                !is_image && LIMB * piece.area < body.area && is_reached && 2 * n_own >= piece.area;
            if 2 * n_dark > piece.area && !is_limb {
                pixels.iter().for_each(|&k| solid.bits[k] = 0);
            }
        }
    }
}

/// A component's pixels in a mask over `rect`, by their numbers.
fn numbers(piece: &Component, rect: Rect) -> Vec<usize> {
    let places = (piece.runs.iter()).flat_map(|run| (run.x0..run.x1).map(|x| (x, run.y)));
    let number = |(x, y): (u32, u32)| ((y - rect.y) * rect.w + x - rect.x) as usize;
    places.map(number).collect()
}

fn brightness(plate: &Plate, x: u32, y: u32) -> f32 {
    plate.rgb.pixel(x, y).map(f32::from).iter().sum()
}
