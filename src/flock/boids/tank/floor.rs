//! Extent of the floor in top view: the part of the background that looks like the floor on which the animal
//! was seen.

use super::site::Line;
use crate::order::percentile;
use crate::raster::RgbImage;

/// Least number of samples along the longer side of the background. Free choice.
const N_PLACES: u32 = 320;
/// Largest share of samples in a strip that may not look like the floor. It is small because a rim is thin.
/// Free choice.
const MOST_OTHER: f64 = 0.05;
/// Least difference from nearly all of the floor found so far that is no longer floor. It is a share of the
/// brightness of the floor, or a number of levels of 255 if that is more. Uneven light changes by less from
/// one strip to the next. Free choices.
const OTHER_SHARE: f64 = 0.1;
const OTHER_LEVELS: f64 = 5.0;

/// Samples of the background.
pub(super) struct Floor {
    places: Vec<Place>,
    /// Size of the background, and distance between samples, pixels.
    size_px: [f64; 2],
    spacing_px: f64,
}

struct Place {
    at_px: [f64; 2],
    rgb: [u8; 3],
}

impl Floor {
    pub(super) fn of(background: &RgbImage) -> Floor {
        let (width, height) = (background.width, background.height);
        let spacing = (width.max(height) / N_PLACES).max(1) as usize;
        let row = move |y| (0..width).step_by(spacing).map(move |x| (x, y));
        let all = (0..height).step_by(spacing).flat_map(row);
        Floor {
            places: all
                .map(|(x, y)| Place {
                    at_px: [f64::from(x) + 0.5, f64::from(y) + 0.5],
                    rgb: background.pixel(x, y),
                })
                .collect(),
            size_px: [width, height].map(f64::from),
            spacing_px: spacing as f64,
        }
    }

    /// Moves each line outward by `by_px` where the floor continues in the strip that this adds, but not
    /// beyond the image. Returns whether any line moved.
    pub(super) fn widen(&self, lines: &mut [Line], by_px: f64) -> bool {
        let Some(usual) = self.usual(lines) else {
            return false;
        };
        let mut moved = false;
        for line in 0..lines.len() {
            let (outward, px) = lines[line];
            let farther_px = (px + by_px).min(self.extent_px(outward));
            if farther_px <= px {
                continue;
            }
            let is_beyond = |place: &&Place| {
                let along_px = along(outward, place.at_px);
                px < along_px
                    && along_px <= farther_px
                    && (lines.iter().enumerate())
                        .all(|(k, &(u, px))| k == line || along(u, place.at_px) <= px)
            };
            let (mut n, mut n_other) = (0.0, 0.0);
            for place in self.places.iter().filter(is_beyond) {
                let is_usual = (place.rgb.iter().zip(&usual))
                    .all(|(&level, [low, high])| (*low..=*high).contains(&f64::from(level)));
                n += 1.0;
                n_other += f64::from(u8::from(!is_usual));
            }
            if n_other <= MOST_OTHER * n {
                lines[line].1 = farther_px;
                moved = true;
            }
        }
        moved
    }

    /// Returns the range of levels of the floor by channel, from the samples within the lines or next to
    /// them. Returns `None` if there are none.
    fn usual(&self, lines: &[Line]) -> Option<[[f64; 2]; 3]> {
        let is_within = |place: &&Place| {
            (lines.iter()).all(|&(u, px)| along(u, place.at_px) <= px + self.spacing_px)
        };
        let within: Vec<&Place> = self.places.iter().filter(is_within).collect();
        let range = |channel: usize| {
            let mut levels: Vec<f64> = (within.iter())
                .map(|place| f64::from(place.rgb[channel]))
                .collect();
            let mut at = |share| percentile(&mut levels, share);
            let (low, middle, high) = (at(MOST_OTHER)?, at(0.5)?, at(1.0 - MOST_OTHER)?);
            let more = (OTHER_SHARE * middle).max(OTHER_LEVELS);
            Some([low - more, high + more])
        };
        Some([range(0)?, range(1)?, range(2)?])
    }

    /// Returns how far the image reaches in a direction, pixels.
    fn extent_px(&self, outward: [f64; 2]) -> f64 {
        let reach = |axis: usize| (outward[axis] * self.size_px[axis]).max(0.0);
        reach(0) + reach(1)
    }
}

fn along(outward: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    outward[0] * x + outward[1] * y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the offsets of four lines that start as a square around the middle.
    fn ends([width, height]: [u32; 2], pixel: fn(u32, u32) -> [u8; 3], step_px: f64) -> Vec<f64> {
        let pixels = (0..width * height).flat_map(|k| pixel(k % width, k / width));
        let floor = Floor::of(&RgbImage {
            width,
            height,
            pixels: pixels.collect(),
        });
        let middle = [width, height].map(|side| f64::from(side) / 2.0);
        let outward = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let mut lines: Vec<Line> = outward.map(|u| (u, along(u, middle) + 20.0)).to_vec();
        let mut n_rounds = 0;
        while floor.widen(&mut lines, step_px) {
            n_rounds += 1;
            assert!(n_rounds < 10_000, "{lines:?}");
        }
        lines.iter().map(|line| line.1).collect()
    }

    #[test]
    fn the_floor_goes_on_to_the_edges_of_the_picture_however_small_the_animal() {
        for size in [[300, 150], [1920, 1080]] {
            let [w, h] = size.map(f64::from);
            assert_eq!(ends(size, |_, _| [200; 3], 5.0), [w, h, 0.0, 0.0]);
        }
    }

    #[test]
    fn it_goes_on_in_uneven_light_and_over_tiles() {
        let vignette = |x: u32, y: u32| [230 - (x.abs_diff(150) / 3 + y.abs_diff(75) / 2) as u8; 3];
        let tiles = |x: u32, y: u32| {
            [if (x / 10 + y / 10).is_multiple_of(2) {
                90
            } else {
                200
            }; 3]
        };
        for pixel in [vignette, tiles] {
            assert_eq!(ends([300, 150], pixel, 10.0), [300.0, 150.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn it_ends_at_a_rim_at_a_gray_wall_and_at_another_color() {
        let rim = |x: u32, _: u32| [if (250..256).contains(&x) { 120 } else { 200 }; 3];
        let wall = |x: u32, _: u32| [if x < 250 { 230 } else { 175 }; 3];
        let dark = |x: u32, _: u32| [if x < 250 { 10 } else { 21 }; 3];
        let color = |x: u32, _: u32| {
            if x < 250 {
                [90, 160, 90]
            } else {
                [160, 90, 90]
            }
        };
        for pixel in [rim, wall, dark, color] {
            let end = ends([300, 150], pixel, 10.0)[0];
            assert!((240.0..=251.0).contains(&end), "{end}");
        }
    }
}
