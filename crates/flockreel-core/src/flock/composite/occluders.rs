//! Occluders: objects between the camera and the animals, such as the wires of a cage or dirt on the pane.
//! They belong to the footage's background and are drawn only with that background.
//!
//! An occluder of color F takes the share w of a pixel, and S is the scene behind it. The background is
//! then B = w F + (1 - w) S. Animals are drawn over S, and w F over the animals
//! (docs/explanation/algorithms.md, "Compositing").

use super::truth::ONE;
use super::view::View;
use crate::geometry::Rect;
use crate::raster::resize::resized;
use crate::raster::{Canvas, RgbImage, RgbaImage};

/// Occluders at the size of the film.
pub(super) struct Occluders {
    canvas: Canvas,
}

impl Occluders {
    /// Returns the occluders, scaled to a view.
    pub(super) fn new(occluders: &RgbaImage, view: &View) -> Occluders {
        let share = |pixel: &[u8]| [pixel[3]; 3];
        let rect = view.rect();
        let at_size = |image: RgbImage| Canvas::from_rgb(&resized(&image, rect.w, rect.h));
        let mut shown = at_size(mapped(occluders, premultiplied));
        let shares = at_size(mapped(occluders, share));
        for (pixel, share) in shown.pixels.iter_mut().zip(&shares.pixels) {
            let alpha = share[0];
            *pixel = [0, 1, 2, 3].map(|k| pixel[k].min(alpha));
        }
        let [width, height] = view.size_px;
        let mut canvas = Canvas::new(width, height);
        canvas.copy_box(&shown, rect);
        Occluders { canvas }
    }

    /// Replaces a background of the film's size by the scene behind the occluders, S = (B - w F) / (1 - w).
    /// Drawing the occluders over S gives B again at any size: colors of occluders that resizing made too
    /// bright or too dark for B are clamped.
    pub(super) fn remove_from(&mut self, background: &mut Canvas) {
        for (behind, front) in background.pixels.iter_mut().zip(&mut self.canvas.pixels) {
            let through = i32::from(ONE as i16 - front[3]);
            if front[3] == 0 {
                continue;
            }
            for (value, before) in behind[..3].iter_mut().zip(front) {
                let shown = i32::from(*value);
                let own = i32::from(*before).clamp((shown - through).max(0), shown);
                *before = own as i16;
                if through > 0 {
                    *value = (((shown - own) * ONE as i32 + through / 2) / through) as i16;
                }
            }
        }
    }

    /// Draws the occluders over a box of a canvas of the film's size.
    pub(super) fn draw(&self, on: &mut Canvas, rect: Rect) {
        on.draw_box_over(&self.canvas, rect);
    }

    /// Returns the share of each pixel that the occluders leave visible, in 16384ths.
    pub(super) fn left(&self) -> Vec<u16> {
        let left = |pixel: &[i16; 4]| ONE as u16 - pixel[3].unsigned_abs();
        self.canvas.pixels.iter().map(left).collect()
    }
}

fn premultiplied(pixel: &[u8]) -> [u8; 3] {
    let share = u32::from(pixel[3]);
    [0, 1, 2].map(|c| ((u32::from(pixel[c]) * share + 127) / 255) as u8)
}

fn mapped(image: &RgbaImage, pixel: impl Fn(&[u8]) -> [u8; 3]) -> RgbImage {
    RgbImage {
        width: image.width,
        height: image.height,
        pixels: image.pixels.chunks_exact(4).flat_map(pixel).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::canvas::straight;

    #[test]
    fn occluders_over_the_scene_behind_them_give_the_background() {
        let (mut background, mut occluders) = (RgbImage::new(16, 16), RgbaImage::new(16, 16));
        let pixels = background.pixels.chunks_exact_mut(3);
        let both = pixels.zip(occluders.pixels.chunks_exact_mut(4));
        for (k, (shown, front)) in both.enumerate() {
            let alpha = [0, 60, 128, 254, 255][k % 5];
            front.copy_from_slice(&[220, 100, 9, alpha]);
            let share = f64::from(alpha) / 255.0;
            for (c, behind) in [60.0 + k as f64 / 2.0, 90.0, 140.0].iter().enumerate() {
                let mixed = share * f64::from(front[c]) + (1.0 - share) * behind;
                shown[c] = mixed.round() as u8;
            }
        }
        for side in [16, 8, 11, 24, 33] {
            let view = View::fitted([16, 16], [side, side]);
            let wanted = Canvas::from_rgb(&resized(&background, side, side));
            let (mut front, mut shown) = (Occluders::new(&occluders, &view), wanted.clone());
            front.remove_from(&mut shown);
            front.draw(&mut shown, Rect::of_size(side, side));
            for (k, (pixel, wanted)) in shown.pixels.iter().zip(&wanted.pixels).enumerate() {
                let [pixel, wanted] = [*pixel, *wanted].map(straight);
                let off = (0..3).map(|c| pixel[c].abs_diff(wanted[c])).max();
                assert!(off <= Some(2), "{side}, {k}: {pixel:?} {wanted:?}");
            }
        }
    }
}
