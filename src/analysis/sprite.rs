//! Mattes made into sprites: one size, the centroid at the middle (O 3.1; ALGORITHMS.md 5).

use std::sync::Arc;

use super::sighting::Sighting;
use super::tracking::{Track, Tracked};
use crate::library::{Sprites, View};
use crate::raster::RgbaImage;
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
/// The centroid's sub-pixel rest is resampled bilinearly in premultiplied alpha.
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
    // Beyond the matte and the pixel around it there is nothing to draw.
    let columns = (-1 - x0).clamp(0, width.into())..(i64::from(rect.w) - x0).clamp(0, width.into());
    let rows = (-1 - y0).clamp(0, height.into())..(i64::from(rect.h) - y0).clamp(0, height.into());
    let blank = vec![[0; 4]; rect.w as usize + 2];
    let (mut above, mut below) = (blank.clone(), blank);
    let stride = width as usize * 4;
    for row in rows {
        fetch(image, y0 + row, &mut above);
        fetch(image, y0 + row + 1, &mut below);
        let line = &mut sprite[row as usize * stride..][..stride];
        for column in columns.clone() {
            // One pixel of blank stands before the matte's first.
            let at = (x0 + column + 1) as usize;
            let corners = [above[at], above[at + 1], below[at], below[at + 1]];
            let pixel = &mut line[column as usize * 4..][..4];
            pixel.copy_from_slice(&blend(corners, weights));
        }
    }
}

/// Copies a row of the matte between one blank pixel on either side; blanks it when there is none.
fn fetch(image: &RgbaImage, row: i64, line: &mut [[u8; 4]]) {
    let n = image.width as usize;
    let within = &mut line[1..=n];
    if (0..i64::from(image.height)).contains(&row) {
        within.copy_from_slice(&image.pixels.as_chunks().0[row as usize * n..][..n]);
    } else {
        within.fill([0; 4]);
    }
}

/// The weighted mean of four straight-alpha pixels, in premultiplied alpha.
fn blend(corners: [[u8; 4]; 4], weights: [f32; 4]) -> [u8; 4] {
    if corners.iter().all(|corner| corner[3] == 0) {
        return [0; 4];
    }
    let mut sum = [0.0f32; 4];
    for (corner, weight) in corners.iter().zip(weights) {
        let alpha = weight * f32::from(corner[3]);
        sum[3] += alpha;
        for c in 0..3 {
            sum[c] += alpha * f32::from(corner[c]);
        }
    }
    let alpha = (sum[3] + 0.5) as u8;
    if alpha == 0 {
        return [0; 4];
    }
    let color = |c: usize| (sum[c] / sum[3] + 0.5) as u8;
    [color(0), color(1), color(2), alpha]
}
