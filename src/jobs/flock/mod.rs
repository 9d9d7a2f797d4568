//! The flock job: library to flock (ALGORITHMS.md 6 to 8), left as `flock.json`, `plan.svg`,
//! `video.mp4`, and what its `render` parameters ask for besides.

mod behind; // another film behind a flock
pub mod film; // frames to files
mod sink; // where frames go
pub mod truth; // the ground truth as a folder and as one file

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::film::{Backdrop, Film, Output, Target};
use super::analysis::Advice;
use super::{Attempt, Context, Error, Product, Stages};
use crate::flock::composite::params::{Format, Render};
use crate::flock::{self, Flock, Params, plan_flock};
use crate::formats::{flock_json, library_dir, svg};
use crate::ids::{FlockId, JobId, LibraryId};
use crate::library::Library;
use crate::progress::Progress;
use crate::store;
use crate::store::jobs::Kind;
use crate::store::jobs::finish::Made;
use crate::store::owners::Account;

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
#[schema(as = FlockSummary)]
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
    /// Advice on the flock; empty if there is none.
    #[serde(default)]
    pub advice: Vec<Advice>,
}

/// Queues a flock, after the job that makes its library if that is not done yet.
pub async fn enqueue(
    context: &Context,
    input: &Input,
    after_job: Option<JobId>,
    account: &Account,
) -> Result<(JobId, FlockId), store::Error> {
    let queued = context.enqueue(Kind::Flock, input, after_job, account);
    let (job_id, flock_id) = queued.await?;
    Ok((job_id, FlockId(flock_id)))
}

impl Input {
    /// Simulates, plans, renders.
    pub fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let (_, files) = attempt.library(self.library_id)?;
        attempt.listener.report("loading", 0.0);
        let library = library_dir::read(files.path(), attempt.scratch())?.library;
        let flock = plan_flock(&library, &self.params, attempt.listener)?;
        let folder = attempt.folder();
        let mut file = BufWriter::new(File::create(folder.join("flock.json"))?);
        flock_json::write_to(&flock, &mut file)?;
        file.flush()?;
        std::fs::write(folder.join("plan.svg"), svg::plan(&flock))?;
        render(attempt, &library, &flock)?;
        let summary = Summary {
            fps: flock.fps,
            image_size_px: flock.image_size_px,
            count: flock.individuals.len() as u32,
            frames: self.params.frames,
            seed: self.params.seed,
            advice: flock::advice::Advice::all(&flock)
                .iter()
                .map(|one| Advice::new(one.code(), one))
                .collect(),
        };
        Ok(Product {
            made: Made::Flock(self.library_id.0),
            params: serde_json::to_string(&flock.params)?,
            summary: serde_json::to_string(&summary)?,
        })
    }
}

fn render(attempt: &Attempt, library: &Library, flock: &Flock) -> Result<(), Error> {
    let folder = attempt.folder();
    let film = Film {
        library,
        flock,
        backdrop: Backdrop::AsAsked,
        progress: attempt.listener,
    };
    let truth = folder.join("ground-truth");
    let targets = targets(folder, &flock.params.render);
    if !flock.params.render.ground_truth {
        return film.make(&targets, None);
    }
    film.make(&targets, Some(&truth))?;
    std::fs::copy(truth.join("tracks.csv"), folder.join("tracks.csv"))?;
    truth::pack(&truth, &folder.join("ground-truth.zip"))?;
    Ok(std::fs::remove_dir_all(&truth)?)
}

/// video.mp4, and what is asked for besides, each once.
fn targets(folder: &Path, render: &Render) -> Vec<Target> {
    let formats: BTreeSet<Format> = render
        .formats
        .iter()
        .copied()
        .chain([Format::Mp4])
        .collect();
    let mut targets: Vec<Target> = formats
        .into_iter()
        .map(|format| Target {
            output: Output::Film(format),
            path: folder.join(file_name(format)),
        })
        .collect();
    if render.overlay {
        targets.push(Target {
            output: Output::Overlay,
            path: folder.join("overlay.mp4"),
        });
    }
    targets
}

/// The name of a format's file among those of a flock.
pub fn file_name(format: Format) -> &'static str {
    match format {
        Format::Mp4 => "video.mp4",
        Format::Webm => "video.webm",
        Format::Mov => "video.mov",
        Format::Png => "frames.zip",
        Format::Gif => "preview.gif",
        Format::Webp => "preview.webp",
        Format::Poster => "poster.png",
    }
}
