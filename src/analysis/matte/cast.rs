//! Removes mirror images from the matte: what the animal casts on things much darker than its ground, such as
//! a dark wall.
//!
//! A few levels are a large share of the little light in a dark thing. In a matte, they would become a dark
//! patch on any lighter background.

use super::solid::Coat;
use crate::analysis::scene::plate::Plate;
use crate::geometry::Rect;
use crate::order::percentile;
use crate::raster::Mask;
use crate::raster::runs::{Component, components};

/// A thing is dark below this share of the ground's brightness. Free choice; a wall that showed an image
/// (mouse in a round arena) has a third of the floor's brightness.
const DARK: f32 = 0.65;
/// Brightness added to both sides of a comparison, sum of R, G and B: near black no thing is darker. Free
/// choice.
const BLACK: f32 = 48.0;
/// Percentile of the brightness behind the animal that counts as its ground; half the animal may be over dark
/// things.
const LIGHTER: f64 = 0.75;

/// Erosions that a dark region must survive; thinner ones, such as wires, show no image. Free choice.
const THIN_PX: u32 = 3;

/// The ground on which the animal stands.
pub(super) struct Ground<'a> {
    plate: &'a Plate,
    /// Brightness: the sum of R, G and B, 0..=765.
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

    /// Returns whether the background at a place of the frame is much darker than the ground.
    fn is_dark(&self, x: u32, y: u32) -> bool {
        brightness(self.plate, x, y) + BLACK < DARK * (self.brightness + BLACK)
    }

    /// Returns the part of a mask that lies on the ground and not on darker things.
    pub(super) fn on(&self, mask: &Mask) -> Mask {
        let (rect, width) = (mask.rect, mask.width());
        let mut on_ground = mask.clone();
        for (k, bit) in on_ground.bits.iter_mut().enumerate() {
            let (x, y) = (rect.x + (k % width) as u32, rect.y + (k / width) as u32);
            *bit &= u8::from(!self.is_dark(x, y));
        }
        on_ground
    }

    /// Clears the faint pixels of mirror images in `solid`.
    ///
    /// An image is a broad region of `mask` on darker things where most pixels do not have the coat's color.
    /// Its middle may be as dark as the animal, but it fades toward its edges.
    pub(super) fn clear_faded(&self, solid: &mut Mask, mask: &Mask, coat: &Coat) {
        let rect = solid.rect;
        let mut on_dark = mask.clone();
        for (bit, on_ground) in on_dark.bits.iter_mut().zip(self.on(mask).bits) {
            *bit &= 1 - on_ground;
        }
        let broad = on_dark.eroded_by(THIN_PX);
        for region in components(&on_dark) {
            let pixels = numbers(&region, rect);
            if pixels.iter().all(|&k| broad.bits[k] == 0) {
                continue;
            }
            let n_own = pixels.iter().filter(|&&k| coat.matches(k)).count();
            if 2 * n_own < pixels.len() {
                let faint = pixels.into_iter().filter(|&k| coat.is_faint(k));
                faint.for_each(|k| solid.bits[k] = 0);
            }
        }
    }
}

/// Returns the indices of a component's pixels in a mask over `rect`.
fn numbers(piece: &Component, rect: Rect) -> Vec<usize> {
    let places = (piece.runs.iter()).flat_map(|run| (run.x0..run.x1).map(|x| (x, run.y)));
    let number = |(x, y): (u32, u32)| ((y - rect.y) * rect.w + x - rect.x) as usize;
    places.map(number).collect()
}

fn brightness(plate: &Plate, x: u32, y: u32) -> f32 {
    plate.rgb.pixel(x, y).map(f32::from).iter().sum()
}
