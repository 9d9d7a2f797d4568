//! Why there is no virtual fish.

use crate::code::Code;

/// The reasons, one variant each.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A parameter is out of its range.
    #[error("{0}")]
    InvalidParams(String),
    /// The animal was found in no frame, so that nothing can drive the fish.
    #[error("the animal was found in none of the {n_frames} frames")]
    NothingMoves {
        /// Frames of the footage.
        n_frames: usize,
    },
}

impl Error {
    /// The stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::InvalidParams(_) => Code::InvalidParams,
            Error::NothingMoves { .. } => Code::NothingMoves,
        }
    }
}
