//! Why an analysis ends without a library.

use super::params::AnimalAtParam;
use crate::code::Code;
use crate::footage::SourceError;
use crate::geometry::Rect;
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
    /// The masks that came with the footage show no animal.
    #[error(
        "the masks show no animal: none has a white place of {} pixels",
        super::subject::LEAST_AREA_PX
    )]
    MasksEmpty,
    /// No component large enough in enough frames.
    #[error("nothing moves before the background")]
    NothingMoves,
    /// Much of the picture changes all the time.
    #[error("the background moves throughout the film, from {at_s:.1} s on")]
    BackgroundNotStatic {
        /// When it begins, seconds.
        at_s: f64,
        /// What moved then besides the animal, where it is known, pixels.
        box_px: Option<Rect>,
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
        /// A frame in which it is as large.
        frame: usize,
        /// Where it is in that frame, pixels.
        box_px: Rect,
    },
    /// Two components of comparable area, each persistent.
    #[error(
        "more than one animal moves in the footage: in frame {frame} one is at {} and another at {}",
        center(&boxes_px[0]), center(&boxes_px[1])
    )]
    SeveralAnimals {
        /// A frame that shows two.
        frame: usize,
        /// Where they are in that frame, pixels.
        boxes_px: [Rect; 2],
    },
    /// The animal's pictures found no room.
    #[error(transparent)]
    Full(#[from] Full),
    /// Somebody cancelled.
    #[error("the analysis was cancelled")]
    Cancelled,
}

/// Where a film shows why it was refused.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// The frame that shows it; or one before a change and one after it. They rise.
    pub frames: Vec<usize>,
    /// What to look at in the last of them, pixels.
    pub boxes_px: Vec<Rect>,
}

impl Error {
    /// Where a film of `fps` frames a second shows the reason; `None` where no frame does.
    pub fn evidence(&self, fps: f64) -> Option<Evidence> {
        let at = |at_s: f64| (at_s * fps).round() as usize;
        let (frames, boxes_px) = match *self {
            Error::BackgroundNotStatic {
                at_s,
                box_px: Some(box_px),
            } => (vec![at(at_s)], vec![box_px]),
            Error::BackgroundNotStatic { at_s, box_px: None }
            | Error::CameraMoves { at_s }
            | Error::LightChanges { at_s }
            | Error::SceneChanges { at_s } => {
                let mut frames = vec![at(at_s / 2.0), at(at_s)];
                frames.dedup();
                (frames, Vec::new())
            }
            Error::AnimalTooLarge { frame, box_px, .. } => (vec![frame], vec![box_px]),
            Error::SeveralAnimals { frame, boxes_px } => (vec![frame], boxes_px.to_vec()),
            _ => return None,
        };
        Some(Evidence { frames, boxes_px })
    }

    /// The stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::Source(error) => error.code,
            Error::TooFewFrames { .. } => Code::TooFewFrames,
            Error::BackgroundSizeDiffers { .. } => Code::BackgroundSizeDiffers,
            Error::NothingAtPoint(_) => Code::NothingAtPoint,
            Error::MasksEmpty => Code::MasksEmpty,
            Error::NothingMoves => Code::NothingMoves,
            Error::BackgroundNotStatic { .. } => Code::BackgroundNotStatic,
            Error::CameraMoves { .. } => Code::CameraMoved,
            Error::LightChanges { .. } => Code::LightChanges,
            Error::SceneChanges { .. } => Code::SceneChanges,
            Error::AnimalTooLarge { .. } => Code::AnimalTooLarge,
            Error::SeveralAnimals { .. } => Code::SeveralAnimals,
            Error::Full(error) => error.code(),
            Error::Cancelled => Code::Cancelled,
        }
    }
}

/// The middle of a box as X,Y, the way `--animal-at` takes it.
fn center(rect: &Rect) -> String {
    format!("{},{}", rect.x + rect.w / 2, rect.y + rect.h / 2)
}
