//! What the animal casts on things much darker than its ground, as its mirror image in a dark wall: it stays behind.
//! A few levels less are a large share of the little light there, and would be a dark patch on anything lighter.

use crate::analysis::background::Plate;
use crate::order::median;
use crate::raster::Mask;
use crate::raster::runs::components;

/// Relative to the ground: of what is cast on darker things nothing goes with the animal, on lighter ones all.
const DARKER: [f32; 2] = [0.5, 0.8];

/// What the animal stands on.
pub(super) struct Ground<'a> {
    plate: &'a Plate,
    /// The plate behind the animal, in the median: the sum of R, G and B.
    brightness: f32,
}

impl Ground<'_> {
    pub(super) fn of<'a>(solid: &Mask, plate: &'a Plate) -> Ground<'a> {
        let (rect, width) = (solid.rect, solid.width());
        let covered = (0..solid.bits.len()).filter(|&k| solid.bits[k] == 1);
        let behind = covered.map(|k| {
            let (x, y) = (rect.x + (k % width) as u32, rect.y + (k / width) as u32);
            f64::from(brightness(plate, x, y))
        });
        Ground {
            plate,
            brightness: median(behind).unwrap_or(0.0) as f32,
        }
    }

    /// How much of what is cast on a place of the frame goes with the animal: 0 to 1.
    pub(super) fn share_at(&self, x: u32, y: u32) -> f32 {
        let relative = brightness(self.plate, x, y) / self.brightness.max(1.0);
        let share = ((relative - DARKER[0]) / (DARKER[1] - DARKER[0])).clamp(0.0, 1.0);
        share * share * (3.0 - 2.0 * share)
    }

    /// Clears what lies apart from the largest piece and mostly on darker things.
    pub(super) fn clear_images(&self, solid: &mut Mask) {
        let pieces = components(solid);
        let largest = pieces.iter().map(|piece| piece.area).max();
        for piece in pieces {
            let pixels =
                || (piece.runs.iter()).flat_map(|run| (run.x0..run.x1).map(move |x| (x, run.y)));
            let share: f32 = pixels().map(|(x, y)| self.share_at(x, y)).sum();
            if Some(piece.area) == largest || 2.0 * share >= piece.area as f32 {
                continue;
            }
            for (x, y) in pixels() {
                let k = (y - solid.rect.y) * solid.rect.w + x - solid.rect.x;
                solid.bits[k as usize] = 0;
            }
        }
    }
}

fn brightness(plate: &Plate, x: u32, y: u32) -> f32 {
    plate.rgb.pixel(x, y).map(f32::from).iter().sum()
}
