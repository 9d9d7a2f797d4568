//! Why an analysis ends without a library.

use crate::code::Code;
use crate::footage::SourceError;
use crate::scratch::Full;

/// The reasons, one variant each (ALGORITHMS.md 2.9).
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The footage could not be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Fewer frames than a library needs.
    #[error("the footage has {n_frames} frames, at least {least} are needed")]
    TooFewFrames {
        /// Frames found.
        n_frames: usize,
        /// Frames needed.
        least: usize,
    },
    /// The given background is of another size.
    #[error("the background image is {found:?} pixels, the footage {wanted:?}")]
    BackgroundSizeDiffers {
        /// Size of the image.
        found: [u32; 2],
        /// Size of the footage.
        wanted: [u32; 2],
    },
    /// No component large enough in enough frames.
    #[error("nothing moves before the background")]
    NothingMoves,
    /// The camera moves, or the scene does.
    #[error("the background moves: the camera must stand still")]
    BackgroundNotStatic,
    /// Two components of comparable area, each persistent.
    #[error(
        "more than one animal moves in the footage: film one alone, or set follow to largest (--follow-largest)"
    )]
    SeveralAnimals,
    /// The animal's pictures found no room.
    #[error(transparent)]
    Full(#[from] Full),
    /// Somebody cancelled.
    #[error("the analysis was cancelled")]
    Cancelled,
}

impl Error {
    /// The stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::Source(error) => error.code,
            Error::TooFewFrames { .. } => Code::TooFewFrames,
            Error::BackgroundSizeDiffers { .. } => Code::BackgroundSizeDiffers,
            Error::NothingMoves => Code::NothingMoves,
            Error::BackgroundNotStatic => Code::BackgroundNotStatic,
            Error::SeveralAnimals => Code::SeveralAnimals,
            Error::Full(error) => error.code(),
            Error::Cancelled => Code::Cancelled,
        }
    }
}
