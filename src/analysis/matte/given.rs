//! The animal cut out by a mask that is given with the footage.

use super::{Matte, NOWHERE, moved, nearest_set};
use crate::raster::{Frame, GivenMask, Mask, RgbaImage, runs};

/// Less alpha is noise, not animal, 0..=255.
const TRACE: u8 = 4;
/// And this much is the animal alone.
const SOLID: u8 = 250;
/// The less of a pixel is the animal, the less its color can be told from what lies behind. It is taken in part from the
/// nearest pixel that is the animal alone: half of it where the square of the share is this (a free choice).
const DOUBT: f32 = 0.2;
/// What is soft reaches beyond the silhouette by this share of its longer side at most: a fin that lets light through.
const REACH: f64 = 0.25;

/// Cuts a silhouette out with the alpha that is given, with all that is soft and hangs together with it. Where colors
/// are mixed, what lies behind a pixel is the nearest pixel of the frame that is no animal at all: so it may move.
pub(super) fn pull(frame: &Frame, given: &GivenMask, silhouette: &Mask) -> Matte {
    let box_px = silhouette.rect;
    let margin_px = (REACH * f64::from(box_px.w.max(box_px.h))).ceil() as u32 + 2;
    let rect = box_px.inflated(margin_px, frame.width, frame.height);
    let silhouette = moved(silhouette, rect);
    let columns = rect.w as usize;
    let alpha_at = |k: usize| {
        let (x, y) = (rect.x as usize + k % columns, rect.y as usize + k / columns);
        given.alpha[y * frame.width as usize + x]
    };
    let near = hanging_together(&silhouette, alpha_at);
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
            .map(|k| near.bits[k] & u8::from(alpha_at(k) >= SOLID))
            .collect(),
    };
    let nearest = |mask: &Mask| match given.is_mixed {
        true => nearest_set(mask, &near),
        false => vec![NOWHERE; near.bits.len()],
    };
    let (behind, beside) = (nearest(&clear), nearest(&solid));
    let mut image = RgbaImage::new(rect.w, rect.h);
    for (k, rgba) in image.pixels.chunks_exact_mut(4).enumerate() {
        let level = alpha_at(k);
        if near.bits[k] == 0 || level == 0 {
            continue;
        }
        let (share, seen) = (f32::from(level) / 255.0, color_at(k));
        let color = match behind[k] {
            NOWHERE => seen,
            place => {
                let back = color_at(place as usize);
                let own = [0, 1, 2].map(|c| (seen[c] - (1.0 - share) * back[c]) / share);
                match beside[k] {
                    NOWHERE => own,
                    solid => {
                        let (trust, solid) = (share * share, color_at(solid as usize));
                        let trust = trust / (trust + DOUBT);
                        [0, 1, 2].map(|c| trust * own[c] + (1.0 - trust) * solid[c])
                    }
                }
            }
        };
        // A cast saturates.
        let [r, g, b] = color.map(|value| (value + 0.5) as u8);
        rgba.copy_from_slice(&[r, g, b, level]);
    }
    Matte { rect, image }
}

/// The pixels with some alpha that hang together with a silhouette.
fn hanging_together(silhouette: &Mask, alpha_at: impl Fn(usize) -> u8) -> Mask {
    let soft = Mask {
        rect: silhouette.rect,
        bits: (0..silhouette.bits.len())
            .map(|k| u8::from(alpha_at(k) >= TRACE))
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
