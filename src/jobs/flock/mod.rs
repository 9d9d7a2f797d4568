//! The flock job: makes a flock from a library (docs/explanation/algorithms.md, "Planning", "Boids" and
//! "Compositing"). It writes `flock.json`, `flock.plan`, `plan.svg`, `video.mp4`, `thumb.webp`, and the further files that
//! the `render` parameters request.

mod background_video;
pub mod dataset; // many flocks with labels
pub mod film; // flock -> files
mod sink; // encoders and pictures
pub mod target; // files that can be made
pub mod truth; // ground truth

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::film::{Backdrop, Film};
use self::target::{Output, Target};
use super::analysis::Advice;
use super::{Attempt, Error, Extent, JobInput, Product, Stages, Subject};
use crate::store::jobs::Kind;
use flockreel_core::flock::composite::params::{Format, Render};
use flockreel_core::flock::{self, Flock, Params, plan_flock};
use flockreel_core::formats::{flock_json, flock_plan, svg};
use flockreel_core::ids::{FlockId, LibraryId};
use flockreel_core::library::Library;

/// Stages with their share of the running time; measured.
pub const STAGES: Stages = &[
    ("loading", 0.05),
    ("simulating", 0.05),
    ("planning", 0.05),
    ("rendering", 0.85),
];

/// Area of a sprite for the estimate of the cost, pixels. Free choice.
const SPRITE_PX: f64 = 10_000.0;

/// Input of a flock.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// The library that the flock is made from.
    pub library_id: LibraryId,
    /// Parameters of the flock.
    pub params: Params,
}

/// Summary of a flock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FlockSummary)]
pub struct Summary {
    /// Frame rate, frames per second.
    pub fps: f64,
    /// Width and height of the picture, pixels.
    pub image_size_px: [u32; 2],
    /// Number of individuals.
    pub count: u32,
    /// Number of frames of the video.
    pub frames: u32,
    /// Random seed.
    pub seed: u64,
    /// Weaknesses of the flock; empty if there are none.
    #[serde(default)]
    pub advice: Vec<Advice>,
}

impl JobInput for Input {
    const KIND: Kind = Kind::Flock;
    type ResultId = FlockId;

    fn subjects(&self) -> Vec<Subject> {
        vec![Subject::Library(self.library_id)]
    }

    /// Every frame is encoded once for each file, and every individual is planned and drawn.
    fn cost_px(&self, library: Option<Extent>) -> Option<f64> {
        let render = &self.params.render;
        let film = Extent {
            n_frames: self.params.frames as usize,
            image_size_px: render.size_px.unwrap_or(library?.image_size_px),
        };
        let n_films = targets(Path::new(""), render).len() + usize::from(render.ground_truth);
        let n_sprites = f64::from(self.params.frames) * f64::from(self.params.most_individuals());
        Some(n_films as f64 * film.film_px() + n_sprites * SPRITE_PX)
    }

    fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let library = attempt.library()?;
        let flock = plan_flock(&library, &self.params, attempt.reporter)?;
        let folder = attempt.folder();
        let mut file = BufWriter::new(File::create(folder.join("flock.json"))?);
        flock_json::write_to(&flock, &mut file)?;
        file.flush()?;
        std::fs::write(folder.join("flock.plan"), flock_plan::write(&flock))?;
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
            film: None,
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
        backdrop: Backdrop::FromParams,
        progress: attempt.reporter,
    };
    let truth = folder.join("ground-truth");
    film.thumb(&folder.join("thumb.webp"))?;
    let targets = targets(folder, &flock.params.render);
    if !flock.params.render.ground_truth {
        return film.make(&targets, None);
    }
    film.make(&targets, Some(&truth))?;
    std::fs::copy(truth.join("tracks.csv"), folder.join("tracks.csv"))?;
    truth::pack(&truth, &folder.join("ground-truth.zip"))?;
    Ok(std::fs::remove_dir_all(&truth)?)
}

/// Returns the files to write: `video.mp4` and the requested formats, each once.
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

/// Returns the file name of a format in the folder of a flock.
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
