//! Samples: frames spread evenly over the footage, kept in memory to estimate the background
//! (docs/explanation/algorithms.md, "Background").
//!
//! There are at most 64, so that one bit per sample fits a 64-bit word. Large frames get fewer, down to 16,
//! to limit memory.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::background::Background;
use super::light;
use super::states::thumbnail::Thumbnail;
use crate::analysis::memory::BUDGET_BYTES;
use crate::analysis::params::AnimalAtParam;
use crate::analysis::{Error, MIN_FRAMES, Params};
use crate::footage::{FrameSource, spread_idx};
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::Frame;

/// Largest number of samples: one bit each in a 64-bit word.
pub(super) const MAX_SAMPLES: usize = 64;
/// Number of frames compared to detect uneven light. Free choice.
const N_LIGHT_FRAMES: u32 = 16;
/// Least number of samples that agree on what a place shows. With three, one outlier is outvoted.
pub(super) const MIN_AGREEING: usize = 3;

/// The samples of a footage.
pub(super) struct Samples {
    /// The frames; `BackgroundEstimate` equalizes their light.
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
    /// Reads the footage once and keeps at most `max` frames spread evenly over it. The frame that `animal_at` names
    /// replaces the sample nearest to it. Fails if the footage is too short, cannot be read or ends before
    /// that frame, or if `progress` is cancelled.
    pub(super) fn spread(
        source: &dyn FrameSource,
        max: usize,
        params: &Params,
        progress: &dyn Progress,
    ) -> Result<Samples, Error> {
        let format = source.format();
        let n_bytes = Frame::n_bytes(format.width, format.height);
        let n_kept = (BUDGET_BYTES / n_bytes).clamp(MIN_FRAMES, max);
        let mut frames = Vec::with_capacity(n_kept);
        source.spread(n_kept, &mut |frame| {
            frames.push(frame.clone());
            progress.report("background", frames.len() as f64 / n_kept as f64);
            if progress.cancelled() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
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
            Some(at) => Some((
                replace_nearest(source, at, &mut frames, &mut frame_idx)?,
                at.at_px,
            )),
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

    /// Returns the sample of `group` whose mean luma is the third quartile. A bright reference keeps gains low,
    /// because a gain above 1 loses levels. The brightest sample may be a flash.
    pub(super) fn bright_reference(&self, group: u64) -> usize {
        let mean = |k: usize| {
            let luma = self.frames[k].luma();
            let sum: u64 = luma.iter().step_by(7).map(|&v| u64::from(v)).sum();
            sum / luma.len().div_ceil(7).max(1) as u64
        };
        let mut by_light: Vec<(u64, usize)> = indices(group).map(|k| (mean(k), k)).collect();
        by_light.sort_unstable();
        by_light[by_light.len() * 3 / 4].1
    }

    /// Divides the samples of `group` by their light relative to a background. Sets `uneven_light` of the
    /// background.
    pub(super) fn equalize_light(&mut self, group: u64, background: &mut Background) {
        let step = group.count_ones().div_ceil(N_LIGHT_FRAMES).max(1) as usize;
        let members = indices(group).step_by(step).map(|k| &self.frames[k]);
        let compared: Vec<&Frame> = members.collect();
        background.uneven_light = light::is_uneven(&compared, background);
        let samples = self.frames.par_iter_mut().enumerate();
        samples
            .filter(|(k, _)| group >> k & 1 == 1)
            .for_each(|(_, frame)| light::measure(frame, background).undo(frame));
    }

    /// Returns a thumbnail of every sample.
    pub(super) fn thumbnails(&self) -> Vec<Thumbnail> {
        self.frames.par_iter().map(Thumbnail::new).collect()
    }

    /// Returns width and height of a frame, pixels.
    pub(super) fn size_px(&self) -> [u32; 2] {
        [self.frames[0].width, self.frames[0].height]
    }

    /// Returns the number of pixels of a frame.
    pub(super) fn n_px(&self) -> usize {
        self.frames[0].width as usize * self.frames[0].height as usize
    }
}

/// Replaces the sample nearest to the frame of `animal_at` by that frame. Returns its index among the
/// samples. Fails if the footage ends before it.
fn replace_nearest(
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

/// Returns the indices of the set bits, in ascending order.
pub(super) fn indices(mask: u64) -> impl Iterator<Item = usize> + Clone {
    (0..64).filter(move |k| mask >> k & 1 == 1)
}
