//! Refused footage: its mends, and `refused.jpg`, frames of the footage that show the reason
//! (docs/explanation/algorithms.md, "Refused footage").

pub mod mend; // parameters that may mend it

use self::mend::Mend;
use super::Error;
use flockreel_core::analysis::{self, Params};
use flockreel_core::footage::{FrameSource, SourceError};
use flockreel_core::formats::evidence;
use flockreel_core::raster::Frame;

/// File name of the picture, also in URLs.
pub const FILE_NAME: &str = "refused.jpg";

/// Returns the error of an analysis with its mends, and with a picture if the footage shows the reason.
pub fn explained(source: &dyn FrameSource, params: &Params, cause: analysis::Error) -> Error {
    let mends = Mend::all_of(&cause, params, &source.format());
    let picture = picture(source, &cause);
    if picture.is_none() && mends.is_empty() {
        return Error::Analysis(cause);
    }
    Error::Refused {
        cause,
        picture,
        mends,
    }
}

/// Returns the frames that show why the footage was refused, as JPEG. `None` if no frame shows it, or if the
/// footage can no longer be read.
pub fn picture(source: &dyn FrameSource, cause: &analysis::Error) -> Option<Vec<u8>> {
    let shown = cause.evidence(source.format().fps)?;
    let frames = frames(source, &shown.frames);
    let frames = frames
        .inspect_err(|error| tracing::warn!(%error, "the picture of a refusal could not be made"));
    let frames = frames.ok().filter(|frames| !frames.is_empty())?;
    Some(evidence::draw(frames, &shown.boxes_px))
}

/// Returns the wanted frames. Their indices must be in ascending order. Fewer are returned if the footage
/// ends earlier.
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
