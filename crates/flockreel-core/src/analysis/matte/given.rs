//! Mattes from a mask that comes with the footage.
//!
//! Alpha is that of the mask. Where the footage mixes the colors of animal and background, the background's
//! share is subtracted.

use super::{Matte, NONE_NEAR, nearest_set, over_box};
use crate::raster::{Frame, GivenMask, Mask, RgbaImage, runs};

/// Least alpha that connects pixels, 0..=255; less is noise. Free choice.
const MIN_ALPHA: u8 = 4;
/// Least alpha of a pixel that shows the animal only, 0..=255. Free choice.
const OPAQUE: u8 = 250;
/// Squared alpha at which half of the color comes from the nearest pixel of the animal only. Free choice.
///
/// The smaller the alpha, the less certain the color without the background.
const HALF_TRUST: f32 = 0.2;
/// Margin around the silhouette as a share of its longer side, for soft parts such as a clear fin. Free
/// choice.
const MARGIN: f64 = 0.25;

/// Returns the matte of a silhouette with the given alpha, including all soft pixels connected to it.
///
/// Where colors are mixed, the background of a pixel is the nearest pixel of the same frame with alpha 0. So
/// the background may move.
pub(super) fn pull(frame: &Frame, given: &GivenMask, silhouette: &Mask) -> Matte {
    let box_px = silhouette.rect;
    let margin_px = (MARGIN * f64::from(box_px.w.max(box_px.h))).ceil() as u32 + 2;
    let rect = box_px.inflated(margin_px, frame.width, frame.height);
    let silhouette = over_box(silhouette, rect);
    let columns = rect.w as usize;
    let alpha_at = |k: usize| {
        let (x, y) = (rect.x as usize + k % columns, rect.y as usize + k / columns);
        given.alpha[y * frame.width as usize + x]
    };
    let near = connected_to(&silhouette, alpha_at);
    let rgb = frame.rgb(rect);
    let color_at = |k: usize| [0, 1, 2].map(|c| f32::from(rgb.pixels[3 * k + c]));
    let clear = Mask {
        rect,
        bits: (0..near.bits.len())
            .map(|k| u8::from(alpha_at(k) == 0))
            .collect(),
    };
    let solid = Mask {
        rect,
        bits: (0..near.bits.len())
            .map(|k| near.bits[k] & u8::from(alpha_at(k) >= OPAQUE))
            .collect(),
    };
    let nearest = |mask: &Mask| {
        if given.is_mixed {
            nearest_set(mask, &near)
        } else {
            vec![NONE_NEAR; near.bits.len()]
        }
    };
    let (nearest_clear, nearest_solid) = (nearest(&clear), nearest(&solid));
    let mut image = RgbaImage::new(rect.w, rect.h);
    for (k, rgba) in image.pixels.chunks_exact_mut(4).enumerate() {
        let level = alpha_at(k);
        if near.bits[k] == 0 || level == 0 {
            continue;
        }
        let (share, seen) = (f32::from(level) / 255.0, color_at(k));
        let color = match nearest_clear[k] {
            NONE_NEAR => seen,
            place => {
                let back = color_at(place as usize);
                let own = [0, 1, 2].map(|c| (seen[c] - (1.0 - share) * back[c]) / share);
                match nearest_solid[k] {
                    NONE_NEAR => own,
                    solid => {
                        let (trust, solid) = (share * share, color_at(solid as usize));
                        let trust = trust / (trust + HALF_TRUST);
                        [0, 1, 2].map(|c| trust * own[c] + (1.0 - trust) * solid[c])
                    }
                }
            }
        };
        // The cast to `u8` saturates.
        let [r, g, b] = color.map(|value| (value + 0.5) as u8);
        rgba.copy_from_slice(&[r, g, b, level]);
    }
    Matte { rect, image }
}

/// Returns the pixels with alpha that are connected to the silhouette.
fn connected_to(silhouette: &Mask, alpha_at: impl Fn(usize) -> u8) -> Mask {
    let soft = Mask {
        rect: silhouette.rect,
        bits: (0..silhouette.bits.len())
            .map(|k| u8::from(alpha_at(k) >= MIN_ALPHA))
            .collect(),
    };
    let mut near = Mask::new(silhouette.rect);
    for component in runs::components(&soft) {
        let part = component.mask(silhouette.rect);
        let mut pairs = part.bits.iter().zip(&silhouette.bits);
        if pairs.any(|(part, set)| part & set == 1) {
            near.add(&part);
        }
    }
    near
}
