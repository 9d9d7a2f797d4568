//! Errors of the virtual fish: the reasons why no fish can be made.

use crate::code::Code;

/// Reason why no virtual fish can be made.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A parameter is out of its range.
    #[error("{0}")]
    InvalidParams(String),
    /// The animal was found in no frame, so no motion is known.
    #[error("the animal was found in none of the {n_frames} frames")]
    NothingMoves {
        /// Number of frames in the footage.
        n_frames: usize,
    },
    /// No frame shows the whole animal, so it has no figure.
    #[error(
        "no frame of the library shows the whole animal, large enough and surely, so the virtual fish cannot look \
         like it: choose `body: goldfish`, or film it whole"
    )]
    NoPictures,
}

impl Error {
    /// Returns the stable error code.
    pub fn code(&self) -> Code {
        match self {
            Error::InvalidParams(_) => Code::InvalidParams,
            Error::NothingMoves { .. } => Code::NothingMoves,
            Error::NoPictures => Code::AnimalTooSmall,
        }
    }
}
