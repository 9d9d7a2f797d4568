//! Background of a film: the footage's background at the film's size, one color, a given picture, or
//! nothing.
//!
//! The background is kept in the pixel format of the film, so that each frame starts as a copy
//! (docs/explanation/algorithms.md, "Compositing").

use super::front::Front;
use super::params::Background;
use super::view::View;
use super::{Form, Shot};
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::canvas::opaque;
use crate::raster::resize::resized;
use crate::raster::{Canvas, Frame, RgbImage, RgbaImage};

/// Background of a film, ready for drawing.
pub(super) struct Backdrop {
    /// Canvas over which sprites are drawn.
    pub(super) canvas: Canvas,
    /// Occluders, drawn over the sprites.
    pub(super) front: Option<Front>,
    /// Whether the background is transparent.
    pub(super) is_clear: bool,
    frame: Frame,
    rgba: Vec<u8>,
}

impl Backdrop {
    /// Returns the background that a parameter selects. `occluders` are used only with `Background::Plate`.
    pub(super) fn of(
        background: Background,
        (plate, occluders): (&RgbImage, Option<&RgbaImage>),
        view: &View,
        form: Form,
    ) -> Backdrop {
        let [width, height] = view.size_px;
        let mut canvas = Canvas::new(width, height);
        let occluders = occluders.filter(|_| background == Background::Plate);
        match background {
            Background::Transparent => {}
            Background::Color(rgb) => canvas.pixels.fill(opaque(rgb)),
            Background::Plate => {
                canvas.pixels.fill(opaque([0; 3]));
                let rect = view.rect();
                let plate = Canvas::from_rgb(&resized(plate, rect.w, rect.h));
                canvas.copy_box(&plate, rect);
            }
        }
        let mut front = occluders.map(|occluders| Front::of(occluders, view));
        if let Some(front) = &mut front {
            front.take_off(&mut canvas);
        }
        let mut backdrop = Backdrop::ready(canvas, front, form);
        if background == Background::Transparent {
            backdrop.is_clear = true;
            backdrop.hide(mean(plate));
        }
        backdrop
    }

    /// Returns a given picture as the background, scaled to fill the film and cropped to its shape.
    pub(super) fn picture(picture: &RgbImage, size_px: [u32; 2], form: Form) -> Backdrop {
        Backdrop::ready(filling(picture, size_px), None, form)
    }

    fn ready(canvas: Canvas, front: Option<Front>, form: Form) -> Backdrop {
        let whole = Rect::of_size(canvas.width, canvas.height);
        let mut shown = canvas.clone();
        if let Some(front) = &front {
            front.draw(&mut shown, whole);
        }
        let mut backdrop = Backdrop {
            is_clear: false,
            frame: Frame::default(),
            rgba: Vec::new(),
            canvas,
            front,
        };
        match form {
            Form::Planar(color) => {
                backdrop.frame = Frame::new(whole.w, whole.h, color);
                let cpu = Level::detect();
                backdrop.frame.draw_canvas(&shown, whole, cpu);
            }
            Form::Straight => {
                backdrop.rgba = vec![0; whole.area() as usize * 4];
                shown.write_straight(whole, &mut backdrop.rgba);
            }
        }
        backdrop
    }

    /// Sets the color of transparent pixels. The color is invisible, but a codec that mixes neighboring
    /// pixels lets some of it through.
    fn hide(&mut self, rgb: [u8; 3]) {
        for pixel in self.rgba.chunks_exact_mut(4) {
            pixel[..3].copy_from_slice(&rgb);
        }
    }

    /// Resets a shot to the background without animals.
    pub(super) fn begin(&self, shot: &mut Shot) {
        shot.frame.clone_from(&self.frame);
        shot.rgba.clone_from(&self.rgba);
    }
}

/// Returns a picture scaled to cover the film. If the aspect ratios differ, the middle of the picture is
/// used.
pub(super) fn filling(picture: &RgbImage, [width, height]: [u32; 2]) -> Canvas {
    let scale = (f64::from(width) / f64::from(picture.width))
        .max(f64::from(height) / f64::from(picture.height));
    let side = |px: u32, least: u32| ((f64::from(px) * scale).round() as u32).max(least);
    let large = resized(
        picture,
        side(picture.width, width),
        side(picture.height, height),
    );
    let (left, top) = ((large.width - width) / 2, (large.height - height) / 2);
    let mut middle = RgbImage::new(width, height);
    let n = width as usize * 3;
    for (y, row) in (top as usize..).zip(middle.pixels.chunks_exact_mut(n)) {
        let at = (y * large.width as usize + left as usize) * 3;
        row.copy_from_slice(&large.pixels[at..at + n]);
    }
    Canvas::from_rgb(&middle)
}

/// Returns the mean color of a picture.
pub(super) fn mean(picture: &RgbImage) -> [u8; 3] {
    let mut sum = [0u64; 3];
    for pixel in picture.pixels.chunks_exact(3) {
        for (sum, &value) in sum.iter_mut().zip(pixel) {
            *sum += u64::from(value);
        }
    }
    let n = (picture.pixels.len() as u64 / 3).max(1);
    sum.map(|sum| (sum / n) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::canvas::straight;

    #[test]
    fn a_picture_of_another_shape_fills_the_film_with_its_middle() {
        let mut picture = RgbImage::new(40, 20);
        for y in 0..20 {
            for x in 0..40 {
                picture.set_pixel(x, y, [(x * 6) as u8, 50, 60]);
            }
        }
        let canvas = filling(&picture, [20, 20]);
        let at = |x: usize| straight(canvas.pixels[10 * 20 + x]);
        assert_eq!((at(0), at(19)), ([60, 50, 60, 255], [174, 50, 60, 255]));
        assert_eq!(mean(&picture), [117, 50, 60]);
    }
}
