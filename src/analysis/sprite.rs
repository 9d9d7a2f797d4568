//! Mattes made into sprites: one size, the centroid at the middle (O 3.1; ALGORITHMS.md 5).

use rayon::prelude::*;

use super::tracking::{Sighting, Tracked};
use crate::library::{Sprites, View};

/// Room around the largest silhouette.
const MARGIN_PX: f64 = 4.0;
/// Sides are multiples of this.
const MULTIPLE: u32 = 8;

/// The sprites of a track. The box holds the largest extent from the centroid over the frames in
/// which the animal is not cut off; from above it is a square that holds the animal at any turn.
///
/// The centroid's sub-pixel rest is resampled bilinearly in premultiplied alpha.
pub fn align(track: &[Tracked], view: View) -> Sprites {
    let [width, height] = common_size(track, view);
    let mut sprites = Sprites::missing(width, height, track.len());
    let present = track.iter().map(|t| t.sighting.is_some()).collect();
    sprites
        .fill_all(present)
        .zip(track)
        .par_bridge()
        .for_each(|(sprite, tracked)| {
            if let Some(sighting) = &tracked.sighting {
                draw(sprite, [width, height], sighting);
            }
        });
    sprites
}

fn common_size(track: &[Tracked], view: View) -> [u32; 2] {
    let all = || track.iter().filter_map(|t| t.sighting.as_ref());
    let reach = |sightings: &mut dyn Iterator<Item = &Sighting>| {
        sightings.map(reach_px).fold([0.0f64; 3], |most, reach| {
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

/// How far the alpha reaches from the centroid: horizontally, vertically, in any direction.
fn reach_px(sighting: &Sighting) -> [f64; 3] {
    let rect = sighting.matte.rect;
    let [cx, cy] = sighting.moments.centroid_px;
    let mut most = [0.0f64; 3];
    for (k, pixel) in sighting.matte.image.pixels.chunks_exact(4).enumerate() {
        if pixel[3] > 0 {
            let (column, row) = (k as u32 % rect.w, k as u32 / rect.w);
            let dx = (f64::from(rect.x + column) + 0.5 - cx).abs() + 0.5;
            let dy = (f64::from(rect.y + row) + 0.5 - cy).abs() + 0.5;
            most = [
                most[0].max(dx),
                most[1].max(dy),
                most[2].max(libm::hypot(dx, dy)),
            ];
        }
    }
    most
}

/// Draws a matte into a sprite, its centroid at the middle.
fn draw(sprite: &mut [u8], [width, height]: [u32; 2], sighting: &Sighting) {
    let (rect, image) = (sighting.matte.rect, &sighting.matte.image);
    let [cx, cy] = sighting.moments.centroid_px;
    // Sprite column c shows the matte at column c + left, whole and fractional part.
    let left = cx - f64::from(width) / 2.0 - f64::from(rect.x);
    let top = cy - f64::from(height) / 2.0 - f64::from(rect.y);
    let (x0, fx) = (left.floor() as i64, (left - left.floor()) as f32);
    let (y0, fy) = (top.floor() as i64, (top - top.floor()) as f32);
    let weights = [
        (1.0 - fx) * (1.0 - fy),
        fx * (1.0 - fy),
        (1.0 - fx) * fy,
        fx * fy,
    ];
    let at = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && x < i64::from(rect.w) && y < i64::from(rect.h);
        if inside {
            image.pixel(x as u32, y as u32)
        } else {
            [0; 4]
        }
    };
    for (k, pixel) in sprite.chunks_exact_mut(4).enumerate() {
        let (x, y) = (
            x0 + (k as u32 % width) as i64,
            y0 + (k as u32 / width) as i64,
        );
        let corners = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
        let mut sum = [0.0f32; 4];
        for (corner, weight) in corners.iter().zip(weights) {
            let alpha = weight * f32::from(corner[3]);
            sum[3] += alpha;
            for c in 0..3 {
                sum[c] += alpha * f32::from(corner[c]);
            }
        }
        let alpha = sum[3].round();
        if alpha >= 1.0 {
            for c in 0..3 {
                pixel[c] = (sum[c] / sum[3]).round().clamp(0.0, 255.0) as u8;
            }
            pixel[3] = alpha as u8;
        }
    }
}
