//! Fills unknown pixels with the surrounding texture: background that the animal never left free, and parts of
//! the animal that no frame shows
//! (docs/explanation/algorithms.md, "Background"). The source is Efros & Leung, "Texture synthesis by
//! non-parametric sampling", 1999.
//!
//! Each pixel, from the rim of the hole inward, copies the color of a nearby place with similar known
//! surroundings. The search compares all places within `SEARCH_PX` in integer arithmetic.
//!
//! Two parts differ from the paper on purpose. There is no limit on the error of a match, because every pixel
//! needs a color. Beyond `MAX_SAMPLED_PX` pixels `smooth` fills the rest: so large a hole is an unseen
//! part of the scene, not a gap in a texture.

use rayon::prelude::*;

use crate::geometry::Rect;
use crate::random;
use crate::raster::{Mask, RgbImage};

/// Half side of the 7 x 7 window of surroundings that is compared, pixels.
const RADIUS: i64 = 3;
/// Largest distance of a copied place from the rim of the hole along x and y, pixels. Free choice.
const SEARCH_PX: i64 = 64;
/// Largest error of an eligible match relative to the best one, as a fraction: the paper's epsilon.
const TOLERANCE: [u64; 2] = [11, 10];
/// Gaussian weights for offsets 0 to 3 (standard deviation 7 / 6.4 pixels, from the paper). They are scaled
/// so that the sum over a window of three channels fits 32 bits.
const WEIGHTS: [u32; 4] = [52, 34, 10, 1];
/// Largest number of pixels filled with texture. Free choice.
pub(crate) const MAX_SAMPLED_PX: usize = 16_384;

/// Replaces the pixels marked unknown by texture. Equal seeds give equal bytes. Leaves the image unchanged if
/// no pixel is known.
pub(crate) fn sample_texture(image: &mut RgbImage, unknown: &[bool], seed: u64) {
    let mut hole = Hole::new(image, unknown);
    let mut n_sampled = 0;
    let mut rim = hole.rim();
    while !rim.is_empty() && n_sampled < MAX_SAMPLED_PX {
        for &px in rim.iter().take(MAX_SAMPLED_PX - n_sampled) {
            if let Some(from) = hole.choose(px, seed) {
                let color = [0, 1, 2].map(|c| hole.image.pixels[3 * from + c]);
                hole.image.pixels[3 * px..3 * px + 3].copy_from_slice(&color);
                hole.copied_from[px] = from;
                hole.known[px] = true;
            }
        }
        n_sampled += rim.len();
        let before = rim;
        rim = hole.rim();
        // No window near the rim is completely known.
        if rim == before {
            break;
        }
    }
    let left: Vec<bool> = hole.known.iter().map(|known| !known).collect();
    smooth(image, &left);
}

/// The image while its hole is filled.
struct Hole<'a> {
    image: &'a mut RgbImage,
    size: [i64; 2],
    known: Vec<bool>,
    /// 1 for pixels whose whole window was known at the start: only these are copied.
    whole: Vec<u8>,
    /// Index of the pixel that each pixel's color was copied from; its own for pixels known at the start.
    copied_from: Vec<usize>,
}

/// One known pixel in the window around an unknown pixel.
struct KnownPixel {
    dx: i64,
    dy: i64,
    weight: u32,
    color: [u8; 3],
}

impl<'a> Hole<'a> {
    fn new(image: &'a mut RgbImage, unknown: &[bool]) -> Hole<'a> {
        let known = Mask {
            rect: Rect::of_size(image.width, image.height),
            bits: unknown.iter().map(|&unknown| u8::from(!unknown)).collect(),
        };
        Hole {
            size: [i64::from(image.width), i64::from(image.height)],
            image,
            known: unknown.iter().map(|&unknown| !unknown).collect(),
            whole: known.eroded_by(3).bits,
            copied_from: (0..unknown.len()).collect(),
        }
    }

    /// Returns the unknown pixels with a known neighbor, those with the most known pixels in their window
    /// first.
    fn rim(&self) -> Vec<usize> {
        let mut rim: Vec<(std::cmp::Reverse<usize>, usize)> = (0..self.known.len())
            .filter(|&px| !self.known[px] && self.known_within(px, 1).next().is_some())
            .map(|px| (std::cmp::Reverse(self.known_within(px, RADIUS).count()), px))
            .collect();
        rim.sort_unstable();
        rim.into_iter().map(|(_, px)| px).collect()
    }

    /// Returns the pixel to copy, drawn at random from the places whose error is close to the least. Returns
    /// `None` when no window within `SEARCH_PX` is completely known.
    fn choose(&self, px: usize, seed: u64) -> Option<usize> {
        let window = self.window(px);
        let [w, h] = self.size;
        let from = self.copied_from[self.known_within(px, 1).next()?] as i64;
        let near = |at: i64, length: i64| {
            (at - SEARCH_PX).max(RADIUS)..(at + SEARCH_PX + 1).min(length - RADIUS)
        };
        let (rows, columns) = (near(from / w, h), near(from % w, w));
        // The places that continue the neighbors' sources give an upper bound of the least error.
        let bound = self
            .known_within(px, 1)
            .filter_map(|other| self.continuation(other, px))
            .filter(|place| columns.contains(&(*place as i64 % w)))
            .filter(|place| rows.contains(&(*place as i64 / w)))
            .map(|place| self.distance(&window, place, u32::MAX))
            .min()
            .unwrap_or(u32::MAX);
        let found: Vec<(u32, usize)> = rows
            .into_par_iter()
            .flat_map_iter(|y| {
                let mut found = Vec::new();
                let mut least = bound;
                for place in (y * w + columns.start) as usize..(y * w + columns.end) as usize {
                    if self.whole[place] == 1 {
                        let distance = self.distance(&window, place, tolerated(least));
                        least = least.min(distance);
                        if distance <= tolerated(least) {
                            found.push((distance, place));
                        }
                    }
                }
                found
            })
            .collect();
        let least = tolerated(found.iter().map(|(distance, _)| *distance).min()?);
        let candidates: Vec<usize> = found
            .into_iter()
            .filter(|(distance, _)| *distance <= least)
            .map(|(_, place)| place)
            .collect();
        let drawn = random::bits(seed, &[px as u64]) % candidates.len() as u64;
        Some(candidates[drawn as usize])
    }

    /// Returns the known pixels of the window, those of largest weight first.
    fn window(&self, px: usize) -> Vec<KnownPixel> {
        let mut window: Vec<KnownPixel> = self
            .known_within(px, RADIUS)
            .map(|other| {
                let (dx, dy) = self.offset(px, other);
                let weight = |d: i64| WEIGHTS[d.unsigned_abs() as usize];
                KnownPixel {
                    dx,
                    dy,
                    weight: weight(dx) * weight(dy),
                    color: [0, 1, 2].map(|c| self.image.pixels[3 * other + c]),
                }
            })
            .collect();
        window.sort_by_key(|a| std::cmp::Reverse(a.weight));
        window
    }

    /// Returns the weighted sum of squared differences. Stops early once the sum exceeds `bound`.
    fn distance(&self, window: &[KnownPixel], place: usize, bound: u32) -> u32 {
        let mut sum = 0;
        for KnownPixel {
            dx,
            dy,
            weight,
            color,
        } in window
        {
            let at = (place as i64 + dy * self.size[0] + dx) as usize;
            let there = &self.image.pixels[3 * at..3 * at + 3];
            let square = |c: usize| u32::from(there[c].abs_diff(color[c])).pow(2);
            sum += weight * (square(0) + square(1) + square(2));
            if sum > bound {
                break;
            }
        }
        sum
    }

    /// Returns the source of a pixel if it continues the source of its neighbor; `None` if that cannot be
    /// copied.
    fn continuation(&self, neighbor: usize, px: usize) -> Option<usize> {
        let (dx, dy) = self.offset(neighbor, px);
        let from = self.copied_from[neighbor] as i64;
        let (x, y) = (from % self.size[0] + dx, from / self.size[0] + dy);
        let inside = (0..self.size[0]).contains(&x) && (0..self.size[1]).contains(&y);
        let place = (y * self.size[0] + x) as usize;
        (inside && self.whole[place] == 1).then_some(place)
    }

    fn offset(&self, from: usize, to: usize) -> (i64, i64) {
        let (from, to, w) = (from as i64, to as i64, self.size[0]);
        (to % w - from % w, to / w - from / w)
    }

    /// Returns the known pixels within `radius` columns and rows, row by row.
    fn known_within(&self, px: usize, radius: i64) -> impl Iterator<Item = usize> {
        let [w, h] = self.size;
        let (x, y) = (px as i64 % w, px as i64 / w);
        let rows = (y - radius).max(0)..(y + radius + 1).min(h);
        let columns = (x - radius).max(0)..(x + radius + 1).min(w);
        rows.flat_map(move |y| columns.clone().map(move |x| (y * w + x) as usize))
            .filter(|&other| self.known[other])
    }
}

fn tolerated(distance: u32) -> u32 {
    let more = u64::from(distance) * TOLERANCE[0] / TOLERANCE[1];
    more.min(u64::from(u32::MAX)) as u32
}

/// Replaces the pixels marked unknown without texture, from the rim inward. In each round, every unknown
/// pixel with a known neighbor gets the mean of its known neighbors. Leaves the image unchanged if no pixel
/// is known.
pub(crate) fn smooth(image: &mut RgbImage, unknown: &[bool]) {
    let (w, h) = (image.width as i64, image.height as i64);
    let mut open: Vec<usize> = (0..unknown.len()).filter(|&px| unknown[px]).collect();
    let mut unknown = unknown.to_vec();
    while !open.is_empty() {
        let known_around = |px: usize| {
            let (x, y) = (px as i64 % w, px as i64 / w);
            let neighbors = (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            neighbors
                .filter(move |&(x, y)| (0..w).contains(&x) && (0..h).contains(&y))
                .map(move |(x, y)| (y * w + x) as usize)
        };
        let mut filled: Vec<(usize, [u8; 3])> = Vec::new();
        for &px in &open {
            let mut sum = [0u32; 3];
            let mut n = 0;
            for other in known_around(px).filter(|&other| !unknown[other]) {
                for (s, &c) in sum.iter_mut().zip(&image.pixels[3 * other..3 * other + 3]) {
                    *s += u32::from(c);
                }
                n += 1;
            }
            if n > 0 {
                filled.push((px, sum.map(|s| ((s + n / 2) / n) as u8)));
            }
        }
        if filled.is_empty() {
            return;
        }
        for (px, rgb) in filled {
            image.pixels[3 * px..3 * px + 3].copy_from_slice(&rgb);
            unknown[px] = false;
        }
        open.retain(|&px| unknown[px]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns slanted stripes, two pixels dark and four pixels light.
    fn stripes() -> RgbImage {
        let mut image = RgbImage::new(72, 60);
        for y in 0..60 {
            for x in 0..72 {
                let level = if (x + y) % 6 < 2 { 60 } else { 190 };
                image.set_pixel(x, y, [level, level / 2, 255 - level]);
            }
        }
        image
    }

    /// Returns the image with a black square of `side` pixels, and a flag for each pixel inside it.
    fn with_hole(image: &RgbImage, side: u32) -> (RgbImage, Vec<bool>) {
        let mut holed = image.clone();
        let hole = Rect {
            x: 26,
            y: 20,
            w: side,
            h: side,
        };
        let inside = |px: u32| hole.contains(px % image.width, px / image.width);
        let unknown: Vec<bool> = (0..image.width * image.height).map(inside).collect();
        for px in (0..unknown.len()).filter(|&px| unknown[px]) {
            holed.pixels[3 * px..3 * px + 3].fill(0);
        }
        (holed, unknown)
    }

    #[test]
    fn stripes_continue_exactly_through_a_hole() {
        let (mut image, unknown) = with_hole(&stripes(), 18);
        sample_texture(&mut image, &unknown, 1);
        assert!(image == stripes());
    }

    #[test]
    fn sampled_texture_keeps_the_contrast_of_coarse_grain() {
        let mut grain = RgbImage::new(72, 60);
        for (k, pixel) in grain.pixels.chunks_exact_mut(3).enumerate() {
            let cell = (k as u64 % 72 / 2, k as u64 / 72 / 2);
            pixel.fill((100 + random::bits(3, &[cell.0, cell.1]) % 100) as u8);
        }
        let (holed, unknown) = with_hole(&grain, 20);
        let deviation = |image: &RgbImage| {
            let levels = (0..unknown.len()).filter(|&px| unknown[px]);
            let levels: Vec<f64> = levels.map(|px| f64::from(image.pixels[3 * px])).collect();
            let mean = levels.iter().sum::<f64>() / levels.len() as f64;
            let variance = levels.iter().map(|l| (l - mean).powi(2)).sum::<f64>();
            (variance / levels.len() as f64).sqrt()
        };
        let (mut sampled, mut smoothed) = (holed.clone(), holed);
        sample_texture(&mut sampled, &unknown, 1);
        smooth(&mut smoothed, &unknown);
        let wanted = deviation(&grain);
        assert!((0.75..1.25).contains(&(deviation(&sampled) / wanted)));
        assert!(deviation(&smoothed) < 0.7 * wanted);
    }

    #[test]
    fn fill_depends_on_the_seed_and_not_on_threads() {
        let mut noisy = stripes();
        for (k, value) in noisy.pixels.iter_mut().enumerate() {
            *value += (random::bits(9, &[k as u64]) % 40) as u8;
        }
        let (holed, unknown) = with_hole(&noisy, 10);
        let filled = |seed: u64, n_threads: usize| {
            let mut image = holed.clone();
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(n_threads)
                .build();
            pool.unwrap()
                .install(|| sample_texture(&mut image, &unknown, seed));
            image
        };
        assert!(filled(1, 1) == filled(1, 3));
        assert!(filled(1, 1) != filled(2, 1));
    }

    #[test]
    fn hole_without_complete_window_takes_the_color_beside_it() {
        let mut image = RgbImage::new(6, 6);
        image.pixels.fill(90);
        let mut unknown = vec![false; 36];
        for px in [7, 8, 9, 13, 14, 15] {
            unknown[px] = true;
            image.pixels[3 * px] = 0;
        }
        sample_texture(&mut image, &unknown, 1);
        assert!(image.pixels.iter().all(|&p| p == 90));
    }

    #[test]
    fn image_without_known_pixels_stays_unchanged() {
        let mut image = RgbImage::new(9, 9);
        image.pixels.fill(7);
        sample_texture(&mut image, &[true; 81], 1);
        assert!(image.pixels.iter().all(|&p| p == 7));
    }
}
