//! Why an analysis ends without a library.

use super::params::AnimalAtParam;
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
    #[error("there are {n_frames} frames to measure, at least {least} are needed")]
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
    /// Nothing that moves is where the animal was said to be.
    #[error(
        "nothing that moves is at {},{} in frame {}",
        .0.point[0], .0.point[1], .0.frame
    )]
    NothingAtPoint(AnimalAtParam),
    /// No component large enough in enough frames.
    #[error("nothing moves before the background")]
    NothingMoves,
    /// Much of the picture changes all the time.
    #[error("the background moves throughout the film, from {at_s:.1} s on")]
    BackgroundNotStatic {
        /// When it begins, seconds.
        at_s: f64,
    },
    /// The camera stands at no place long enough.
    #[error("the camera moves from {at_s:.1} s on")]
    CameraMoves {
        /// When it begins, seconds.
        at_s: f64,
    },
    /// The light changes all the time.
    #[error("the light keeps changing from {at_s:.1} s on")]
    LightChanges {
        /// When it begins, seconds.
        at_s: f64,
    },
    /// The film shows several scenes, none of them long enough.
    #[error("the film cuts to another scene at {at_s:.1} s")]
    SceneChanges {
        /// When the first one ends, seconds.
        at_s: f64,
    },
    /// The animal leaves too little of the scene.
    #[error("the animal covers {:.0} % of the picture, at most 35 % can be measured", 100.0 * share)]
    AnimalTooLarge {
        /// Share of the picture, 0..=1.
        share: f64,
    },
    /// Two components of comparable area, each persistent.
    #[error("more than one animal moves in the footage")]
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
            Error::NothingAtPoint(_) => Code::NothingAtPoint,
            Error::NothingMoves => Code::NothingMoves,
            Error::BackgroundNotStatic { .. } => Code::BackgroundNotStatic,
            Error::CameraMoves { .. } => Code::CameraMoved,
            Error::LightChanges { .. } => Code::LightChanges,
            Error::SceneChanges { .. } => Code::SceneChanges,
            Error::AnimalTooLarge { .. } => Code::AnimalTooLarge,
            Error::SeveralAnimals => Code::SeveralAnimals,
            Error::Full(error) => error.code(),
            Error::Cancelled => Code::Cancelled,
        }
    }
}
