//! What tells the animal apart in a footage besides its colors: masks that came with it, or its own alpha channel.

use std::path::Path;

use super::Error;
use crate::footage::{FrameSource, Masked, Visit};
use crate::media::{Hints, Limits, Video};

/// A mask that is less than this somewhere is one, 0..=255.
const OPAQUE: u8 = 250;
/// So many frames of an alpha channel are looked at.
const N_LOOKED_AT: usize = 16;

/// The masks of a footage.
pub struct Masks {
    video: Video,
    /// Whether the colors of the footage are mixed with what lies behind the animal.
    is_mixed: bool,
}

impl Masks {
    /// The masks at `given`, one for each frame of the footage; or else the alpha channel of the footage, whose file is
    /// at `path`; `None` where there is neither, or that is opaque throughout.
    ///
    /// Fails where they cannot be read.
    pub fn open(
        footage: &Video,
        (path, given): (&Path, Option<&Path>),
        limits: &Limits,
        hints: &Hints,
    ) -> Result<Option<Masks>, Error> {
        if let Some(given) = given {
            // Masks have no rate of their own: each is one of a frame.
            let hints = Hints {
                fps: Some(footage.format().fps),
                ..*hints
            };
            let video = Video::open_with(given, limits, &hints)?;
            return Ok(Some(Masks {
                video,
                is_mixed: true,
            }));
        }
        if !footage.has_alpha() {
            return Ok(None);
        }
        let hints = Hints {
            of_alpha: true,
            ..*hints
        };
        let video = Video::open_with(path, limits, &hints)?;
        let masks = Masks {
            video,
            is_mixed: false,
        };
        Ok(masks.tell_anything()?.then_some(masks))
    }

    /// The footage with its masks. Fails where their sizes differ.
    pub fn over<'a>(&'a self, footage: &'a Video) -> Result<Masked<'a>, Error> {
        Ok(Masked::of(footage, &self.video, self.is_mixed)?)
    }

    /// Whether some frame shows more than the animal.
    fn tell_anything(&self) -> Result<bool, Error> {
        let mut tells = false;
        let mut look: Box<Visit<'_>> = Box::new(|frame| {
            let levels = frame.gray_levels();
            let is_clear = |&luma: &u8| levels[usize::from(luma)] < OPAQUE;
            tells |= frame.luma().iter().any(is_clear);
            match tells {
                true => std::ops::ControlFlow::Break(()),
                false => std::ops::ControlFlow::Continue(()),
            }
        });
        self.video.spread(N_LOOKED_AT, &mut look)?;
        drop(look);
        Ok(tells)
    }
}
