//! Estimates the scene of a footage from samples: frames spread evenly over it
//! (docs/explanation/algorithms.md, "Background"). A scene has backgrounds and a subject, the animal.
//!
//! 1. `states` groups the samples by light and camera position. Black frames and title cards join no group.
//! 2. Short time windows of each group get provisional backgrounds. `survey` compares the samples with them
//!    and selects the animal among the components that differ.
//! 3. `windows` splits a group where its scene changes for good. Each piece gets its own background.
//! 4. Two rounds repaint the backgrounds from the samples that show the scene at each pixel (`occupancy`).
//!    Where a background shows the resting animal, only samples without the animal count there.
//! 5. `refusal` rejects footage that cannot become a library, before any frame is tracked.

use super::silhouette;
use super::subject::Subject;
use super::{Error, Params};
use crate::footage::FrameSource;
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::{Frame, RgbImage};

mod draft;
mod fill;
pub mod light;
pub mod mirror;
mod occupancy;
pub mod plate;
mod ranks;
mod refusal;
mod resting;
mod samples;
mod scenery;
mod shift;
mod states;
mod survey;
mod sway;
mod thumbnail;
mod windows;

use draft::Draft;
use light::Light;
use mirror::Mirror;
use occupancy::Occupancy;
use plate::Plate;
use refusal::Company;
use samples::Samples;
use survey::Survey;

/// Largest share of blocks that may differ where a frame shows a background's scene, 0..=1. Free choice.
const FOREIGN: f64 = 0.5;

/// The scene of a footage.
pub struct Scene {
    /// The backgrounds, the one with the most samples first.
    pub plates: Vec<Plate>,
    /// For each sample its frame index and the index of its background, ordered by frame. `place` first tries
    /// the backgrounds of the samples around a frame.
    likely: Vec<(usize, Option<usize>)>,
    /// Typical appearance of the animal in the samples.
    pub subject: Subject,
    /// Half the width below which a part of the animal's component counts as thin, pixels. `None` where no
    /// tether leads away from the animal.
    pub tether_px: Option<u32>,
    /// Whether several animals move.
    pub several_animals: bool,
    /// The mirror that shows the animal's image; `None` without one.
    pub mirror: Option<Mirror>,
    /// Whether every frame comes with a mask of the animal.
    pub is_masked: bool,
}

/// A frame matched with the background that it shows.
pub struct Placed<'a> {
    /// Index of the background in `Scene::plates`.
    pub plate_idx: usize,
    /// The background.
    pub plate: &'a Plate,
    /// Light of the frame relative to the background.
    pub light: Light,
    /// Boxes of the picture that may differ from the background.
    pub boxes: Vec<Rect>,
}

impl Scene {
    /// Builds the scene from finished backgrounds. A last survey yields the subject, under the same
    /// thresholds as tracking.
    fn of(draft: Draft, samples: &Samples, company: Company) -> Result<Scene, Error> {
        let survey = Survey::of(samples, &draft.plates, &draft.plate_of);
        let frames = samples.frame_idx.iter().copied();
        Ok(Scene {
            plates: draft.plates,
            likely: frames.zip(draft.plate_of).collect(),
            subject: survey.subject.ok_or(Error::NothingMoves)?,
            tether_px: survey.tether_px,
            several_animals: matches!(company, Company::Animals),
            mirror: match company {
                Company::Image(mirror) => Some(mirror),
                Company::None | Company::Animals => None,
            },
            is_masked: samples.are_masked(),
        })
    }

    /// Returns the background that a frame shows. Returns `None` where it matches none: a black frame or a
    /// title card.
    pub fn place(&self, frame_idx: usize, frame: &Frame) -> Option<Placed<'_>> {
        if self.is_masked {
            return Some(Placed {
                plate_idx: 0,
                plate: &self.plates[0],
                light: Light::SAME,
                boxes: Vec::new(),
            });
        }
        let after = self.likely.partition_point(|(at, _)| *at < frame_idx);
        let around = [after.checked_sub(1), Some(after)];
        let near = around
            .into_iter()
            .flatten()
            .filter_map(|at| self.likely.get(at));
        let mut tried: Vec<usize> = near.filter_map(|(_, plate)| *plate).collect();
        tried.dedup();
        let likely = tried
            .iter()
            .map(|&plate_idx| self.compare(plate_idx, frame))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let best = match likely.filter(|(_, share)| *share <= FOREIGN) {
            Some(likely) => Some(likely),
            None => (0..self.plates.len())
                .filter(|plate_idx| !tried.contains(plate_idx))
                .map(|plate_idx| self.compare(plate_idx, frame))
                .filter(|(_, share)| *share <= FOREIGN)
                .min_by(|a, b| a.1.total_cmp(&b.1)),
        };
        best.map(|(placed, _)| placed)
    }

    /// Matches a frame with one background. Also returns the share of blocks that differ, 0..=1.
    fn compare(&self, plate_idx: usize, frame: &Frame) -> (Placed<'_>, f64) {
        let plate = &self.plates[plate_idx];
        let light = light::of(frame, plate);
        let (boxes, share) = plate.blocks.proposals(frame, &light, silhouette::MARGIN_PX);
        let placed = Placed {
            plate_idx,
            plate,
            light,
            boxes,
        };
        (placed, share)
    }
}

/// Estimates the scene. A `given` background keeps its pixels, and only its noise is measured.
///
/// Fails if the given background differs in size from the footage, if the footage cannot become a library, or
/// if `progress` is cancelled.
pub fn estimate(
    source: &dyn FrameSource,
    given: Option<&RgbImage>,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Scene, Error> {
    let mut samples = Samples::spread(source, params, progress)?;
    if samples.are_masked() {
        return of_masked(&mut samples, given, params);
    }
    let mut draft = match given {
        Some(image) => Draft::given(image, &mut samples, params)?,
        None => Draft::of_states(&mut samples, params)?,
    };
    let (short, mut survey) = draft.in_short_windows(&samples);
    let mut seen = draft.occupancy_over_time(&short, &samples, &survey);
    if given.is_none() {
        draft.split_in_time(&samples, &seen);
    }
    for round in 0..2 {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if round > 0 {
            seen = Occupancy::of(&samples, &draft.plates, &draft.plate_of, &survey);
        }
        draft.paint(&samples, &seen, given.is_some());
        survey = draft.survey(&samples);
    }
    let company = refusal::judge(&survey, &samples, params)?;
    let seen = Occupancy::of(&samples, &draft.plates, &draft.plate_of, &survey);
    draft.finish(&samples, &seen, &survey, given.is_some());
    Scene::of(draft, &samples, company)
}

/// Estimates the scene of footage with masks of the animal. Movement, dimming and flicker of the scene are no
/// reason to refuse it.
fn of_masked(
    samples: &mut Samples,
    given: Option<&RgbImage>,
    params: &Params,
) -> Result<Scene, Error> {
    let mut draft = match given {
        Some(image) => Draft::given(image, samples, params)?,
        None => Draft::of_all(samples, params),
    };
    let survey = Survey::of(samples, &draft.plates, &draft.plate_of);
    let company = refusal::judge_masked(&survey, samples, params)?;
    let seen = Occupancy::of(samples, &draft.plates, &draft.plate_of, &survey);
    draft.paint(samples, &seen, given.is_some());
    draft.finish(samples, &seen, &survey, given.is_some());
    Scene::of(draft, samples, company)
}

#[cfg(test)]
mod tests;
