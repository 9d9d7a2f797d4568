//! Given masks of the animal: mask videos that came with the footage, or the alpha channel of the footage.

use std::ops::ControlFlow;
use std::path::Path;

use super::Error;
use crate::media::{Limits, ReadOptions, Video};
use flockreel_core::footage::{FrameSource, Masked, Visit};

/// Alpha below which a pixel counts as transparent, 0..=255. Free choice.
const MIN_OPAQUE_ALPHA: u8 = 250;
/// Number of frames of an alpha channel that are checked for transparency. Free choice.
const N_CHECKED_FRAMES: usize = 16;

/// The masks of a footage.
pub struct Masks {
    video: Video,
    /// Whether the colors of partly covered pixels include the background.
    is_mixed: bool,
}

impl Masks {
    /// Opens the masks at `given`, one per frame of the footage; without them, the alpha channel of the
    /// footage, whose file is at `path`. Returns `None` if there is neither, or if the alpha channel is
    /// opaque.
    ///
    /// Fails if the masks cannot be read.
    pub fn open(
        footage: &Video,
        path: &Path,
        given: Option<&Path>,
        limits: &Limits,
        options: &ReadOptions,
    ) -> Result<Option<Masks>, Error> {
        if let Some(given) = given {
            // Masks have no frame rate of their own: each belongs to one frame.
            let options = ReadOptions {
                fps: Some(footage.format().fps),
                ..*options
            };
            let video = Video::open_with(given, limits, &options)?;
            return Ok(Some(Masks {
                video,
                is_mixed: true,
            }));
        }
        if !footage.has_alpha() {
            return Ok(None);
        }
        let options = ReadOptions {
            alpha_as_gray: true,
            ..*options
        };
        let video = Video::open_with(path, limits, &options)?;
        let masks = Masks {
            video,
            is_mixed: false,
        };
        Ok(masks.has_transparency()?.then_some(masks))
    }

    /// Returns the footage with its masks. Fails if their picture sizes differ.
    pub fn over<'a>(&'a self, footage: &'a Video) -> Result<Masked<'a>, Error> {
        Ok(Masked::new(footage, &self.video, self.is_mixed)?)
    }

    /// Returns whether any checked frame has transparent pixels.
    fn has_transparency(&self) -> Result<bool, Error> {
        let mut found = false;
        let mut visit: Box<Visit<'_>> = Box::new(|frame| {
            let levels = frame.gray_levels();
            let is_clear = |&luma: &u8| levels[usize::from(luma)] < MIN_OPAQUE_ALPHA;
            found |= frame.luma().iter().any(is_clear);
            if found {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        self.video.spread(N_CHECKED_FRAMES, &mut visit)?;
        drop(visit);
        Ok(found)
    }
}
