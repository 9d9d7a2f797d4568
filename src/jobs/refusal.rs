//! refused.jpg: the frames of a film that show why it became no library.

use super::Error;
use crate::analysis;
use crate::footage::{FrameSource, SourceError};
use crate::formats::evidence;
use crate::raster::Frame;

/// The name of the picture in a folder and in an address.
pub const NAME: &str = "refused.jpg";

/// The error of an analysis, with its picture where the film shows the reason.
pub fn illustrated(source: &dyn FrameSource, cause: analysis::Error) -> Error {
    match picture(source, &cause) {
        Some(picture) => Error::Refused { cause, picture },
        None => Error::Analysis(cause),
    }
}

/// The frames that show why the film was refused, as JPEG; `None` where no frame does, or the film
/// cannot be read any more.
pub fn picture(source: &dyn FrameSource, cause: &analysis::Error) -> Option<Vec<u8>> {
    let shown = cause.evidence(source.format().fps)?;
    let frames = frames(source, &shown.frames);
    let frames = frames.inspect_err(|error| tracing::warn!(%error, "no picture of a refusal"));
    let frames = frames.ok().filter(|frames| !frames.is_empty())?;
    Some(evidence::draw(frames, &shown.boxes_px))
}

/// Reads the wanted frames, which rise; fewer where the film ends before.
fn frames(source: &dyn FrameSource, wanted: &[usize]) -> Result<Vec<Frame>, SourceError> {
    let mut stream = source.open()?;
    let (mut frame, mut frames) = (Frame::default(), Vec::new());
    for frame_idx in 0.. {
        if frames.len() == wanted.len() || stream.next_frame(&mut frame)?.is_none() {
            break;
        }
        if wanted[frames.len()] == frame_idx {
            frames.push(frame.clone());
        }
    }
    Ok(frames)
}
