//! The scene without the animal: one plate for each of its states, and what the animal looks like, from frames spread
//! through the film (ALGORITHMS.md 2.1 to 2.4).
//!
//! 1. The samples are sorted into states (`states`): the light was switched, the camera was moved. Black frames and
//!    title cards belong to none.
//! 2. Each state's plate is the median of its samples. What differs from the plates is surveyed (`survey`): components, their
//!    looks, and the subject, which is the look that explains the most samples as one body.
//! 3. Twice more: the plate is the median over the samples in which nothing stands before a pixel (`occupancy`). Where the
//!    animal rested so long that the plate shows it, its pixels come from the samples in which its ghost is seen. A
//!    scene that changes for good gets plates one after the other (`windows`).
//! 4. Films that cannot become a library are refused (`refusal`), before any frame is tracked.

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

/// A frame in which more than this share of the blocks differs does not show the plate's scene.
const FOREIGN: f64 = 0.5;

/// The scene of a film.
pub struct Scene {
    /// Its plates, the one of the most samples first.
    pub plates: Vec<Plate>,
    /// The samples' frames and plates, by frame: which plate is likely in between.
    likely: Vec<(usize, Option<usize>)>,
    /// The animal, as the samples show it.
    pub subject: Subject,
    /// Something thin leads from the animal to the border of the picture: half the width up to which things are thin.
    pub tether_px: Option<u32>,
    /// Several animals move.
    pub several_animals: bool,
    /// Where the animal is mirrored, if it is.
    pub mirror: Option<Mirror>,
    /// Every frame comes with a mask, which says what is the animal.
    pub is_masked: bool,
}

/// What a frame is compared with.
pub struct Placed<'a> {
    /// Which plate.
    pub plate_idx: usize,
    /// The plate.
    pub plate: &'a Plate,
    /// The light of the frame.
    pub light: Light,
    /// Boxes that differ.
    pub boxes: Vec<Rect>,
}

impl Scene {
    /// The scene of finished plates, with the subject as they show it, and as the track will.
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

    /// The plate whose scene a frame shows; `None` when it shows none of them (a black frame, a title card).
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

    /// The frame before a plate, and the share of blocks that differ.
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

/// Estimates the scene, or takes the picture given and estimates its noise alone.
///
/// Fails when the given picture has another size than the footage, and with the reason when the footage cannot
/// become a library.
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

/// The scene behind an animal that masks tell apart: whatever moves, dims or flickers there is no matter.
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
