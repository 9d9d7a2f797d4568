//! How far the floor goes on that the animal was seen on, seen from above: what looks like it in the background.

use super::site::Line;
use crate::order::median;
use crate::raster::RgbImage;

/// Along the longer side about so many places are looked at.
const N_PLACES: u32 = 160;
/// What is less bright or brighter than where the animal was seen, by this share of it or so many levels of 255, is
/// another thing: a rim, a wall, what lies outside.
const OTHER_SHARE: f64 = 0.3;
const OTHER_LEVELS: f64 = 12.0;
/// A strip with more of other things than this ends the floor.
const MOST_OTHER: f64 = 0.05;

/// The floor, and what is around it.
pub(super) struct Floor {
    /// Places looked at, and whether the floor is seen there.
    places: Vec<([f64; 2], bool)>,
}

impl Floor {
    /// Within these lines the animal was seen.
    pub(super) fn of(background: &RgbImage, seen: &[Line]) -> Floor {
        let (width, height) = (background.width, background.height);
        let spacing = (width.max(height) / N_PLACES).max(1) as usize;
        let row = move |y| (0..width).step_by(spacing).map(move |x| (x, y));
        let at = (0..height).step_by(spacing).flat_map(row);
        let brightness: Vec<([f64; 2], f64)> = at
            .map(|(x, y)| {
                let sum: f64 = background.pixel(x, y).map(f64::from).iter().sum();
                ([f64::from(x) + 0.5, f64::from(y) + 0.5], sum / 3.0)
            })
            .collect();
        let inside = brightness
            .iter()
            .filter(|(place, _)| is_within(seen, *place));
        let usual = median(inside.map(|&(_, level)| level)).unwrap_or(0.0);
        let most_off = (OTHER_SHARE * usual).max(OTHER_LEVELS);
        let is_floor = |level: f64| (level - usual).abs() < most_off;
        Floor {
            places: (brightness.into_iter())
                .map(|(place, level)| (place, is_floor(level)))
                .collect(),
        }
    }

    /// Moves each line out by so many pixels beyond which, and within all the others, the floor goes on.
    pub(super) fn widen(&self, lines: &mut [Line], by_px: f64) {
        for line in 0..lines.len() {
            let mut farther = lines.to_vec();
            farther[line].1 += by_px;
            let beyond = |place| is_within(&farther, place) && !is_within(lines, place);
            let (mut n, mut n_other) = (0.0, 0.0);
            for &(_, is_floor) in self.places.iter().filter(|(place, _)| beyond(*place)) {
                n += 1.0;
                n_other += f64::from(u8::from(!is_floor));
            }
            if n > 0.0 && n_other <= MOST_OTHER * n {
                lines[line].1 += by_px;
            }
        }
    }
}

fn is_within(lines: &[Line], [x, y]: [f64; 2]) -> bool {
    (lines.iter()).all(|&(outward, px)| outward[0] * x + outward[1] * y <= px)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Paper up to x = 200, which gets darker by a fifth across it, and a dark rim beyond.
    fn background() -> RgbImage {
        let [width, height] = [300, 150];
        let level = |x: u32| if x < 200 { 170 - (x / 6) as u8 } else { 50 };
        RgbImage {
            width,
            height,
            pixels: (0..width * height)
                .flat_map(|k| [level(k % width); 3])
                .collect(),
        }
    }

    /// A box in the middle of the paper.
    fn seen() -> Vec<Line> {
        let edges = [120.0, 90.0, -60.0, -60.0];
        let outward = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        outward.into_iter().zip(edges).collect()
    }

    #[test]
    fn the_floor_goes_on_in_uneven_light_and_ends_at_a_rim_and_at_the_pictures_edge() {
        let mut lines = seen();
        let floor = Floor::of(&background(), &lines);
        for _ in 0..30 {
            floor.widen(&mut lines, 10.0);
        }
        let ends: Vec<f64> = lines.iter().map(|line| line.1).collect();
        assert_eq!(ends, [200.0, 150.0, 0.0, 0.0]);
    }
}
