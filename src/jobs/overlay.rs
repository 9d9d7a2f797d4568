//! Videos of the footage: `overlay.mp4` with its poses drawn over it (Okabe et al., figure 10), and `film.mp4`
//! with `poster.jpg`, which browsers can show whatever the format of the footage. The footage itself has a
//! poster too, made before it is analyzed.

use std::path::Path;
use std::time::{Duration, Instant};

use super::Error;
use crate::media::{self, Encoding, VideoFormat, VideoWriter};
use crate::store::footage::POSTER;
use flockreel_core::footage::FrameSource;
use flockreel_core::formats::evidence::small_jpeg;
use flockreel_core::formats::overlay::Overlay;
use flockreel_core::library::Poses;
use flockreel_core::progress::Progress;
use flockreel_core::raster::Frame;

/// Last frame that may be the poster of footage. A film cannot be read from its middle. Free choice.
const MAX_POSTER_FRAME: usize = 30;
/// Time after which an upload looks for no later frame. Free choice.
pub(super) const MAX_POSTER_TIME: Duration = Duration::from_secs(10);

/// Writes a frame as `poster.jpg` into a folder: the middle one, or an earlier one of long footage.
pub(super) fn write_poster(source: &dyn FrameSource, folder: &Path) -> Result<(), Error> {
    let format = source.format();
    let wanted = (format.n_frames_hint / 2).min(MAX_POSTER_FRAME);
    let begin = Instant::now();
    let (mut stream, mut frame, mut n_read) = (source.open()?, Frame::default(), 0);
    while n_read <= wanted
        && begin.elapsed() < MAX_POSTER_TIME
        && stream.next_frame(&mut frame)?.is_some()
    {
        n_read += 1;
    }
    if n_read == 0 {
        return Err(media::Error::TooFewFrames { n_frames: 0 }.into());
    }
    write_jpeg(&frame, folder)
}

fn write_jpeg(frame: &Frame, folder: &Path) -> Result<(), Error> {
    Ok(std::fs::write(folder.join(POSTER), small_jpeg(frame))?)
}

/// Writes the footage with its poses drawn over it to `path`. The extension of `path` selects the container.
pub fn film(
    source: &dyn FrameSource,
    poses: &Poses,
    path: &Path,
    progress: &dyn Progress,
) -> Result<(), Error> {
    film_with(source, poses, path, progress, |_, _| Ok(()))
}

/// Writes `overlay.mp4`, `film.mp4` and `poster.jpg` into a folder.
///
/// `film.mp4` has the frames of the footage, small and quick to seek. The poster is the middle one of the
/// frames that show the animal.
pub fn write_views(
    source: &dyn FrameSource,
    poses: &Poses,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<(), Error> {
    let format = VideoFormat::from(source.format());
    let mut film = VideoWriter::create_as(&folder.join("film.mp4"), &format, Encoding::Seekable)?;
    let shown = (0..poses.frames.len()).filter(|&idx| poses.frames[idx].detected());
    let shown: Vec<usize> = shown.collect();
    let poster_idx = shown.get(shown.len() / 2).copied();
    let overlay = folder.join("overlay.mp4");
    film_with(source, poses, &overlay, progress, |frame_idx, frame| {
        if Some(frame_idx) == poster_idx {
            write_jpeg(frame, folder)?;
        }
        Ok(film.write(frame)?)
    })?;
    Ok(film.finish()?)
}

/// Writes the footage with its poses, and passes each frame to `visit` before they are drawn.
fn film_with(
    source: &dyn FrameSource,
    poses: &Poses,
    path: &Path,
    progress: &dyn Progress,
    mut visit: impl FnMut(usize, &Frame) -> Result<(), Error>,
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
        visit(frame_idx, &frame)?;
        overlay.draw(frame_idx, &mut frame);
        writer.write(&frame)?;
        progress.report("overlay", (frame_idx + 1) as f64 / n_frames as f64);
    }
    Ok(writer.finish()?)
}
