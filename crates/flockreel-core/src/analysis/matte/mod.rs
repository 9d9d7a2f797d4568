//! Mattes: the animal cut out of a frame, with soft alpha and without the background's color.
//!
//! The animal's pixels are those that its colors explain better than the background and its shadow do (`coat`,
//! `cut`). Alpha is 1 inside. In a band around the outline, alpha is the pixel's share of the way from the
//! background's color to the animal's color nearby. The background's share is then subtracted from the color.
//! Shadows are left out, because a sprite would turn them with the body; `shadow` measures them.
//!
//! Values are encoded sRGB, as in the compositor. So a matte over its background reproduces the frame, except
//! for shadows. See docs/explanation/algorithms.md, "Mattes".

mod around;
mod coat;
mod cut;
mod given;
mod seen;

pub use self::around::Shape;
pub use self::coat::Coat;
use self::coat::{dot, minus};
pub use self::seen::{Seen, Stored};
use super::scene::background::Background;
use super::scene::light::Light;
use super::silhouette::Difference;
use crate::geometry::Rect;
use crate::raster::{Frame, Mask, RgbaImage, runs};

/// The animal cut out of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Matte {
    /// Box of the matte in the frame, pixels.
    pub rect: Rect,
    /// Colors with straight alpha, in the light of the background.
    pub image: RgbaImage,
}

/// A frame with its background, its light and the learned colors: the input of a cut.
pub struct View<'a> {
    /// The frame.
    pub frame: &'a Frame,
    /// The background.
    pub background: &'a Background,
    /// Light of the frame relative to the background.
    pub light: &'a Light,
    /// Colors of the animal and of the scene.
    pub coat: &'a Coat,
    /// Boxes to ignore.
    pub ignored: &'a [Rect],
}

/// Width of the band along the outline whose pixels show animal and background, pixels. Free choice: lens and
/// codec blur about as far.
const BAND_PX: u32 = 2;
/// Width of the floor around a silhouette in which parts of the animal are looked for, pixels. Free choice;
/// it doubles while the animal reaches its border.
pub const MARGIN_PX: u32 = 16;

/// A matte of one frame, and what a second cut of the frame needs.
pub struct Pulled {
    /// The matte.
    pub matte: Matte,
    /// The frame around it; `None` where the frame has a given mask.
    pub seen: Option<Seen>,
}

/// Returns the matte of a silhouette.
///
/// `length_px` is the approximate length of the animal; no part lies farther from the silhouette. When the
/// frame has a given mask, its alpha is used.
pub fn pull(view: &View, silhouette: &Mask, length_px: f64) -> Pulled {
    let frame = view.frame;
    if let Some(given) = &frame.mask {
        let matte = given::pull(frame, given, silhouette);
        return Pulled { matte, seen: None };
    }
    let seen = Seen::first(view, silhouette, length_px);
    let matte = painted(&seen.difference, view.background, &seen.solid);
    Pulled {
        matte,
        seen: Some(seen),
    }
}

/// Returns the matte of the pixels that show the animal.
fn painted(difference: &Difference, background: &Background, solid: &Mask) -> Matte {
    let rect = difference.rect;
    let inside = solid.eroded_by(BAND_PX);
    let outer = solid.dilated_by(BAND_PX);
    let puller = MattePuller {
        difference,
        background,
        solid,
        inside: &inside,
        broad: &solid.eroded().dilated_by(2),
        nearest_inside: nearest_set(&inside, &outer),
        nearest_solid: nearest_set(solid, &outer),
    };
    let mut image = RgbaImage::new(rect.w, rect.h);
    for (k, pixel) in image.pixels.chunks_exact_mut(4).enumerate() {
        let rgba = if inside.bits[k] == 1 {
            let [r, g, b] = puller.frame_color(k);
            [r, g, b, 255]
        } else if outer.bits[k] == 1 {
            puller.band_pixel(k)
        } else {
            [0; 4]
        };
        pixel.copy_from_slice(&rgba);
    }
    cropped(rect, &image)
}

/// Returns the matte in the smallest box with all its pixels that are not transparent.
fn cropped(rect: Rect, image: &RgbaImage) -> Matte {
    let bits = image
        .pixels
        .chunks_exact(4)
        .map(|rgba| u8::from(rgba[3] > 0));
    let bits = Mask {
        rect,
        bits: bits.collect(),
    };
    let pieces = runs::components(&bits);
    let own = pieces
        .iter()
        .fold(Rect::default(), |own, piece| own.union(&piece.rect));
    let mut pixels = Vec::with_capacity(4 * own.area() as usize);
    for y in own.y..own.bottom() {
        let first = 4 * ((y - rect.y) * rect.w + own.x - rect.x) as usize;
        pixels.extend_from_slice(&image.pixels[first..first + 4 * own.w as usize]);
    }
    let mut image = RgbaImage::new(own.w, own.h);
    image.pixels = pixels;
    Matte { rect: own, image }
}

/// Returns the mask over another box, clear outside the old one.
fn over_box(mask: &Mask, rect: Rect) -> Mask {
    let mut result = Mask::new(rect);
    result.add(mask);
    result
}

/// Marks a pixel without a known nearest set pixel.
const NONE_NEAR: u32 = u32::MAX;

/// Returns for each pixel of `wanted` the index of the set pixel of `mask` that takes the fewest steps to
/// reach (8-connected). All entries are [`NONE_NEAR`] when no pixel is set.
///
/// A breadth-first search starts at the set pixels with a clear neighbor. It stops when all wanted pixels are
/// reached. A border of pixels marked as reached keeps it inside the mask.
fn nearest_set(mask: &Mask, wanted: &Mask) -> Vec<u32> {
    const BORDER: u32 = NONE_NEAR - 1;
    let (w, h) = (mask.width(), mask.height());
    let padded = w + 2;
    let inner = mask.eroded();
    let mut nearest = vec![BORDER; padded * (h + 2)];
    let mut is_wanted = vec![0u8; nearest.len()];
    let (mut front, mut next) = (Vec::new(), Vec::new());
    let mut n_left = 0;
    for y in 0..h {
        for x in 0..w {
            let (k, at) = (y * w + x, (y + 1) * padded + x + 1);
            let is_set = mask.bits[k] == 1;
            nearest[at] = if is_set { k as u32 } else { NONE_NEAR };
            is_wanted[at] = wanted.bits[k];
            n_left += usize::from(!is_set && wanted.bits[k] == 1);
            if is_set && inner.bits[k] == 0 {
                front.push(at);
            }
        }
    }
    while !front.is_empty() && n_left > 0 {
        for &at in &front {
            for first in [at - padded - 1, at - 1, at + padded - 1] {
                for other in first..first + 3 {
                    if nearest[other] == NONE_NEAR {
                        nearest[other] = nearest[at];
                        n_left -= usize::from(is_wanted[other]);
                        next.push(other);
                    }
                }
            }
        }
        std::mem::swap(&mut front, &mut next);
        next.clear();
    }
    let rows = nearest[padded..].chunks_exact(padded).take(h);
    rows.flat_map(|row| row[1..=w].iter().copied()).collect()
}

struct MattePuller<'a> {
    difference: &'a Difference,
    background: &'a Background,
    /// The pixels that show the animal.
    solid: &'a Mask,
    /// The solid part without the band along its outline, where alpha is 1.
    inside: &'a Mask,
    /// The solid part where it is at least 3 pixels broad, and the pixels next to it.
    broad: &'a Mask,
    /// Index of an inside pixel near each pixel, or [`NONE_NEAR`].
    nearest_inside: Vec<u32>,
    /// Index of a solid pixel near each pixel, or [`NONE_NEAR`].
    nearest_solid: Vec<u32>,
}

impl MattePuller<'_> {
    fn frame_color(&self, k: usize) -> [u8; 3] {
        let rgb = &self.difference.rgb.pixels[3 * k..3 * k + 3];
        [rgb[0], rgb[1], rgb[2]]
    }

    /// Returns the index of a pixel in the background image.
    fn background_px(&self, k: usize) -> usize {
        self.background.px_in(self.solid.rect, k)
    }

    fn background_color(&self, k: usize) -> [f32; 3] {
        self.background.color(self.background_px(k))
    }

    /// Returns the straight color and the alpha of a pixel of the band.
    fn band_pixel(&self, k: usize) -> [u8; 4] {
        let Some(color) = self.color_nearby(k) else {
            return [0; 4];
        };
        let alpha = self
            .alpha_by_color(color, k)
            .unwrap_or_else(|| self.alpha_without_contrast(k));
        let thin = self.thin_part_color(k);
        let alpha = thin.map_or(alpha, |body| self.alpha_of_thin_part(alpha, body, k));
        let level = (alpha * 255.0 + 0.5) as u8;
        if level == 0 {
            return [0; 4];
        }
        let color = if alpha <= 0.2 {
            color
        } else {
            let (back, seen) = (self.background_color(k), self.frame_color(k).map(f32::from));
            [0, 1, 2].map(|c| ((seen[c] - (1.0 - alpha) * back[c]) / alpha).clamp(0.0, 255.0))
        };
        let [r, g, b] = color.map(|c| (c + 0.5) as u8);
        [r, g, b, level]
    }

    /// Returns the color of the nearest inside pixels for a part at most 2 pixels broad; `None` for broader
    /// parts.
    fn thin_part_color(&self, k: usize) -> Option<[f32; 3]> {
        let inside = self.nearest_inside[k];
        (inside != NONE_NEAR && self.broad.bits[k] == 0).then(|| self.mean_inside(inside as usize))
    }

    /// Returns the alpha of a pixel of a thin part, such as a tail far away.
    ///
    /// A pixel between the colors of background and body is a mixture, because the part does not fill it. Its
    /// alpha is then the body's share, but at least 0.5 to keep the part within its outline. The resulting
    /// color is near the body's, so the part does not shine on a dark background.
    fn alpha_of_thin_part(&self, alpha: f32, body: [f32; 3], k: usize) -> f32 {
        let (back, seen) = (self.background_color(k), self.frame_color(k).map(f32::from));
        let explained = self.alpha_by_color(body, k).filter(|&share| {
            let off = [0, 1, 2].map(|c| seen[c] - back[c] - share * (body[c] - back[c]));
            dot(off, off) < self.noise_squared(k)
        });
        explained.map_or(alpha, |share| share.max(0.5).min(alpha))
    }

    /// Returns the share of the way from the background's color to `fore`, 0..=1.
    ///
    /// Returns `None` when the two colors differ by less than three standard deviations of the noise.
    fn alpha_by_color(&self, fore: [f32; 3], k: usize) -> Option<f32> {
        let (back, seen) = (self.background_color(k), self.frame_color(k).map(f32::from));
        let (span, seen_span) = (minus(fore, back), minus(seen, back));
        let is_distinct = dot(span, span) >= self.noise_squared(k);
        is_distinct.then(|| (dot(seen_span, span) / dot(span, span)).clamp(0.0, 1.0))
    }

    /// Returns the alpha where the animal has the background's color.
    ///
    /// A pixel that differs from the background is opaque: a share of a small color difference would
    /// exaggerate it.
    fn alpha_without_contrast(&self, k: usize) -> f32 {
        let off = minus(self.frame_color(k).map(f32::from), self.background_color(k));
        if dot(off, off) < self.noise_squared(k) {
            self.blurred_solid(k)
        } else {
            1.0
        }
    }

    fn noise_squared(&self, k: usize) -> f32 {
        (3.0 * self.background.sigma[self.background_px(k)]).powi(2)
    }

    /// Returns the animal's color near a pixel of the band; `None` outside the band.
    fn color_nearby(&self, k: usize) -> Option<[f32; 3]> {
        let band = BAND_PX as usize;
        let solid = self.nearest_solid[k];
        if solid == NONE_NEAR || self.steps(k, solid as usize) > band {
            return None;
        }
        let inside = self.nearest_inside[k];
        if inside != NONE_NEAR && self.steps(k, inside as usize) <= 2 * band + 1 {
            Some(self.mean_inside(inside as usize))
        } else {
            self.starkest(solid as usize)
        }
    }

    /// Returns the number of steps from one pixel to another (8-connected).
    fn steps(&self, from: usize, to: usize) -> usize {
        let width = self.solid.width();
        let along_x = (from % width).abs_diff(to % width);
        along_x.max((from / width).abs_diff(to / width))
    }

    /// Returns the mean color of the inside pixels in the 3 x 3 neighborhood of an inside pixel.
    fn mean_inside(&self, at: usize) -> [f32; 3] {
        let [x, y] = self.xy(at);
        let (mut sum, mut n) = ([0.0; 3], 0.0);
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            if let Some(at) = self
                .at(x + dx, y + dy)
                .filter(|&at| self.inside.bits[at] == 1)
            {
                n += 1.0;
                for (s, c) in sum.iter_mut().zip(self.frame_color(at)) {
                    *s += f32::from(c);
                }
            }
        }
        sum.map(|s| s / n)
    }

    /// Returns the color of the solid pixel within 2 pixels that differs most from the background.
    fn starkest(&self, at: usize) -> Option<[f32; 3]> {
        let [x, y] = self.xy(at);
        let around = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy)));
        around
            .filter_map(|(dx, dy)| self.at(x + dx, y + dy))
            .filter(|&at| self.solid.bits[at] == 1)
            .max_by_key(|&at| (self.difference.levels[at], std::cmp::Reverse(at)))
            .map(|at| self.frame_color(at).map(f32::from))
    }

    /// Returns the solid mask at a pixel after a Gaussian blur of 0.7 pixels (5 x 5), 0..=1.
    fn blurred_solid(&self, k: usize) -> f32 {
        let [x, y] = self.xy(k);
        // exp(-d^2 / (2 * 0.49)) for d = 0, 1, 2.
        const WEIGHTS: [f32; 3] = [1.0, 0.3604, 0.0169];
        let (mut sum, mut total) = (0.0, 0.0);
        for (dx, dy) in (-2..=2i64).flat_map(|dy| (-2..=2i64).map(move |dx| (dx, dy))) {
            let weight = WEIGHTS[dx.unsigned_abs() as usize] * WEIGHTS[dy.unsigned_abs() as usize];
            total += weight;
            if let Some(at) = self.at(x + dx, y + dy) {
                sum += weight * f32::from(self.solid.bits[at]);
            }
        }
        sum / total
    }

    fn xy(&self, k: usize) -> [i64; 2] {
        let width = self.solid.width();
        [k % width, k / width].map(|at| at as i64)
    }

    fn at(&self, x: i64, y: i64) -> Option<usize> {
        let (w, h) = (i64::from(self.solid.rect.w), i64::from(self.solid.rect.h));
        ((0..w).contains(&x) && (0..h).contains(&y)).then_some((y * w + x) as usize)
    }
}

#[cfg(test)]
mod tests;
