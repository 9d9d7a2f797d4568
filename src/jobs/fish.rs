//! The fish job: makes a virtual fish from the poses of a library
//! (docs/explanation/algorithms.md, "Virtual fish"; Nakajima et al., section 7). It writes `video.mp4`, in
//! front of the background of the footage, `model.glb` and `fish.json`.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Attempt, Error, Extent, JobInput, Product, Stages, Subject};
use crate::media::{VideoFormat, VideoWriter};
use crate::store::jobs::Kind;
use flockreel_core::fish::{Film, Params};
use flockreel_core::formats::{fish_json, glb};
use flockreel_core::ids::{FishId, LibraryId};
use flockreel_core::progress::Progress;
use flockreel_core::raster::{ColorSpec, Frame};

/// Stages with their share of the running time.
pub const STAGES: Stages = &[("loading", 0.05), ("rendering", 0.95)];

/// Input of a virtual fish.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// The library whose poses drive the fish.
    pub library_id: LibraryId,
    /// Parameters of the virtual fish.
    pub params: Params,
}

/// Summary of a virtual fish.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FishSummary)]
pub struct Summary {
    /// Frame rate, frames per second.
    pub fps: f64,
    /// Width and height of the picture, pixels.
    pub image_size_px: [u32; 2],
    /// Number of frames of the video.
    pub frames: usize,
    /// Number of frames in which the fish is visible.
    pub visible_frames: usize,
}

impl JobInput for Input {
    const KIND: Kind = Kind::Fish;
    type ResultId = FishId;

    fn subjects(&self) -> Vec<Subject> {
        vec![Subject::Library(self.library_id)]
    }

    fn cost_px(&self, library: Option<Extent>) -> Option<f64> {
        Some(library?.film_px())
    }

    fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let library = attempt.library()?;
        let film = Film::of(&library, &self.params)?;
        let motion = film.motion();
        let model = glb::write(motion, film.renderer().mesh());
        std::fs::write(attempt.folder().join("model.glb"), model)?;
        std::fs::write(attempt.folder().join("fish.json"), fish_json::write(motion))?;
        let summary = Summary {
            fps: motion.fps,
            image_size_px: motion.image_size_px,
            frames: motion.frames.len(),
            visible_frames: motion
                .frames
                .iter()
                .filter(|posture| posture.visible)
                .count(),
        };
        render(attempt, &film)?;
        Ok(Product {
            film: None,
            params: serde_json::to_string(&self.params)?,
            summary: serde_json::to_string(&summary)?,
        })
    }
}

fn render(attempt: &Attempt, film: &Film) -> Result<(), Error> {
    let motion = film.motion();
    let [width, height] = motion.image_size_px;
    let format = VideoFormat {
        width,
        height,
        fps: motion.fps,
        color: ColorSpec::default(),
    };
    let mut video = VideoWriter::create(&attempt.folder().join("video.mp4"), &format)?;
    let mut frame = Frame::default();
    for frame_idx in 0..motion.frames.len() {
        if attempt.reporter.cancelled() {
            return Err(Error::Cancelled);
        }
        film.render(frame_idx, &mut frame);
        video.write(&frame)?;
        let fraction = (frame_idx + 1) as f64 / motion.frames.len() as f64;
        attempt.reporter.report("rendering", fraction);
    }
    Ok(video.finish()?)
}
