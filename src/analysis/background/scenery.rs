//! Scenery that sways: a plant differs from the plate in many samples, always at the same place, while
//! the animal is to be seen elsewhere (ALGORITHMS.md 2.4: its pixels get a large sigma and drop out).

use crate::raster::runs::Component;

/// A place that differs in more than this share of the samples is not where an animal passes by ...
const RECURRENCE: f64 = 0.25;
/// ... if in this share of them something else, which does not recur so, is to be seen as well.
const COMPANY: f64 = 0.5;

/// Whether a component of sample `k` is scenery, told from the components of all samples.
///
/// An animal that sleeps at one place recurs there, but alone.
pub(super) fn is_scenery(found: &[Vec<Component>], k: usize, component: &Component) -> bool {
    let recurs = |c: &Component| {
        let at_same_place = |other: &&Vec<Component>| other.iter().any(|o| same_place(o, c));
        found.iter().filter(at_same_place).count() as f64 > RECURRENCE * found.len() as f64
    };
    if found[k].len() < 2 && found.iter().all(|components| components.len() < 2)
        || !recurs(component)
    {
        return false;
    }
    let mut times = 0;
    let mut in_company = 0;
    for components in found
        .iter()
        .filter(|cs| cs.iter().any(|c| same_place(c, component)))
    {
        times += 1;
        let roams = |c: &&Component| !same_place(c, component) && !recurs(c);
        in_company += usize::from(components.iter().any(|c| roams(&c)));
    }
    in_company as f64 >= COMPANY * f64::from(times)
}

/// Whether the boxes of two components cover mostly the same pixels (Jaccard above one half).
fn same_place(a: &Component, b: &Component) -> bool {
    let both = a.rect.intersection(&b.rect).area();
    2 * both > a.rect.area() + b.rect.area() - both
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
        assert!(is_scenery(&found, 0, &found[0][1]));
        assert!(!is_scenery(&found, 0, &found[0][0]));
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
        assert!(!is_scenery(&found, 0, &found[0][0]));
    }
}
