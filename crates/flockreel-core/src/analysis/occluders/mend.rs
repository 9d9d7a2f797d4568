//! Removes known occluders from the mattes of a track.
//!
//! A partly occluded pixel is solved for the animal's color. Any other pixel takes the weighted mean of the
//! pixels around it.

use rayon::prelude::*;

use super::ring::OUTER_PX;
use crate::analysis::Error;
use crate::analysis::track::Track;
use crate::analysis::track::sighting::Sighting;
use crate::progress::Progress;
use crate::raster::RgbaImage;
use crate::scratch::{Full, Scratch};

/// Greatest alpha of an occluder that is subtracted, 0..=255. Free choice: beyond a half, noise would
/// dominate.
const MAX_SUBTRACTED: u8 = 128;

/// Mends every matte that overlaps an occluder, and measures its sighting again.
///
/// Only mattes in front of the main background are mended. Fails when the scratch is full, and with
/// `Cancelled`.
pub(super) fn mend_mattes(
    track: &mut Track,
    occluders: &RgbaImage,
    progress: &dyn Progress,
) -> Result<(), Error> {
    let scratch = track.scratch.clone();
    track.frames.par_iter_mut().try_for_each(|tracked| {
        let Some(seen) = tracked.before_main_background() else {
            return Ok(());
        };
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        let occluder =
            |x: usize, y: usize| occluders.pixel(seen.rect.x + x as u32, seen.rect.y + y as u32);
        let mut image = RgbaImage::new(seen.rect.w, seen.rect.h);
        scratch.get(seen.at, &mut image.pixels);
        if fill(&mut image, occluder) {
            tracked.sighting = remeasured(seen, &image, &*scratch)?;
        }
        Ok(())
    })
}

fn remeasured(
    seen: &Sighting,
    image: &RgbaImage,
    scratch: &dyn Scratch,
) -> Result<Option<Sighting>, Full> {
    let Some(mut mended) = Sighting::measured(seen.rect, image) else {
        return Ok(None);
    };
    mended.at = scratch.put(&image.pixels)?;
    mended.confidence = seen.confidence;
    mended.box_px = seen.box_px;
    mended.cut = seen.cut;
    Ok(Some(mended))
}

/// Removes the occluder from the pixels of a matte; returns whether any pixel changed.
///
/// An opaque pixel whose occluder takes up to half of it is solved for its color. All others take the mean of
/// their surroundings.
fn fill(image: &mut RgbaImage, occluder: impl Fn(usize, usize) -> [u8; 4]) -> bool {
    let (width, height) = (image.width as usize, image.height as usize);
    let is_found = |x: usize, y: usize| occluder(x, y)[3] > 0;
    let mut filled = Vec::new();
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        if is_found(x, y) {
            let (old, occluder_rgba) = (image.pixel(x as u32, y as u32), occluder(x, y));
            let new = if old[3] == 255 && occluder_rgba[3] <= MAX_SUBTRACTED {
                unoccluded(old, occluder_rgba)
            } else {
                mean_around(image, [x, y], &is_found)
            };
            filled.push((y * width + x, new));
        }
    }
    let mut has_changed = false;
    for (k, pixel) in filled {
        let old = &mut image.pixels[4 * k..4 * k + 4];
        has_changed |= old != pixel;
        old.copy_from_slice(&pixel);
    }
    has_changed
}

/// Returns the animal's color A = (I - w F) / (1 - w), opaque.
fn unoccluded(seen: [u8; 4], occluder_rgba: [u8; 4]) -> [u8; 4] {
    let share = f64::from(occluder_rgba[3]) / 255.0;
    let own = |c: usize| {
        let left = f64::from(seen[c]) - share * f64::from(occluder_rgba[c]);
        (left / (1.0 - share)).round() as u8
    };
    [own(0), own(1), own(2), 255]
}

/// Returns the mean around a pixel without occluded pixels, weighted by 1 / distance^4 to keep edges sharp.
fn mean_around(
    image: &RgbaImage,
    [x, y]: [usize; 2],
    is_found: &impl Fn(usize, usize) -> bool,
) -> [u8; 4] {
    let rows = y.saturating_sub(OUTER_PX)..(y + OUTER_PX + 1).min(image.height as usize);
    let (mut color, mut alpha, mut total) = ([0.0; 3], 0.0, 0.0);
    for v in rows {
        for u in x.saturating_sub(OUTER_PX)..(x + OUTER_PX + 1).min(image.width as usize) {
            if is_found(u, v) {
                continue;
            }
            let (dx, dy) = (u.abs_diff(x) as f64, v.abs_diff(y) as f64);
            let squared = dx * dx + dy * dy;
            let weight = 1.0 / (squared * squared);
            let [r, g, b, a] = image.pixel(u as u32, v as u32).map(f64::from);
            for (sum, value) in color.iter_mut().zip([r, g, b]) {
                *sum += weight * a * value;
            }
            alpha += weight * a;
            total += weight;
        }
    }
    if alpha <= 0.0 {
        return [0; 4];
    }
    let [r, g, b] = color.map(|sum| (sum / alpha).round() as u8);
    match (alpha / total).round() as u8 {
        0 => [0; 4],
        a => [r, g, b, a],
    }
}
