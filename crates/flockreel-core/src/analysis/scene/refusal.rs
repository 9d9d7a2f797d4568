//! Rejects footage that cannot become a library, from its samples and before tracking
//! (docs/explanation/algorithms.md, "Refused footage").
//!
//! The reasons checked here are: nothing moves, the scene moves, the animal is too large, or there are
//! several animals. Moving cameras and changing light are found earlier, in `states`.

use super::mirror::{MIN_RANGE, Mirror};
use super::samples::Samples;
use super::states::thumbnail::Thumbnail;
use super::survey::Survey;
use crate::analysis::params::Follow;
use crate::analysis::subject::{FITS, Look, MIN_AREA_PX, Subject};
use crate::analysis::{Error, Params};
use crate::geometry::Rect;
use crate::order;
use crate::raster::Frame;

/// Least share of the samples in which the animal must be found, 0..=1. Free choice.
const MIN_FOUND_SHARE: f64 = 0.05;
/// Share of the samples, 0..=1. The scene moves if other things than the animal exceed `MAX_AREA_SHARE` in more of
/// them. A second animal must appear in more of them. Free choice.
const FREQUENT_SHARE: f64 = 0.3;
/// Largest median area of the animal, and of all other things together, as a share of the picture; a larger one
/// hides too much of the background. The limit also refuses moving bedding that is mistaken for the animal.
///
/// Free choice: of the films `large_animal` in `bench/cases.py`, which come near it, one is measured wrongly
/// (docs/measurements.md).
const MAX_AREA_SHARE: f64 = 0.15;
/// Least area of a second animal, as a share of the animal's area. Free choice.
const MIN_SECOND_AREA: f64 = 0.5;

/// Moving objects besides the animal that look like it.
pub(super) enum SimilarObjects {
    /// None, or too rarely to matter.
    None,
    /// The animal's mirror image.
    MirrorImage(Mirror),
    /// Other animals.
    Animals,
}

/// Checks footage by the survey of its samples; fails with the reason to refuse it. Returns the objects that
/// resemble the animal. With masks of the animal, the scene may move.
pub(super) fn check(
    survey: &Survey,
    samples: &Samples,
    params: &Params,
) -> Result<SimilarObjects, Error> {
    if let Some(at) = params.animal_at
        && !survey.is_pinned
    {
        return Err(Error::NothingAtPoint(at));
    }
    match &survey.subject {
        None if samples.are_masked() => Err(Error::MasksEmpty),
        None => Err(Error::NothingMoves),
        Some(subject) => {
            if !samples.are_masked() {
                check_scene(survey, samples, subject)?;
            }
            similar_objects(survey, samples, subject, params)
        }
    }
}

/// Fails if the scene moves, or if the animal is found too rarely or is too large.
fn check_scene(survey: &Survey, samples: &Samples, subject: &Subject) -> Result<(), Error> {
    let n_samples = survey.looks.len() as f64;
    let n_px = samples.n_px() as f64;
    let animal_area_px = |k: usize| survey.animal[k].map_or(0.0, |at| survey.looks[k][at].area_px);
    let other_area_px =
        |k: usize| survey.looks[k].iter().map(|l| l.area_px).sum::<f64>() - animal_area_px(k);
    let busy: Vec<usize> = (0..survey.looks.len())
        .filter(|&k| other_area_px(k) > MAX_AREA_SHARE * n_px)
        .collect();
    if busy.len() as f64 > FREQUENT_SHARE * n_samples {
        let at_s = samples.time_s(busy[0]);
        let calm = (0..survey.looks.len()).find(|k| !busy.contains(k));
        if calm
            .is_some_and(|calm| differs_all_over(&samples.frames[busy[0]], &samples.frames[calm]))
        {
            return Err(Error::LightChanges { at_s });
        }
        let looks = survey.looks[busy[0]].iter().enumerate();
        let others = looks.filter(|(at, _)| survey.animal[busy[0]] != Some(*at));
        let boxes = others.map(|(_, look)| look.box_px);
        return Err(Error::BackgroundNotStatic {
            at_s,
            box_px: boxes.reduce(|all, one| all.union(&one)),
        });
    }
    let n_found = survey.animal.iter().flatten().count() as f64;
    if n_found < MIN_FOUND_SHARE * n_samples {
        return Err(Error::NothingMoves);
    }
    if subject.area_px() > MAX_AREA_SHARE * n_px {
        let seen =
            (0..survey.looks.len()).filter_map(|k| Some((k, &survey.looks[k][survey.animal[k]?])));
        let off = |look: &Look| (look.area_px - subject.area_px()).abs();
        let usual = seen.min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
        let (k, look) = usual.ok_or(Error::NothingMoves)?;
        return Err(Error::AnimalTooLarge {
            share: subject.area_px() / n_px,
            frame: samples.frame_idx[k],
            box_px: look.box_px,
        });
    }
    Ok(())
}

/// Returns whether two frames differ in most of the picture. Only another light changes the still parts too.
fn differs_all_over(a: &Frame, b: &Frame) -> bool {
    let [a, b] = [a, b].map(Thumbnail::new);
    let n_differing = (0..a.len()).filter(|&cell| a.differs_at(&b, cell)).count();
    2 * n_differing > a.len()
}

/// Returns the objects that resemble the animal. Fails if they are animals and the parameters do not say
/// which one to follow.
fn similar_objects(
    survey: &Survey,
    samples: &Samples,
    subject: &Subject,
    params: &Params,
) -> Result<SimilarObjects, Error> {
    let n_samples = survey.looks.len() as f64;
    let (in_samples, pairs): (Vec<usize>, Vec<[&Look; 2]>) = (0..survey.looks.len())
        .filter_map(|k| {
            let (looks, at) = (&survey.looks[k], survey.animal[k]?);
            Some((k, [&looks[at], &looks[second_animal(looks, at, subject)?]]))
        })
        .unzip();
    let seconds: Vec<&Look> = pairs.iter().map(|[_, second]| *second).collect();
    if (pairs.len() as f64) <= FREQUENT_SHARE * n_samples
        || range_px(&seconds) < MIN_RANGE * subject.diagonal_px
    {
        return Ok(SimilarObjects::None);
    }
    match Mirror::from_pairs(&pairs, subject.diagonal_px) {
        Some(_) if samples.are_masked() => Ok(SimilarObjects::None),
        Some(mirror) => Ok(SimilarObjects::MirrorImage(mirror)),
        None if params.follow == Follow::One && params.animal_at.is_none() => {
            // In a pair from the middle of the list, both animals are fully in view.
            let at = pairs.len() / 2;
            Err(Error::SeveralAnimals {
                frame: samples.frame_idx[in_samples[at]],
                boxes_px: pairs[at].map(|look| look.box_px),
            })
        }
        None => Ok(SimilarObjects::Animals),
    }
}

/// Returns another component that resembles the subject and has a comparable area. The gap to the animal must
/// exceed the length of the shorter one. Returns `None` if there is none.
fn second_animal(looks: &[Look], animal: usize, subject: &Subject) -> Option<usize> {
    let first = &looks[animal];
    (0..looks.len()).find(|&at| {
        let look = &looks[at];
        at != animal
            && !look.is_ghost
            && look.area_px >= (MIN_SECOND_AREA * first.area_px).max(MIN_AREA_PX as f64)
            && subject.cost(look) < FITS
            && look.is_shadow == first.is_shadow
            && gap_px(&look.box_px, &first.box_px)
                > longest(&first.box_px).min(longest(&look.box_px))
    })
}

/// Returns the range of the centroids without the outermost tenth, pixels: the larger of x and y.
fn range_px(looks: &[&Look]) -> f64 {
    let along = |axis: usize| {
        let mut values: Vec<f64> = looks.iter().map(|look| look.centroid_px[axis]).collect();
        let mut at = |share| order::percentile(&mut values, share).unwrap_or(0.0);
        at(0.95) - at(0.05)
    };
    along(0).max(along(1))
}

fn longest(rect: &Rect) -> u32 {
    rect.w.max(rect.h)
}

/// Returns the gap between two boxes, pixels: the larger of x and y; 0 where they touch or overlap.
fn gap_px(a: &Rect, b: &Rect) -> u32 {
    let apart =
        |a0: u32, a1: u32, b0: u32, b1: u32| b0.saturating_sub(a1).max(a0.saturating_sub(b1));
    apart(a.x, a.right(), b.x, b.right()).max(apart(a.y, a.bottom(), b.y, b.bottom()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::ColorSpec;

    #[test]
    fn only_another_light_differs_all_over() {
        let mut scene = Frame::new(320, 240, ColorSpec::default());
        for (at, value) in scene.planes[..320 * 240].iter_mut().enumerate() {
            *value = if (at % 320 / 40 + at / 320 / 40).is_multiple_of(2) {
                60
            } else {
                160
            };
        }
        let mut bluer = scene.clone();
        bluer.planes[320 * 240..][..160 * 120].fill(145);
        assert!(differs_all_over(&scene, &bluer));
        let mut moved = scene.clone();
        moved.planes[..320 * 240].rotate_left(8);
        assert!(!differs_all_over(&scene, &moved));
        let mut crossed = scene.clone();
        crossed.planes[..320 * 80].fill(220);
        assert!(!differs_all_over(&scene, &crossed));
    }
}
