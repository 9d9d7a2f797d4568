//! The analysis job: makes a library from footage (docs/explanation/algorithms.md, from "Background" to
//! "Transitions and playback"). It writes the library folder (docs/reference/formats.md, "library.json") and
//! the pictures that the web page shows.

pub mod preview; // what a job would find

use std::path::Path;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::jobs::attempt::Counted;
use crate::jobs::masks::Masks;
use crate::jobs::views::poster::Glimpses;
use crate::jobs::{Attempt, Error, Extent, JobInput, Product, Stages, Subject, refusal};
use crate::media::{Encoding, Notice, ReadOptions, Video, read_image, write_picture};
use crate::store::footage::{BACKGROUND, MASKS, VIDEO};
use crate::store::jobs::Kind;
use flockreel_core::analysis::similarity::distance::{ComparedSprites, Distances, Side};
use flockreel_core::analysis::{self, Params, analyze};
use flockreel_core::cpu;
use flockreel_core::footage::FrameSource;
use flockreel_core::formats::atlas::Atlas;
use flockreel_core::formats::distance_map::DistanceMap;
use flockreel_core::formats::{csv, library_dir, svg};
use flockreel_core::ids::{FootageId, LibraryId};
use flockreel_core::library::{Library, View};
use flockreel_core::progress::Progress;

/// Stages with their share of the running time; measured.
pub const STAGES: Stages = &[
    ("background", 0.28),
    ("tracking", 0.43),
    ("distances", 0.07),
    ("writing", 0.22),
];

/// Input of an analysis.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// The footage to measure.
    pub footage_id: FootageId,
    /// Parameters of the analysis.
    pub params: Params,
}

/// Summary of a library.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = LibrarySummary)]
pub struct Summary {
    /// Frame rate, frames per second.
    pub fps: f64,
    /// Width and height of the picture, pixels.
    pub image_size_px: [u32; 2],
    /// Camera view of the animal: `side` or `top`.
    pub view: String,
    /// Number of frames of the footage.
    pub n_frames: usize,
    /// Share of the frames in which the animal was found, 0..=1.
    pub detected_share: f64,
    /// Number of transitions: pairs of similar clips between which playback can jump.
    pub n_transitions: usize,
    /// Share of the frames between which playback can continue endlessly, 0..=1.
    pub component_share: f64,
    /// Number of frames in a clip.
    pub clip_frames: usize,
    /// Length of the animal, pixels: 80th percentile over the frames. Null if unknown.
    pub length_px: Option<f64>,
    /// Weaknesses of the library and how to film better, most serious first, followed by remarks on the video
    /// file. Empty if there are none.
    #[serde(default)]
    pub advice: Vec<Advice>,
}

/// A weakness of a library or flock, or a remark on a video file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Advice {
    /// Stable code, such as `little_playback` or `lacks_up`.
    pub code: String,
    /// The advice as a sentence.
    pub sentence: String,
}

/// Returns the parameters that concern the decoding of the video.
pub fn read_options(params: &Params) -> ReadOptions {
    ReadOptions {
        fps: params.fps,
        pixel_aspect: params.pixel_aspect,
        alpha_as_gray: false,
    }
}

impl JobInput for Input {
    const KIND: Kind = Kind::Analysis;
    type ResultId = LibraryId;

    fn subjects(&self) -> Vec<Subject> {
        vec![Subject::Footage(self.footage_id)]
    }

    /// The film is decoded twice.
    fn cost_px(&self, footage: Option<Extent>) -> Option<f64> {
        Some(2.0 * footage?.film_px())
    }

    fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let limits = attempt.limits();
        let given = |name| Some(attempt.subject_file(name)).filter(|path| path.exists());
        let options = read_options(&self.params);
        let path = attempt.subject_file(VIDEO);
        let video = Video::open_with(&path, &limits, &options)?;
        let masks = Masks::open(&video, &path, given(MASKS).as_deref(), &limits, &options)?;
        let masked = masks.as_ref().map(|masks| masks.over(&video)).transpose()?;
        let background = given(BACKGROUND);
        let background = background.map(|path| read_image(&path, &limits));
        let background = background.transpose()?;
        let level = cpu::Level::detect();
        let progress = attempt.reporter;
        let (background, scratch) = (background.as_ref(), attempt.scratch());
        let source: &dyn FrameSource = match &masked {
            Some(masked) => masked,
            None => &video,
        };
        let glimpses = Glimpses::new(source, self.params.from_s, self.params.to_s);
        let film = Counted::new(&glimpses, progress);
        let library = analyze(&film, background, &self.params, level, &scratch, progress)
            .map_err(|cause| refusal::explained(source, &self.params, cause))?;
        self.write(attempt, &library)?;
        glimpses.write_poster(&library.poses, attempt.folder())?;
        Ok(Product {
            film: None,
            params: serde_json::to_string(&self.params)?,
            summary: serde_json::to_string(&Summary::new(&library, &self.params, video.notices()))?,
        })
    }
}

impl Input {
    fn write(&self, attempt: &Attempt, library: &Library) -> Result<(), Error> {
        attempt.reporter.report("writing", 0.0);
        let folder = attempt.folder();
        library_dir::write(folder, library, &self.params, attempt.footage()?)?;
        std::fs::write(folder.join("poses.csv"), csv::write_poses(&library.poses))?;
        for (name, picture) in svg::pictures(library) {
            std::fs::write(folder.join(name), picture)?;
        }
        library_dir::write_sprites(folder, &library.sprites)?;
        write_atlas(folder, library)?;
        let map = self.distance_map(attempt, library)?;
        std::fs::write(folder.join("distance.png"), map.draw_distances())?;
        let candidates = map.draw_candidates(library);
        std::fs::write(folder.join("candidates.png"), candidates)?;
        Ok(())
    }

    fn distance_map(&self, attempt: &Attempt, library: &Library) -> Result<DistanceMap, Error> {
        let pixels = ComparedSprites::new(&library.sprites, &library.poses, self.params.planes)
            .map_err(analysis::Error::from)?;
        let distances = Distances {
            pixels: &pixels,
            clip: self.params.clip(library.clip_frames),
            side: Side::Plain,
            cpu: cpu::Level::detect(),
        };
        DistanceMap::compute(&distances, library, attempt.reporter)
            .map_err(|_cancelled| Error::Cancelled)
    }
}

/// Writes `atlas.json` and its pages (docs/reference/formats.md, "Atlas").
fn write_atlas(folder: &Path, library: &Library) -> Result<(), Error> {
    let atlas = Atlas::new(library);
    for (name, page) in atlas.pages(&library.sprites) {
        let size_px = [page.width, page.height];
        write_picture(
            &folder.join(name),
            size_px,
            Encoding::StillWebp,
            &page.pixels,
        )?;
    }
    Ok(std::fs::write(folder.join("atlas.json"), atlas.to_json())?)
}

impl Summary {
    fn new(library: &Library, params: &Params, notices: &[Notice]) -> Summary {
        let stats = &library.stats;
        Summary {
            fps: library.poses.fps,
            image_size_px: library.poses.image_size_px,
            view: match library.poses.view {
                View::Side => "side".to_owned(),
                View::Top => "top".to_owned(),
            },
            n_frames: stats.n_frames,
            detected_share: stats.n_detected as f64 / stats.n_frames.max(1) as f64,
            n_transitions: library.transitions.len(),
            component_share: stats.component_share,
            clip_frames: library.clip_frames,
            length_px: stats.length_px,
            advice: Advice::for_library(library, params, notices),
        }
    }
}

impl Advice {
    /// Returns a piece of advice in the form stored with results.
    pub(in crate::jobs) fn new(code: &str, sentence: &impl ToString) -> Advice {
        Advice {
            code: code.to_owned(),
            sentence: sentence.to_string(),
        }
    }

    /// Returns the weaknesses of a library, most serious first, followed by remarks on its video file.
    pub fn for_library(library: &Library, params: &Params, notices: &[Notice]) -> Vec<Advice> {
        let all = analysis::stats::advice(library, params);
        let of_library = all.iter().map(|one| Advice::new(one.code(), one));
        let of_file = notices
            .iter()
            .map(|notice| Advice::new(notice.code(), notice));
        of_library.chain(of_file).collect()
    }
}
