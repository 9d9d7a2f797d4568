//! The film of a virtual fish: each posture drawn over a background, in the encoder's pixel format.

use super::motion::Motion;
use super::render::{Drawing, Renderer};
use crate::geometry::Rect;
use crate::raster::{ColorSpec, Frame, RgbImage};

/// Motion, renderer and background of the film of a virtual fish.
pub struct Film {
    motion: Motion,
    renderer: Renderer,
    background: RgbImage,
    plate: Frame,
}

impl Film {
    /// Returns the film of a motion over a background. Panics if the background does not have the motion's
    /// image size.
    pub fn new(motion: Motion, background: RgbImage) -> Film {
        let [width, height] = motion.image_size_px;
        assert_eq!(
            [background.width, background.height],
            motion.image_size_px,
            "the background has the size of the footage"
        );
        let mut plate = Frame::new(width, height, ColorSpec::default());
        plate.draw_rgb(&background, Rect::of_size(width, height));
        Film {
            renderer: Renderer::new(motion.size, motion.palette),
            motion,
            background,
            plate,
        }
    }

    /// Returns the motion of the fish.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Returns the renderer of the fish.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Returns the background without the fish.
    pub fn background(&self) -> &RgbImage {
        &self.background
    }

    /// Returns the fish of one frame, without the background. Panics beyond the last frame.
    pub fn draw(&self, frame_idx: usize) -> Drawing {
        let posture = &self.motion.frames[frame_idx];
        self.renderer
            .draw(&self.motion.camera, self.motion.image_size_px, posture)
    }

    /// Draws one whole frame into `frame`, reusing its memory. Panics beyond the last frame.
    pub fn render(&self, frame_idx: usize, frame: &mut Frame) {
        frame.clone_from(&self.plate);
        let drawing = self.draw(frame_idx);
        let mut canvas = self.background.clone();
        drawing.over(&mut canvas);
        frame.draw_rgb(&canvas, drawing.rect);
    }
}

/// Returns a picture of empty water, lighter at the top.
pub fn plain_water(width: u32, height: u32) -> RgbImage {
    let (top, bottom) = ([128.0, 182.0, 190.0], [38.0, 84.0, 100.0]);
    let mut image = RgbImage::new(width, height);
    for y in 0..height {
        let share = f64::from(y) / f64::from(height.max(2) - 1);
        let rgb: [u8; 3] =
            std::array::from_fn(|c: usize| (top[c] + share * (bottom[c] - top[c]) + 0.5) as u8);
        for x in 0..width {
            image.set_pixel(x, y, rgb);
        }
    }
    image
}
