//! An animal that rests for long is in the median of its time, and is not scenery.
//!
//! The plates of short windows of time are compared with the plate of the whole state. A component in which one of them
//! looks like the subject, and the other does not, is the animal at rest: in that window, or in the windows that
//! look like the whole. There its pixels do not show the scene.

use super::light::Light;
use super::occupancy::Occupancy;
use super::plate::Plate;
use super::states::Part;
use super::survey::color_in;
use crate::analysis::silhouette;
use crate::analysis::subject::{FITS, Look, Subject};
use crate::raster::runs::Component;

/// A component below this share of the subject's area is none of it.
const LEAST_SHARE: f64 = 0.3;
/// Two plates that differ by fewer levels than this on average show the same.
const SAME_LEVELS: f64 = 10.0;

/// Marks the samples and pixels in which the subject rests. `windows` are parts of the state that `whole` describes.
pub(super) fn mark(
    seen: &mut Occupancy,
    whole: &Plate,
    windows: &[(Part, &Plate)],
    subject: &Subject,
) {
    for (part, plate) in windows {
        let found = silhouette::components(&plate.frame, whole, &Light::SAME);
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

/// How unlike the subject a component of one plate looks before another.
fn cost(subject: &Subject, plate: &Plate, behind: &Plate, component: &Component) -> f64 {
    let difference = silhouette::difference(&plate.frame, behind, &Light::SAME, component.rect);
    let picture = [plate.frame.width, plate.frame.height];
    let look = Look::of(component, &difference.rgb, &difference.levels, picture);
    subject.cost(&Look {
        color: color_in(&plate.rgb, component),
        ..look
    })
}

/// Whether two plates show the same within a component.
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
