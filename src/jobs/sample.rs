//! The sample job: films the virtual fish as footage, so that an empty service has a flock to show at the
//! first visit. [`fill`] queues it, followed by its analysis and its flock.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::attempt::Film;
use super::views::poster;
use super::{
    Attempt, Context, Error, Extent, IdSequence, JobInput, Product, Stages, Subject, analysis,
    flock,
};
use crate::media::VideoWriter;
use crate::store;
use crate::store::footage::{Footage, VIDEO};
use crate::store::jobs::Kind;
use crate::store::owners::{Account, OwnerFilter};
use flockreel_core::fish::sample::{SampleFilm, SampleParams};
use flockreel_core::footage::FrameSource;
use flockreel_core::ids::FootageId;
use flockreel_core::progress::Progress;
use flockreel_core::raster::Frame;

/// Stages with their share of the running time.
pub const STAGES: Stages = &[("filming", 1.0)];

/// Name of the footage.
pub(super) const FILM_NAME: &str = "sample.mp4";

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
    let newest = store.list_resources::<Footage>(1, None, &OwnerFilter::All);
    if !newest.await?.is_empty() || store.has_jobs_under_way().await? {
        return Ok(());
    }
    let (account, mut ids) = (Account::local(), IdSequence::random());
    let input = Input::default();
    let sample = context.enqueue(&input, None, &account, &mut ids);
    let (sample_job, footage_id) = sample.await?;
    let analysis = analysis::Input {
        footage_id,
        params: flockreel_core::analysis::Params::default(),
    };
    let analysis = context.enqueue(&analysis, Some(sample_job), &account, &mut ids);
    let (analysis_job, library_id) = analysis.await?;
    let flock = flock::Input {
        library_id,
        params: flockreel_core::flock::Params::default(),
    };
    let flock = context.enqueue(&flock, Some(analysis_job), &account, &mut ids);
    flock.await?;
    Ok(())
}

impl JobInput for Input {
    const KIND: Kind = Kind::Sample;
    type ResultId = FootageId;

    fn subjects(&self) -> Vec<Subject> {
        Vec::new()
    }

    fn cost_px(&self, _: Option<Extent>) -> Option<f64> {
        let SampleParams { width, height, .. } = self.params();
        let film = Extent {
            n_frames: self.n_frames,
            image_size_px: [width, height],
        };
        Some(film.film_px())
    }

    fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let film = SampleFilm::new(self.params())?;
        let path = attempt.folder().join(VIDEO);
        // The extension of the path selects the container.
        let written = path.with_extension("mp4");
        write(&film, &written, attempt.reporter)?;
        std::fs::rename(&written, &path)?;
        poster::write_poster(&film, attempt.folder())?;
        let format = film.format();
        Ok(Product {
            film: Some(Film {
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

impl Input {
    fn params(&self) -> SampleParams {
        SampleParams {
            n_frames: self.n_frames,
            ..SampleParams::default()
        }
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
