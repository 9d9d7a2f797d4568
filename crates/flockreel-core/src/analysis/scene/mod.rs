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

use super::matte::{self, Coat};
use super::silhouette::{self, blocks::Proposals};
use super::subject::Subject;
use super::{Error, Params};
use crate::footage::FrameSource;
use crate::geometry::Rect;
use crate::library::DisturbanceKind;
use crate::progress::Progress;
use crate::raster::{Frame, RgbImage};

pub mod background;
mod background_estimate;
mod ghost;
pub mod light;
pub mod mirror;
mod occupancy;
mod pixel_statistics;
pub mod preview;
mod probes;
mod refusal;
mod resting;
mod samples;
mod scenery;
mod states;
mod still_part;
mod survey;
mod sway;
mod windows;

use background::Background;
use background_estimate::BackgroundEstimate;
use light::Light;
use mirror::Mirror;
use preview::Preview;
use refusal::SimilarObjects;
use samples::{MAX_SAMPLES, Samples};
use survey::Survey;

/// Largest share of blocks that may differ where a frame shows a background's scene, and of the background's edges
/// where the camera is steady, 0..=1. Free choice.
const MAX_DIFFERING_SHARE: f64 = 0.5;
/// Difference between a frame's gain and 1 above which its light is reported. Free choice.
const OTHER_LIGHT: f32 = 0.2;
/// Number of times that still parts of the animal are taken out of the backgrounds. Free choice: it bounds the
/// time.
const MAX_REPAIRS: usize = 3;
/// Number of frames of a preview. Free choice: a person waits for it.
const PREVIEW_SAMPLES: usize = 40;
/// Least area of the first still part as a share of the animal's; a smaller one changes little. Free choice.
const MIN_STILL_SHARE: f64 = 0.3;

/// The scene of a footage.
pub struct Scene {
    /// The backgrounds, the one with the most samples first.
    pub backgrounds: Vec<Background>,
    /// For each sample its frame index and the index of its background, ordered by frame. `place` first tries
    /// the backgrounds of the samples around a frame.
    samples: Vec<(usize, Option<usize>)>,
    /// Typical appearance of the animal in the samples.
    pub subject: Subject,
    /// Colors of the animal and of the scene around it.
    pub coat: Coat,
    /// Half the width below which a part of the animal's component counts as thin, pixels. `None` where no
    /// tether leads away from the animal.
    pub tether_px: Option<u32>,
    /// Whether several animals move.
    pub several_animals: bool,
    /// Number of pixels of the backgrounds that showed a part of the animal which never left its place, until they
    /// were filled.
    pub still_px: u64,
    /// The mirror that shows the animal's image; `None` without one.
    pub mirror: Option<Mirror>,
    /// Whether every frame comes with a mask of the animal.
    pub is_masked: bool,
}

/// A frame matched with the background that it shows.
pub struct Placed<'a> {
    /// Index of the background in `Scene::backgrounds`.
    pub background_idx: usize,
    /// The background.
    pub background: &'a Background,
    /// Light of the frame relative to the background.
    pub light: Light,
    /// Boxes of the picture that may differ from the background.
    pub boxes: Vec<Rect>,
    /// Difference of the whole frame from the background, caused by camera or light.
    pub disturbance: Option<DisturbanceKind>,
}

impl Scene {
    /// Builds the scene from finished backgrounds. A last survey yields the subject, under the same
    /// thresholds as tracking.
    fn new(
        estimate: BackgroundEstimate,
        samples: &Samples,
        similar_objects: SimilarObjects,
    ) -> Result<Scene, Error> {
        let survey = Survey::new(samples, &estimate.of_samples());
        let is_cut_off =
            survey.tether_px.is_some() || matches!(similar_objects, SimilarObjects::MirrorImage(_));
        let coat = Coat::learn(
            &survey.animals_seen(samples, &estimate.of_samples(), matte::MARGIN_PX),
            !is_cut_off,
        );
        let frames = samples.frame_idx.iter().copied();
        Ok(Scene {
            coat,
            still_px: estimate
                .still_parts
                .iter()
                .map(|part| part.pixels.area() as u64)
                .sum(),
            backgrounds: estimate.backgrounds,
            samples: frames.zip(estimate.background_of).collect(),
            subject: survey.subject.ok_or(Error::NothingMoves)?,
            tether_px: survey.tether_px,
            several_animals: matches!(similar_objects, SimilarObjects::Animals),
            mirror: match similar_objects {
                SimilarObjects::MirrorImage(mirror) => Some(mirror),
                SimilarObjects::None | SimilarObjects::Animals => None,
            },
            is_masked: samples.are_masked(),
        })
    }

    /// Returns the background that a frame shows. Returns `None` where it matches none: a black frame or a
    /// title card.
    pub fn place(&self, frame_idx: usize, frame: &Frame) -> Option<Placed<'_>> {
        if self.is_masked {
            return Some(Placed {
                background_idx: 0,
                background: &self.backgrounds[0],
                light: Light::NEUTRAL,
                boxes: Vec::new(),
                disturbance: None,
            });
        }
        let after = self.samples.partition_point(|(at, _)| *at < frame_idx);
        let around = [after.checked_sub(1), Some(after)];
        let near = around
            .into_iter()
            .flatten()
            .filter_map(|at| self.samples.get(at));
        let mut tried: Vec<usize> = near.filter_map(|(_, background)| *background).collect();
        tried.dedup();
        let best_of = |backgrounds: &[usize]| {
            let compared = backgrounds.iter().map(|&at| self.compare(at, frame));
            compared
                .filter(|(_, share)| *share <= MAX_DIFFERING_SHARE)
                .min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let others = (0..self.backgrounds.len()).filter(|at| !tried.contains(at));
        let best = best_of(&tried).or_else(|| best_of(&others.collect::<Vec<_>>()));
        best.map(|(placed, _)| placed)
    }

    /// Matches a frame with one background. Also returns the share of blocks that differ, 0..=1.
    fn compare(&self, background_idx: usize, frame: &Frame) -> (Placed<'_>, f64) {
        let background = &self.backgrounds[background_idx];
        let light = light::measure(frame, background);
        let blocks = &background.blocks;
        let Proposals {
            boxes,
            share,
            edge_share,
        } = blocks.proposals(frame, &light, silhouette::MARGIN_PX);
        let is_lit_differently =
            background.light != self.backgrounds[0].light || light.is_other_by(OTHER_LIGHT);
        let disturbance = match () {
            () if edge_share > MAX_DIFFERING_SHARE => Some(DisturbanceKind::Camera),
            () if is_lit_differently => Some(DisturbanceKind::Light),
            () => None,
        };
        let placed = Placed {
            background_idx,
            background,
            light,
            boxes,
            disturbance,
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
    let (samples, mut estimate, survey) = explore(source, MAX_SAMPLES, given, params, progress)?;
    let similar_objects = refusal::check(&survey, &samples, params)?;
    let occupancy = estimate.occupancy(&samples, &survey);
    if samples.are_masked() {
        estimate.repaint(&samples, &occupancy, given.is_some());
    }
    estimate.finish(&samples, &occupancy, &survey, given.is_some());
    Scene::new(estimate, &samples, similar_objects)
}

/// Estimates the scene only as far as the samples show what an analysis would find and whether it would refuse the
/// footage. The arguments and failures are those of [`estimate`].
pub fn preview(
    source: &dyn FrameSource,
    given: Option<&RgbImage>,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Preview, Error> {
    let (samples, _, survey) = explore(source, PREVIEW_SAMPLES, given, params, progress)?;
    Ok(Preview {
        frames: preview::seen(&samples, &survey),
        refused: refusal::check(&survey, &samples, params).err(),
    })
}

/// Takes at most `max_samples` samples, makes backgrounds, and finds the animal in the samples.
fn explore(
    source: &dyn FrameSource,
    max_samples: usize,
    given: Option<&RgbImage>,
    params: &Params,
    progress: &dyn Progress,
) -> Result<(Samples, BackgroundEstimate, Survey), Error> {
    let mut samples = Samples::spread(source, max_samples, params, progress)?;
    let mut estimate = match given {
        Some(image) => BackgroundEstimate::from_image(image, &mut samples, params)?,
        // Movement, dimming and flicker of the scene matter only where the animal is found by its motion.
        None if samples.are_masked() => BackgroundEstimate::from_all_samples(&samples, params),
        None => BackgroundEstimate::from_states(&mut samples, params)?,
    };
    if samples.are_masked() {
        let survey = Survey::new(&samples, &estimate.of_samples());
        return Ok((samples, estimate, survey));
    }
    let (first, mut survey) = estimate.for_first_survey(&samples);
    let mut occupancy = estimate.occupancy_over_time(&first, &samples, &survey);
    if given.is_none() {
        estimate.split_in_time(&samples, &occupancy);
    }
    for round in 0..2 {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if round > 0 {
            occupancy = estimate.occupancy(&samples, &survey);
        }
        estimate.repaint(&samples, &occupancy, given.is_some());
        survey = estimate.survey(&samples);
    }
    let cast_shadow = survey.cast_shadow(&samples, &estimate.of_samples());
    if cast_shadow.is_some() {
        let backgrounds = estimate.backgrounds.iter_mut();
        backgrounds.for_each(|background| background.cast_shadow = cast_shadow);
        for _ in 0..2 {
            survey = estimate.survey(&samples);
            occupancy = estimate.occupancy(&samples, &survey);
            estimate.repaint(&samples, &occupancy, given.is_some());
        }
        survey = estimate.survey(&samples);
    }
    if given.is_none() {
        survey = uncover_still_parts(&mut estimate, &samples, survey);
    }
    Ok((samples, estimate, survey))
}

/// Takes parts of the animal that never leave their place out of the backgrounds. Each repair shows more of the
/// animal, and so may show further parts. Returns the survey afterward.
fn uncover_still_parts(
    estimate: &mut BackgroundEstimate,
    samples: &Samples,
    mut survey: Survey,
) -> Survey {
    for repair in 0..MAX_REPAIRS {
        let parts = still_part::find(
            samples,
            &estimate.backgrounds,
            &estimate.background_of,
            &survey,
        );
        let animal_px = survey.subject.as_ref().map_or(0.0, Subject::area_px);
        let largest_px = parts.iter().map(|part| part.area_px).fold(0.0, f64::max);
        if largest_px == 0.0 || (repair == 0 && largest_px < MIN_STILL_SHARE * animal_px) {
            break;
        }
        estimate.still_parts.extend(parts);
        for _ in 0..2 {
            let occupancy = estimate.occupancy(samples, &survey);
            estimate.repaint(samples, &occupancy, false);
            survey = estimate.survey(samples);
        }
    }
    survey
}

#[cfg(test)]
mod tests;
