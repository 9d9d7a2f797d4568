//! The film of a flock: real frames over the background, only where something is drawn
//! (ALGORITHMS.md 8).
//!
//! Sprites are drawn far to near, ties by id, premultiplied, by Catmull-Rom interpolation; whole
//! pixels without rotation come out as they are. A frame starts from the background already in the
//! encoder's form; what is drawn is converted box by box, so the cost follows the area drawn.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::individual::{Fade, Individual};
use super::{Flock, Library};
use crate::geometry::Rect;
use crate::raster::blend::{mix, over};
use crate::raster::resample::{Placement, Premultiplied, Resampled};
use crate::raster::{ColorSpec, Frame, RgbImage};

/// Draws the frames of a flock, any of them from any thread.
pub struct Compositor<'a> {
    library: &'a Library,
    flock: &'a Flock,
    plate: Frame,
    /// Per individual and output frame: which of its fades concerns it.
    fade_at: Vec<Vec<Option<u32>>>,
    canvases: Mutex<Vec<Canvas>>,
}

/// What one thread draws on, kept from frame to frame.
struct Canvas {
    image: RgbImage,
    dirty: Vec<Rect>,
    straight: Vec<u8>,
    sprite: Premultiplied,
    main: Resampled,
    second: Resampled,
}

impl<'a> Compositor<'a> {
    /// Ready to draw in the usual color form.
    pub fn new(library: &'a Library, flock: &'a Flock) -> Compositor<'a> {
        Compositor::with_color(library, flock, ColorSpec::default())
    }

    /// Ready to draw in a given color form.
    pub fn with_color(library: &'a Library, flock: &'a Flock, color: ColorSpec) -> Compositor<'a> {
        let background = &library.background;
        let mut plate = Frame::new(background.width, background.height, color);
        plate.draw_rgb(
            background,
            Rect::of_size(background.width, background.height),
        );
        Compositor {
            library,
            flock,
            plate,
            fade_at: flock.individuals.iter().map(fades_by_frame).collect(),
            canvases: Mutex::new(Vec::new()),
        }
    }

    /// Frames of the film.
    pub fn n_frames(&self) -> usize {
        self.flock
            .individuals
            .first()
            .map_or(0, |individual| individual.source_frame.len())
    }

    /// Draws one frame. Its size and color form become those of the film.
    pub fn render(&self, frame_idx: usize, frame: &mut Frame) {
        let mut canvas = self.take_canvas();
        for rect in std::mem::take(&mut canvas.dirty) {
            copy_box(&self.library.background, &mut canvas.image, rect);
        }
        for individual in self.far_to_near(frame_idx) {
            self.draw(individual, frame_idx, &mut canvas);
        }
        frame.clone_from(&self.plate);
        merge_overlapping(&mut canvas.dirty);
        for &rect in &canvas.dirty {
            frame.draw_rgb(&canvas.image, rect);
        }
        self.canvases
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(canvas);
    }

    /// Draws every frame in order on all threads and gives each to `sink`, which may refuse: then
    /// its error comes back. While one batch is taken, the next is drawn.
    pub fn render_all<E: Send>(
        &self,
        mut sink: impl FnMut(usize, &Frame) -> Result<(), E> + Send,
    ) -> Result<(), E> {
        let batch = 2 * rayon::current_num_threads();
        let draw = |from: usize, frames: &mut [Frame]| {
            let indexed = frames.par_iter_mut().enumerate();
            indexed.for_each(|(k, frame)| {
                if from + k < self.n_frames() {
                    self.render(from + k, frame);
                }
            });
        };
        let mut ready = vec![Frame::default(); batch];
        let mut coming = vec![Frame::default(); batch];
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

    fn take_canvas(&self) -> Canvas {
        let spare = self
            .canvases
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        spare.unwrap_or_else(|| Canvas {
            image: self.library.background.clone(),
            dirty: Vec::new(),
            straight: Vec::new(),
            sprite: Premultiplied::default(),
            main: Resampled::default(),
            second: Resampled::default(),
        })
    }

    fn far_to_near(&self, frame_idx: usize) -> Vec<&Individual> {
        let depth = |individual: &&Individual| individual.boid.position_px[frame_idx][2];
        let mut order: Vec<&Individual> = self.flock.individuals.iter().collect();
        order.sort_by(|a, b| depth(b).total_cmp(&depth(a)).then(a.id.cmp(&b.id)));
        order
    }

    fn draw(&self, individual: &Individual, t: usize, canvas: &mut Canvas) {
        let mut place = Placement {
            center_px: individual.centroid_px[t],
            rotation_rad: individual.rotation_rad[t],
            scale: individual.scale[t],
            mirrored: individual.mirrored[t],
        };
        let size = [canvas.image.width, canvas.image.height];
        self.premultiply(individual.source_frame[t], canvas);
        canvas.main.draw(&canvas.sprite, &place, size);
        let fade = self.fade_at[individual.id as usize][t];
        if let Some(fade) = fade.map(|idx| &individual.fades[idx as usize]) {
            let k = t - fade.start as usize;
            place.rotation_rad = fade.rotation_rad[k];
            place.scale = fade.scale[k];
            place.mirrored = fade.mirrored;
            self.premultiply(fade.source_frame[k], canvas);
            canvas.second.draw(&canvas.sprite, &place, size);
            mix(&mut canvas.main, &canvas.second, fade.weight[k] as f32);
        }
        over(&mut canvas.image, &canvas.main);
        if !canvas.main.rect.is_empty() {
            canvas.dirty.push(canvas.main.rect);
        }
    }

    fn premultiply(&self, frame: u32, canvas: &mut Canvas) {
        let (sprites, idx) = (&self.library.sprites, frame as usize);
        sprites.read(idx, &mut canvas.straight);
        let size = [sprites.width(), sprites.height()];
        canvas
            .sprite
            .fill(&canvas.straight, size, sprites.bounds(idx));
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

fn copy_box(from: &RgbImage, to: &mut RgbImage, rect: Rect) {
    let stride = from.width as usize * 3;
    let n = rect.w as usize * 3;
    for y in rect.y..rect.bottom() {
        let at = y as usize * stride + rect.x as usize * 3;
        to.pixels[at..at + n].copy_from_slice(&from.pixels[at..at + n]);
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
