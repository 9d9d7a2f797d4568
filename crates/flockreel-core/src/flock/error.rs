//! Reasons for which a flock is not made.

use crate::code::Code;

/// Reason for which a flock is not made.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Playback of the library would end, because no jump leads back.
    #[error(
        "no two moments of the footage are similar enough for endless playback: film for longer, until the animal \
         returns to the same poses"
    )]
    NoTransitions,
    /// The animal stays at one place, and several of it are asked for at filmed places.
    #[error(
        "the animal stays at one place in the film, so all of a flock would be there: film it while it moves about, or \
         ask for a flock of one"
    )]
    StaysInPlace,
    /// The library has no sprites, because the animal covers too few pixels.
    #[error(
        "the animal is too small in the picture: film from a shorter distance, or analyze again with sprites set to \
         always"
    )]
    AnimalTooSmall,
    /// A parameter is out of range. The text names the parameter and its range.
    #[error("{0}")]
    InvalidParams(String),
    /// No plan of this number of frames leads back to the start of the loop.
    #[error(
        "no loop of {0} frames returns to its first frame with this footage: request another number of frames, \
         preferably more"
    )]
    LoopDoesNotClose(usize),
    /// The job was cancelled.
    #[error("the flock was cancelled")]
    Cancelled,
}

impl Error {
    /// Returns the stable error code.
    pub fn code(&self) -> Code {
        match self {
            Error::NoTransitions => Code::NoTransitions,
            Error::StaysInPlace => Code::StaysInPlace,
            Error::AnimalTooSmall => Code::AnimalTooSmall,
            Error::InvalidParams(_) | Error::LoopDoesNotClose(_) => Code::InvalidParams,
            Error::Cancelled => Code::Cancelled,
        }
    }
}
