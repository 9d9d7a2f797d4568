//! The sample job: films the virtual fish as footage, so that an empty service has a flock to show at the
//! first visit. [`fill`] queues it, followed by its analysis and its flock.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Attempt, Context, Error, Product, Stages, analysis, flock};
use crate::fish::sample::{SampleFilm, SampleParams};
use crate::footage::FrameSource;
use crate::ids::{FootageId, JobId};
use crate::media::VideoWriter;
use crate::progress::Progress;
use crate::raster::Frame;
use crate::store;
use crate::store::footage::{Filmed, VIDEO};
use crate::store::jobs::Kind;
use crate::store::jobs::finish::Made;
use crate::store::owners::{Account, Reach};

/// Stages with their share of the running time.
pub const STAGES: Stages = &[("filming", 1.0)];

/// Input of the sample.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// Number of frames, at least 1.
    pub n_frames: usize,
}

impl Default for Input {
    /// Returns 1200 frames: long enough for transitions in every direction.
    fn default() -> Input {
        Input { n_frames: 1200 }
    }
}

/// Queues the sample, its analysis and its flock if the store is empty. Does nothing if the store has
/// footage, or jobs that are queued or running: after a restart the jobs of the first start are still in the
/// queue.
pub async fn fill(context: &Context) -> Result<(), store::Error> {
    let store = &context.store;
    let has_footage = !store.list_footage(1, None, &Reach::All).await?.is_empty();
    if has_footage || store.has_jobs_under_way().await? {
        return Ok(());
    }
    let account = Account::local();
    let (sample_job, footage_id) = enqueue(context, &Input::default(), &account).await?;
    let measure = analysis::Input {
        footage_id,
        params: crate::analysis::Params::default(),
    };
    let queued = analysis::enqueue(context, &measure, Some(sample_job), &account);
    let (analysis_job, library_id) = queued.await?;
    let make = flock::Input {
        library_id,
        params: crate::flock::Params::default(),
    };
    flock::enqueue(context, &make, Some(analysis_job), &account).await?;
    Ok(())
}

/// Queues a sample. Returns the id of the job and the id that the footage will have.
pub async fn enqueue(
    context: &Context,
    input: &Input,
    account: &Account,
) -> Result<(JobId, FootageId), store::Error> {
    let queued = context.enqueue(Kind::Sample, input, None, account);
    let (job_id, footage_id) = queued.await?;
    Ok((job_id, FootageId(footage_id)))
}

impl Input {
    /// Films the virtual fish and leaves the video in the folder of the attempt.
    pub fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let film = SampleFilm::new(SampleParams {
            n_frames: self.n_frames,
            ..SampleParams::default()
        })?;
        let path = attempt.folder().join(VIDEO);
        // The extension of the path selects the container.
        let written = path.with_extension("mp4");
        write(&film, &written, attempt.listener)?;
        std::fs::rename(&written, &path)?;
        let format = film.format();
        Ok(Product {
            made: Made::Sample(Filmed {
                name: "sample.mp4",
                width: format.width,
                height: format.height,
                fps: format.fps,
                n_frames: format.n_frames_hint,
            }),
            params: String::new(),
            summary: String::new(),
        })
    }
}

fn write(film: &SampleFilm, path: &Path, progress: &dyn Progress) -> Result<(), Error> {
    let n_frames = film.format().n_frames_hint;
    progress.report("filming", 0.0);
    let mut writer = VideoWriter::create(path, &film.format().into())?;
    let mut stream = film.open()?;
    let mut frame = Frame::default();
    for n_written in 1.. {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if stream.next_frame(&mut frame)?.is_none() {
            break;
        }
        writer.write(&frame)?;
        progress.report("filming", n_written as f64 / n_frames as f64);
    }
    Ok(writer.finish()?)
}
