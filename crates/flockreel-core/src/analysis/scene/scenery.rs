//! Detects swaying scenery: components that recur at one place in many samples while the animal is elsewhere
//! (docs/explanation/algorithms.md, "Light and noise").
//!
//! Example: a plant. A sleeping animal recurs too, but does not appear elsewhere in the same sample.

use crate::raster::runs::Component;

/// Overlap above which a box has not moved at all (Jaccard index). Free choice.
const EXACT_OVERLAP: f64 = 0.8;

/// Share of the samples above which a place recurs too often for a passing animal, 0..=1. Free choice.
const RECURRENCE: f64 = 0.25;

/// Returns whether a component is swaying scenery. `samples` holds the components of all samples, and `animal`
/// the index of the animal among those of each sample.
pub(super) fn is_scenery(
    samples: &[Vec<Component>],
    animal: &[Option<usize>],
    component: &Component,
) -> bool {
    let (mut n_recurrences, mut n_elsewhere) = (0, 0);
    for (components, animal) in samples.iter().zip(animal) {
        if !components
            .iter()
            .any(|other| is_same_place(other, component))
        {
            continue;
        }
        n_recurrences += 1;
        let elsewhere = animal.is_some_and(|at| !is_same_place(&components[at], component));
        n_elsewhere += u32::from(elsewhere);
    }
    f64::from(n_recurrences) > RECURRENCE * samples.len() as f64 && 2 * n_elsewhere >= n_recurrences
}

/// Returns whether at least `least` samples show a component at exactly the same place; its own sample
/// counts.
pub(super) fn recurs_exactly(
    samples: &[Vec<Component>],
    component: &Component,
    least: usize,
) -> bool {
    let here = |components: &&Vec<Component>| {
        components
            .iter()
            .any(|other| overlap(other, component) > EXACT_OVERLAP)
    };
    samples.iter().filter(here).take(least).count() == least
}

/// Returns whether the boxes of two components share most of their pixels.
fn is_same_place(a: &Component, b: &Component) -> bool {
    overlap(a, b) > 0.5
}

/// Returns the Jaccard index of the boxes of two components, 0..=1.
fn overlap(a: &Component, b: &Component) -> f64 {
    let both = a.rect.intersection(&b.rect).area();
    both as f64 / (a.rect.area() + b.rect.area() - both) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rect;

    fn component(x: u32, y: u32, side: u32) -> Component {
        Component {
            runs: vec![],
            area: u64::from(side * side),
            rect: Rect {
                x,
                y,
                w: side,
                h: side,
            },
        }
    }

    #[test]
    fn plant_is_scenery_and_passing_animal_is_not() {
        let plant = component(200, 50, 20);
        let samples: Vec<Vec<Component>> = (0..40)
            .map(|k| {
                let animal = component(4 * k, 90, 15);
                if k % 2 == 0 {
                    vec![animal, plant.clone()]
                } else {
                    vec![animal]
                }
            })
            .collect();
        let animal = vec![Some(0); 40];
        assert!(is_scenery(&samples, &animal, &samples[0][1]));
        assert!(!is_scenery(&samples, &animal, &samples[0][0]));
    }

    #[test]
    fn sleeping_animal_is_not_scenery() {
        let samples: Vec<Vec<Component>> = (0..40u32)
            .map(|k| {
                vec![if k < 20 {
                    component(100, 50, 20)
                } else {
                    component(10 * k, 90, 20)
                }]
            })
            .collect();
        assert!(!is_scenery(&samples, &vec![Some(0); 40], &samples[0][0]));
    }
}
