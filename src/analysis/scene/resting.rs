//! Finds an animal that rests so long that the median of a time window shows it.
//!
//! Backgrounds of short windows are compared with the background of the whole state. The animal rests in a
//! component that resembles it in one of the two backgrounds but not in the other. If the window's background
//! shows the animal, its pixels count as taken in that window. Otherwise they count as taken in all windows
//! that look like the whole.

use super::fill;
use super::light::Light;
use super::occupancy::Occupancy;
use super::plate::Plate;
use super::refusal::longest;
use super::states::{Part, bits};
use super::survey::{Survey, color_in};
use crate::analysis::silhouette;
use crate::analysis::subject::{FITS, Look, Subject};
use crate::geometry::Rect;
use crate::raster::runs::Component;

/// Least area of a component, as a share of the subject's area. Free choice.
const LEAST_SHARE: f64 = 0.3;
/// Least number of consecutive samples without the animal, and of samples that show it elsewhere. Free
/// choice.
const LEAST_GAP: usize = 3;
/// Mean difference below which two backgrounds show the same, levels of 255. Free choice.
const SAME_LEVELS: f64 = 10.0;

/// Marks the samples and pixels in which the subject rests as taken. `windows` are parts of the state that
/// `whole` describes, with their backgrounds.
pub(super) fn mark(
    seen: &mut Occupancy,
    whole: &Plate,
    windows: &[(Part, &Plate)],
    subject: &Subject,
) {
    for (part, plate) in windows {
        let found = silhouette::components(&plate.frame, whole, &Light::SAME, &[]);
        for component in found {
            if (component.area as f64) < LEAST_SHARE * subject.area_px() {
                continue;
            }
            let here = cost(subject, plate, whole, &component);
            let there = cost(subject, whole, plate, &component);
            if here.min(there) > FITS {
                continue;
            }
            let rests = match here < there {
                true => part.samples,
                false => {
                    let same = windows
                        .iter()
                        .filter(|(_, other)| is_same(other, whole, &component));
                    same.fold(0, |all, (part, _)| all | part.samples)
                }
            };
            seen.take(&component, [whole.frame.width, whole.frame.height], rests);
        }
    }
}

/// Marks the pixels of an animal that settles where it was last seen moving, and is then lost. No sample
/// shows the scene behind it. Its surroundings, continued across its place, therefore serve as background.
///
/// An animal that hides in a hole differs: the samples in which it is elsewhere show that place without it.
pub(super) fn mark_settled(
    seen: &mut Occupancy,
    whole: &Plate,
    part: u64,
    survey: &Survey,
    subject: &Subject,
) {
    let picture = [whole.frame.width, whole.frame.height];
    let members: Vec<usize> = bits(part).collect();
    let sighting = |k: usize| Some(&survey.looks[k][survey.animal[k]?]);
    for gap in members.chunk_by(|&a, &b| sighting(a).is_none() == sighting(b).is_none()) {
        if gap.len() < LEAST_GAP || sighting(gap[0]).is_some() {
            continue;
        }
        let before = gap[0].checked_sub(1).and_then(sighting);
        let after = gap
            .last()
            .map(|k| k + 1)
            .filter(|k| *k < survey.looks.len());
        for look in before.into_iter().chain(after.and_then(sighting)) {
            let rect = look
                .box_px
                .inflated(longest(&look.box_px) / 3, picture[0], picture[1]);
            let is_elsewhere = |k: &&usize| {
                sighting(**k).is_some_and(|other| other.box_px.intersection(&rect).is_empty())
            };
            if members.iter().filter(is_elsewhere).count() >= LEAST_GAP {
                continue;
            }
            let empty = without(whole, rect);
            let found = silhouette::components(&whole.frame, &empty, &Light::SAME, &[]);
            let with_cost = found.iter().map(|c| (cost(subject, whole, &empty, c), c));
            let best = with_cost.min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, component)) = best.filter(|(cost, _)| *cost < FITS) {
                let samples = gap.iter().fold(0, |all, k| all | 1 << k);
                seen.take(component, picture, samples);
            }
        }
    }
}

/// Returns a copy of the background in which a box is filled smoothly from its surroundings.
fn without(plate: &Plate, rect: Rect) -> Plate {
    let mut rgb = plate.rgb.clone();
    let is_inside = |k: usize| {
        let (x, y) = (k as u32 % rgb.width, k as u32 / rgb.width);
        (rect.x..rect.right()).contains(&x) && (rect.y..rect.bottom()).contains(&y)
    };
    let unknown: Vec<bool> = (0..plate.frame.luma().len()).map(is_inside).collect();
    fill::smooth(&mut rgb, &unknown);
    let mut frame = plate.frame.clone();
    frame.draw_rgb(&rgb, rect);
    Plate {
        core_threshold: plate.core_threshold.clone(),
        ..Plate::of(frame, plate.sigma.clone(), 0)
    }
}

/// Returns how unlike the subject (`Subject::cost`) a component of `plate` looks in front of `behind`.
fn cost(subject: &Subject, plate: &Plate, behind: &Plate, component: &Component) -> f64 {
    let difference = silhouette::difference(&plate.frame, behind, &Light::SAME, component.rect);
    let picture = [plate.frame.width, plate.frame.height];
    let look = Look::of(
        component,
        &difference.rgb,
        &difference.levels,
        picture,
        behind.light,
    );
    subject.cost(&Look {
        color: color_in(&plate.rgb, component),
        ..look
    })
}

/// Returns whether two backgrounds show the same within a component.
fn is_same(plate: &Plate, other: &Plate, component: &Component) -> bool {
    let difference = silhouette::difference(&plate.frame, other, &Light::SAME, component.rect);
    let mask = component.mask(component.rect);
    let inside = difference
        .levels
        .iter()
        .zip(&mask.bits)
        .filter(|(_, bit)| **bit == 1);
    let sum: u64 = inside.map(|(level, _)| u64::from(*level)).sum();
    (sum as f64) < SAME_LEVELS * component.area as f64
}
