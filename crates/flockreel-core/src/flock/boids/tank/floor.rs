//! Extent of the floor in top view: the part of the background that looks like the floor on which the animal
//! was seen.

use super::Line;
use crate::order::percentile;
use crate::raster::RgbImage;

/// Least number of samples along the longer side of the background. Free choice.
const MIN_SAMPLES: u32 = 320;
/// Largest share of samples in a strip that may not look like the floor. It is small because a rim is thin.
/// Free choice.
const MAX_OTHER_SHARE: f64 = 0.05;
/// Least difference from nearly all of the floor found so far that is no longer floor. It is a share of the
/// brightness of the floor, or a number of levels of 255 if that is more. Uneven light changes by less from
/// one strip to the next. Free choices.
const MIN_DIFFERENCE_SHARE: f64 = 0.1;
const MIN_DIFFERENCE_LEVELS: f64 = 5.0;

/// Samples of the background.
pub(super) struct Floor {
    samples: Vec<Sample>,
    /// Size of the background, and distance between samples, pixels.
    size_px: [f64; 2],
    spacing_px: f64,
}

struct Sample {
    at_px: [f64; 2],
    rgb: [u8; 3],
}

impl Floor {
    pub(super) fn new(background: &RgbImage) -> Floor {
        let (width, height) = (background.width, background.height);
        let spacing = (width.max(height) / MIN_SAMPLES).max(1) as usize;
        let sample = |(x, y)| Sample {
            at_px: [f64::from(x) + 0.5, f64::from(y) + 0.5],
            rgb: background.pixel(x, y),
        };
        let row = move |y| (0..width).step_by(spacing).map(move |x| (x, y));
        let all = (0..height).step_by(spacing).flat_map(row);
        Floor {
            samples: all.map(sample).collect(),
            size_px: [width, height].map(f64::from),
            spacing_px: spacing as f64,
        }
    }

    /// Moves each line outward by `by_px` where the floor continues in the strip that this adds, but not
    /// beyond the image. Returns whether any line moved.
    pub(super) fn widen(&self, lines: &mut [Line], by_px: f64) -> bool {
        let Some(usual) = self.usual_levels(lines) else {
            return false;
        };
        let mut moved = false;
        for k in 0..lines.len() {
            let line = lines[k];
            let farther_px = (line.offset_px + by_px).min(self.extent_px(line.outward));
            if farther_px <= line.offset_px {
                continue;
            }
            let mut widened = lines.to_vec();
            widened[k].offset_px = farther_px;
            let is_in_strip = |sample: &&Sample| {
                !line.contains(sample.at_px)
                    && widened.iter().all(|line| line.contains(sample.at_px))
            };
            let (mut n, mut n_other) = (0.0, 0.0);
            for sample in self.samples.iter().filter(is_in_strip) {
                let is_usual = (sample.rgb.iter().zip(&usual))
                    .all(|(&level, [low, high])| (*low..=*high).contains(&f64::from(level)));
                n += 1.0;
                n_other += f64::from(u8::from(!is_usual));
            }
            if n_other <= MAX_OTHER_SHARE * n {
                lines[k].offset_px = farther_px;
                moved = true;
            }
        }
        moved
    }

    /// Returns the range of levels of the floor by channel, from the samples within the lines or next to
    /// them. Returns `None` if there are none.
    fn usual_levels(&self, lines: &[Line]) -> Option<[[f64; 2]; 3]> {
        let is_within = |sample: &&Sample| {
            let is_near =
                |line: &Line| line.along_px(sample.at_px) <= line.offset_px + self.spacing_px;
            lines.iter().all(is_near)
        };
        let within: Vec<&Sample> = self.samples.iter().filter(is_within).collect();
        let range = |channel: usize| {
            let levels = within.iter().map(|sample| f64::from(sample.rgb[channel]));
            let mut levels: Vec<f64> = levels.collect();
            let mut at = |share| percentile(&mut levels, share);
            let low = at(MAX_OTHER_SHARE)?;
            let (middle, high) = (at(0.5)?, at(1.0 - MAX_OTHER_SHARE)?);
            let margin = (MIN_DIFFERENCE_SHARE * middle).max(MIN_DIFFERENCE_LEVELS);
            Some([low - margin, high + margin])
        };
        Some([range(0)?, range(1)?, range(2)?])
    }

    /// Returns how far the image reaches in a direction, pixels.
    fn extent_px(&self, outward: [f64; 2]) -> f64 {
        let reach = |axis: usize| (outward[axis] * self.size_px[axis]).max(0.0);
        reach(0) + reach(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the offsets of four lines that start as a square around the middle.
    fn ends([width, height]: [u32; 2], pixel: fn(u32, u32) -> [u8; 3], step_px: f64) -> Vec<f64> {
        let pixels = (0..width * height).flat_map(|k| pixel(k % width, k / width));
        let floor = Floor::new(&RgbImage {
            width,
            height,
            pixels: pixels.collect(),
        });
        let middle = [width, height].map(|side| f64::from(side) / 2.0);
        let outward = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let mut lines = outward.map(|outward| {
            let from_corner = Line {
                outward,
                offset_px: 0.0,
            };
            let offset_px = from_corner.along_px(middle) + 20.0;
            Line { outward, offset_px }
        });
        let mut n_rounds = 0;
        while floor.widen(&mut lines, step_px) {
            n_rounds += 1;
            assert!(n_rounds < 10_000, "{lines:?}");
        }
        lines.iter().map(|line| line.offset_px).collect()
    }

    #[test]
    fn plain_floor_reaches_the_edges_at_any_body_length() {
        for size in [[300, 150], [1920, 1080]] {
            let [w, h] = size.map(f64::from);
            assert_eq!(ends(size, |_, _| [200; 3], 5.0), [w, h, 0.0, 0.0]);
        }
    }

    #[test]
    fn floor_continues_in_uneven_light_and_over_tiles() {
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
    fn floor_ends_at_rims_walls_and_other_colors() {
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
