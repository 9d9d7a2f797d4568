//! The light of a frame relative to the plate: exposure, flicker, white balance, mains banding and lamps dimmed
//! from one side are undone by dividing the frame by its [`Light`] (ALGORITHMS.md 2.3).
//!
//! Light is a gain per color channel, the same for the whole picture. Where the film needs more, a luma factor per
//! row and per column follows: their product describes the bands of a rolling shutter along either axis and a light
//! that falls off in any direction. All are medians of pixel ratios, so that the animal does not count.

use std::ops::Range;

use super::plate::Plate;
use crate::order;
use crate::random;
use crate::raster::{Frame, RgbImage};

/// Pixels compared per frame, at fixed places.
const N_SAMPLES: u64 = 4096;
/// Ratios are counted in steps of 1 / 1024, from 0 to 4.
const STEPS: usize = 1024;
/// A channel of the plate at or below this level says nothing about light, levels of 255.
const DARKEST: u32 = 16;
/// Where fewer of the pixels compared are bright enough (5 %), the animal may cover most of them: the light counts as
/// that of the plate.
const LEAST_PROBES: u32 = N_SAMPLES as u32 / 20;
/// Gains that a light can have.
const DARKEST_GAIN: f32 = 0.2;
const BRIGHTEST_GAIN: f32 = 3.9;
/// Pixels compared in a row or column, at most.
const ALONG: usize = 160;
/// Fewer bright pixels than this in a row or column say nothing about its light.
const LEAST_ALONG: usize = 24;
/// Light is colored where a channel's gain deviates from that of luma by this share.
const COLORED: f32 = 0.02;
/// Rows and columns whose factors are averaged, to either side. A 100 Hz lamp gives at most about ten bands a
/// picture, far broader than this.
const SMOOTH: usize = 2;
/// Light is uneven where rows or columns deviate by more than this share at the 90th percentile ...
const UNEVEN: f64 = 0.012;
/// ... in more than this share of the frames examined.
const UNEVEN_SHARE: f64 = 0.1;

/// How much brighter a frame is than its plate.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Gain of R, G and B; 1 where frame and plate are equally bright.
    pub rgb: [f32; 3],
    /// What remains, for luma; `None` where the light is even.
    field: Option<Field>,
}

/// Luma factors on top of the gain: at (x, y) the light is `gain * rows[y] * columns[x]`.
#[derive(Clone, Debug, PartialEq)]
struct Field {
    rows: Vec<f32>,
    columns: Vec<f32>,
}

impl Light {
    /// The light of the plate itself.
    pub const SAME: Light = Light {
        rgb: [1.0; 3],
        field: None,
    };

    /// The gain of luma, close enough for finding candidate places.
    pub fn luma(&self) -> f32 {
        0.3 * self.rgb[0] + 0.59 * self.rgb[1] + 0.11 * self.rgb[2]
    }

    /// 1 / gain per channel in 12-bit fixed point: `(value * factor + 2048) >> 12` is in the plate's light.
    pub fn to_plate(&self) -> [i32; 3] {
        self.rgb.map(|gain| (4096.0 / gain).round() as i32)
    }

    /// Whether the light differs over the picture.
    pub fn is_uneven(&self) -> bool {
        self.field.is_some()
    }

    /// The luma factor at a pixel on top of the gain; 1 where the light is even.
    pub fn factor(&self, x: usize, y: usize) -> f32 {
        let of = |field: &Field| field.rows[y] * field.columns[x];
        self.field.as_ref().map_or(1.0, of)
    }

    /// Divides a frame by its light: luma pixel by pixel, chroma by the gain of luma; all channels one by one where the light is
    /// colored.
    pub fn undo(&self, frame: &mut Frame) {
        let gain = self.luma();
        self.undo_gain(frame, gain);
        let tint = self.rgb.map(|of_channel| of_channel / gain);
        if tint.iter().all(|t| (t - 1.0).abs() < COLORED) {
            return;
        }
        let mut image = frame.to_rgb();
        for pixel in image.pixels.chunks_exact_mut(3) {
            for (value, tint) in pixel.iter_mut().zip(tint) {
                *value = (f32::from(*value) / tint).round().min(255.0) as u8;
            }
        }
        frame.draw_all_rgb(&image);
    }

    fn undo_gain(&self, frame: &mut Frame, gain: f32) {
        if (gain - 1.0).abs() < 0.002 && !self.is_uneven() {
            return;
        }
        let black = frame.color.black();
        let (width, n_px) = (
            frame.width as usize,
            frame.width as usize * frame.height as usize,
        );
        let scaled = |value: u8, zero: f32, gain: f32| {
            (zero + (f32::from(value) - zero) / gain)
                .round()
                .clamp(0.0, 255.0) as u8
        };
        let (luma, chroma) = frame.planes.split_at_mut(n_px);
        let table: Vec<u8> = (0..=255).map(|y| scaled(y, black, gain)).collect();
        match &self.field {
            None => luma
                .iter_mut()
                .for_each(|value| *value = table[usize::from(*value)]),
            Some(field) => {
                for (row, &by_row) in luma.chunks_exact_mut(width).zip(&field.rows) {
                    for (value, &by_column) in row.iter_mut().zip(&field.columns) {
                        *value = scaled(*value, black, gain * by_row * by_column);
                    }
                }
            }
        }
        let table: Vec<u8> = (0..=255).map(|c| scaled(c, 128.0, gain)).collect();
        for value in chroma {
            *value = table[usize::from(*value)];
        }
    }
}

/// A pixel whose light is compared in every frame.
pub struct Probe {
    /// Indices of its luma and its chroma.
    luma_at: u32,
    chroma_at: u32,
    /// R, G, B of the plate.
    base: [u32; 3],
    /// 2^32 / base, rounded up, so that division is a multiplication; 0 where the plate is too dark.
    inverse: [u32; 3],
}

/// The pixels compared with a plate, in the order of their places.
pub fn probes(plate: &RgbImage) -> Vec<Probe> {
    let n_px = u64::from(plate.width) * u64::from(plate.height);
    let mut places: Vec<u32> = (0..N_SAMPLES)
        .map(|k| (random::bits(0, &[k]) % n_px) as u32)
        .collect();
    places.sort_unstable();
    let probe = |luma_at: u32| {
        let (x, y) = (luma_at % plate.width, luma_at / plate.width);
        let base = plate.pixel(x, y).map(u32::from);
        let inverse = |base| match base {
            0..=DARKEST => 0,
            base => (1u64 << 32).div_ceil(u64::from(base)) as u32,
        };
        Probe {
            luma_at,
            chroma_at: y / 2 * plate.width.div_ceil(2) + x / 2,
            base,
            inverse: base.map(inverse),
        }
    };
    places.into_iter().map(probe).collect()
}

/// The light of a frame: the gain alone, and rows and columns as well where the plate's film needs them.
pub fn of(frame: &Frame, plate: &Plate) -> Light {
    let mut light = Light {
        rgb: gain(frame, plate),
        field: None,
    };
    if plate.uneven_light {
        light.field = Some(field(frame, &plate.frame, light.luma()));
    }
    light
}

/// Whether the light of a film differs over the picture, from some of its frames.
pub fn is_uneven<'a>(frames: impl ExactSizeIterator<Item = &'a Frame>, plate: &Plate) -> bool {
    let n_frames = frames.len();
    let deviates = |frame: &Frame| {
        let field = field(frame, &plate.frame, luma_of(gain(frame, plate)));
        let off = |factors: &[f32]| {
            let mut off: Vec<f64> = factors.iter().map(|f| f64::from((f - 1.0).abs())).collect();
            order::percentile(&mut off, 0.9).unwrap_or(0.0)
        };
        off(&field.rows).max(off(&field.columns)) > UNEVEN
    };
    let n_uneven = frames.filter(|frame| deviates(frame)).count();
    n_uneven as f64 > UNEVEN_SHARE * n_frames as f64
}

fn luma_of(rgb: [f32; 3]) -> f32 {
    Light { rgb, field: None }.luma()
}

/// The median ratio of the frame to the plate, per channel. Pixels that differ by more than a quarter from the median
/// of all (the animal, wherever it is) do not count.
fn gain(frame: &Frame, plate: &Plate) -> [f32; 3] {
    let convert = frame.color.to_rgb();
    let (luma, (u, v)) = (frame.luma(), frame.chroma());
    let mut counts = [[0u16; 4 * STEPS]; 3];
    for probe in &plate.probes {
        let chroma = probe.chroma_at as usize;
        let rgb = convert.convert(luma[probe.luma_at as usize], u[chroma], v[chroma]);
        for channel in 0..3 {
            // (value * STEPS + base / 2) / base, exact because the dividend is below 2^19.
            let dividend = u32::from(rgb[channel]) * STEPS as u32 + probe.base[channel] / 2;
            let ratio = (u64::from(dividend) * u64::from(probe.inverse[channel])) >> 32;
            counts[channel][(ratio as usize).min(4 * STEPS - 1)] += 1;
        }
    }
    let n_dark = |channel: usize| {
        let dark = plate.probes.iter().filter(|p| p.inverse[channel] == 0);
        dark.count() as u16
    };
    let median = |channel: usize| {
        counts[channel][0] -= n_dark(channel);
        median_ratio(&counts[channel])
    };
    let gains = [0, 1, 2].map(median);
    // A channel too dark to tell has the gain of the others.
    let known: Vec<f32> = gains.iter().flatten().copied().collect();
    let usual = match known.len() {
        0 => 1.0,
        n => known.iter().sum::<f32>() / n as f32,
    };
    gains.map(|gain| gain.unwrap_or(usual))
}

/// The median of the counted ratios near their median; `None` when too few pixels are bright enough, or when they do
/// not agree: then it is not light in which they differ.
fn median_ratio(counts: &[u16; 4 * STEPS]) -> Option<f32> {
    let n: u32 = counts.iter().map(|&count| u32::from(count)).sum();
    let middle = median_step(counts, 0..4 * STEPS);
    let near = middle - middle / 4..(middle + middle / 4 + 1).min(4 * STEPS);
    let n_near: u32 = counts[near.clone()].iter().map(|&c| u32::from(c)).sum();
    let gain = median_step(counts, near) as f32 / STEPS as f32;
    let agree =
        n >= LEAST_PROBES && 2 * n_near > n && (DARKEST_GAIN..BRIGHTEST_GAIN).contains(&gain);
    agree.then_some(gain)
}

/// The step at which half of the count within `steps` is reached.
fn median_step(counts: &[u16; 4 * STEPS], steps: Range<usize>) -> usize {
    let n: u32 = counts[steps.clone()].iter().map(|&c| u32::from(c)).sum();
    let mut below = 0;
    steps
        .clone()
        .find(|&step| {
            below += u32::from(counts[step]);
            2 * below >= n
        })
        .unwrap_or(steps.start)
}

/// The factors of rows, then of columns once the rows are divided out.
fn field(frame: &Frame, plate: &Frame, gain: f32) -> Field {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let black = frame.color.black();
    let (luma, base) = (frame.luma(), plate.luma());
    let ratio = |at: usize| {
        let below = f32::from(base[at]) - black;
        (below > DARKEST as f32).then(|| (f32::from(luma[at]) - black) / (gain * below))
    };
    let step_x = width.div_ceil(ALONG);
    let rows = smoothed((0..height).map(|y| {
        let along = (y % step_x..width).step_by(step_x);
        median_factor(along.filter_map(|x| ratio(y * width + x)))
    }));
    let step_y = height.div_ceil(ALONG);
    let columns = smoothed((0..width).map(|x| {
        let along = (x % step_y..height).step_by(step_y);
        median_factor(along.filter_map(|y| Some(ratio(y * width + x)? / rows[y])))
    }));
    Field { rows, columns }
}

/// The median of ratios that light can make; `None` of too few.
fn median_factor(ratios: impl Iterator<Item = f32>) -> Option<f32> {
    let mut ratios: Vec<f32> = ratios.filter(|r| (0.4..2.5).contains(r)).collect();
    if ratios.len() < LEAST_ALONG {
        return None;
    }
    let middle = ratios.len() / 2;
    Some(*ratios.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Each factor as the mean of itself and its neighbors; 1 where none is known.
fn smoothed(factors: impl Iterator<Item = Option<f32>>) -> Vec<f32> {
    let factors: Vec<Option<f32>> = factors.collect();
    let near = |k: usize| k.saturating_sub(SMOOTH)..(k + SMOOTH + 1).min(factors.len());
    (0..factors.len())
        .map(|k| {
            let known = factors[near(k)].iter().flatten();
            let (sum, n) = known.fold((0.0, 0.0), |(sum, n), f| (sum + f, n + 1.0));
            if n > 0.0 { sum / n } else { 1.0 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::ColorSpec;

    #[test]
    fn the_inverse_divides_exactly() {
        for base in DARKEST + 1..256 {
            let inverse = (1u64 << 32).div_ceil(u64::from(base));
            for value in 0..256 {
                let dividend = value * STEPS as u32 + base / 2;
                assert_eq!(
                    (u64::from(dividend) * inverse) >> 32,
                    u64::from(dividend / base)
                );
            }
        }
    }

    #[test]
    fn a_dark_animal_does_not_move_the_median_of_the_light() {
        // 3000 probes 10 % brighter with a spread, 1000 on a black animal.
        let mut counts = [0u16; 4 * STEPS];
        counts[100] = 1000;
        for k in 0..301 {
            counts[1126 - 150 + k] = 10;
        }
        assert_eq!(median_ratio(&counts), Some(1126.0 / 1024.0));
    }

    #[test]
    fn bands_and_a_slope_of_light_are_measured_and_undone() {
        let mut plate = Frame::new(160, 120, ColorSpec::default());
        for (k, value) in plate.planes.iter_mut().enumerate() {
            *value = 90 + (random::bits(1, &[k as u64]) % 40) as u8;
        }
        let light = |x: usize, y: usize| {
            (1.0 + 0.1 * libm::sin(y as f64 / 9.0)) * libm::exp(-0.002 * x as f64)
        };
        let mut frame = plate.clone();
        for (k, value) in frame.planes[..160 * 120].iter_mut().enumerate() {
            let lit = (f64::from(*value) - 16.0) * light(k % 160, k / 160);
            // An animal over a fifth of the rows.
            *value = if (40..64).contains(&(k / 160)) && k % 160 < 60 {
                30
            } else {
                (16.0 + lit).round() as u8
            };
        }
        let mut found = Light {
            rgb: [1.0; 3],
            field: Some(field(&frame, &plate, 1.0)),
        };
        found.undo(&mut frame);
        let off = |k: usize| frame.planes[k].abs_diff(plate.planes[k]);
        let worst = (0..160 * 120)
            .filter(|k| !(38..66).contains(&(k / 160)))
            .map(off)
            .max();
        assert!(worst.is_some_and(|worst| worst <= 4), "{worst:?}");
        found.field = None;
        assert!(!found.is_uneven());
    }
}
