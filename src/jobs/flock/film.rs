//! A planned flock to files: its film, and the ground truth from the same layers (ALGORITHMS.md 8). The
//! command line and the service make them here.

use std::path::Path;

use super::truth::TruthFolder;
use crate::flock::{Compositor, Flock, Shot};
use crate::formats::ground_truth::FilmShape;
use crate::jobs::Error;
use crate::library::Library;
use crate::media::{VideoFormat, VideoWriter};
use crate::progress::Progress;
use crate::raster::ColorSpec;

/// A flock that can be filmed.
#[derive(Clone, Copy)]
pub struct Film<'a> {
    /// Whose frames are shown.
    pub library: &'a Library,
    /// What they do.
    pub flock: &'a Flock,
    /// Told how far the film is; may cancel it.
    pub progress: &'a dyn Progress,
}

impl Film<'_> {
    /// Films into an MP4, and where a folder for it is given tells the ground truth.
    pub fn make(&self, video: &Path, truth: Option<&Path>) -> Result<(), Error> {
        let mut compositor = Compositor::new(self.library, self.flock);
        if truth.is_some() {
            compositor = compositor.with_truth();
        }
        let [width, height] = compositor.size_px();
        let shape = FilmShape {
            size_px: [width, height],
            n_frames: compositor.n_frames(),
            fps: self.flock.fps,
        };
        let format = VideoFormat {
            width,
            height,
            fps: shape.fps,
            color: ColorSpec::default(),
        };
        let mut video = VideoWriter::create(video, &format)?;
        let mut truth = (truth.map(|folder| TruthFolder::create(folder, shape))).transpose()?;
        compositor.render_all(|frame_idx, shot: &Shot| {
            if self.progress.cancelled() {
                return Err(Error::Cancelled);
            }
            video.write(&shot.frame)?;
            if let Some(truth) = &mut truth {
                truth.add(self.flock, frame_idx, &shot.truth)?;
            }
            let fraction = (frame_idx + 1) as f64 / shape.n_frames as f64;
            self.progress.report("rendering", fraction);
            Ok::<(), Error>(())
        })?;
        video.finish()?;
        Ok(truth.map_or(Ok(()), TruthFolder::finish)?)
    }
}
