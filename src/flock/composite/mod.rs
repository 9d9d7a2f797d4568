//! The film of a flock: real frames over the background, only where something is drawn
//! (ALGORITHMS.md 8).
//!
//! Sprites are drawn far to near, ties by id, premultiplied, by Catmull-Rom interpolation; whole
//! pixels without rotation come out as they are. A frame starts from the background already in the
//! encoder's form; what is drawn is converted box by box, so the cost follows the area drawn. The ground
//! truth comes from the same layers.

mod backdrop; // what lies behind
mod layer; // one individual in one frame
pub mod params;
pub mod truth; // what of whom can be seen
mod view; // from pixels of the footage to those of the film

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use self::backdrop::Backdrop;
use self::layer::{Appearance, Painter, Scene};
use self::params::Background;
use self::truth::{Drawn, FrameTruth};
use self::view::View;
use super::individual::{Fade, Individual};
use super::{Flock, Library};
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::{Canvas, ColorSpec, Frame, RgbImage};

/// Draws the frames of a flock, any of them from any thread.
pub struct Compositor<'a> {
    library: &'a Library,
    flock: &'a Flock,
    view: View,
    form: Form,
    with_truth: bool,
    backdrop: Backdrop,
    cpu: Level,
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
}

/// What one thread draws on and with, kept from frame to frame.
struct Desk {
    canvas: Canvas,
    dirty: Vec<Rect>,
    painter: Painter,
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
            backdrop: Backdrop::of(background, &library.background, &view, form),
            cpu: Level::detect(),
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
        let plate = &self.library.background;
        self.backdrop = Backdrop::of(background, plate, &self.view, self.form);
        self
    }

    /// Frames of the film.
    pub fn n_frames(&self) -> usize {
        self.flock
            .individuals
            .first()
            .map_or(0, |individual| individual.source_frame.len())
    }

    /// Width and height of the film.
    pub fn size_px(&self) -> [u32; 2] {
        self.view.size_px
    }

    /// Draws one frame.
    pub fn render(&self, frame_idx: usize, shot: &mut Shot) {
        let mut desk = self.take_desk();
        for rect in std::mem::take(&mut desk.dirty) {
            desk.canvas.copy_box(&self.backdrop.canvas, rect);
        }
        desk.drawn.clear();
        for individual in self.far_to_near(frame_idx) {
            self.draw(individual, frame_idx, &mut desk);
        }
        if self.with_truth {
            shot.truth = FrameTruth::of(&desk.drawn, self.view.size_px);
        }
        merge_overlapping(&mut desk.dirty);
        self.backdrop.begin(shot);
        for &rect in &desk.dirty {
            match self.form {
                Form::Planar(_) => shot.frame.draw_canvas(&desk.canvas, rect),
                Form::Straight => desk.canvas.straight_into(rect, &mut shot.rgba),
            }
        }
        self.desks
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(desk);
    }

    /// Draws every frame in order on all threads and gives each to `sink`, which may refuse: then
    /// its error comes back. While one batch is taken, the next is drawn.
    pub fn render_all<E: Send>(
        &self,
        mut sink: impl FnMut(usize, &Shot) -> Result<(), E> + Send,
    ) -> Result<(), E> {
        let batch = 2 * rayon::current_num_threads();
        let draw = |from: usize, shots: &mut [Shot]| {
            let indexed = shots.par_iter_mut().enumerate();
            indexed.for_each(|(k, shot)| {
                if from + k < self.n_frames() {
                    self.render(from + k, shot);
                }
            });
        };
        let mut ready = vec![Shot::default(); batch];
        let mut coming = vec![Shot::default(); batch];
        draw(0, &mut ready);
        for from in (0..self.n_frames()).step_by(batch) {
            let n_ready = batch.min(self.n_frames() - from);
            let (taken, ()) = rayon::join(
                || {
                    (from..)
                        .zip(&ready[..n_ready])
                        .try_for_each(|(k, f)| sink(k, f))
                },
                || draw(from + batch, &mut coming),
            );
            taken?;
            std::mem::swap(&mut ready, &mut coming);
        }
        Ok(())
    }

    fn take_desk(&self) -> Desk {
        let spare = self
            .desks
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        spare.unwrap_or_else(|| Desk {
            canvas: self.backdrop.canvas.clone(),
            dirty: Vec::new(),
            painter: Painter::default(),
            drawn: Vec::new(),
        })
    }

    fn far_to_near(&self, frame_idx: usize) -> Vec<&Individual> {
        let depth = |individual: &&Individual| match &individual.depth_m {
            Some(depth_m) => depth_m[frame_idx],
            None => individual.boid.position_px[frame_idx][2],
        };
        let mut order: Vec<&Individual> = self.flock.individuals.iter().collect();
        order.sort_by(|a, b| depth(b).total_cmp(&depth(a)).then(a.id.cmp(&b.id)));
        order
    }

    fn draw(&self, individual: &Individual, frame_idx: usize, desk: &mut Desk) {
        let scene = Scene {
            sprites: &self.library.sprites,
            view: self.view,
            cpu: self.cpu,
        };
        let fade = self.fade_at[individual.id as usize][frame_idx];
        let who = Appearance {
            individual,
            frame_idx,
            fade: fade.map(|idx| &individual.fades[idx as usize]),
        };
        desk.painter.paint(&scene, &who);
        let layer = &desk.painter.layer;
        desk.canvas.over(layer, self.cpu);
        if !layer.rect.is_empty() {
            desk.dirty.push(layer.rect);
        }
        if self.with_truth {
            let drawn = desk.painter.drawn(&scene, &who);
            desk.drawn.push(drawn);
        }
    }
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

/// Boxes that overlap by much become one, so that few pixels are converted twice.
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
