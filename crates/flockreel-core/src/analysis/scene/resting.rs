//! Finds an animal that rests so long that the median of a time window shows it.
//!
//! Backgrounds of short windows are compared with the background of the whole state. The animal rests in a
//! component that resembles it in one of the two backgrounds but not in the other. If the window's background
//! shows the animal, its pixels count as taken in that window. Otherwise they count as taken in all windows
//! that look like the whole.

use super::background::Background;
use super::light::Light;
use super::occupancy::Occupancy;
use super::pixel_statistics::ranks::SAME_LEVELS;
use super::states::SampleGroup;
use crate::analysis::silhouette;
use crate::analysis::subject::{Color, FITS, Look, Subject};
use crate::raster::runs::Component;

/// Marks the samples and pixels in which the subject rests as taken. `windows` are time windows of the state
/// that `whole` describes, with their backgrounds.
pub(super) fn mark_resting(
    occupancy: &mut Occupancy,
    whole: &Background,
    windows: &[(SampleGroup, &Background)],
    subject: &Subject,
) {
    for (window, background) in windows {
        let found = silhouette::components(&background.frame, whole, &Light::NEUTRAL, &[]);
        for component in found {
            if component.area < subject.least_area_px() {
                continue;
            }
            let here = cost(subject, background, whole, &component);
            let there = cost(subject, whole, background, &component);
            if here.min(there) > FITS {
                continue;
            }
            let rests = if here < there {
                window.samples
            } else {
                let same = windows
                    .iter()
                    .filter(|(_, other)| is_same(other, whole, &component));
                same.fold(0, |all, (window, _)| all | window.samples)
            };
            occupancy.mark_taken(&component, [whole.frame.width, whole.frame.height], rests);
        }
    }
}

/// Returns how unlike the subject (`Subject::cost`) a component of `background` looks in front of `behind`.
fn cost(
    subject: &Subject,
    background: &Background,
    behind: &Background,
    component: &Component,
) -> f64 {
    let difference =
        silhouette::difference(&background.frame, behind, &Light::NEUTRAL, component.rect);
    let picture = [background.frame.width, background.frame.height];
    let look = Look::measure(
        component,
        &difference.rgb,
        &difference.levels,
        picture,
        behind.light,
    );
    subject.cost(&Look {
        color: Color::in_component(&background.rgb, component),
        ..look
    })
}

/// Returns whether two backgrounds show the same within a component.
fn is_same(background: &Background, other: &Background, component: &Component) -> bool {
    let difference =
        silhouette::difference(&background.frame, other, &Light::NEUTRAL, component.rect);
    let mask = component.mask(component.rect);
    let inside = difference
        .levels
        .iter()
        .zip(&mask.bits)
        .filter(|(_, bit)| **bit == 1);
    let sum: u64 = inside.map(|(level, _)| u64::from(*level)).sum();
    sum < u64::from(SAME_LEVELS) * component.area
}
