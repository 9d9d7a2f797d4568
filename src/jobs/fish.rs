//! The fish job: poses to virtual fish (ALGORITHMS.md 4; N 7), left as `video.mp4` before the
//! footage's own background, and `model.glb`.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Attempt, Context, Error, Product, Stages};
use crate::fish::{Film, Params, drive};
use crate::formats::{glb, library_dir};
use crate::ids::{FishId, JobId, LibraryId};
use crate::media::{VideoFormat, VideoWriter};
use crate::progress::Progress;
use crate::raster::{ColorSpec, Frame};
use crate::store;
use crate::store::jobs::Kind;
use crate::store::jobs::finish::Made;
use crate::store::owners::Account;

/// The stages, with their shares.
pub const STAGES: Stages = &[("loading", 0.05), ("rendering", 0.95)];

/// What a virtual fish needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// The library whose poses drive it.
    pub library_id: LibraryId,
    /// How.
    pub params: Params,
}

/// What is worth knowing of a virtual fish at a glance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FishSummary)]
pub struct Summary {
    /// Frames a second.
    pub fps: f64,
    /// Width and height of the picture, pixels.
    pub image_size_px: [u32; 2],
    /// Frames of the video.
    pub frames: usize,
    /// Frames in which the fish is in sight.
    pub visible_frames: usize,
}

/// Queues a virtual fish, after the job that makes its library if that is not done yet.
pub async fn enqueue(
    context: &Context,
    input: &Input,
    after_job: Option<JobId>,
    account: &Account,
) -> Result<(JobId, FishId), store::Error> {
    let queued = context.enqueue(Kind::Fish, input, after_job, account);
    let (job_id, fish_id) = queued.await?;
    Ok((job_id, FishId(fish_id)))
}

impl Input {
    /// Drives, writes the model, renders.
    pub fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let (_, files) = attempt.library(self.library_id)?;
        attempt.listener.report("loading", 0.0);
        let library = library_dir::read(files.path(), attempt.scratch())?.library;
        let motion = drive(&library.poses, &self.params)?;
        std::fs::write(attempt.folder().join("model.glb"), glb::write(&motion))?;
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
        render(attempt, &Film::new(motion, library.background))?;
        Ok(Product {
            made: Made::Fish(self.library_id.0),
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
        if attempt.listener.cancelled() {
            return Err(Error::Cancelled);
        }
        film.render(frame_idx, &mut frame);
        video.write(&frame)?;
        let fraction = (frame_idx + 1) as f64 / motion.frames.len() as f64;
        attempt.listener.report("rendering", fraction);
    }
    Ok(video.finish()?)
}
