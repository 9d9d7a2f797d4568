//! Scenery that sways: a plant differs from the plate in many samples, always at the same place, while
//! the animal is to be seen elsewhere (ALGORITHMS.md 2.4: its pixels get a large sigma and drop out).

use crate::raster::runs::Component;

/// Boxes with more than this in common are at the same place ...
const MOSTLY_THERE: f64 = 0.5;
/// ... and with more than this have not moved at all.
const JUST_THERE: f64 = 0.8;

/// A place that differs in more than this share of the samples is not where an animal passes by ...
const RECURRENCE: f64 = 0.25;
/// ... if in this share of them the animal is seen elsewhere.
const COMPANY: f64 = 0.5;

/// Whether a component is scenery, told from the components of all samples and from which of them is the animal.
///
/// An animal that sleeps recurs at its place too, but is not seen elsewhere meanwhile.
pub(super) fn is_scenery(
    found: &[Vec<Component>],
    animal: &[Option<usize>],
    component: &Component,
) -> bool {
    let (mut n_times, mut n_in_company) = (0, 0);
    for (components, animal) in found.iter().zip(animal) {
        if !components.iter().any(|other| same_place(other, component)) {
            continue;
        }
        n_times += 1;
        let elsewhere = animal.is_some_and(|at| !same_place(&components[at], component));
        n_in_company += usize::from(elsewhere);
    }
    f64::from(n_times) > RECURRENCE * found.len() as f64
        && f64::from(n_in_company as u32) >= COMPANY * f64::from(n_times)
}

/// Whether a component is seen just where it is in so many samples, its own included.
pub(super) fn recurs(found: &[Vec<Component>], component: &Component, least: usize) -> bool {
    let here = |components: &&Vec<Component>| {
        components
            .iter()
            .any(|other| overlap(other, component) > JUST_THERE)
    };
    found.iter().filter(here).take(least).count() == least
}

/// Whether the boxes of two components cover mostly the same pixels.
fn same_place(a: &Component, b: &Component) -> bool {
    overlap(a, b) > MOSTLY_THERE
}

/// Jaccard's index of the boxes of two components, 0..=1.
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
    fn a_plant_is_scenery_and_the_animal_passing_it_is_not() {
        let plant = component(200, 50, 20);
        let found: Vec<Vec<Component>> = (0..40)
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
        assert!(is_scenery(&found, &animal, &found[0][1]));
        assert!(!is_scenery(&found, &animal, &found[0][0]));
    }

    #[test]
    fn an_animal_asleep_is_not_scenery() {
        let found: Vec<Vec<Component>> = (0..40u32)
            .map(|k| {
                vec![if k < 20 {
                    component(100, 50, 20)
                } else {
                    component(10 * k, 90, 20)
                }]
            })
            .collect();
        assert!(!is_scenery(&found, &vec![Some(0); 40], &found[0][0]));
    }
}
