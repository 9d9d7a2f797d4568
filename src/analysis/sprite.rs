//! Mattes made into sprites: one size, the centroid at the middle (O 3.1; ALGORITHMS.md 5).

use std::sync::Arc;

use super::sighting::Sighting;
use super::tracking::{Track, Tracked};
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::library::{Sprites, View};
use crate::raster::RgbaImage;
use crate::raster::canvas::straight;
use crate::raster::resample::{Placement, Premultiplied, Resampled, Room};
use crate::scratch::Full;

/// Room around the largest silhouette.
const MARGIN_PX: f64 = 4.0;
/// An animal of a smaller median area is too small to be looked at.
const LEAST_AREA_PX: f64 = 24.0;
/// Sides are multiples of this.
const MULTIPLE: u32 = 8;

/// The sprites of a track. The box holds the largest extent from the centroid over the frames in
/// which the animal is not cut off; from above it is a square that holds the animal at any turn.
///
/// The centroid's sub-pixel rest is interpolated by Catmull and Rom's curve in premultiplied alpha: a sprite
/// is drawn between pixels once more, and would be soft if either step were bilinear.
pub fn align(track: &Track, view: View) -> Result<Sprites, Full> {
    let size = common_size(&track.frames, view);
    let n_frames = track.frames.len();
    let scratch = Arc::clone(&track.scratch);
    Sprites::drawn(size, n_frames, scratch, |frame_idx, sprite| {
        let sighting = track.frames[frame_idx].sighting.as_ref();
        if let Some(sighting) = sighting {
            draw(sprite, size, sighting, &track.image(sighting));
        }
        Ok(sighting.is_some())
    })
}

/// Whether the animal covers, in the median, fewer pixels than are worth looking at.
pub fn is_too_small(track: &[Tracked]) -> bool {
    let sightings = track.iter().filter_map(|t| t.sighting.as_ref());
    let mut areas_px: Vec<f64> = sightings.map(|s| s.moments.area_px).collect();
    areas_px.sort_by(f64::total_cmp);
    areas_px
        .get(areas_px.len() / 2)
        .is_some_and(|&area_px| area_px < LEAST_AREA_PX)
}

/// The sprites of an animal that none are cut of: all missing.
pub fn none(n_frames: usize) -> Sprites {
    Sprites::missing(MULTIPLE, MULTIPLE, n_frames)
}

fn common_size(track: &[Tracked], view: View) -> [u32; 2] {
    let all = || track.iter().filter_map(|t| t.sighting.as_ref());
    let reach = |sightings: &mut dyn Iterator<Item = &Sighting>| {
        sightings
            .map(|s| s.reach_px)
            .fold([0.0f64; 3], |most, reach| {
                [
                    most[0].max(reach[0]),
                    most[1].max(reach[1]),
                    most[2].max(reach[2]),
                ]
            })
    };
    let whole = reach(&mut all().filter(|s| !s.cut));
    // An animal that is never seen whole has sprites all the same.
    let [x, y, radius] = if whole[2] > 0.0 {
        whole
    } else {
        reach(&mut all())
    };
    let side = |reach: f64| ((2.0 * reach + MARGIN_PX).ceil() as u32).next_multiple_of(MULTIPLE);
    match view {
        View::Side => [side(x), side(y)],
        View::Top => [side(radius); 2],
    }
}

/// Draws a matte into a sprite, its centroid at the middle.
fn draw(sprite: &mut [u8], [width, height]: [u32; 2], sighting: &Sighting, image: &RgbaImage) {
    let rect = sighting.rect;
    let [cx, cy] = sighting.moments.centroid_px;
    let middle = |from: u32, side: u32, c: f64| f64::from(from) + f64::from(side) / 2.0 - c;
    let place = Placement {
        center_px: [
            f64::from(width) / 2.0 + middle(rect.x, rect.w, cx),
            f64::from(height) / 2.0 + middle(rect.y, rect.h, cy),
        ],
        rotation_rad: 0.0,
        scale: 1.0,
        mirrored: false,
    };
    let whole = Rect::of_size(image.width, image.height);
    let matte = Premultiplied::of(&image.pixels, [image.width, image.height], whole, 1.0);
    let mut placed = Resampled::default();
    let size = [width, height];
    let room = Room { size, nearer: None };
    placed.draw(&matte, &place, room, Level::detect());
    let rows = placed.pixels.chunks_exact(placed.rect.w.max(1) as usize);
    for (row, y) in rows.zip(placed.rect.y as usize..) {
        let at = (y * width as usize + placed.rect.x as usize) * 4;
        let out = &mut sprite[at..at + row.len() * 4];
        for (out, &pixel) in out.chunks_exact_mut(4).zip(row) {
            out.copy_from_slice(&visible(straight(pixel)));
        }
    }
}

/// A pixel whose alpha rounds to nothing has no color either.
fn visible(pixel: [u8; 4]) -> [u8; 4] {
    match pixel[3] {
        0 => [0; 4],
        _ => pixel,
    }
}
