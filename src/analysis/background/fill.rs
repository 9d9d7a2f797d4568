//! Pixels of the plate that the animal never left free, filled from around them.
//!
//! Nearest first: each round gives every unknown pixel with a known neighbor the mean of its known
//! neighbors. Smooth, without texture; ALGORITHMS.md 2.1 asks for Efros and Leung's sampling.

use crate::raster::RgbImage;

/// Replaces the pixels marked unknown. Leaves the image as it is when nothing is known.
pub(super) fn fill_from_around(image: &mut RgbImage, unknown: &[bool]) {
    let (w, h) = (image.width as i64, image.height as i64);
    let mut open: Vec<usize> = (0..unknown.len()).filter(|&px| unknown[px]).collect();
    let mut unknown = unknown.to_vec();
    while !open.is_empty() {
        let known_around = |px: usize| {
            let (x, y) = (px as i64 % w, px as i64 / w);
            let around = (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            around
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

    #[test]
    fn a_hole_takes_the_color_around_it() {
        let mut image = RgbImage::new(5, 5);
        image.pixels.fill(90);
        let mut unknown = vec![false; 25];
        for px in [6, 7, 8, 11, 12, 13] {
            unknown[px] = true;
            image.pixels[3 * px] = 0;
        }
        fill_from_around(&mut image, &unknown);
        assert!(image.pixels.iter().all(|&p| p == 90));
    }
}
