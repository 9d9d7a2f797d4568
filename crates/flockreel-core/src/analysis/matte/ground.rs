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

/// Returns the part of a mask that lies on the ground of an animal and not on darker things.
pub(super) fn part_on_ground(mask: &Mask, animal: &Mask, background: &Background) -> Mask {
    let brightness = |k: usize| {
        let color = background.color(background.px_in(mask.rect, k));
        color.iter().sum::<f32>()
    };
    let covered = (0..animal.bits.len()).filter(|&k| animal.bits[k] == 1);
    let mut behind: Vec<f64> = covered.map(|k| f64::from(brightness(k))).collect();
    let of_ground = percentile(&mut behind, GROUND_PERCENTILE).unwrap_or(0.0) as f32;
    let mut on_ground = mask.clone();
    for (k, bit) in on_ground.bits.iter_mut().enumerate() {
        let is_dark = brightness(k) + BLACK_OFFSET < MAX_DARK_SHARE * (of_ground + BLACK_OFFSET);
        *bit &= u8::from(!is_dark);
    }
    on_ground
}

/// Clears the faint pixels of mirror images in `solid`.
///
/// An image is a broad region of `mask` on darker things where most pixels do not have the coat's color. Its
/// middle may be as dark as the animal, but it fades toward its edges.
pub(super) fn clear_images(solid: &mut Mask, mask: &Mask, coat: &Coat, background: &Background) {
    let on_ground = part_on_ground(mask, solid, background);
    let mut on_dark = mask.clone();
    for (bit, on_ground) in on_dark.bits.iter_mut().zip(on_ground.bits) {
        *bit &= 1 - on_ground;
    }
    let broad = on_dark.eroded_by(MIN_HALF_WIDTH_PX);
    for region in components(&on_dark) {
        let pixels = pixel_indices(&region, solid.rect);
        if pixels.iter().all(|&k| broad.bits[k] == 0) {
            continue;
        }
        let n_matching = pixels.iter().filter(|&&k| coat.matches(k)).count();
        if 2 * n_matching < pixels.len() {
            let faint = pixels.into_iter().filter(|&k| coat.is_faint(k));
            faint.for_each(|k| solid.bits[k] = 0);
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
