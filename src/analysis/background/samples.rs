//! Frames spread evenly through the footage, kept in memory while the plate is made of them.
//!
//! At most 64, so that a pixel's samples fit the bits of one word, and no more than fit a budget of
//! memory: a 4K footage gets fewer.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::{Occupancy, Plate, SIGMA_FLOOR};
use crate::analysis::{Error, LEAST_FRAMES, light, silhouette};
use crate::footage::FrameSource;
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::Frame;
use crate::raster::runs::Component;

const MOST: usize = 64;
const LEAST: usize = 16;
const BUDGET_BYTES: usize = 160 << 20;

pub(super) struct Samples {
    pub(super) frames: Vec<Frame>,
}

impl Samples {
    /// Reads the footage once and keeps frames spread evenly over it.
    pub(super) fn spread(
        source: &dyn FrameSource,
        progress: &dyn Progress,
    ) -> Result<Samples, Error> {
        let format = source.format();
        let n_bytes = Frame::n_bytes(format.width, format.height);
        let n_kept = (BUDGET_BYTES / n_bytes).clamp(LEAST, MOST);
        let mut frames = Vec::with_capacity(n_kept);
        source.spread(n_kept, &mut |frame| {
            frames.push(frame.clone());
            progress.report("background", frames.len() as f64 / n_kept as f64);
            match progress.cancelled() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })?;
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if format.n_frames_hint < LEAST_FRAMES || frames.is_empty() {
            return Err(Error::TooFewFrames {
                n_frames: format.n_frames_hint,
                least: LEAST_FRAMES,
            });
        }
        Ok(Samples { frames })
    }

    /// Pixels of a frame.
    pub(super) fn n_px(&self) -> usize {
        self.frames[0].width as usize * self.frames[0].height as usize
    }

    /// A word with a bit for every sample.
    pub(super) fn all_bits(&self) -> u64 {
        u64::MAX >> (64 - self.frames.len())
    }

    /// Divides every sample's light by its gain over the plate, so that flicker is not noise.
    pub(super) fn even_out_light(&mut self, plate: &Plate) {
        self.frames.par_iter_mut().for_each(|frame| {
            let gain = light::gain(frame, plate, Rect::default());
            gain.undo(frame);
        });
    }

    /// The components of every sample, whose light is even already.
    pub(super) fn components(&self, plate: &Plate) -> Vec<Vec<Component>> {
        let whole = Rect::of_size(plate.frame.width, plate.frame.height);
        let of = |frame: &Frame| silhouette::components(frame, plate, &light::Gain::ONE, whole);
        self.frames.par_iter().map(of).collect()
    }

    /// The median of every sample of every plane.
    pub(super) fn median_frame(&self) -> Frame {
        self.each_value(|values, _| median(values))
    }

    /// The median over the samples in which the pixel is free; where it is free in none, as before.
    pub(super) fn median_where_free(&self, before: &Frame, seen: &Occupancy) -> Frame {
        let all = self.all_bits();
        self.each_value(|values, at| {
            let free = self.free_at(at, seen, all);
            if free == all {
                return median(values);
            }
            let mut kept = [0; MOST];
            let kept = keep(values, free, &mut kept);
            if kept.is_empty() {
                before.planes[at]
            } else {
                median(kept)
            }
        })
    }

    /// The noise of each pixel over its free samples: 1.4826 times the median absolute deviation,
    /// luma and chroma added as they add in RGB, at least the floor (ALGORITHMS.md 2.4). Where scenery
    /// sways the values gather at two places and the median says nothing: there it is what a normal
    /// distribution with the same 90th percentile would have.
    pub(super) fn noise(&self, plate: &Frame, seen: &Occupancy) -> Vec<f32> {
        let all = self.all_bits();
        let deviation = self.each_value(|values, at| {
            let mut kept = [0; MOST];
            let kept = keep(values, self.free_at(at, seen, all), &mut kept);
            if kept.is_empty() {
                return 0;
            }
            kept.iter_mut()
                .for_each(|value| *value = value.abs_diff(plate.planes[at]));
            if self.sways(at, seen) {
                let rank = kept.len() * 9 / 10;
                return (f32::from(*kept.select_nth_unstable(rank).1) * 0.41).ceil() as u8;
            }
            median(kept)
        });
        let (u, v) = deviation.chroma();
        let width = plate.width as usize;
        let sigma = |px: usize| {
            let at = (px / width / 2) * plate.chroma_width() as usize + px % width / 2;
            let (y, c) = (f32::from(deviation.luma()[px]), f32::from(u[at].max(v[at])));
            (1.4826 * (y * y * 1.36 + c * c * 4.0).sqrt()).max(SIGMA_FLOOR)
        };
        (0..self.n_px()).map(sigma).collect()
    }

    /// The samples in which the value at `at` (of any plane) is free; a chroma value stands for four
    /// pixels and is free where all of them are.
    fn free_at(&self, at: usize, seen: &Occupancy, all: u64) -> u64 {
        if at < self.n_px() {
            return seen.free(at, all);
        }
        self.pixels_of_chroma(at)
            .iter()
            .fold(all, |free, &px| free & seen.free(px, all))
    }

    /// Whether scenery sways at the value at `at` (of any plane).
    fn sways(&self, at: usize, seen: &Occupancy) -> bool {
        if at < self.n_px() {
            return seen.scenery[at];
        }
        self.pixels_of_chroma(at).iter().any(|&px| seen.scenery[px])
    }

    fn pixels_of_chroma(&self, at: usize) -> [usize; 4] {
        let frame = &self.frames[0];
        let (w, h) = (frame.width as usize, frame.height as usize);
        let chroma_width = frame.chroma_width() as usize;
        let at = (at - self.n_px()) % (chroma_width * h.div_ceil(2));
        let (x, y) = (2 * (at % chroma_width), 2 * (at / chroma_width));
        let (x1, y1) = ((x + 1).min(w - 1), (y + 1).min(h - 1));
        [y * w + x, y * w + x1, y1 * w + x, y1 * w + x1]
    }

    /// A frame each of whose values is made of the samples' values at the same place.
    fn each_value(&self, value: impl Fn(&mut [u8], usize) -> u8 + Sync) -> Frame {
        const CHUNK: usize = 4096;
        let mut result = self.frames[0].clone();
        result
            .planes
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, values)| {
                let mut column = [0; MOST];
                let column = &mut column[..self.frames.len()];
                for (slot, at) in values.iter_mut().zip(chunk * CHUNK..) {
                    for (value, frame) in column.iter_mut().zip(&self.frames) {
                        *value = frame.planes[at];
                    }
                    *slot = value(column, at);
                }
            });
        result
    }
}

/// The values whose bit is set, gathered at the front of `kept`.
fn keep<'a>(values: &[u8], bits: u64, kept: &'a mut [u8; MOST]) -> &'a mut [u8] {
    let mut n = 0;
    for (k, &value) in values.iter().enumerate() {
        kept[n] = value;
        n += (bits >> k & 1) as usize;
        if n == MOST {
            break;
        }
    }
    &mut kept[..n]
}

/// The lower median; reorders the values. Panics when there are none.
fn median(values: &mut [u8]) -> u8 {
    let middle = (values.len() - 1) / 2;
    *values.select_nth_unstable(middle).1
}
