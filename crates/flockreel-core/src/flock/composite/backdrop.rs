//! Background of a film: the footage's background at the film's size, one color, a given picture, or
//! nothing.
//!
//! The background is kept in the pixel format of the film, so that each frame starts as a copy
//! (docs/explanation/algorithms.md, "Compositing").

use super::occluders::Occluders;
use super::params::Background;
use super::view::View;
use super::{PixelFormat, Shot};
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::library::Library;
use crate::raster::canvas::opaque;
use crate::raster::resize::resized;
use crate::raster::{Canvas, Frame, RgbImage};

/// Background of a film, ready for drawing.
pub(super) struct Backdrop {
    /// Canvas over which sprites are drawn.
    pub(super) canvas: Canvas,
    /// Occluders, drawn over the sprites.
    pub(super) occluders: Option<Occluders>,
    /// Whether the background is transparent.
    pub(super) is_clear: bool,
    frame: Frame,
    rgba: Vec<u8>,
}

impl Backdrop {
    /// Returns the background that a parameter selects. Occluders are used only with
    /// `Background::Plate`.
    pub(super) fn new(
        background: Background,
        library: &Library,
        view: &View,
        format: PixelFormat,
    ) -> Backdrop {
        let [width, height] = view.size_px;
        let mut canvas = Canvas::new(width, height);
        let occluders = (library.occluders.as_ref()).filter(|_| background == Background::Plate);
        match background {
            Background::Transparent => {}
            Background::Color(rgb) => canvas.pixels.fill(opaque(rgb)),
            Background::Plate => {
                canvas.pixels.fill(opaque([0; 3]));
                let rect = view.rect();
                let filmed = Canvas::from_rgb(&resized(&library.background, rect.w, rect.h));
                canvas.copy_box(&filmed, rect);
            }
        }
        let mut occluders = occluders.map(|image| Occluders::new(image, view));
        if let Some(occluders) = &mut occluders {
            occluders.remove_from(&mut canvas);
        }
        let mut backdrop = Backdrop::from_canvas(canvas, occluders, format);
        if background == Background::Transparent {
            backdrop.is_clear = true;
            backdrop.set_transparent_color(mean_color(&library.background));
        }
        backdrop
    }

    /// Returns a given picture as the background, scaled to fill the film and cropped to its shape.
    pub(super) fn picture(picture: &RgbImage, size_px: [u32; 2], format: PixelFormat) -> Backdrop {
        Backdrop::from_canvas(scaled_to_cover(picture, size_px), None, format)
    }

    fn from_canvas(canvas: Canvas, occluders: Option<Occluders>, format: PixelFormat) -> Backdrop {
        let whole = Rect::of_size(canvas.width, canvas.height);
        let mut shown = canvas.clone();
        if let Some(occluders) = &occluders {
            occluders.draw(&mut shown, whole);
        }
        let mut backdrop = Backdrop {
            is_clear: false,
            frame: Frame::default(),
            rgba: Vec::new(),
            canvas,
            occluders,
        };
        match format {
            PixelFormat::Planar(color) => {
                backdrop.frame = Frame::new(whole.w, whole.h, color);
                let cpu = Level::detect();
                backdrop.frame.draw_canvas(&shown, whole, cpu);
            }
            PixelFormat::Straight => {
                backdrop.rgba = vec![0; whole.area() as usize * 4];
                shown.write_straight(whole, &mut backdrop.rgba);
            }
        }
        backdrop
    }

    /// Sets the color of transparent pixels. The color is invisible, but a codec that mixes neighboring
    /// pixels lets some of it through.
    fn set_transparent_color(&mut self, rgb: [u8; 3]) {
        for pixel in self.rgba.chunks_exact_mut(4) {
            pixel[..3].copy_from_slice(&rgb);
        }
    }

    /// Resets a shot to the background without animals.
    pub(super) fn reset(&self, shot: &mut Shot) {
        shot.frame.clone_from(&self.frame);
        shot.rgba.clone_from(&self.rgba);
    }
}

/// Returns a picture scaled to cover the film. If the aspect ratios differ, the middle of the picture is
/// used.
pub(super) fn scaled_to_cover(picture: &RgbImage, [width, height]: [u32; 2]) -> Canvas {
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
pub(super) fn mean_color(picture: &RgbImage) -> [u8; 3] {
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
        let canvas = scaled_to_cover(&picture, [20, 20]);
        let at = |x: usize| straight(canvas.pixels[10 * 20 + x]);
        assert_eq!((at(0), at(19)), ([60, 50, 60, 255], [174, 50, 60, 255]));
        assert_eq!(mean_color(&picture), [117, 50, 60]);
    }
}
