//! Why a flock is not made.

use crate::code::Code;

/// The reasons, one variant each.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Playback of the library would end: nothing leads back.
    #[error(
        "no two moments of the footage look alike enough to play on without an end; \
         film longer, and let the animal come back to the same poses"
    )]
    NoTransitions,
    /// The library has no sprites, because the animal covers too few pixels.
    #[error(
        "the animal is too small in the picture: film it from nearer, \
         or analyze it again with sprites set to always"
    )]
    AnimalTooSmall,
    /// The sentence says which parameter is out of which range.
    #[error("{0}")]
    InvalidParams(String),
    /// No plan of so many frames ends where its heir begins.
    #[error(
        "no loop of {0} frames comes back to where it began with this footage; ask for another number of frames, best for more"
    )]
    LoopDoesNotClose(usize),
    /// Somebody cancelled.
    #[error("the flock was cancelled")]
    Cancelled,
}

impl Error {
    /// The stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::NoTransitions => Code::NoTransitions,
            Error::AnimalTooSmall => Code::AnimalTooSmall,
            Error::InvalidParams(_) | Error::LoopDoesNotClose(_) => Code::InvalidParams,
            Error::Cancelled => Code::Cancelled,
        }
    }
}
