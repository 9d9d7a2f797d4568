//! The film of a virtual fish: each posture drawn over a background, in the encoder's pixel format.

use super::drive::drive;
use super::error::Error;
use super::figure::Figure;
use super::mesh::Mesh;
use super::motion::Motion;
use super::params::{Body, Params};
use super::render::{Drawing, Renderer};
use crate::library::Library;
use crate::parameters::Parameters;
use crate::raster::{ColorSpec, Frame, RgbImage};

/// Motion, renderer and background of the film of a virtual fish.
pub struct Film {
    motion: Motion,
    renderer: Renderer,
    background: RgbImage,
    /// `background` in the encoder's pixel format.
    background_frame: Frame,
}

impl Film {
    /// Returns the film of the virtual animal of a library over its background.
    pub fn of(library: &Library, params: &Params) -> Result<Film, Error> {
        params.check().map_err(Error::InvalidParams)?;
        let figure = match params.body {
            Body::Own => Some(Figure::learn(library)?),
            Body::Goldfish => None,
        };
        let motion = drive(&library.poses, params, figure.as_ref())?;
        let mesh = match &figure {
            Some(figure) => figure.mesh(motion.size.length_m, params.height_m),
            None => Mesh::goldfish(motion.size, params.palette),
        };
        Ok(Film::new(motion, mesh, library.background.clone()))
    }

    /// Returns the film of a motion over a background. Panics if the background does not have the motion's
    /// image size.
    pub fn new(motion: Motion, mesh: Mesh, background: RgbImage) -> Film {
        let [width, height] = motion.image_size_px;
        assert_eq!(
            background.size(),
            motion.image_size_px,
            "the background has the size of the footage"
        );
        let mut background_frame = Frame::new(width, height, ColorSpec::default());
        background_frame.draw_all_rgb(&background);
        Film {
            renderer: Renderer::new(mesh),
            motion,
            background,
            background_frame,
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
        frame.clone_from(&self.background_frame);
        let drawing = self.draw(frame_idx);
        let mut canvas = self.background.clone();
        drawing.over(&mut canvas);
        frame.draw_rgb(&canvas, drawing.rect);
    }
}
