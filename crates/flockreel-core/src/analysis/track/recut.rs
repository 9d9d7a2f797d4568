//! Cuts the animal out a second time, once it is known where it is in the frames around.
//!
//! See docs/explanation/algorithms.md, "Mattes".

use std::ops::Range;

use rayon::prelude::*;

use super::sighting::Sighting;
use super::{Tracked, body};
use crate::analysis::Error;
use crate::analysis::matte::{Seen, Shape};
use crate::analysis::scene::Scene;
use crate::progress::Progress;
use crate::scratch::{Full, Scratch};

/// Number of frames before and after one whose cuts count. Free choice.
const REACH: usize = 2;
/// Number of frames whose shapes are in memory. Free choice.
const BATCH: usize = 64;

/// Cuts every sighting out again.
pub(super) fn all(
    frames: &mut [Tracked],
    scene: &Scene,
    scratch: &dyn Scratch,
    progress: &dyn Progress,
) -> Result<(), Error> {
    let mut mended = Vec::with_capacity(frames.len());
    for first in (0..frames.len()).step_by(BATCH) {
        let batch = first..(first + BATCH).min(frames.len());
        let near = around(&batch, frames.len());
        let shape = |k: usize| shape(Seen::get(frames[k].sighting.as_ref()?.seen?, scratch));
        let shapes = Shapes {
            first: near.start,
            shapes: near.into_par_iter().map(shape).collect(),
        };
        let again = (batch.into_par_iter()).map(|k| shapes.again(k, &frames[k], scene, scratch));
        mended.extend(again.collect::<Result<Vec<_>, Full>>()?);
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
    }
    for (tracked, mended) in frames.iter_mut().zip(mended) {
        if mended.is_some() {
            tracked.sighting = mended;
        }
    }
    Ok(())
}

/// Returns the animal by the first cut; `None` if it has no pixels.
fn shape(seen: Seen) -> Option<Shape> {
    let body = body::moments(seen.solid())?;
    Some(seen.shape(body.centroid_px, body.major_rad))
}

/// Returns the frames within reach of some.
fn around(frames: &Range<usize>, n_frames: usize) -> Range<usize> {
    frames.start.saturating_sub(REACH)..(frames.end + REACH).min(n_frames)
}

/// The animal in successive frames by the first cuts.
struct Shapes {
    /// Index of the first frame.
    first: usize,
    shapes: Vec<Option<Shape>>,
}

impl Shapes {
    fn at(&self, k: usize) -> Option<&Shape> {
        self.shapes.get(k - self.first)?.as_ref()
    }

    /// Cuts the animal out of a frame again; `None` where that changes nothing.
    fn again(
        &self,
        k: usize,
        tracked: &Tracked,
        scene: &Scene,
        scratch: &dyn Scratch,
    ) -> Result<Option<Sighting>, Full> {
        let cut = || {
            let (own, sighting) = (self.at(k)?, tracked.sighting.as_ref()?);
            let near = around(&(k..k + 1), self.first + self.shapes.len());
            let others = near
                .filter(|&near| near != k)
                .filter_map(|near| self.at(near));
            let around: Vec<_> = others.map(|other| other.from_frame_of(own)).collect();
            let background = &scene.backgrounds[tracked.background_idx?];
            let seen = Seen::get(sighting.seen?, scratch);
            let matte = seen.pull(background, &scene.coat, &around)?;
            let measured = Sighting::measured(matte.rect, &matte.image)?;
            Some((sighting, matte, measured))
        };
        let Some((sighting, matte, measured)) = cut() else {
            return Ok(None);
        };
        Ok(Some(Sighting {
            at: scratch.put(&matte.image.pixels)?,
            confidence: sighting.confidence,
            edge_share: sighting.edge_share,
            box_px: sighting.box_px,
            cut: sighting.cut,
            surroundings: sighting.surroundings,
            ..measured
        }))
    }
}
