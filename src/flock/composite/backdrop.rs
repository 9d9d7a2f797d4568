//! What lies behind a flock: the plate at the film's size, one color, nothing, or a given picture
//! (ALGORITHMS.md 8); in the form of the film already, so that a frame begins with a copy.

use super::front::Front;
use super::params::Background;
use super::view::View;
use super::{Form, Shot};
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::canvas::opaque;
use crate::raster::resize::resized;
use crate::raster::{Canvas, Frame, RgbImage, RgbaImage};

/// A background, ready.
pub(super) struct Backdrop {
    /// What sprites are drawn over.
    pub(super) canvas: Canvas,
    /// What is drawn over the sprites.
    pub(super) front: Option<Front>,
    /// Whether there is nothing behind.
    pub(super) is_clear: bool,
    frame: Frame,
    rgba: Vec<u8>,
}

impl Backdrop {
    /// A background that can be asked for by name; `occluders` are what stands before everyone in the plate.
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
                let plate = Canvas::of_rgb(&resized(plate, rect.w, rect.h));
                canvas.put(&plate, rect);
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

    /// A picture that fills the film.
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
                shown.straight_into(whole, &mut backdrop.rgba);
            }
        }
        backdrop
    }

    /// Gives transparent pixels a color, which nobody sees but a codec that cannot keep pixels apart.
    fn hide(&mut self, rgb: [u8; 3]) {
        for pixel in self.rgba.chunks_exact_mut(4) {
            pixel[..3].copy_from_slice(&rgb);
        }
    }

    /// Makes a shot what it is before anybody is drawn.
    pub(super) fn begin(&self, shot: &mut Shot) {
        shot.frame.clone_from(&self.frame);
        shot.rgba.clone_from(&self.rgba);
    }
}

/// A picture as it fills a film: its middle, where it has another shape.
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
    Canvas::of_rgb(&middle)
}

/// A picture's mean color.
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
