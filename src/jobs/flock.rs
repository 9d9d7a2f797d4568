//! The flock job: library to flock (ALGORITHMS.md 6 to 8), left as `flock.json`, `plan.svg` and
//! `video.mp4`.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use super::{Attempt, Context, Error, Product, Stages, clock};
use crate::flock::{Compositor, Flock, Params, plan_flock};
use crate::formats::{flock_json, library_dir, svg};
use crate::ids::{FlockId, JobId, LibraryId};
use crate::library::Library;
use crate::media::{VideoFormat, VideoWriter};
use crate::progress::Progress;
use crate::raster::ColorSpec;
use crate::store;
use crate::store::jobs::Kind;
use crate::store::jobs::enqueue::NewJob;
use crate::store::jobs::finish::Made;

/// The stages, with their measured shares.
pub const STAGES: Stages = &[
    ("loading", 0.05),
    ("simulating", 0.05),
    ("planning", 0.3),
    ("rendering", 0.6),
];

/// What a flock needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// The library to make it of.
    pub library_id: LibraryId,
    /// How.
    pub params: Params,
}

/// What is worth knowing of a flock at a glance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Summary {
    /// Frames a second.
    pub fps: f64,
    /// Width and height of the picture, pixels.
    pub image_size_px: [u32; 2],
    /// Individuals.
    pub count: u32,
    /// Frames of the video.
    pub frames: u32,
    /// The seed of everything random.
    pub seed: u64,
}

/// Queues a flock, after the job that makes its library if that is not done yet.
pub async fn enqueue(
    context: &Context,
    input: &Input,
    after_job: Option<JobId>,
) -> Result<(JobId, FlockId), store::Error> {
    let (job_id, flock_id) = (JobId(Uuid::now_v7()), FlockId(Uuid::now_v7()));
    let job = NewJob {
        job_id,
        kind: Kind::Flock,
        input: serde_json::json!(input).to_string(),
        result_id: flock_id.0,
        after_job,
        priority: 0,
    };
    context.store.enqueue(&job, clock::now_ms()).await?;
    context.wake.notify_one();
    Ok((job_id, flock_id))
}

impl Input {
    /// Simulates, plans, renders.
    pub fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let (_, folder) = attempt.library(self.library_id)?;
        attempt.listener.report("loading", 0.0);
        let library = library_dir::read(&folder, attempt.scratch())?.library;
        let flock = plan_flock(&library, &self.params, attempt.listener)?;
        let folder = attempt.folder();
        std::fs::write(folder.join("flock.json"), flock_json::write(&flock))?;
        std::fs::write(folder.join("plan.svg"), svg::plan(&flock))?;
        render(attempt, &library, &flock)?;
        let summary = Summary {
            fps: flock.fps,
            image_size_px: flock.image_size_px,
            count: self.params.count,
            frames: self.params.frames,
            seed: self.params.seed,
        };
        Ok(Product {
            made: Made::Flock(self.library_id.0),
            params: serde_json::to_string(&self.params)?,
            summary: serde_json::to_string(&summary)?,
        })
    }
}

fn render(attempt: &Attempt, library: &Library, flock: &Flock) -> Result<(), Error> {
    let format = VideoFormat {
        width: flock.image_size_px[0],
        height: flock.image_size_px[1],
        fps: flock.fps,
        color: ColorSpec::default(),
    };
    let mut video = VideoWriter::create(&attempt.folder().join("video.mp4"), &format)?;
    let compositor = Compositor::with_color(library, flock, format.color);
    let n_frames = compositor.n_frames();
    compositor.render_all(|frame_idx, frame| {
        if attempt.listener.cancelled() {
            return Err(Error::Cancelled);
        }
        video.write(frame)?;
        let fraction = (frame_idx + 1) as f64 / n_frames as f64;
        attempt.listener.report("rendering", fraction);
        Ok(())
    })?;
    Ok(video.finish()?)
}
