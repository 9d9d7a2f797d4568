//! Frames spread evenly through the footage, kept in memory while the plate is made of them.
//!
//! At most 64, so that a pixel's samples fit the bits of one word, and no more than fit a budget of
//! memory: a 4K footage gets fewer.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::ranks::{self, MOST, Wanted};
use super::{Occupancy, Plate, SIGMA_FLOOR};
use crate::analysis::{Error, LEAST_FRAMES, light, silhouette};
use crate::footage::FrameSource;
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::Frame;
use crate::raster::runs::Component;

const LEAST: usize = 16;
const BUDGET_BYTES: usize = 128 << 20;

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
            let gain = light::gain(frame, plate);
            gain.undo(frame);
        });
    }

    /// The components of every sample, whose light is even already.
    pub(super) fn components(&self, plate: &Plate) -> Vec<Vec<Component>> {
        let whole = Rect::of_size(plate.frame.width, plate.frame.height);
        let of =
            |frame: &Frame| silhouette::components(frame, plate, &light::Gain::ONE, [whole; 2]);
        self.frames.par_iter().map(of).collect()
    }

    /// The median of every sample of every plane.
    pub(super) fn median_frame(&self) -> Frame {
        let all = self.all_bits();
        self.each_row(None, |wanted, _, _| wanted.fill(Wanted::median(all)))
    }

    /// The median over the samples in which the pixel is free; where it is free in none, as before.
    pub(super) fn median_where_free(&self, before: &Frame, seen: &Occupancy) -> Frame {
        let all = self.all_bits();
        let mut result = self.each_row(None, |wanted, plane, row| {
            for (x, wanted) in wanted.iter_mut().enumerate() {
                *wanted = Wanted::median(self.free_at(plane, x, row, seen, all));
            }
        });
        for at in self.never_free(&result, seen) {
            result.planes[at] = before.planes[at];
        }
        result
    }

    /// The noise of each pixel over its free samples: 1.4826 times the median absolute deviation,
    /// luma and chroma added as they add in RGB, at least the floor (ALGORITHMS.md 2.4). Where scenery
    /// sways the values gather at two places and the median says nothing: there it is what a normal
    /// distribution with the same 90th percentile would have.
    pub(super) fn noise(&self, plate: &Frame, seen: &Occupancy) -> Vec<f32> {
        let all = self.all_bits();
        let sways_anywhere = seen.scenery.contains(&true);
        let mut deviation = self.each_row(Some(plate), |wanted, plane, row| {
            for (x, wanted) in wanted.iter_mut().enumerate() {
                let free = self.free_at(plane, x, row, seen, all);
                *wanted = Wanted::median(free);
                if sways_anywhere && free != 0 && self.sways(plane, x, row, seen) {
                    wanted.rank = (free.count_ones() * 9 / 10) as u8;
                }
            }
        });
        for at in self.never_free(&deviation, seen) {
            deviation.planes[at] = 0;
        }
        if sways_anywhere {
            self.each_place(|at, plane, x, row| {
                if self.sways(plane, x, row, seen) {
                    let value = &mut deviation.planes[at];
                    *value = (f32::from(*value) * 0.41).ceil() as u8;
                }
            });
        }
        let (u, v) = deviation.chroma();
        let (width, chroma_width) = (plate.width as usize, plate.chroma_width() as usize);
        let mut sigma = vec![0.0; self.n_px()];
        let rows = sigma
            .par_chunks_mut(width)
            .zip(deviation.luma().par_chunks(width));
        rows.enumerate().for_each(|(y, (sigma, luma))| {
            let chroma = y / 2 * chroma_width;
            for (x, (sigma, &luma)) in sigma.iter_mut().zip(luma).enumerate() {
                let at = chroma + x / 2;
                let (y, c) = (f32::from(luma), f32::from(u[at].max(v[at])));
                *sigma = (1.4826 * (y * y * 1.36 + c * c * 4.0).sqrt()).max(SIGMA_FLOOR);
            }
        });
        sigma
    }

    /// The samples in which a value is free; a chroma value stands for four pixels and is free where
    /// all of them are.
    fn free_at(&self, plane: Plane, x: usize, y: usize, seen: &Occupancy, all: u64) -> u64 {
        match plane {
            Plane::Luma => seen.free(y * self.frames[0].width as usize + x, all),
            Plane::Chroma => self
                .pixels_of_chroma(x, y)
                .iter()
                .fold(all, |free, &px| free & seen.free(px, all)),
        }
    }

    /// Whether scenery sways at a value.
    fn sways(&self, plane: Plane, x: usize, y: usize, seen: &Occupancy) -> bool {
        match plane {
            Plane::Luma => seen.scenery[y * self.frames[0].width as usize + x],
            Plane::Chroma => self
                .pixels_of_chroma(x, y)
                .iter()
                .any(|&px| seen.scenery[px]),
        }
    }

    fn pixels_of_chroma(&self, x: usize, y: usize) -> [usize; 4] {
        let (w, h) = (
            self.frames[0].width as usize,
            self.frames[0].height as usize,
        );
        let (x0, y0) = (2 * x, 2 * y);
        let (x1, y1) = ((x0 + 1).min(w - 1), (y0 + 1).min(h - 1));
        [y0 * w + x0, y0 * w + x1, y1 * w + x0, y1 * w + x1]
    }

    /// Calls `visit` with the index of every value, its plane, column and row in it.
    fn each_place(&self, mut visit: impl FnMut(usize, Plane, usize, usize)) {
        let mut at = 0;
        for (plane, width, n_rows) in self.planes() {
            for y in 0..n_rows {
                for x in 0..width {
                    visit(at, plane, x, y);
                    at += 1;
                }
            }
        }
    }

    /// The indices of the values that are free in no sample, where `ranked` holds 255.
    fn never_free(&self, ranked: &Frame, seen: &Occupancy) -> Vec<usize> {
        let all = self.all_bits();
        let mut never = Vec::new();
        self.each_place(|at, plane, x, y| {
            if ranked.planes[at] == 255 && self.free_at(plane, x, y, seen, all) == 0 {
                never.push(at);
            }
        });
        never
    }

    /// Kind, width and number of rows of each plane, in the order of the frame's bytes.
    fn planes(&self) -> [(Plane, usize, usize); 3] {
        let frame = &self.frames[0];
        let (w, h) = (frame.width as usize, frame.height as usize);
        let chroma = (Plane::Chroma, frame.chroma_width() as usize, h.div_ceil(2));
        [(Plane::Luma, w, h), chroma, chroma]
    }

    /// A frame each of whose values is of the wanted rank among the samples' values at the same place, or
    /// among their distances from `base`. `want` fills in what is wanted of a row.
    fn each_row(
        &self,
        base: Option<&Frame>,
        want: impl Fn(&mut [Wanted], Plane, usize) + Sync,
    ) -> Frame {
        let mut result = self.frames[0].clone();
        let mut rest = result.planes.as_mut_slice();
        let mut first = 0;
        for (plane, width, n_rows) in self.planes() {
            let (values, others) = rest.split_at_mut(width * n_rows);
            values
                .par_chunks_mut(width)
                .enumerate()
                .for_each(|(y, row)| {
                    let mut wanted = vec![Wanted::default(); width];
                    want(&mut wanted, plane, y);
                    let bytes = first + y * width..first + (y + 1) * width;
                    let samples: Vec<&[u8]> = self
                        .frames
                        .iter()
                        .map(|f| &f.planes[bytes.clone()])
                        .collect();
                    let base = base.map(|base| &base.planes[bytes]);
                    ranks::ranked(&samples, base, &wanted, row);
                });
            first += width * n_rows;
            rest = others;
        }
        result
    }
}

/// Whether a value belongs to one pixel or to four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plane {
    Luma,
    Chroma,
}
