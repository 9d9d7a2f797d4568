//! Splits a component that holds two things: the animal and its mirror image in a wall, or two animals.
//!
//! Each of them differs strongly from the background, and less where they meet. So the blurred difference has
//! two summits and a pass between them. A thin tail is no summit after the blur, and a fin only falls off
//! from the body. A watershed assigns the other pixels to the summits (Vincent & Soille 1991). See
//! docs/explanation/algorithms.md, "Silhouette".

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::analysis::silhouette::Difference;
use crate::raster::Mask;
use crate::raster::runs::{self, Component};

/// Least area of a summit as a share of the animal's median area. Free choice.
const LEAST_SHARE: f64 = 0.15;
/// Greatest height of the pass as a share of the lower summit. Free choice.
const PASS: f64 = 0.7;
/// Greatest contact length, in sides of a square with the area of the smaller part. Free choice.
///
/// An animal and its image touch at a nose, a foot or a part of a flank. A pale zone within one animal meets
/// the rest along a long, ragged line.
const CONTACT: f64 = 1.2;
/// Number of heights tried for the pass. Free choice.
const N_HEIGHTS: usize = 24;

/// Returns the parts of a component with several summits of difference.
///
/// Each part touches the rest along a short line only. The result is empty when the component is one thing.
/// `difference` covers the component's box.
pub(super) fn parts_of(
    component: &Component,
    difference: &Difference,
    usual_area: f64,
) -> Vec<Component> {
    let mask = component.mask(difference.rect);
    let heights = blurred(&mask, difference, (0.02 * usual_area.sqrt()) as usize);
    let Some(summits) = summits(&mask, &heights, LEAST_SHARE * usual_area) else {
        return Vec::new();
    };
    let labels = flooded(&mask, &heights, &summits);
    let part = |label: usize| {
        let bits = labels.iter().map(|&l| u8::from(l == Some(label)));
        let part = Mask {
            rect: mask.rect,
            bits: bits.collect(),
        };
        let is_apart = contact(&part, &mask) <= CONTACT;
        let pieces = runs::components(&part).into_iter();
        pieces
            .reduce(|all, piece| all.joined(piece))
            .filter(|_| is_apart)
    };
    (0..summits.len()).filter_map(part).collect()
}

/// Returns the contact length of a part with the rest of a mask, in sides of a square with the area of the
/// smaller.
fn contact(part: &Mask, all: &Mask) -> f64 {
    let (w, n) = (all.width(), all.bits.len());
    let is_rest = |at: usize| all.bits[at] == 1 && part.bits[at] == 0;
    let touches = |&at: &usize| {
        part.bits[at] == 1
            && ((at % w > 0 && is_rest(at - 1))
                || (at % w < w - 1 && is_rest(at + 1))
                || (at >= w && is_rest(at - w))
                || (at + w < n && is_rest(at + w)))
    };
    let length = (0..n).filter(touches).count() as f64;
    let smaller = part.area().min(all.area() - part.area());
    length / (smaller.max(1) as f64).sqrt()
}

/// Returns the differences within the mask, as means over squares of side 2 `radius` + 1, `radius` limited to
/// 1..=4.
fn blurred(mask: &Mask, difference: &Difference, radius: usize) -> Vec<f32> {
    let (w, h) = (mask.width(), mask.height());
    let radius = radius.clamp(1, 4);
    let masked = difference.levels.iter().zip(&mask.bits);
    let mut values: Vec<f32> = masked
        .map(|(&level, &bit)| f32::from(level * bit))
        .collect();
    // First along rows, then along columns. Beyond the edge, the edge value repeats.
    let mean = |line: &[f32], at: usize| {
        let sum: f32 = (0..=2 * radius)
            .map(|k| line[(at + k).saturating_sub(radius).min(line.len() - 1)])
            .sum();
        sum / (2 * radius + 1) as f32
    };
    for row in values.chunks_exact_mut(w) {
        let line = row.to_vec();
        for (x, value) in row.iter_mut().enumerate() {
            *value = mean(&line, x);
        }
    }
    for x in 0..w {
        let line: Vec<f32> = (0..h).map(|y| values[y * w + x]).collect();
        for y in 0..h {
            values[y * w + x] = mean(&line, y);
        }
    }
    values
}

/// Returns the parts above the lowest height at which several large parts exist.
///
/// Returns `None` when there is no such height, or when a part does not rise far above it.
fn summits(mask: &Mask, heights: &[f32], least_area: f64) -> Option<Vec<Component>> {
    let highest = heights.iter().copied().fold(0.0, f32::max);
    let above = |height: f32| {
        let high = heights.iter().zip(&mask.bits);
        let bits = high.map(|(&h, &bit)| bit * u8::from(h > height)).collect();
        let rect = mask.rect;
        let mut parts = runs::components(&Mask { rect, bits });
        parts.retain(|part| part.area as f64 >= least_area);
        parts
    };
    let top = |part: &Component| {
        let part = part.mask(mask.rect);
        let inside = heights.iter().zip(&part.bits).filter(|(_, bit)| **bit == 1);
        inside.map(|(&height, _)| height).fold(0.0, f32::max)
    };
    for step in 1..N_HEIGHTS {
        let height = highest * step as f32 / N_HEIGHTS as f32;
        let parts = above(height);
        if parts.len() > 1 {
            let lowest = parts.iter().map(top).fold(f32::MAX, f32::min);
            return (f64::from(height) < PASS * f64::from(lowest)).then_some(parts);
        }
    }
    None
}

/// Returns the index of each pixel's summit; pixels are labeled from their neighbors, the highest ones first.
fn flooded(mask: &Mask, heights: &[f32], summits: &[Component]) -> Vec<Option<usize>> {
    let (w, h) = (mask.width(), mask.height());
    let mut labels: Vec<Option<usize>> = vec![None; mask.bits.len()];
    let mut open = BinaryHeap::new();
    // Heights are never negative, so their bit patterns sort like the numbers.
    let entry = |at: usize| (heights[at].to_bits(), Reverse(at));
    for (label, summit) in summits.iter().enumerate() {
        let bits = summit.mask(mask.rect).bits;
        for at in (0..bits.len()).filter(|&at| bits[at] == 1) {
            labels[at] = Some(label);
            open.push(entry(at));
        }
    }
    while let Some((_, Reverse(at))) = open.pop() {
        let (x, y) = (at % w, at / w);
        for ny in y.saturating_sub(1)..=(y + 1).min(h - 1) {
            for nx in x.saturating_sub(1)..=(x + 1).min(w - 1) {
                let other = ny * w + nx;
                if mask.bits[other] == 1 && labels[other].is_none() {
                    labels[other] = labels[at];
                    open.push(entry(other));
                }
            }
        }
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rect;
    use crate::raster::RgbImage;

    /// A scene of 90 x 90 pixels with the given difference, and the largest component above level 10.
    fn scene(level: impl Fn(f64, f64) -> f64) -> (Component, Difference) {
        let rect = Rect::of_size(90, 90);
        let at = |k: u32| level(f64::from(k % 90), f64::from(k / 90)).clamp(0.0, 255.0) as u8;
        let levels: Vec<u8> = (0..90 * 90).map(at).collect();
        let bits = levels.iter().map(|&level| u8::from(level > 10)).collect();
        let component = runs::components(&Mask { rect, bits })
            .into_iter()
            .max_by_key(|c| c.area);
        let rgb = RgbImage::new(90, 90);
        (component.unwrap(), Difference { rect, rgb, levels })
    }

    fn ellipse(x: f64, y: f64, center: [f64; 2], radii: [f64; 2]) -> bool {
        ((x - center[0]) / radii[0]).powi(2) + ((y - center[1]) / radii[1]).powi(2) < 1.0
    }

    fn animal(x: f64, y: f64) -> bool {
        ellipse(x, y, [45.0, 60.0], [25.0, 12.0])
    }

    /// Returns the part that contains the animal's center.
    fn animals_part(both: &Component, difference: &Difference, usual_area: f64) -> Component {
        let parts = parts_of(both, difference, usual_area);
        let mut holding = parts
            .into_iter()
            .filter(|part| part.mask(part.rect).is_set(45, 58));
        holding.next().expect("two things")
    }

    #[test]
    fn a_fainter_mirror_image_that_touches_is_left_out() {
        let (both, difference) = scene(|x, y| {
            let image = ellipse(x, y, [45.0, 30.0], [25.0, 12.0]);
            let bridge = (40.0..50.0).contains(&x) && (38.0..52.0).contains(&y);
            if animal(x, y) {
                180.0
            } else if image {
                70.0
            } else {
                f64::from(u8::from(bridge)) * 25.0
            }
        });
        let usual_area = std::f64::consts::PI * 25.0 * 12.0;
        assert!(both.area as f64 > 1.9 * usual_area);
        let part = animals_part(&both, &difference, usual_area);
        let share = part.area as f64 / usual_area;
        assert!((0.95..1.15).contains(&share) && part.rect.y > 38, "{share}");
    }

    #[test]
    fn so_is_the_part_of_an_image_that_the_frame_leaves() {
        let (both, difference) = scene(|x, y| {
            let image = y < 9.0 && (35.0..55.0).contains(&x);
            let bridge = y < 50.0 && (42.0..48.0).contains(&x);
            if animal(x, y) {
                180.0
            } else if image {
                70.0
            } else {
                f64::from(u8::from(bridge)) * 25.0
            }
        });
        let usual_area = std::f64::consts::PI * 25.0 * 12.0;
        let part = animals_part(&both, &difference, usual_area);
        assert!(part.rect.y > 8, "{:?}", part.rect);
    }

    #[test]
    fn an_animal_with_a_dull_middle_is_one_thing() {
        let (whole, difference) = scene(|x, y| match ellipse(x, y, [45.0, 60.0], [21.0, 15.0]) {
            true if (42.0..50.0).contains(&x) => 40.0,
            true => 180.0,
            false => 0.0,
        });
        assert!(parts_of(&whole, &difference, 500.0).is_empty());
    }

    #[test]
    fn an_animal_with_a_thin_tail_and_a_faint_fin_is_one_thing() {
        let (whole, difference) = scene(|x, y| {
            let tail = (70.0..88.0).contains(&x) && (58.0..62.0).contains(&y);
            let fin = ellipse(x, y, [40.0, 47.0], [12.0, 9.0]);
            if animal(x, y) {
                180.0
            } else if tail {
                120.0
            } else {
                f64::from(u8::from(fin)) * 60.0
            }
        });
        assert!(parts_of(&whole, &difference, 900.0).is_empty());
    }
}
