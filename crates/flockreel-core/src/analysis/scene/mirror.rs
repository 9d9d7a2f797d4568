//! Detects the animal's mirror image in a water surface, a pane or a mirror.
//!
//! An image is a second object that moves as the animal does, mirrored about a line. The steps from image to
//! object then have the direction of the line's normal, and their middles lie on the line. Two animals move
//! independently, so the steps vary.

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

/// A line in the picture, and the side of it on which images lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Unit normal of the line, toward the side of the images.
    normal: [f64; 2],
    /// Distance of the line from the picture's corner along the normal, pixels.
    line_px: f64,
}

impl Mirror {
    /// Returns whether an object with this centroid is an image.
    pub fn is_image(&self, centroid_px: [f64; 2]) -> bool {
        along(self.normal, centroid_px) > self.line_px
    }

    /// Splits a component at the line. The animal touches its image where it touches the mirror.
    pub fn split(&self, component: Component) -> Vec<Component> {
        let rect = component.rect;
        let corners = [rect.x, rect.right()].map(f64::from);
        let corners = corners
            .into_iter()
            .flat_map(|x| [rect.y, rect.bottom()].map(|y| [x, f64::from(y)]));
        let n_behind = corners.filter(|&corner| self.is_image(corner)).count();
        if matches!(n_behind, 0 | 4) {
            return vec![component];
        }
        let mut sides = [component.mask(rect), component.mask(rect)];
        for k in 0..sides[0].bits.len() {
            let (x, y) = (k as u32 % rect.w, k as u32 / rect.w);
            let center = [rect.x + x, rect.y + y].map(|at| f64::from(at) + 0.5);
            sides[usize::from(self.is_image(center))].bits[k] = 0;
        }
        sides.iter().flat_map(runs::components).collect()
    }

    /// Returns the mirror that explains the pairs of objects seen together in samples; `None` where none
    /// does. `diagonal_px` is the animal's diagonal.
    pub(super) fn from_pairs(pairs: &[[&Look; 2]], diagonal_px: f64) -> Option<Mirror> {
        let tolerance_px = MAX_DEVIATION * diagonal_px;
        let step = |[a, b]: &[&Look; 2]| [0, 1].map(|c| a.centroid_px[c] - b.centroid_px[c]);
        let middle =
            |[a, b]: &[&Look; 2]| [0, 1].map(|c| (a.centroid_px[c] + b.centroid_px[c]) / 2.0);
        // The mean axis of the steps. Their angles are doubled, because a step and its opposite have one axis.
        let mut doubled = [0.0; 2];
        for [dx, dy] in pairs.iter().map(step) {
            let angle = 2.0 * libm::atan2(dy, dx);
            doubled = [doubled[0] + libm::cos(angle), doubled[1] + libm::sin(angle)];
        }
        let angle = libm::atan2(doubled[1], doubled[0]) / 2.0;
        let normal = [libm::cos(angle), libm::sin(angle)];
        let tangent = [-normal[1], normal[0]];
        let line_px = median(pairs.iter().map(|pair| along(normal, middle(pair))))?;
        let agrees = |pair: &&[&Look; 2]| {
            2.0 * (along(normal, middle(pair)) - line_px).abs() < tolerance_px
                && along(tangent, step(pair)).abs() < tolerance_px
        };
        let agreeing: Vec<&[&Look; 2]> = pairs.iter().filter(agrees).collect();
        let moved = |c: usize| {
            let at = || agreeing.iter().map(|[a, _]| a.centroid_px[c]);
            at().fold(f64::MIN, f64::max) - at().fold(f64::MAX, f64::min)
        };
        let enough = agreeing.len() >= MIN_PAIRS
            && agreeing.len() as f64 >= MIN_AGREEING_SHARE * pairs.len() as f64
            && moved(0).max(moved(1)) > MIN_RANGE * diagonal_px;
        // An image has less contrast than its object.
        let fainter_ahead = |pair: &&&[&Look; 2]| {
            (pair[0].contrast < pair[1].contrast) == (along(normal, step(pair)) > 0.0)
        };
        let n_ahead = agreeing.iter().filter(fainter_ahead).count();
        let sign = if 2 * n_ahead > agreeing.len() {
            1.0
        } else {
            -1.0
        };
        enough.then_some(Mirror {
            normal: normal.map(|v| sign * v),
            line_px: sign * line_px,
        })
    }
}

/// Returns the distance of a point along a unit vector, pixels.
fn along(unit: [f64; 2], point: [f64; 2]) -> f64 {
    unit[0] * point[0] + unit[1] * point[1]
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
        // A wall at an angle: the image of (x, y) is (y + 150, x - 150).
        let slanted = found(|_, [x, y]| [y + 150.0, x - 150.0]).expect("it is an image");
        assert!(slanted.is_image([300.0, 60.0]) && !slanted.is_image([200.0, 160.0]));
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
