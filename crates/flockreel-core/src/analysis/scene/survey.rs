//! Finds the components of the samples that differ from the background, and decides which one is the animal
//! (docs/explanation/algorithms.md, "Silhouette").
//!
//! [`Subject::learn`] derives the animal's typical appearance from all samples. The survey marks ghosts:
//! places at which the background shows the animal and the sample does not. It also cuts off a tether, such
//! as a cable.

use rayon::prelude::*;

use super::background::Background;
use super::ghost;
use super::light::Light;
use super::samples::{MIN_AGREEING, Samples};
use super::scenery;
use crate::analysis::silhouette::cast_shadow::{self, Lump};
use crate::analysis::silhouette::{self, Difference, shadow, tether};
use crate::analysis::subject::{Color, Look, MIN_AREA_PX, Subject, touches_border};
use crate::order;
use crate::raster::runs::{Component, Run};
use crate::raster::{Frame, Mask};

/// Number of components kept per sample, largest first; further ones are noise. Free choice.
const MAX_COMPONENTS: usize = 24;

/// A tether ends at a fixed place if the spread of its ends is below this share of the animal's spread. The
/// background may hide the rest of such a tether. Free choice.
const MAX_END_SPREAD: f64 = 0.4;

/// The components of every sample that differ from its background; a sample without a background has none.
pub(super) struct Survey {
    /// Components of each sample, largest first.
    pub(super) components: Vec<Vec<Component>>,
    /// Appearance of each of the components.
    pub(super) looks: Vec<Vec<Look>>,
    /// Typical appearance of the animal; `None` where no component can be the animal.
    pub(super) subject: Option<Subject>,
    /// How well the subject explains the samples (`Subject::score`); 0 without a subject.
    pub(super) score: f64,
    /// Half the width below which a part of a component is thin, pixels (`silhouette::tether`). `None`
    /// without a tether. With one, tethers are components of their own.
    pub(super) tether_px: Option<u32>,
    /// Whether a component lies at the point that the parameter `animal_at` gives.
    pub(super) is_pinned: bool,
    /// Whether every frame comes with a mask of the animal.
    is_masked: bool,
    /// Index of the animal's component in each sample; `None` where it is not found.
    pub(super) animal: Vec<Option<usize>>,
}

impl Survey {
    /// Compares every sample with its background in `backgrounds`. The light of the samples must be equalized.
    /// If the animal has a tether, cuts it off and repeats the survey.
    pub(super) fn new(samples: &Samples, backgrounds: &[Option<&Background>]) -> Survey {
        let components_of = |k: usize| match backgrounds[k] {
            Some(background) => {
                let (frame, ignored) = (&samples.frames[k], &samples.ignored[k]);
                silhouette::components(frame, background, &Light::NEUTRAL, ignored)
            }
            None => Vec::new(),
        };
        let found: Vec<Vec<Component>> = (0..samples.frames.len())
            .into_par_iter()
            .map(components_of)
            .collect();
        let whole = Survey::from_components(found.clone(), samples, backgrounds);
        if samples.are_masked() {
            return whole;
        }
        let Some(thin_px) = whole.thin_px(samples) else {
            return whole;
        };
        let cut = |component| tether::cut_all(component, thin_px, samples.size_px());
        let without_tether = found
            .into_iter()
            .map(|c| c.into_iter().flat_map(cut).collect());
        Survey {
            tether_px: Some(thin_px),
            ..Survey::from_components(without_tether.collect(), samples, backgrounds)
        }
    }

    /// Returns each sample around the animal, with its background and the animal's silhouette in the same box.
    pub(super) fn animals_seen<'a>(
        &self,
        samples: &Samples,
        backgrounds: &[Option<&'a Background>],
        margin_px: u32,
    ) -> Vec<(Difference, &'a Background, Mask)> {
        let [width, height] = samples.size_px();
        let seen = |k: usize| {
            let (background, component) = (backgrounds[k]?, &self.components[k][self.animal[k]?]);
            let rect = component.rect.inflated(margin_px, width, height);
            let (frame, light) = (&samples.frames[k], Light::NEUTRAL);
            let difference = silhouette::difference(frame, background, &light, rect);
            Some((difference, background, component.mask(rect)))
        };
        (0..samples.frames.len()).filter_map(seen).collect()
    }

    fn from_components(
        mut found: Vec<Vec<Component>>,
        samples: &Samples,
        backgrounds: &[Option<&Background>],
    ) -> Survey {
        for components in &mut found {
            components.retain(|c| c.area >= MIN_AREA_PX);
            components.sort_by_key(|c| std::cmp::Reverse(c.area));
            components.truncate(MAX_COMPONENTS);
        }
        let looks_of = |(k, components): (usize, &Vec<Component>)| {
            let looks = components
                .iter()
                .filter_map(|c| Some(measure(&samples.frames[k], backgrounds[k]?, c)));
            looks.collect()
        };
        let mut looks: Vec<Vec<Look>> = found.par_iter().enumerate().map(looks_of).collect();
        let pinned = samples.pinned.and_then(|(k, point_px)| {
            let at = nearest_component(&found[k], point_px)?;
            Some((k, at))
        });
        let subject = Subject::learn(&looks, pinned);
        for ((looks, components), background) in looks.iter_mut().zip(&found).zip(backgrounds) {
            for (look, component) in looks.iter_mut().zip(components) {
                let shows_animal = |background: &Background, subject: &Subject| {
                    subject.prefers(&Color::in_component(&background.rgb, component), look)
                };
                look.is_ghost = look.is_ghost
                    && scenery::recurs_exactly(&found, component, MIN_AGREEING)
                    && (background.zip(subject.as_ref()))
                        .is_some_and(|(background, subject)| shows_animal(background, subject));
            }
        }
        let mut animal = match &subject {
            Some(subject) => subject.choices(&looks),
            None => vec![None; looks.len()],
        };
        if let Some((k, at)) = pinned {
            animal[k] = Some(at);
        }
        Survey {
            score: subject
                .as_ref()
                .map_or(0.0, |subject| subject.score(&looks)),
            tether_px: None,
            is_masked: samples.are_masked(),
            is_pinned: pinned.is_some(),
            components: found,
            looks,
            subject,
            animal,
        }
    }

    /// Returns the brightness of the hard shadow that the animal casts, from the largest component of each sample;
    /// `None` without one.
    pub(super) fn cast_shadow(
        &self,
        samples: &Samples,
        backgrounds: &[Option<&Background>],
    ) -> Option<f32> {
        let lump_of = |k: usize| {
            let (background, largest) = (backgrounds[k]?, self.components[k].first()?);
            let frame = &samples.frames[k];
            let difference =
                silhouette::difference(frame, background, &Light::NEUTRAL, largest.rect);
            Some(Lump::largest(&difference, background, largest))
        };
        let lumps: Vec<Lump> = (0..samples.frames.len()).filter_map(lump_of).collect();
        cast_shadow::usual_brightness(&lumps)
    }

    /// Returns half the width below which a part is thin, pixels; `None` if few sightings show a tether. A
    /// tether is a thin part that reaches the border or always ends at one place. The end of a tail moves
    /// with the animal.
    fn thin_px(&self, samples: &Samples) -> Option<u32> {
        let picture = samples.size_px();
        let animals = self.animal.iter().enumerate();
        let animals: Vec<&Component> = animals
            .filter_map(|(k, at)| Some(&self.components[k][(*at)?]))
            .collect();
        let thin_px = order::median(animals.iter().map(|c| f64::from(tether::thin_px(c))))? as u32;
        let cut = |whole: &&Component| tether::cut(whole, thin_px, picture);
        let parts: Vec<[Component; 2]> = animals.iter().filter_map(cut).collect();
        let n_at_border = parts
            .iter()
            .filter(|[_, tether]| touches_border(tether.rect, picture))
            .count();
        let ends: Vec<[f64; 2]> = parts.iter().map(tether::end_px).collect();
        let places: Vec<[f64; 2]> = parts
            .iter()
            .map(|[animal, _]| animal.centroid_px())
            .collect();
        let is_anchored = spread_px(&ends) < MAX_END_SPREAD * spread_px(&places);
        let n_tethered = if is_anchored {
            parts.len()
        } else {
            n_at_border
        };
        (2 * n_tethered > animals.len()).then_some(thin_px)
    }

    /// Returns the subject's score over the root of its area, and so without its size. A threshold that is
    /// too low enlarges the animal by scenery.
    pub(super) fn starkness(&self) -> f64 {
        let area_px = self.subject.as_ref().map_or(1.0, Subject::area_px);
        self.score / area_px.sqrt()
    }

    /// Returns the subject's score times the share of all that differs which is the animal. The rest is scenery,
    /// other objects, or ghosts.
    pub(super) fn explained(&self) -> f64 {
        let chosen = self.looks.iter().zip(&self.animal);
        let animals = chosen.filter_map(|(looks, at)| Some(&looks[(*at)?]));
        self.score * self.share_px(animals)
    }

    /// Returns the share of all that differs which is a ghost, 0..=1.
    pub(super) fn ghost_share(&self) -> f64 {
        let looks = self.looks.iter().flatten();
        self.share_px(looks.filter(|look| look.is_ghost))
    }

    fn share_px<'a>(&self, some: impl Iterator<Item = &'a Look>) -> f64 {
        let all_px: f64 = self.looks.iter().flatten().map(|look| look.area_px).sum();
        some.map(|look| look.area_px).sum::<f64>() / all_px.max(1.0)
    }

    /// Returns the total area of the components of a sample, pixels: the median over the samples.
    pub(super) fn differing_px(&self) -> f64 {
        let area_px = |looks: &Vec<Look>| looks.iter().map(|look| look.area_px).sum::<f64>();
        order::median(self.looks.iter().map(area_px)).unwrap_or(0.0)
    }

    /// Returns whether component `at` of sample `k` is swaying scenery; always false with masks.
    pub(super) fn is_scenery(&self, k: usize, at: usize) -> bool {
        !self.is_masked
            && scenery::is_scenery(&self.components, &self.animal, &self.components[k][at])
    }

    /// Returns the least area of a moving object, pixels: 0.3 of the subject's, but at least `MIN_AREA_PX`.
    pub(super) fn least_area_px(&self) -> u64 {
        let subject = self.subject.as_ref();
        subject.map_or(MIN_AREA_PX, Subject::least_area_px)
    }
}

/// Returns the median distance of points from their coordinate-wise median, pixels.
fn spread_px(points: &[[f64; 2]]) -> f64 {
    let middle = [0, 1].map(|axis| order::median(points.iter().map(|p| p[axis])).unwrap_or(0.0));
    let distances = points
        .iter()
        .map(|p| libm::hypot(p[0] - middle[0], p[1] - middle[1]));
    order::median(distances).unwrap_or(0.0)
}

fn measure(frame: &Frame, background: &Background, component: &Component) -> Look {
    let difference = silhouette::difference(frame, background, &Light::NEUTRAL, component.rect);
    let picture = [frame.width, frame.height];
    let look = Look::measure(
        component,
        &difference.rgb,
        &difference.levels,
        picture,
        background.light,
    );
    if frame.mask.is_some() {
        return look;
    }
    Look {
        is_shadow: shadow::is_all_shadow(&difference, background, component),
        is_ghost: ghost::is_ghost(frame, background, component),
        ..look
    }
}

/// Returns the component at the point, or else the nearest one no farther away than its box is long.
fn nearest_component(components: &[Component], point_px: [f64; 2]) -> Option<usize> {
    let gap_px = |component: &Component| {
        let rect = component.rect;
        let beyond = |v: f64, from: u32, to: u32| (f64::from(from) - v).max(v - f64::from(to));
        let x = beyond(point_px[0], rect.x, rect.right()).max(0.0);
        let y = beyond(point_px[1], rect.y, rect.bottom()).max(0.0);
        libm::hypot(x, y)
    };
    let holds = |component: &Component| {
        let [x, y] = point_px.map(|v| v.floor());
        let inside =
            |run: &Run| y == f64::from(run.y) && f64::from(run.x0) <= x && x < f64::from(run.x1);
        component.runs.iter().any(inside)
    };
    let near = (0..components.len()).filter(|&at| {
        let rect = components[at].rect;
        gap_px(&components[at]) <= f64::from(rect.w.max(rect.h))
    });
    near.min_by(|&a, &b| {
        let rank = |at: usize| (!holds(&components[at]), gap_px(&components[at]));
        let ((out_a, gap_a), (out_b, gap_b)) = (rank(a), rank(b));
        out_a.cmp(&out_b).then(gap_a.total_cmp(&gap_b))
    })
}
