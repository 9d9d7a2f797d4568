//! `overlay.mp4`: the footage with its poses drawn over it (Okabe et al., figure 10).

use std::path::Path;

use super::Error;
use crate::media::VideoWriter;
use flockreel_core::footage::FrameSource;
use flockreel_core::formats::overlay::Overlay;
use flockreel_core::library::Poses;
use flockreel_core::progress::Progress;
use flockreel_core::raster::Frame;

/// Writes the footage with its poses drawn over it to `path`. The extension of `path` selects the container.
pub fn film(
    source: &dyn FrameSource,
    poses: &Poses,
    path: &Path,
    progress: &dyn Progress,
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
        overlay.draw(frame_idx, &mut frame);
        writer.write(&frame)?;
        progress.report("overlay", (frame_idx + 1) as f64 / n_frames as f64);
    }
    Ok(writer.finish()?)
}
