//! Preview of an analysis: finds the animal in some frames of the film, for a person who is choosing parameters.
//! A child process reads the film (docs/explanation/promises.md, "Bad input"). Nothing is stored.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::read_options;
use crate::jobs::masks::Masks;
use crate::jobs::refusal::mend::Mend;
use crate::jobs::{Context, Error, attempt};
use crate::media::{Limits, Video, read_image};
use crate::store::footage::{BACKGROUND, Footage, MASKS, VIDEO};
use crate::store::owners::Owner;
use flockreel_core::analysis::scene::preview::SeenFrame;
use flockreel_core::analysis::{self, Params};
use flockreel_core::code::Code;
use flockreel_core::footage::FrameSource;
use flockreel_core::order;
use flockreel_core::progress::Progress;

/// Longest side of the pictures that a preview looks at first, pixels. Free choice: the time grows with its square.
const LONGEST_PX: u32 = 480;
/// Length of an animal in these pictures below which the preview looks at the film as it is, pixels. Free choice.
const LEAST_PX: f64 = 20.0;

/// Preview of an analysis: the animal in some frames, and the verdict on the film.
#[derive(Debug, Serialize, Deserialize)]
pub struct Preview {
    /// The frames, in the order of time.
    pub frames: Vec<SeenFrame>,
    /// Reason for which an analysis would refuse the film.
    pub refusal: Option<Refusal>,
}

/// Reason for which an analysis would refuse a film.
#[derive(Debug, Serialize, Deserialize)]
pub struct Refusal {
    /// Stable code.
    code: String,
    /// The reason as a sentence.
    pub sentence: String,
    /// Changes of the parameters that may mend it, the most promising first.
    pub mends: Vec<Mend>,
}

impl Refusal {
    /// Returns the stable code.
    pub fn code(&self) -> Code {
        Code::from_name(&self.code).unwrap_or(Code::Internal)
    }
}

/// Returns the preview of an analysis. Waits for the owner's turn, and fails with [`Error::Busy`] if it does not come in
/// time. If the future is dropped, the computation ends.
pub async fn preview(
    context: &Context,
    owner: &Owner,
    footage: &Footage,
    params: Params,
) -> Result<Preview, Error> {
    let _permit = context.upload_checks.acquire(owner).await?;
    let files = [VIDEO, BACKGROUND, MASKS];
    let files = context.store.fetch(&footage.folder, &files).await?;
    attempt::preview(context, files, params).await
}

/// Computes the preview of an analysis of the film in a folder.
pub(in crate::jobs) fn compute(
    folder: &Path,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Preview, Error> {
    let limits = Limits::default();
    let options = read_options(params);
    let given = |name| Some(folder.join(name)).filter(|path| path.exists());
    let path = folder.join(VIDEO);
    let mut video = Video::open_with(&path, &limits, &options)?;
    let format = video.format();
    let masks = Masks::open(&video, &path, given(MASKS).as_deref(), &limits, &options)?;
    let background = given(BACKGROUND).map(|path| read_image(&path, &limits));
    let background = background.transpose()?;
    let whole = video.clone();
    let find = |video: &Video, scale| {
        let masked = masks.as_ref().map(|masks| masks.over(video)).transpose()?;
        let source: &dyn FrameSource = match &masked {
            Some(masked) => masked,
            None => video,
        };
        found(analysis::preview(
            source,
            scale,
            background.as_ref(),
            params,
            progress,
        ))
    };
    // Masks and background have the size of the film.
    let scale = match (&masks, &background) {
        (None, None) => video.reduce(LONGEST_PX),
        _ => 1.0,
    };
    let (mut frames, mut refused) = find(&video, scale)?;
    if scale < 1.0 && is_lost(&frames, refused.as_ref(), scale) {
        (frames, refused) = find(&whole, 1.0)?;
    }
    let refusal = refused.map(|cause| Refusal {
        code: cause.code().name().to_owned(),
        sentence: cause.to_string(),
        mends: Mend::all_of(&cause, params, &format),
    });
    Ok(Preview { frames, refusal })
}

/// Returns frames and refusal of a preview, and those of one that ended with a refusal. Fails if it ended otherwise.
fn found(
    preview: Result<analysis::scene::preview::Preview, analysis::Error>,
) -> Result<(Vec<SeenFrame>, Option<analysis::Error>), Error> {
    match preview {
        Ok(preview) => Ok((preview.frames, preview.refused)),
        Err(analysis::Error::Cancelled) => Err(Error::Cancelled),
        Err(error @ analysis::Error::Source(_)) => Err(error.into()),
        Err(refused) => Ok((Vec::new(), Some(refused))),
    }
}

/// Returns whether pictures reduced by `scale` may have lost the animal: it is absent or small.
fn is_lost(frames: &[SeenFrame], refused: Option<&analysis::Error>, scale: f64) -> bool {
    let length_px = |outline: &Vec<[f64; 2]>| {
        let extent = |axis: usize| {
            let along = || outline.iter().map(|point| point[axis]);
            along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
        };
        scale * extent(0).max(extent(1))
    };
    let lengths = frames.iter().filter_map(|seen| seen.animal_px.as_ref());
    let length_px = order::median(lengths.map(length_px)).unwrap_or(0.0);
    let is_unseen =
        |error: &analysis::Error| matches!(error.code(), Code::NothingMoves | Code::NothingAtPoint);
    match refused {
        Some(error) => is_unseen(error),
        None => length_px < LEAST_PX,
    }
}
