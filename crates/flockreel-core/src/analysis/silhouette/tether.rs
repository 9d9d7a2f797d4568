//! Separates the animal from a tether: a thin cable, leash or thread that leads to the border of the picture.
//!
//! A distance transform finds the thin parts of a component. The largest thin part that touches the border,
//! or is too long for a tail, is the tether.

use crate::analysis::subject::touches_border;
use crate::raster::Mask;
use crate::raster::runs::{self, Component};

/// Greatest half width of a thin part, as a share of the component's greatest half width. Free choice.
const THIN_SHARE: f64 = 0.45;
/// A thin part with a diagonal above this multiple of the thin half width is too long for a tail. Free
/// choice.
const MIN_LENGTH: f64 = 6.0;
/// Width of the blurred rim around the parts that are not thin, pixels. Free choice.
const RIM_PX: u32 = 2;

/// Returns the half width up to which parts of a component are thin, pixels: a share of its greatest half
/// width.
pub fn thin_px(component: &Component) -> u32 {
    let mut mask = component.mask(component.rect);
    mask.fill_holes();
    let half_width = mask.depth_px().into_iter().max().unwrap_or(0);
    (THIN_SHARE * f64::from(half_width)) as u32
}

/// Splits a component into the animal and its tether.
///
/// A tether touches the border of a picture of the given size. It may also end before the border, when it is
/// long: the background may hide the rest. Returns `None` when there is no tether.
pub fn cut(component: &Component, thin_px: u32, picture: [u32; 2]) -> Option<[Component; 2]> {
    if thin_px == 0 {
        return None;
    }
    let mask = component.mask(component.rect);
    let mut filled = mask.clone();
    filled.fill_holes();
    let depth = filled.depth_px();
    let part = |bits: Vec<u8>| Mask {
        rect: mask.rect,
        bits,
    };
    let thick = part(
        depth
            .iter()
            .map(|&depth| u8::from(depth > thin_px))
            .collect(),
    );
    let thick = thick.dilated_by(thin_px + RIM_PX);
    let thin = part(
        mask.bits
            .iter()
            .zip(&thick.bits)
            .map(|(set, thick)| set & (1 - thick))
            .collect(),
    );
    let tether = runs::components(&thin)
        .into_iter()
        .filter(|part| touches_border(part.rect, picture) || is_long(part, thin_px))
        .max_by_key(|component| component.area)?;
    let tether_mask = tether.mask(mask.rect);
    let remainder = part(
        mask.bits
            .iter()
            .zip(&tether_mask.bits)
            .map(|(set, tether)| set & (1 - tether))
            .collect(),
    );
    let animal = runs::components(&remainder)
        .into_iter()
        .max_by_key(|component| component.area)?;
    Some([animal, tether])
}

/// Returns the point of a tether that is farthest from the animal's centroid, pixels.
pub fn end_px([animal, tether]: &[Component; 2]) -> [f64; 2] {
    let from = animal.centroid_px();
    let ends = tether
        .runs
        .iter()
        .flat_map(|run| [run.x0, run.x1].map(|x| [f64::from(x), f64::from(run.y)]));
    let distance_px = |p: &[f64; 2]| libm::hypot(p[0] - from[0], p[1] - from[1]);
    ends.max_by(|a, b| distance_px(a).total_cmp(&distance_px(b)))
        .unwrap_or(from)
}

fn is_long(part: &Component, thin_px: u32) -> bool {
    let diagonal_px = libm::hypot(f64::from(part.rect.w), f64::from(part.rect.h));
    diagonal_px > MIN_LENGTH * f64::from(thin_px)
}

/// Returns the animal and its tether as two components, or the whole component when there is no tether.
pub fn cut_all(component: Component, thin_px: u32, picture: [u32; 2]) -> Vec<Component> {
    match cut(&component, thin_px, picture) {
        Some(parts) => parts.into(),
        None => vec![component],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rect;

    fn component(set: impl Fn(f64, f64) -> bool) -> Component {
        let rect = Rect::of_size(120, 90);
        let at = |k: u32| u8::from(set(f64::from(k % 120) + 0.5, f64::from(k / 120) + 0.5));
        let mask = Mask {
            rect,
            bits: (0..120 * 90).map(at).collect(),
        };
        runs::components(&mask).remove(0)
    }

    fn animal(x: f64, y: f64) -> bool {
        let tail = (84.0..96.0).contains(&x) && (y - 60.0).abs() < 2.0;
        ((x - 60.0) / 26.0).powi(2) + ((y - 60.0) / 13.0).powi(2) < 1.0 || tail
    }

    #[test]
    fn cable_to_the_border_is_cut_off_and_tail_is_not() {
        let cable = |x: f64, y: f64| y < 60.0 && (x - 40.0 - y / 3.0).abs() < 1.7;
        let both = component(|x, y| animal(x, y) || cable(x, y));
        let [cut_off, tether] = cut(&both, thin_px(&both), [120, 90]).expect("there is a cable");
        let alone = component(animal).area as f64;
        assert!(
            (cut_off.area as f64 / alone - 1.0).abs() < 0.05,
            "{}",
            cut_off.area
        );
        assert_eq!(tether.rect.y, 0);
        assert_eq!(cut(&component(animal), 5, [120, 90]), None);
    }

    #[test]
    fn animal_at_the_border_is_not_cut() {
        let low = component(|x, y| animal(x, y - 25.0));
        assert_eq!(cut(&low, thin_px(&low), [120, 90]), None);
    }
}
