//! The film of a flock: real frames over the background, only where something is drawn
//! (ALGORITHMS.md 8).
//!
//! Sprites are drawn near to far, each under those before it, premultiplied, by Catmull-Rom interpolation:
//! what is hidden costs nothing, and whole pixels without rotation come out as they are. A frame starts
//! from the background already in the encoder's form; what is drawn is converted tile by tile, so the cost
//! follows the area seen. The ground truth comes from the same layers.

mod backdrop; // what lies behind
mod bleed; // color beyond the edges of alpha
mod draw_ahead; // the frames of a film, in order
mod front; // what stands before all
mod layer; // one individual in one frame
mod morph; // two sprites bent to each other at a jump
pub mod params;
mod shadow; // below all
mod stock; // sprites ready to be drawn
pub mod truth; // what of whom can be seen
mod view; // from pixels of the footage to those of the film

use std::sync::{Mutex, PoisonError};

use self::backdrop::Backdrop;
use self::bleed::bleed;
use self::draw_ahead::draw_ahead;
use self::front::Front;
use self::layer::{Appearance, Haze, Painter, Stage};
use self::params::Background;
use self::shadow::{Shade, Shadows};
use self::stock::Stock;
use self::truth::{Drawn, FrameTruth};
use self::view::View;
use super::individual::{Fade, Individual};
use super::{Flock, Library};
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::canvas::{Cover, opaque};
use crate::raster::{Canvas, ColorSpec, Frame, RgbImage, RgbaImage};

/// Draws the frames of a flock, any of them from any thread.
pub struct Compositor<'a> {
    library: &'a Library,
    flock: &'a Flock,
    view: View,
    form: Form,
    with_truth: bool,
    backdrop: Backdrop,
    haze: Option<Haze>,
    shadows: Option<Shadows>,
    stock: Stock,
    cpu: Level,
    n_frames: usize,
    /// Per individual and output frame: which of its fades concerns it.
    fade_at: Vec<Vec<Option<u32>>>,
    desks: Mutex<Vec<Desk>>,
}

/// The form in which frames are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Opaque planes, as an encoder takes them.
    Planar(ColorSpec),
    /// Straight-alpha RGBA.
    Straight,
}

/// One frame of the film, in the form asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shot {
    /// The planes; empty in the form `Straight`.
    pub frame: Frame,
    /// RGBA, by rows; empty in the form `Planar`.
    pub rgba: Vec<u8>,
    /// What of whom can be seen, where that was asked for.
    pub truth: FrameTruth,
    /// What lies behind this frame alone, filling the film; empty = the film's own backdrop.
    pub behind: Frame,
}

/// What one thread draws on and with, kept from frame to frame.
struct Desk {
    /// Everyone drawn so far, the nearest first, on nothing.
    canvas: Canvas,
    /// What of the canvas has been drawn on.
    cover: Cover,
    /// The boxes of everyone, where color is to go beyond edges.
    boxes: Vec<Rect>,
    painter: Painter,
    shade: Shade,
    drawn: Vec<Drawn>,
}

impl<'a> Compositor<'a> {
    /// Ready to draw as the flock's own `render` parameters say, in the usual planes; over the plate
    /// where they ask for nothing behind.
    pub fn new(library: &'a Library, flock: &'a Flock) -> Compositor<'a> {
        let render = &flock.params.render;
        let size_px = render.size_px.unwrap_or(flock.image_size_px);
        let view = View::fitted(flock.image_size_px, size_px);
        let background = match render.background {
            Background::Transparent => Background::Plate,
            other => other,
        };
        let form = Form::Planar(ColorSpec::default());
        Compositor {
            library,
            flock,
            view,
            form,
            with_truth: false,
            backdrop: Backdrop::of(background, scene_of(library), &view, form),
            haze: (render.haze_per_bl > 0.0).then(|| Haze {
                left_per_px: libm::pow(1.0 - render.haze_per_bl, 1.0 / flock.length_px),
                color: opaque(backdrop::mean(&library.background)),
            }),
            shadows: Shadows::of(library, flock),
            stock: Stock::default(),
            cpu: Level::detect(),
            n_frames: (flock.individuals.first()).map_or(0, |one| one.source_frame.len()),
            fade_at: flock.individuals.iter().map(fades_by_frame).collect(),
            desks: Mutex::default(),
        }
    }

    /// The same in straight-alpha RGBA, with nothing behind where the parameters ask for that.
    pub fn straight(mut self) -> Compositor<'a> {
        self.form = Form::Straight;
        let background = self.flock.params.render.background;
        self.behind(background)
    }

    /// The same, telling the ground truth of every frame.
    pub fn with_truth(mut self) -> Compositor<'a> {
        self.with_truth = true;
        self
    }

    /// The same before a picture, cut to the film's shape.
    pub fn before(mut self, picture: &RgbImage) -> Compositor<'a> {
        self.backdrop = Backdrop::picture(picture, self.view.size_px, self.form);
        self
    }

    fn behind(mut self, background: Background) -> Compositor<'a> {
        let scene = scene_of(self.library);
        self.backdrop = Backdrop::of(background, scene, &self.view, self.form);
        self
    }

    /// The same, but no more than `n_frames` of it.
    pub fn first(mut self, n_frames: usize) -> Compositor<'a> {
        self.n_frames = self.n_frames.min(n_frames);
        self
    }

    /// Frames of the film.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Width and height of the film.
    pub fn size_px(&self) -> [u32; 2] {
        self.view.size_px
    }

    /// Draws one frame.
    pub fn render(&self, frame_idx: usize, shot: &mut Shot) {
        let mut desk = self.take_desk();
        desk.drawn.clear();
        if self.shadows.is_some() {
            desk.shade.begin(self.view.size_px);
        }
        let order = self.near_to_far(frame_idx);
        for who in &order {
            self.draw(who, &mut desk);
        }
        if self.shadows.is_some() {
            desk.shade.layer(&mut desk.painter.layer);
            desk.put(self.cpu);
        }
        if self.with_truth {
            let shade = self.shadows.as_ref().map(|_| desk.shade.alpha());
            shot.truth = FrameTruth::of(&desk.drawn, shade, self.view.size_px, self.left(shot));
        }
        self.develop(&mut desk, shot);
        self.desks
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(desk);
    }

    /// What stands before everyone in a shot.
    fn front(&self, shot: &Shot) -> Option<&Front> {
        let front = self.backdrop.front.as_ref();
        front.filter(|_| shot.behind.planes.is_empty())
    }

    /// How much of each pixel of a shot is left for everyone, 16384ths.
    fn left(&self, shot: &Shot) -> Vec<u16> {
        let [width, height] = self.view.size_px.map(|side| side as usize);
        match self.front(shot) {
            Some(front) => front.left(),
            None => vec![truth::ONE as u16; width * height],
        }
    }

    /// Turns what is on the desk into the form asked for, and wipes it off.
    fn develop(&self, desk: &mut Desk, shot: &mut Shot) {
        self.backdrop.begin(shot);
        let own = (!shot.behind.planes.is_empty())
            .then(|| backdrop::filling(&shot.behind.to_rgb(), self.view.size_px));
        if own.is_some() {
            desk.cover.touch_all();
        }
        let behind = own.as_ref().unwrap_or(&self.backdrop.canvas);
        for rect in desk.cover.take() {
            desk.canvas.under_box(behind, rect, self.cpu);
            if let Some(front) = self.front(shot) {
                front.draw(&mut desk.canvas, rect);
            }
            match self.form {
                Form::Planar(_) => shot.frame.draw_canvas(&desk.canvas, rect, self.cpu),
                Form::Straight => desk.canvas.straight_into(rect, &mut shot.rgba),
            }
            desk.canvas.clear_box(rect);
        }
        if self.form == Form::Straight && self.backdrop.is_clear {
            merge_overlapping(&mut desk.boxes);
            for &rect in &desk.boxes {
                bleed(&mut shot.rgba, self.view.size_px, rect);
            }
        }
        desk.boxes.clear();
    }

    /// Draws every frame on all threads and gives each to `sink`, in order. Before a frame is drawn `prepare` may say
    /// what lies behind it. Either may refuse: then its error comes back.
    pub fn render_all<E: Send>(
        &self,
        prepare: impl FnMut(usize, &mut Shot) -> Result<(), E>,
        sink: impl FnMut(usize, &Shot) -> Result<(), E> + Send,
    ) -> Result<(), E> {
        let [width, height] = self.view.size_px;
        let n_bytes = match self.form {
            Form::Planar(_) => Frame::n_bytes(width, height),
            Form::Straight => 4 * width as usize * height as usize,
        };
        let draw = |frame_idx: usize, shot: &mut Shot| self.render(frame_idx, shot);
        draw_ahead((self.n_frames, n_bytes), prepare, draw, sink)
    }

    fn take_desk(&self) -> Desk {
        let spare = self
            .desks
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        spare.unwrap_or_else(|| Desk {
            canvas: Canvas::new(self.view.size_px[0], self.view.size_px[1]),
            cover: Cover::none(self.view.size_px),
            boxes: Vec::new(),
            painter: Painter::default(),
            shade: Shade::default(),
            drawn: Vec::new(),
        })
    }

    /// Ties by id: the greater one is nearer.
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

    fn stage(&self) -> Stage<'_> {
        Stage {
            sprites: &self.library.sprites,
            stock: &self.stock,
            view: self.view,
            cpu: self.cpu,
            cut: self.flock.params.render.cut,
            haze: self.haze,
        }
    }

    fn draw(&self, who: &Appearance, desk: &mut Desk) {
        let stage = self.stage();
        let outlines = self.shadows.as_ref().is_some_and(Shadows::are_outlines);
        if self.with_truth || outlines {
            // Both ask for everyone whole.
            desk.painter.paint(&stage, who, None);
            desk.put(self.cpu);
        }
        if let Some(shadows) = &self.shadows {
            shadows.add(who, &desk.painter.layer, &self.view, &mut desk.shade);
        }
        if self.with_truth {
            desk.drawn.push(desk.painter.drawn(&stage, who));
        }
        if self.with_truth || outlines {
            return;
        }
        let Desk {
            painter,
            canvas,
            cover,
            boxes,
            ..
        } = desk;
        let rect = painter.paint_under(&stage, who, canvas, cover);
        boxes.extend((!rect.is_empty()).then_some(rect));
    }
}

impl Desk {
    /// Puts what the painter has drawn under what is on the canvas.
    fn put(&mut self, cpu: Level) {
        let layer = &self.painter.layer;
        self.canvas.under(layer, &mut self.cover, cpu);
        if !layer.rect.is_empty() {
            self.boxes.push(layer.rect);
        }
    }
}

/// The plate, and what stands before everyone in it.
fn scene_of(library: &Library) -> (&RgbImage, Option<&RgbaImage>) {
    (&library.background, library.occluders.as_ref())
}

fn fades_by_frame(individual: &Individual) -> Vec<Option<u32>> {
    let mut fade_at = vec![None; individual.source_frame.len()];
    for (idx, fade) in (0u32..).zip(&individual.fades) {
        mark(&mut fade_at, fade, idx);
    }
    fade_at
}

fn mark(fade_at: &mut [Option<u32>], fade: &Fade, idx: u32) {
    let start = fade.start as usize;
    for at in &mut fade_at[start..start + fade.weight.len()] {
        *at = Some(idx);
    }
}

/// Boxes that overlap by much become one, so that few pixels are gone over twice.
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
