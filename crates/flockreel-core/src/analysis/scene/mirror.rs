//! Detects the animal's mirror image in a water surface, a pane or a mirror.
//!
//! An image is a second object that moves as the animal does, mirrored about a horizontal or vertical line.
//! Their coordinates across the line then have a constant sum. Two animals move independently, so the sum
//! varies.

use crate::analysis::subject::Look;
use crate::order::median;
use crate::raster::runs::{self, Component};

/// Largest deviation of an image from its expected place, as a share of the animal's diagonal. Free choice.
const MAX_DEVIATION: f64 = 0.15;
/// Least share of the pairs that must agree with the mirror, 0..=1. Free choice.
const MIN_AGREEING_SHARE: f64 = 0.8;
/// Least number of pairs for a decision. Free choice.
const MIN_PAIRS: usize = 6;
/// Least range of an object that moves, as a share of the animal's diagonal. A swaying plant moves less, and a
/// resting pair agrees with any mirror. Free choice.
pub(super) const MIN_RANGE: f64 = 0.5;

/// A line along an axis of the picture, and the side of it on which images lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// The coordinate that is mirrored: 0 for x, 1 for y.
    axis: usize,
    /// Coordinate of the line along `axis`, pixels.
    line_px: f64,
    /// Whether images have the smaller coordinate.
    is_before: bool,
}

impl Mirror {
    /// Returns whether an object with this centroid is an image.
    pub fn is_image(&self, centroid_px: [f64; 2]) -> bool {
        (centroid_px[self.axis] < self.line_px) == self.is_before
    }

    /// Splits a component at the line. The animal touches its image where it touches the mirror.
    pub fn split(&self, component: Component) -> Vec<Component> {
        let rect = component.rect;
        let line = self.line_px.round().max(0.0) as u32;
        let [mut before, mut after] = [rect; 2];
        match self.axis {
            0 if rect.x < line && line < rect.right() => {
                before.w = line - rect.x;
                (after.x, after.w) = (line, rect.right() - line);
            }
            1 if rect.y < line && line < rect.bottom() => {
                before.h = line - rect.y;
                (after.y, after.h) = (line, rect.bottom() - line);
            }
            _ => return vec![component],
        }
        [before, after]
            .into_iter()
            .flat_map(|half| runs::components(&component.mask(half)))
            .collect()
    }

    /// Returns the mirror that explains the pairs of objects seen together in samples; `None` where none
    /// does. Prefers a horizontal line. `diagonal_px` is the animal's diagonal.
    pub(super) fn from_pairs(pairs: &[[&Look; 2]], diagonal_px: f64) -> Option<Mirror> {
        [1, 0]
            .into_iter()
            .find_map(|axis| Mirror::along(axis, pairs, diagonal_px))
    }

    fn along(axis: usize, pairs: &[[&Look; 2]], diagonal_px: f64) -> Option<Mirror> {
        let tolerance_px = MAX_DEVIATION * diagonal_px;
        let sum = |[a, b]: &[&Look; 2]| a.centroid_px[axis] + b.centroid_px[axis];
        let apart = |[a, b]: &[&Look; 2]| a.centroid_px[1 - axis] - b.centroid_px[1 - axis];
        let usual = median(pairs.iter().map(sum))?;
        let agrees = |pair: &&[&Look; 2]| {
            (sum(pair) - usual).abs() < tolerance_px && apart(pair).abs() < tolerance_px
        };
        let agreeing: Vec<&[&Look; 2]> = pairs.iter().filter(agrees).collect();
        let moved = |c: usize| {
            let at = || agreeing.iter().map(|[a, _]| a.centroid_px[c]);
            at().fold(f64::MIN, f64::max) - at().fold(f64::MAX, f64::min)
        };
        let enough = agreeing.len() >= MIN_PAIRS
            && agreeing.len() as f64 >= MIN_AGREEING_SHARE * pairs.len() as f64
            && moved(0).max(moved(1)) > MIN_RANGE * diagonal_px;
        let line_px = usual / 2.0;
        // An image has less contrast than its object.
        let fainter_before = |[a, b]: &&&[&Look; 2]| {
            let a_is_before = a.centroid_px[axis] < b.centroid_px[axis];
            (a.contrast < b.contrast) == a_is_before
        };
        let n_before = agreeing.iter().filter(fainter_before).count();
        enough.then_some(Mirror {
            axis,
            line_px,
            is_before: 2 * n_before > agreeing.len(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::subject::Color;
    use crate::geometry::Rect;
    use crate::raster::Mask;

    fn look(centroid_px: [f64; 2], contrast: f64) -> Look {
        Look {
            area_px: 400.0,
            color: Color::from_pixels(std::iter::empty()),
            contrast,
            box_px: Rect::of_size(40, 20),
            centroid_px,
            on_border: false,
            light: 0,
            is_shadow: false,
            is_ghost: false,
        }
    }

    fn found(other: impl Fn(f64, [f64; 2]) -> [f64; 2]) -> Option<Mirror> {
        let animal = |k: f64| {
            [
                200.0 + 90.0 * libm::sin(k),
                160.0 + 40.0 * libm::cos(1.7 * k),
            ]
        };
        let looks: Vec<[Look; 2]> = (0..20)
            .map(|k| {
                let here = animal(f64::from(k));
                [look(here, 40.0), look(other(f64::from(k), here), 28.0)]
            })
            .collect();
        let pairs: Vec<[&Look; 2]> = looks.iter().map(|[a, b]| [a, b]).collect();
        Mirror::from_pairs(&pairs, 45.0)
    }

    #[test]
    fn image_in_the_surface_is_distinguished_from_a_second_animal() {
        let mirror = found(|_, [x, y]| [x + 1.0, 222.0 - y]).expect("it is an image");
        assert!(mirror.is_image([100.0, 40.0]) && !mirror.is_image([100.0, 140.0]));
        assert_eq!(found(|k, _| [200.0 + 90.0 * libm::cos(k), 60.0]), None);
    }

    #[test]
    fn animal_at_the_surface_is_split_from_its_image() {
        let mirror = found(|_, [x, y]| [x, 40.0 - y]).expect("it is an image");
        let touching = Mask {
            rect: Rect {
                x: 10,
                y: 14,
                w: 8,
                h: 12,
            },
            bits: vec![1; 96],
        };
        let parts = mirror.split(runs::components(&touching).remove(0));
        let boxes: Vec<[u32; 2]> = parts
            .iter()
            .map(|part| [part.rect.y, part.rect.h])
            .collect();
        assert_eq!(boxes, [[14, 6], [20, 6]]);
        let below = Mask {
            rect: Rect {
                y: 20,
                ..touching.rect
            },
            ..touching
        };
        assert_eq!(mirror.split(runs::components(&below).remove(0)).len(), 1);
    }
}
