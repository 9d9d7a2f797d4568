//! The views job: makes the videos of a library, which need the footage again. They are `overlay.mp4`, the footage with
//! its poses drawn over it (Okabe et al., figure 10), and `film.mp4`, which browsers can show whatever the format of the
//! footage. No flock needs them, so the service queues this job with the library, behind what people wait for.

pub(super) mod poster; // one frame of footage or of a library

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::jobs::analysis::read_options;
use crate::jobs::{Attempt, Error, Extent, JobInput, Product, Stages, Subject};
use crate::media::{Encoding, Video, VideoFormat, VideoWriter};
use crate::store::footage::VIDEO;
use crate::store::jobs::Kind;
use flockreel_core::footage::{FrameSource, Part};
use flockreel_core::formats::overlay::Overlay;
use flockreel_core::ids::LibraryId;
use flockreel_core::library::Poses;
use flockreel_core::progress::Progress;
use flockreel_core::raster::Frame;

/// Stages with their share of the running time.
pub const STAGES: Stages = &[("overlay", 1.0)];
/// The footage as browsers can play it.
pub const FILM: &str = "film.mp4";
/// The footage with its poses drawn over it.
pub const OVERLAY: &str = "overlay.mp4";

/// Input of the views.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// The library.
    pub library_id: LibraryId,
}

impl JobInput for Input {
    const KIND: Kind = Kind::Views;
    // The views have no address of their own.
    type ResultId = LibraryId;

    fn subjects(&self) -> Vec<Subject> {
        vec![Subject::Library(self.library_id)]
    }

    /// Never small: the workers for small jobs do what people wait for.
    fn cost_px(&self, _: Option<Extent>) -> Option<f64> {
        None
    }

    fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        let (poses, params) = attempt.measurement()?;
        let options = read_options(&params);
        let video = Video::open_with(&attempt.film_file(VIDEO), &attempt.limits(), &options)?;
        let part = Part::new(&video, params.from_s, params.to_s);
        write_views(&part, &poses, attempt.folder(), attempt.reporter)?;
        Ok(Product {
            film: None,
            params: "{}".to_owned(),
            summary: "{}".to_owned(),
        })
    }
}

/// Writes the footage with its poses drawn over it to `path`. The extension of `path` selects the container.
pub fn write_overlay(
    source: &dyn FrameSource,
    poses: &Poses,
    path: &Path,
    progress: &dyn Progress,
) -> Result<(), Error> {
    draw(source, poses, path, progress, |_| Ok(()))
}

/// Writes both videos into a folder. The film has the frames of the footage, small and quick to seek.
fn write_views(
    source: &dyn FrameSource,
    poses: &Poses,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<(), Error> {
    let format = VideoFormat::from(source.format());
    let mut film = VideoWriter::create_as(&folder.join(FILM), &format, Encoding::Seekable)?;
    draw(source, poses, &folder.join(OVERLAY), progress, |frame| {
        Ok(film.write(frame)?)
    })?;
    Ok(film.finish()?)
}

/// Writes the footage with its poses, and passes each frame to `visit` before they are drawn.
fn draw(
    source: &dyn FrameSource,
    poses: &Poses,
    path: &Path,
    progress: &dyn Progress,
    mut visit: impl FnMut(&Frame) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut writer = VideoWriter::create(path, &source.format().into())?;
    let mut overlay = Overlay::new(poses);
    let mut stream = source.open()?;
    let mut frame = Frame::default();
    let (first, n_frames) = (source.first_frame(), poses.frames.len());
    for frame_idx in first..n_frames {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if stream.next_frame(&mut frame)?.is_none() {
            break;
        }
        visit(&frame)?;
        overlay.draw(frame_idx, &mut frame);
        writer.write(&frame)?;
        progress.report("overlay", (frame_idx + 1) as f64 / n_frames as f64);
    }
    Ok(writer.finish()?)
}
