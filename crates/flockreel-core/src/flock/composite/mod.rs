//! The film of a flock: sprites composited over a background
//! (docs/explanation/algorithms.md, "Compositing").
//!
//! Sprites are drawn from near to far, each under the sprites drawn before it, in premultiplied alpha with
//! Catmull-Rom interpolation. Pixels that are already opaque are skipped. A sprite at scale 1, without
//! rotation and at a whole-pixel position, is copied exactly.
//!
//! A frame starts as a copy of the background in the encoder's pixel format. Only tiles with sprites are
//! converted again, so the cost grows with the area drawn. The ground truth is computed from the same
//! layers.

mod backdrop; // the background of the film
mod bleed; // color of transparent pixels
mod draw_ahead; // drawing on all threads, ahead of the consumer
pub mod keypoints; // head, midline and tail
mod layer; // drawing of one individual
mod morph; // warping of two sprites at a jump
mod occluders; // occluders in front of the animals
pub mod params;
mod shadow; // shadows on the floor
mod sprite_cache; // cache of premultiplied sprites
pub mod truth; // ground truth of a frame
mod view; // footage pixels to film pixels

use std::sync::{Mutex, PoisonError};

use self::backdrop::Backdrop;
use self::bleed::bleed;
use self::draw_ahead::draw_ahead;
use self::keypoints::SourceKeypoints;
use self::layer::{Appearance, DrawContext, Haze, Painter};
use self::occluders::Occluders;
use self::params::Background;
use self::shadow::{Shade, Shadows};
use self::sprite_cache::SpriteCache;
use self::truth::{Drawn, FrameTruth};
use self::view::View;
use super::individual::Individual;
use super::{Flock, Library};
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::canvas::{Coverage, opaque};
use crate::raster::{Canvas, ColorSpec, Frame, RgbImage};

/// Draws the frames of a flock. Frames can be drawn in any order and from any thread.
pub struct Compositor<'a> {
    library: &'a Library,
    flock: &'a Flock,
    view: View,
    format: PixelFormat,
    /// Keypoints of the source frames; `None` without ground truth.
    truth: Option<SourceKeypoints>,
    backdrop: Backdrop,
    haze: Option<Haze>,
    shadows: Option<Shadows>,
    sprite_cache: SpriteCache,
    cpu: Level,
    n_frames: usize,
    /// `[id][frame]`: index of the fade that is active at an output frame; `None` outside of fades.
    fade_at: Vec<Vec<Option<u32>>>,
    workspaces: Mutex<Vec<Workspace>>,
}

/// Pixel format of the drawn frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// Opaque planes, as encoders take them.
    Planar(ColorSpec),
    /// Straight-alpha RGBA.
    Straight,
}

/// One drawn frame of the film.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shot {
    /// Planes; empty with `PixelFormat::Straight`.
    pub frame: Frame,
    /// Straight-alpha RGBA by rows; empty with `PixelFormat::Planar`.
    pub rgba: Vec<u8>,
    /// Ground truth of the frame, if the compositor computes it (`Compositor::with_truth`).
    pub truth: FrameTruth,
    /// Background of this frame only, scaled to fill the film; empty = the background of the film.
    pub behind: Frame,
}

/// Working memory of one drawing thread, reused from frame to frame.
struct Workspace {
    /// Sprites drawn so far, over a transparent background.
    canvas: Canvas,
    /// Which parts of the canvas have been drawn on.
    cover: Coverage,
    /// Boxes of the sprites. In a transparent film color is spread beyond their edges.
    boxes: Vec<Rect>,
    painter: Painter,
    shade: Shade,
    drawn: Vec<Drawn>,
}

impl<'a> Compositor<'a> {
    /// Returns a compositor for the flock's `render` parameters that draws planes. The footage's background
    /// replaces `Background::Transparent`, because planes have no alpha.
    pub fn new(library: &'a Library, flock: &'a Flock) -> Compositor<'a> {
        let render = &flock.params.render;
        let size_px = render.size_px.unwrap_or(flock.image_size_px);
        let view = View::fitted(flock.image_size_px, size_px);
        let background = match render.background {
            Background::Transparent => Background::Plate,
            other => other,
        };
        let format = PixelFormat::Planar(ColorSpec::default());
        Compositor {
            library,
            flock,
            view,
            format,
            truth: None,
            backdrop: Backdrop::new(background, library, &view, format),
            haze: (render.haze_per_bl > 0.0).then(|| Haze {
                left_per_px: libm::pow(1.0 - render.haze_per_bl, 1.0 / flock.length_px),
                color: opaque(backdrop::mean_color(&library.background)),
            }),
            shadows: Shadows::new(library, flock),
            sprite_cache: SpriteCache::default(),
            cpu: Level::detect(),
            n_frames: (flock.individuals.first()).map_or(0, |one| one.source_frame.len()),
            fade_at: flock.individuals.iter().map(fades_by_frame).collect(),
            workspaces: Mutex::default(),
        }
    }

    /// Switches to straight-alpha RGBA, with the background that the parameters select, transparent
    /// included.
    pub fn straight(mut self) -> Compositor<'a> {
        self.format = PixelFormat::Straight;
        let background = self.flock.params.render.background;
        self.backdrop = Backdrop::new(background, self.library, &self.view, self.format);
        self
    }

    /// Makes the compositor also compute the ground truth of every frame.
    pub fn with_truth(mut self) -> Compositor<'a> {
        self.truth = Some(SourceKeypoints::of(self.library, self.flock));
        self
    }

    /// Replaces the background by a picture, scaled to fill the film and cropped to its shape.
    pub fn before(mut self, picture: &RgbImage) -> Compositor<'a> {
        self.backdrop = Backdrop::picture(picture, self.view.size_px, self.format);
        self
    }

    /// Shortens the film to at most `n_frames` frames.
    pub fn first(mut self, n_frames: usize) -> Compositor<'a> {
        self.n_frames = self.n_frames.min(n_frames);
        self
    }

    /// Returns the number of frames.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Returns width and height of the film, in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.view.size_px
    }

    /// Returns the film pixels per footage pixel.
    pub fn scale(&self) -> f64 {
        self.view.scale
    }

    /// Draws one frame into `shot`, reusing its memory. Panics beyond the last frame.
    pub fn render(&self, frame_idx: usize, shot: &mut Shot) {
        let mut workspace = self.take_workspace();
        workspace.drawn.clear();
        if self.shadows.is_some() {
            workspace.shade.begin(self.view.size_px);
        }
        let order = self.near_to_far(frame_idx);
        for appearance in &order {
            self.draw(appearance, &mut workspace);
        }
        if self.shadows.is_some() {
            workspace.shade.layer(&mut workspace.painter.layer);
            workspace.draw_layer(self.cpu);
        }
        if self.truth.is_some() {
            let shade = self.shadows.as_ref().map(|_| workspace.shade.alpha());
            shot.truth = FrameTruth::new(
                &workspace.drawn,
                shade,
                self.view.size_px,
                self.unoccluded(shot),
            );
        }
        self.finish(&mut workspace, shot);
        self.workspaces
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(workspace);
    }

    /// Returns the occluders in front of the animals. `None` if there are none, or if the shot has its own
    /// background.
    fn occluders(&self, shot: &Shot) -> Option<&Occluders> {
        let occluders = self.backdrop.occluders.as_ref();
        occluders.filter(|_| shot.behind.planes.is_empty())
    }

    /// Returns the share of each pixel that the occluders leave to the animals, in 16384ths.
    fn unoccluded(&self, shot: &Shot) -> Vec<u16> {
        let [width, height] = self.view.size_px.map(|side| side as usize);
        match self.occluders(shot) {
            Some(front) => front.left(),
            None => vec![truth::ONE as u16; width * height],
        }
    }

    /// Puts the background under the canvas, converts the result to the film's pixel format, and clears the
    /// canvas.
    fn finish(&self, workspace: &mut Workspace, shot: &mut Shot) {
        self.backdrop.reset(shot);
        let own = (!shot.behind.planes.is_empty())
            .then(|| backdrop::scaled_to_cover(&shot.behind.to_rgb(), self.view.size_px));
        if own.is_some() {
            workspace.cover.mark_all_drawn();
        }
        let behind = own.as_ref().unwrap_or(&self.backdrop.canvas);
        for rect in workspace.cover.take_drawn_boxes() {
            workspace.canvas.draw_box_under(behind, rect, self.cpu);
            if let Some(front) = self.occluders(shot) {
                front.draw(&mut workspace.canvas, rect);
            }
            match self.format {
                PixelFormat::Planar(_) => shot.frame.draw_canvas(&workspace.canvas, rect, self.cpu),
                PixelFormat::Straight => workspace.canvas.write_straight(rect, &mut shot.rgba),
            }
            workspace.canvas.clear_box(rect);
        }
        if self.format == PixelFormat::Straight && self.backdrop.is_clear {
            merge_overlapping(&mut workspace.boxes);
            for &rect in &workspace.boxes {
                bleed(&mut shot.rgba, self.view.size_px, rect);
            }
        }
        workspace.boxes.clear();
    }

    /// Draws all frames on all threads and passes each to `sink`, in order. `prepare` is called for each
    /// frame before it is drawn, also in order, and may set `Shot::behind`. The first error of either ends
    /// the drawing and is returned.
    pub fn render_all<E: Send>(
        &self,
        prepare: impl FnMut(usize, &mut Shot) -> Result<(), E>,
        sink: impl FnMut(usize, &Shot) -> Result<(), E> + Send,
    ) -> Result<(), E> {
        let [width, height] = self.view.size_px;
        let n_bytes = match self.format {
            PixelFormat::Planar(_) => Frame::n_bytes(width, height),
            PixelFormat::Straight => 4 * width as usize * height as usize,
        };
        let draw = |frame_idx: usize, shot: &mut Shot| self.render(frame_idx, shot);
        draw_ahead(self.n_frames, n_bytes, prepare, draw, sink)
    }

    fn take_workspace(&self) -> Workspace {
        let spare = self
            .workspaces
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        spare.unwrap_or_else(|| Workspace {
            canvas: Canvas::new(self.view.size_px[0], self.view.size_px[1]),
            cover: Coverage::new(self.view.size_px),
            boxes: Vec::new(),
            painter: Painter::default(),
            shade: Shade::default(),
            drawn: Vec::new(),
        })
    }

    /// Returns the individuals from near to far. At equal depth the larger id is nearer.
    fn near_to_far(&self, frame_idx: usize) -> Vec<Appearance<'a>> {
        let depth = |individual: &&Individual| match &individual.depth_m {
            Some(depth_m) => depth_m[frame_idx],
            None => individual.boid.position_px[frame_idx][2],
        };
        let mut order: Vec<&'a Individual> = self.flock.individuals.iter().collect();
        order.sort_by(|a, b| depth(a).total_cmp(&depth(b)).then(b.id.cmp(&a.id)));
        let appearance = |individual: &'a Individual| Appearance {
            individual,
            frame_idx,
            fade: self.fade_at[individual.id as usize][frame_idx]
                .map(|idx| &individual.fades[idx as usize]),
        };
        order.into_iter().map(appearance).collect()
    }

    fn context(&self) -> DrawContext<'_> {
        DrawContext {
            sprites: &self.library.sprites,
            sprite_cache: &self.sprite_cache,
            view: self.view,
            cpu: self.cpu,
            cut: self.flock.params.render.cut,
            haze: self.haze,
        }
    }

    fn draw(&self, appearance: &Appearance, workspace: &mut Workspace) {
        let context = self.context();
        let outlines = self.shadows.as_ref().is_some_and(Shadows::are_outlines);
        if self.truth.is_some() || outlines {
            // The ground truth and outline shadows need whole sprites, hidden parts included.
            workspace.painter.paint(&context, appearance, None);
            workspace.draw_layer(self.cpu);
        }
        if let Some(shadows) = &self.shadows {
            shadows.add(
                appearance,
                &workspace.painter.layer,
                &self.view,
                &mut workspace.shade,
            );
        }
        if let Some(keypoints) = &self.truth {
            let drawn = workspace.painter.drawn(&context, appearance, keypoints);
            workspace.drawn.push(drawn);
        }
        if self.truth.is_some() || outlines {
            return;
        }
        let Workspace {
            painter,
            canvas,
            cover,
            boxes,
            ..
        } = workspace;
        let rect = painter.paint_under(&context, appearance, canvas, cover);
        boxes.extend((!rect.is_empty()).then_some(rect));
    }
}

impl Workspace {
    /// Draws the painter's layer under the content of the canvas.
    fn draw_layer(&mut self, cpu: Level) {
        let layer = &self.painter.layer;
        self.canvas.draw_layer_under(layer, &mut self.cover, cpu);
        if !layer.rect.is_empty() {
            self.boxes.push(layer.rect);
        }
    }
}

/// Returns by frame the index of the fade that is active.
fn fades_by_frame(individual: &Individual) -> Vec<Option<u32>> {
    let mut fade_at = vec![None; individual.source_frame.len()];
    for (idx, fade) in (0u32..).zip(&individual.fades) {
        let start = fade.start as usize;
        fade_at[start..start + fade.weight.len()].fill(Some(idx));
    }
    fade_at
}

/// Merges boxes whose common bounding box is no larger than their areas together. Few pixels are then
/// processed twice.
fn merge_overlapping(rects: &mut Vec<Rect>) {
    let mut at = 0;
    while at < rects.len() {
        let overlapping = (at + 1..rects.len()).find(|&other| {
            let union = rects[at].union(&rects[other]).area();
            union <= rects[at].area() + rects[other].area()
        });
        match overlapping {
            Some(other) => {
                let merged = rects.swap_remove(other);
                rects[at] = rects[at].union(&merged);
            }
            None => at += 1,
        }
    }
}

#[cfg(test)]
mod tests;
