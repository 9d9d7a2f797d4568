//! Mattes: the animal cut out of a frame, with soft alpha and without the background's color.
//!
//! Alpha is 1 inside the silhouette. In a band around the outline, alpha is the pixel's share of the way from
//! the background's color to the animal's color nearby. The background's share is then subtracted from the
//! color. Shadows are left out, because a sprite would turn them with the body; `shadow` measures them.
//! Mirror images are left out too (`ground`).
//!
//! Values are encoded sRGB, as in the compositor. So a matte over its background reproduces the frame, except
//! for shadows and mirror images. See docs/explanation/algorithms.md, "Mattes".

mod coat;
mod given;
mod ground;

use self::coat::Coat;
use self::ground::Ground;
use super::scene::background::Background;
use super::scene::light::Light;
use super::silhouette::{self, Difference};
use crate::geometry::Rect;
use crate::raster::{Frame, Mask, RgbaImage};

/// The animal cut out of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Matte {
    /// Box of the matte in the frame, pixels.
    pub rect: Rect,
    /// Colors with straight alpha, in the light of the background.
    pub image: RgbaImage,
}

/// Returns the matte of a silhouette.
///
/// `length_px` is the approximate length of the animal. The band along the outline is 2 % of it wide, 2 to 8
/// pixels. When the frame has a given mask, its alpha is used.
pub fn pull(
    frame: &Frame,
    background: &Background,
    light: &Light,
    silhouette: &Mask,
    length_px: f64,
) -> Matte {
    if let Some(given) = &frame.mask {
        return given::pull(frame, given, silhouette);
    }
    let band_px = ((0.02 * length_px).round() as u32).clamp(2, 8);
    let rect = silhouette
        .rect
        .inflated(band_px + 1, frame.width, frame.height);
    let difference = silhouette::difference(frame, background, light, rect);
    let mask = over_box(silhouette, rect);
    let on_ground = Ground::behind(&mask, background).part_of(&mask);
    let coat_of = |mask: &Mask| Coat::measure(mask, &difference, background);
    let coat = coat_of(&mask).or_starker(coat_of(&on_ground));
    let mut solid = coat.without_halo(&mask, band_px);
    let ground = Ground::behind(&solid, background);
    let images = ground.clear_fading_images(&mut solid, &mask, &coat);
    ground.clear_separate_images(&mut solid, &images, &coat);
    let inside = solid.eroded_by(band_px);
    let outer = mask.dilated_by(band_px);
    let mut without_gaps = solid.dilated_by(MAX_GAP_PX).eroded_by(MAX_GAP_PX);
    without_gaps.add(&solid);
    let puller = MattePuller {
        difference: &difference,
        background,
        mask: &mask,
        solid: &solid,
        inside: &inside,
        broad: &solid.eroded().dilated_by(2),
        without_gaps: &without_gaps,
        coat: &coat,
        nearest_inside: nearest_set(&inside, &outer),
        nearest_solid: nearest_set(&solid, &outer),
        band_px,
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
    Matte { rect, image }
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

/// Half the width of gaps in the silhouette that count as narrow, pixels. A wire across the animal leaves
/// one.
const MAX_GAP_PX: u32 = 2;

/// Properties of the animal near a pixel of the band.
struct NearbyAnimal {
    /// The animal's color, levels of 255.
    color: [f32; 3],
    /// Whether the pixel has the background's color with less light.
    is_shadow: bool,
}

struct MattePuller<'a> {
    difference: &'a Difference,
    background: &'a Background,
    mask: &'a Mask,
    /// The silhouette without the shadow around it.
    solid: &'a Mask,
    /// The solid part without the band along its outline, where alpha is 1.
    inside: &'a Mask,
    /// The solid part where it is at least 3 pixels broad, and the pixels next to it.
    broad: &'a Mask,
    /// The solid part with its narrow gaps closed.
    without_gaps: &'a Mask,
    coat: &'a Coat<'a>,
    /// Index of an inside pixel near each pixel, or [`NONE_NEAR`].
    nearest_inside: Vec<u32>,
    /// Index of a solid pixel near each pixel, or [`NONE_NEAR`].
    nearest_solid: Vec<u32>,
    band_px: u32,
}

impl MattePuller<'_> {
    fn frame_color(&self, k: usize) -> [u8; 3] {
        let rgb = &self.difference.rgb.pixels[3 * k..3 * k + 3];
        [rgb[0], rgb[1], rgb[2]]
    }

    /// Returns the index of a pixel in the background image.
    fn background_px(&self, k: usize) -> usize {
        self.background.px_in(self.mask.rect, k)
    }

    fn background_color(&self, k: usize) -> [f32; 3] {
        self.background.color(self.background_px(k))
    }

    /// Returns the straight color and the alpha of a pixel of the band.
    fn band_pixel(&self, k: usize) -> [u8; 4] {
        let Some(NearbyAnimal { color, is_shadow }) = self.nearby(k) else {
            return [0; 4];
        };
        let max_alpha = if is_shadow {
            self.blurred_solid(k)
        } else {
            1.0
        };
        let alpha = self
            .alpha_by_color(color, k)
            .unwrap_or_else(|| self.alpha_without_contrast(k))
            .min(max_alpha);
        let alpha = match self.thin_part_color(k) {
            Some(body) if !is_shadow => self.alpha_of_thin_part(alpha, body, k),
            _ => alpha,
        };
        let level = (alpha * 255.0 + 0.5) as u8;
        if level == 0 {
            return [0; 4];
        }
        let color = if !is_shadow && alpha <= 0.2 {
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
    ///
    /// Pixels in narrow gaps of the animal never count as shadow.
    fn nearby(&self, k: usize) -> Option<NearbyAnimal> {
        let band = self.band_px as usize;
        let solid = self.nearest_solid[k];
        if solid == NONE_NEAR || self.steps(k, solid as usize) > band {
            return None;
        }
        let inside = self.nearest_inside[k];
        let color = if inside != NONE_NEAR && self.steps(k, inside as usize) <= 2 * band + 1 {
            self.mean_inside(inside as usize)
        } else {
            self.starkest(solid as usize)?
        };
        Some(NearbyAnimal {
            color,
            is_shadow: self.without_gaps.bits[k] == 0 && self.coat.is_shadow(k),
        })
    }

    /// Returns the number of steps from one pixel to another (8-connected).
    fn steps(&self, from: usize, to: usize) -> usize {
        let width = self.mask.width();
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
        let width = self.mask.width();
        [k % width, k / width].map(|at| at as i64)
    }

    fn at(&self, x: i64, y: i64) -> Option<usize> {
        let (w, h) = (i64::from(self.mask.rect.w), i64::from(self.mask.rect.h));
        ((0..w).contains(&x) && (0..h).contains(&y)).then_some((y * w + x) as usize)
    }
}

fn minus(p: [f32; 3], q: [f32; 3]) -> [f32; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

fn dot(p: [f32; 3], q: [f32; 3]) -> f32 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

#[cfg(test)]
mod tests;
