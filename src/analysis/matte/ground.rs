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

/// The ground on which the animal stands.
pub(super) struct Ground<'a> {
    background: &'a Background,
    /// Brightness: the sum of R, G and B, 0..=765.
    brightness: f32,
}

impl Ground<'_> {
    /// Returns the ground behind the animal in `mask`.
    pub(super) fn new<'a>(mask: &Mask, background: &'a Background) -> Ground<'a> {
        let (rect, width) = (mask.rect, mask.width());
        let covered = (0..mask.bits.len()).filter(|&k| mask.bits[k] == 1);
        let mut behind: Vec<f64> = covered
            .map(|k| {
                let (x, y) = (rect.x + (k % width) as u32, rect.y + (k / width) as u32);
                f64::from(brightness(background, x, y))
            })
            .collect();
        Ground {
            background,
            brightness: percentile(&mut behind, GROUND_PERCENTILE).unwrap_or(0.0) as f32,
        }
    }

    /// Returns whether the background at a place of the frame is much darker than the ground.
    fn is_dark(&self, x: u32, y: u32) -> bool {
        brightness(self.background, x, y) + BLACK_OFFSET
            < MAX_DARK_SHARE * (self.brightness + BLACK_OFFSET)
    }

    /// Returns the part of a mask that lies on the ground and not on darker things.
    pub(super) fn part_on_ground(&self, mask: &Mask) -> Mask {
        let (rect, width) = (mask.rect, mask.width());
        let mut on_ground = mask.clone();
        for (k, bit) in on_ground.bits.iter_mut().enumerate() {
            let (x, y) = (rect.x + (k % width) as u32, rect.y + (k / width) as u32);
            *bit &= u8::from(!self.is_dark(x, y));
        }
        on_ground
    }
}

fn brightness(background: &Background, x: u32, y: u32) -> f32 {
    background.rgb.pixel(x, y).map(f32::from).iter().sum()
}
