//! What stands before everyone: the wires of a cage, what lies on the pane. They are a part of the plate, so
//! that they are drawn only where the plate lies behind.
//!
//! Where they take the share w of a pixel the plate is B = w F + (1 - w) S. Everyone is drawn over S, and
//! w F over everyone.

use super::truth::ONE;
use super::view::View;
use crate::geometry::Rect;
use crate::raster::resize::resized;
use crate::raster::{Canvas, RgbImage, RgbaImage};

/// The occluders at the film's size.
pub(super) struct Front {
    canvas: Canvas,
}

impl Front {
    /// The occluders as a view shows them.
    pub(super) fn of(occluders: &RgbaImage, view: &View) -> Front {
        let share = |pixel: &[u8]| [pixel[3]; 3];
        let rect = view.rect();
        let at_size = |image: RgbImage| Canvas::of_rgb(&resized(&image, rect.w, rect.h));
        let mut shown = at_size(mapped(occluders, premultiplied));
        let shares = at_size(mapped(occluders, share));
        for (pixel, share) in shown.pixels.iter_mut().zip(&shares.pixels) {
            let alpha = share[0];
            *pixel = [0, 1, 2, 3].map(|k| pixel[k].min(alpha));
        }
        let [width, height] = view.size_px;
        let mut canvas = Canvas::new(width, height);
        canvas.put(&shown, rect);
        Front { canvas }
    }

    /// Draws them over a box of a canvas of the film's size.
    pub(super) fn draw(&self, on: &mut Canvas, rect: Rect) {
        on.over_box(&self.canvas, rect);
    }

    /// How much of each pixel they leave to be seen, 16384ths.
    pub(super) fn left(&self) -> Vec<u16> {
        let left = |pixel: &[i16; 4]| ONE as u16 - pixel[3].unsigned_abs();
        self.canvas.pixels.iter().map(left).collect()
    }
}

/// The plate without what stands in front.
pub(super) fn scene(plate: &RgbImage, occluders: &RgbaImage) -> RgbImage {
    let mut scene = plate.clone();
    let pixels = scene.pixels.chunks_exact_mut(3);
    for (pixel, front) in pixels.zip(occluders.pixels.chunks_exact(4)) {
        let through = 1.0 - f64::from(front[3]) / 255.0;
        if through < 1.0 && through > 0.0 {
            for (value, before) in pixel.iter_mut().zip(premultiplied(front)) {
                *value = ((f64::from(*value) - f64::from(before)) / through).round() as u8;
            }
        }
    }
    scene
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
    fn over_the_scene_behind_them_they_are_the_plate_again() {
        let (mut plate, mut occluders) = (RgbImage::new(16, 16), RgbaImage::new(16, 16));
        let pixels = plate.pixels.chunks_exact_mut(3);
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
        let view = View::fitted([16, 16], [16, 16]);
        let mut shown = Canvas::of_rgb(&scene(&plate, &occluders));
        Front::of(&occluders, &view).draw(&mut shown, Rect::of_size(16, 16));
        for ((k, pixel), wanted) in (0..).zip(&shown.pixels).zip(plate.pixels.chunks_exact(3)) {
            let off = (0..3).map(|c| straight(*pixel)[c].abs_diff(wanted[c]));
            assert!(
                off.max() <= Some(1),
                "{k}: {:?} {wanted:?}",
                straight(*pixel)
            );
        }
    }
}
