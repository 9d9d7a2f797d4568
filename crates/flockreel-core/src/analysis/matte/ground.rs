//! The ground on which the animal stands, without things much darker than it, such as a wall.
//!
//! On a dark thing the animal stands out less, so the coat is also measured on the ground only (`coat`).

use crate::analysis::scene::background::Background;
use crate::order::percentile;
use crate::raster::Mask;

/// A thing is dark below this share of the ground's brightness. Free choice; a wall that showed an image
/// (mouse in a round arena) has a third of the floor's brightness.
const MAX_DARK_SHARE: f32 = 0.65;
/// Brightness added to both sides of a comparison, sum of R, G and B: near black no thing is darker. Free
/// choice.
const BLACK_OFFSET: f32 = 48.0;
/// Percentile of the brightness behind the animal that counts as its ground; half the animal may be over dark
/// things.
const GROUND_PERCENTILE: f64 = 0.75;

/// Returns the part of a mask that lies on the ground and not on darker things.
pub(super) fn part_on_ground(mask: &Mask, background: &Background) -> Mask {
    let brightness = |k: usize| {
        let color = background.color(background.px_in(mask.rect, k));
        color.iter().sum::<f32>()
    };
    let covered = (0..mask.bits.len()).filter(|&k| mask.bits[k] == 1);
    let mut behind: Vec<f64> = covered.map(|k| f64::from(brightness(k))).collect();
    let of_ground = percentile(&mut behind, GROUND_PERCENTILE).unwrap_or(0.0) as f32;
    let mut on_ground = mask.clone();
    for (k, bit) in on_ground.bits.iter_mut().enumerate() {
        let is_dark = brightness(k) + BLACK_OFFSET < MAX_DARK_SHARE * (of_ground + BLACK_OFFSET);
        *bit &= u8::from(!is_dark);
    }
    on_ground
}
