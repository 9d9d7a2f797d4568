//! Reasons for which an analysis ends without a library.

use super::params::AnimalAtParam;
use crate::code::Code;
use crate::footage::SourceError;
use crate::geometry::Rect;
use crate::scratch::Full;

/// A reason for which the analysis fails (docs/explanation/algorithms.md, "Refused footage").
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The footage cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The footage has too few frames.
    #[error("the footage has {n_frames} frames to measure, but at least {least} are needed")]
    TooFewFrames {
        /// Number of frames found.
        n_frames: usize,
        /// Minimum number of frames.
        least: usize,
    },
    /// The given background differs in size from the footage.
    #[error(
        "the size of the background image is {found:?} pixels, but that of the footage is {wanted:?}"
    )]
    BackgroundSizeDiffers {
        /// Width and height of the background, pixels.
        found: [u32; 2],
        /// Width and height of the footage, pixels.
        wanted: [u32; 2],
    },
    /// Nothing moves at the point that `animal_at` gives.
    #[error(
        "frame {} has no moving object at {},{}: point at the animal in a frame in which it has moved",
        .0.frame, .0.at_px[0], .0.at_px[1]
    )]
    NothingAtPoint(AnimalAtParam),
    /// The masks uploaded with the footage show no animal.
    #[error(
        "the masks show no animal: no mask has a white region of at least {} pixels",
        super::subject::MIN_AREA_PX
    )]
    MasksEmpty,
    /// No component is large enough in enough frames.
    #[error("no moving animal was found in the film")]
    NothingMoves,
    /// Much of the image changes throughout the footage.
    #[error("the background changes during the whole film, from {at_s:.1} s on")]
    BackgroundNotStatic {
        /// Start of the change, seconds.
        at_s: f64,
        /// Box around the changes besides the animal, pixels; `None` when unknown.
        box_px: Option<Rect>,
    },
    /// The camera never stays in one position long enough.
    #[error("the camera moves from {at_s:.1} s on")]
    CameraMoves {
        /// Start of the motion, seconds.
        at_s: f64,
    },
    /// The light changes throughout the footage.
    #[error("the light keeps changing from {at_s:.1} s on")]
    LightChanges {
        /// Start of the change, seconds.
        at_s: f64,
    },
    /// The footage shows several scenes, none of them long enough.
    #[error("the film cuts to another scene at {at_s:.1} s")]
    SceneChanges {
        /// End of the first scene, seconds.
        at_s: f64,
    },
    /// The animal covers too much of the image.
    #[error("the animal covers {:.0} % of the picture, but at most 15 % can be measured", 100.0 * share)]
    AnimalTooLarge {
        /// Share of the image that the animal covers, 0..=1.
        share: f64,
        /// A frame in which the animal covers that share.
        frame: usize,
        /// Box around the animal in that frame, pixels.
        box_px: Rect,
    },
    /// Two components of similar area persist through the footage.
    #[error(
        "several animals move in the film: frame {frame} shows one at {} and another at {}",
        center(&boxes_px[0]), center(&boxes_px[1])
    )]
    SeveralAnimals {
        /// A frame that shows both.
        frame: usize,
        /// Boxes around the two in that frame, pixels.
        boxes_px: [Rect; 2],
    },
    /// The temporary storage for the mattes is full.
    #[error(transparent)]
    Full(#[from] Full),
    /// The analysis was cancelled.
    #[error("the analysis was cancelled")]
    Cancelled,
}

/// The frames and boxes that show why a footage was refused.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Frame numbers, ascending: one frame that shows the reason, or one before a change and one at it.
    pub frames: Vec<usize>,
    /// Boxes to look at in the last of the frames, pixels.
    pub boxes_px: Vec<Rect>,
}

impl Error {
    /// Returns the evidence at a frame rate of `fps`, or `None` if no frame shows the reason.
    pub fn evidence(&self, fps: f64) -> Option<Evidence> {
        let frame_at = |at_s: f64| (at_s * fps).round() as usize;
        let (frames, boxes_px) = match *self {
            Error::BackgroundNotStatic {
                at_s,
                box_px: Some(box_px),
            } => (vec![frame_at(at_s)], vec![box_px]),
            Error::BackgroundNotStatic { at_s, box_px: None }
            | Error::CameraMoves { at_s }
            | Error::LightChanges { at_s }
            | Error::SceneChanges { at_s } => {
                let mut frames = vec![frame_at(at_s / 2.0), frame_at(at_s)];
                frames.dedup();
                (frames, Vec::new())
            }
            Error::AnimalTooLarge { frame, box_px, .. } => (vec![frame], vec![box_px]),
            Error::SeveralAnimals { frame, boxes_px } => (vec![frame], boxes_px.to_vec()),
            _ => return None,
        };
        Some(Evidence { frames, boxes_px })
    }

    /// Returns the error in frames and pixels of the footage. The analyzed part starts at frame `first` and was read at
    /// `scale` times its size.
    pub(super) fn in_footage(mut self, first: usize, scale: f64) -> Error {
        let larger = |box_px: &mut Rect| *box_px = box_px.scaled(1.0 / scale);
        match &mut self {
            Error::NothingAtPoint(at) => {
                at.frame += first as u32;
                at.at_px = at.at_px.map(|v| v / scale);
            }
            Error::AnimalTooLarge { frame, box_px, .. } => {
                *frame += first;
                larger(box_px);
            }
            Error::SeveralAnimals { frame, boxes_px } => {
                *frame += first;
                boxes_px.iter_mut().for_each(larger);
            }
            Error::BackgroundNotStatic { box_px, .. } => box_px.iter_mut().for_each(larger),
            _ => {}
        }
        self
    }

    /// Returns the stable error code.
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

/// Returns the center of a box as X,Y, the format of `--animal-at`.
fn center(rect: &Rect) -> String {
    format!("{},{}", rect.x + rect.w / 2, rect.y + rect.h / 2)
}
