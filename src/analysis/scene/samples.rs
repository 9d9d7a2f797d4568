//! Samples: frames spread evenly over the footage, kept in memory to estimate the background
//! (docs/explanation/algorithms.md, "Background").
//!
//! There are at most 64, so that one bit per sample fits a 64-bit word. Large frames get fewer, down to 16,
//! to limit memory. The module also computes the median, the commonest value and the noise of each pixel over
//! the samples.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::occupancy::Occupancy;
use super::plate::SIGMA_FLOOR;
use super::ranks::{self, MOST, Wanted};
use super::states;
use super::thumbnail::Thumbnail;
use crate::analysis::params::AnimalAtParam;
use crate::analysis::{Error, MIN_FRAMES, Params};
use crate::footage::{FrameSource, spread_idx};
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::Frame;

/// Least number of samples, even where they exceed the memory budget. Free choice.
const LEAST: usize = 16;
/// Memory for the samples, bytes. Free choice.
const BUDGET_BYTES: usize = 128 << 20;

/// The samples of a footage.
pub(super) struct Samples {
    /// The frames; `Draft` equalizes their light.
    pub(super) frames: Vec<Frame>,
    /// Index of each sample in the footage.
    pub(super) frame_idx: Vec<usize>,
    /// For each sample the boxes that the parameter `ignore` excludes.
    pub(super) ignored: Vec<Vec<Rect>>,
    /// The sample and the point in it that the parameter `animal_at` gives, pixels.
    pub(super) pinned: Option<(usize, [f64; 2])>,
    /// Number in the footage of the frame with index 0.
    first_frame: usize,
    fps: f64,
}

impl Samples {
    /// Reads the footage once and keeps frames spread evenly over it. The frame that `animal_at` names
    /// replaces the sample nearest to it. Fails if the footage is too short, cannot be read or ends before
    /// that frame, or if `progress` is cancelled.
    pub(super) fn spread(
        source: &dyn FrameSource,
        params: &Params,
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
        if format.n_frames_hint < MIN_FRAMES || frames.is_empty() {
            return Err(Error::TooFewFrames {
                n_frames: format.n_frames_hint,
                least: MIN_FRAMES,
            });
        }
        let mut frame_idx = spread_idx(format.n_frames_hint, n_kept);
        frame_idx.truncate(frames.len());
        let pinned = match params.animal_at {
            Some(at) => Some((pin(source, at, &mut frames, &mut frame_idx)?, at.at_px)),
            None => None,
        };
        let size = [format.width, format.height];
        let first_frame = source.first_frame();
        let ignored =
            |&idx: &usize| params.ignored_at((first_frame + idx) as f64 / format.fps, size);
        Ok(Samples {
            ignored: frame_idx.iter().map(ignored).collect(),
            frames,
            frame_idx,
            pinned,
            first_frame,
            fps: format.fps,
        })
    }

    /// Returns the time of a sample, seconds from the start of the footage.
    pub(super) fn time_s(&self, k: usize) -> f64 {
        (self.first_frame + self.frame_idx[k]) as f64 / self.fps
    }

    /// Returns whether every sample comes with a mask of the animal.
    pub(super) fn are_masked(&self) -> bool {
        self.frames.iter().all(|frame| frame.mask.is_some())
    }

    /// Applies `change` to the samples of `part`, in parallel.
    pub(super) fn change(&mut self, part: u64, change: impl Fn(&mut Frame) + Sync) {
        let members = self.frames.par_iter_mut().enumerate();
        members
            .filter(|(k, _)| part >> k & 1 == 1)
            .for_each(|(_, frame)| change(frame));
    }

    /// Returns a thumbnail of every sample.
    pub(super) fn thumbnails(&self) -> Vec<Thumbnail> {
        self.frames.par_iter().map(Thumbnail::of).collect()
    }

    /// Returns the number of pixels of a frame.
    pub(super) fn n_px(&self) -> usize {
        self.frames[0].width as usize * self.frames[0].height as usize
    }

    /// Returns the median of the samples of `part`, value by value in each plane.
    pub(super) fn median_frame(&self, part: u64) -> Frame {
        self.each_row(part, None, false, |wanted, _, _| {
            wanted.fill(Wanted::median(part))
        })
    }

    /// Returns the commonest values of the samples of `part` (`ranks::want_commonest`).
    pub(super) fn commonest_frame(&self, part: u64) -> Frame {
        self.each_row(part, None, true, |wanted, _, _| {
            wanted.fill(Wanted::median(part))
        })
    }

    /// Returns the commonest values over the samples of `part` in which each value is free. Where it is free
    /// in fewer than `least` samples, the value of `before` stays.
    pub(super) fn median_where_free(
        &self,
        part: u64,
        before: &Frame,
        seen: &Occupancy,
        least: u32,
    ) -> Frame {
        let mut result = self.each_row(part, None, true, |wanted, plane, row| {
            for (x, wanted) in wanted.iter_mut().enumerate() {
                let free = self.free_at(plane, x, row, seen, part);
                let enough = free.count_ones() >= least;
                *wanted = Wanted::median(if enough { free } else { 0 });
            }
        });
        // Values without a wanted sample are 255.
        self.each_place(|at, plane, x, y| {
            if result.planes[at] == 255
                && self.free_at(plane, x, y, seen, part).count_ones() < least
            {
                result.planes[at] = before.planes[at];
            }
        });
        result
    }

    /// Returns the noise of each pixel over its free samples in `part`: one standard deviation, levels of
    /// 255, at least `SIGMA_FLOOR` (docs/explanation/algorithms.md, "Light and noise").
    ///
    /// Each sample is compared with its own background. The noise is 1.4826 times the median absolute
    /// deviation, with luma and chroma weighted by the conversion to RGB. Where scenery sways, the values
    /// cluster around two colors, and a median would miss one. There the 90th percentile replaces it, scaled
    /// by 0.41 as for a normal distribution.
    pub(super) fn noise(&self, part: u64, backgrounds: &[&Frame], seen: &Occupancy) -> Vec<f32> {
        let sways_anywhere = seen.scenery.contains(&true);
        let mut deviation = self.each_row(part, Some(backgrounds), false, |wanted, plane, row| {
            for (x, wanted) in wanted.iter_mut().enumerate() {
                let free = self.free_at(plane, x, row, seen, part);
                *wanted = Wanted::median(free);
                if sways_anywhere && free != 0 && self.sways(plane, x, row, seen) {
                    wanted.rank = (free.count_ones() * 9 / 10) as u8;
                }
            }
        });
        self.each_place(|at, plane, x, y| {
            let value = &mut deviation.planes[at];
            if *value == 255 && self.free_at(plane, x, y, seen, part) == 0 {
                *value = 0;
            }
            if sways_anywhere && self.sways(plane, x, y, seen) {
                *value = (f32::from(*value) * 0.41).ceil() as u8;
            }
        });
        let (u, v) = deviation.chroma();
        let (width, chroma_width) = (deviation.width as usize, deviation.chroma_width() as usize);
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

    /// Returns the samples of `all` in which a value is free. A chroma value is free where all its four
    /// pixels are.
    fn free_at(&self, plane: Plane, x: usize, y: usize, seen: &Occupancy, all: u64) -> u64 {
        match plane {
            Plane::Luma => seen.free(y * self.frames[0].width as usize + x, all),
            Plane::Chroma => self
                .pixels_of_chroma(x, y)
                .iter()
                .fold(all, |free, &px| free & seen.free(px, all)),
        }
    }

    /// Returns whether scenery sways at any pixel of a value.
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

    /// Calls `visit` for every value of a frame with its index, plane, column and row.
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

    /// Returns kind, width and number of rows of each plane, in the order of the frame's bytes.
    fn planes(&self) -> [(Plane, usize, usize); 3] {
        let frame = &self.frames[0];
        let (w, h) = (frame.width as usize, frame.height as usize);
        let chroma = (Plane::Chroma, frame.chroma_width() as usize, h.div_ceil(2));
        [(Plane::Luma, w, h), chroma, chroma]
    }

    /// Returns a frame of order statistics: each value has the wanted rank among the values of the samples of
    /// `part`. With `bases`, one frame for each sample, the absolute differences from them are ranked
    /// instead. `want` writes the wanted ranks of a row. `commonest` then narrows them by
    /// `ranks::want_commonest`.
    fn each_row(
        &self,
        part: u64,
        bases: Option<&[&Frame]>,
        commonest: bool,
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
                    for wanted in &mut wanted {
                        wanted.free = packed(wanted.free, part);
                    }
                    let members = states::bits(part);
                    let samples: Vec<&[u8]> = members
                        .clone()
                        .map(|k| &self.frames[k].planes[bytes.clone()])
                        .collect();
                    let bases = bases.map(|bases| -> Vec<&[u8]> {
                        members.map(|k| &bases[k].planes[bytes.clone()]).collect()
                    });
                    if commonest {
                        ranks::want_commonest(&samples, &mut wanted);
                    }
                    ranks::ranked(&samples, bases.as_deref(), &wanted, row);
                });
            first += width * n_rows;
            rest = others;
        }
        result
    }
}

/// Replaces the sample nearest to the frame of `animal_at` by that frame. Returns its index among the
/// samples. Fails if the footage ends before it.
fn pin(
    source: &dyn FrameSource,
    at: AnimalAtParam,
    frames: &mut [Frame],
    frame_idx: &mut [usize],
) -> Result<usize, Error> {
    let wanted = at.frame as usize;
    let nearest = (0..frames.len()).min_by_key(|&k| frame_idx[k].abs_diff(wanted));
    let k = nearest.unwrap_or(0);
    let mut stream = source.open()?;
    for _ in 0..=wanted {
        if stream.next_frame(&mut frames[k])?.is_none() {
            return Err(Error::NothingAtPoint(at));
        }
    }
    frame_idx[k] = wanted;
    Ok(k)
}

/// Returns the bits of `free` at the set bits of `part`, packed into the low bits.
fn packed(free: u64, part: u64) -> u64 {
    if free == part {
        return u64::MAX >> (64 - part.count_ones());
    }
    let at = |(to, from): (usize, usize)| (free >> from & 1) << to;
    states::bits(part)
        .enumerate()
        .map(at)
        .fold(0, |all, bit| all | bit)
}

/// Kind of a plane: a luma value belongs to one pixel, a chroma value to four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plane {
    Luma,
    Chroma,
}
