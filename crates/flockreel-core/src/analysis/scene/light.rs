//! The light of a frame relative to its background (docs/explanation/algorithms.md, "Light and noise").
//! Dividing a frame by its [`Light`] undoes exposure, flicker, white balance, mains banding and lamps that
//! dim from one side.
//!
//! Light is one gain per color channel for the whole picture. Where the footage needs more, luma factors for
//! each row and each column follow. Their product describes the bands of a rolling shutter along either axis,
//! and light that falls off in any direction. All gains and factors are medians of pixel ratios, so that the
//! animal has no effect.

use super::background::Background;
use super::probes::{DARKEST, MAX_GAIN, N_PROBES, RATIO_STEPS};
use crate::order;
use crate::raster::Frame;

/// Least number of bright pixels for a gain, 5 % of the pixels compared. With fewer, the animal may cover
/// most of them. Free choice.
const MIN_PROBES: u32 = N_PROBES as u32 / 20;
/// Number of pixels compared in a row or column, at most. Free choice.
const MAX_PER_LINE: usize = 160;
/// Least number of bright pixels for the factor of a row or column. Free choice.
const MIN_PER_LINE: usize = 24;
/// Neighbors on either side whose factors are averaged. A 100 Hz lamp gives at most about ten bands in a
/// picture, and they are far broader.
const SMOOTHING_RADIUS: usize = 2;
/// Light is uneven if the 90th percentile of |factor - 1| of rows or columns exceeds this. Free choice.
const UNEVEN_DEVIATION: f64 = 0.012;
/// Light of the footage is uneven if it is so in more than this share of the frames examined. Free choice.
const UNEVEN_SHARE: f64 = 0.1;

/// Brightness of a frame relative to its background.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Gains of R, G and B; 1 where frame and background are equally bright.
    pub rgb: [f32; 3],
    /// Further luma factors; `None` where the light is even.
    line_factors: Option<LineFactors>,
}

/// Luma factors in addition to the gain: at (x, y) the light is `gain * rows[y] * columns[x]`.
#[derive(Clone, Debug, PartialEq)]
struct LineFactors {
    rows: Vec<f32>,
    columns: Vec<f32>,
}

impl Light {
    /// The light of the background itself.
    pub const NEUTRAL: Light = Light {
        rgb: [1.0; 3],
        line_factors: None,
    };

    /// Returns the approximate gain of luma, exact enough to propose boxes.
    pub fn luma(&self) -> f32 {
        0.3 * self.rgb[0] + 0.59 * self.rgb[1] + 0.11 * self.rgb[2]
    }

    /// Returns 1 / gain of each channel in 12-bit fixed point: apply it as `(value * factor + 2048) >> 12`.
    pub fn inverse_gains(&self) -> [i32; 3] {
        self.rgb.map(|gain| (4096.0 / gain).round() as i32)
    }

    /// Returns whether the light varies over the picture.
    pub fn is_uneven(&self) -> bool {
        self.line_factors.is_some()
    }

    /// Returns whether a channel's gain differs from 1 by more than `share`.
    pub fn is_other_by(&self, share: f32) -> bool {
        self.rgb.iter().any(|gain| (gain - 1.0).abs() > share)
    }

    /// Returns the luma factor at a pixel in addition to the gain; 1 where the light is even.
    pub fn factor(&self, x: usize, y: usize) -> f32 {
        let at_pixel = |factors: &LineFactors| factors.rows[y] * factors.columns[x];
        self.line_factors.as_ref().map_or(1.0, at_pixel)
    }

    /// Divides a frame by its light: luma by gain and factor of the pixel, chroma by the luma gain. The color
    /// of the light remains.
    pub fn undo(&self, frame: &mut Frame) {
        let gain = self.luma();
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
        match &self.line_factors {
            None => luma
                .iter_mut()
                .for_each(|value| *value = table[usize::from(*value)]),
            Some(factors) => {
                for (row, &by_row) in luma.chunks_exact_mut(width).zip(&factors.rows) {
                    for (value, &by_column) in row.iter_mut().zip(&factors.columns) {
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

/// Returns the light of a frame. Measures rows and columns only if the background has `uneven_light`.
pub fn measure(frame: &Frame, background: &Background) -> Light {
    let mut light = Light {
        rgb: gain(frame, background),
        line_factors: None,
    };
    if background.uneven_light {
        light.line_factors = Some(line_factors(frame, &background.frame, light.luma()));
    }
    light
}

/// Returns whether the light of the footage varies over the picture, measured on some of its frames.
pub fn is_uneven(frames: &[&Frame], background: &Background) -> bool {
    let n_frames = frames.len();
    let deviates = |frame: &Frame| {
        let gain = luma_of(gain(frame, background));
        let factors = line_factors(frame, &background.frame, gain);
        let deviation = |factors: &[f32]| {
            let mut all: Vec<f64> = factors.iter().map(|f| f64::from((f - 1.0).abs())).collect();
            order::percentile(&mut all, 0.9).unwrap_or(0.0)
        };
        deviation(&factors.rows).max(deviation(&factors.columns)) > UNEVEN_DEVIATION
    };
    let n_uneven = frames.iter().filter(|frame| deviates(frame)).count();
    n_uneven as f64 > UNEVEN_SHARE * n_frames as f64
}

fn luma_of(rgb: [f32; 3]) -> f32 {
    Light {
        rgb,
        line_factors: None,
    }
    .luma()
}

/// Returns the median ratio of frame to background for each channel.
fn gain(frame: &Frame, background: &Background) -> [f32; 3] {
    let convert = frame.color.to_rgb();
    let (luma, (u, v)) = (frame.luma(), frame.chroma());
    // The last bin has all greater ratios.
    let mut counts = [[0u16; MAX_GAIN * RATIO_STEPS + 1]; 3];
    for probe in &background.probes {
        let chroma = probe.chroma_idx as usize;
        let rgb = convert.convert(luma[probe.luma_idx as usize], u[chroma], v[chroma]);
        for channel in 0..3 {
            let ratio = probe.ratio(channel, rgb[channel]);
            counts[channel][ratio.min(MAX_GAIN * RATIO_STEPS)] += 1;
        }
    }
    let n_dark = |channel: usize| {
        let dark = background.probes.iter().filter(|p| p.is_dark(channel));
        dark.count() as u16
    };
    let median = |channel: usize| {
        counts[channel][0] -= n_dark(channel);
        median_gain(&counts[channel])
    };
    let gains = [0, 1, 2].map(median);
    // A channel of unknown gain takes the mean gain of the others.
    let known: Vec<f32> = gains.iter().flatten().copied().collect();
    let usual = match known.len() {
        0 => 1.0,
        n => known.iter().sum::<f32>() / n as f32,
    };
    gains.map(|gain| gain.unwrap_or(usual))
}

/// Returns the median of the counted ratios. Returns `None` when too few pixels are bright enough or when the
/// median is no gain that light can cause.
fn median_gain(counts: &[u16]) -> Option<f32> {
    let n: u32 = counts.iter().map(|&count| u32::from(count)).sum();
    let mut below = 0;
    let middle = counts.iter().position(|&count| {
        below += u32::from(count);
        2 * below >= n
    })?;
    let is_light = middle < MAX_GAIN * RATIO_STEPS && MAX_GAIN * middle > RATIO_STEPS;
    (n >= MIN_PROBES && is_light).then_some(middle as f32 / RATIO_STEPS as f32)
}

/// Returns the factors of the rows, and of the columns after division by the rows.
fn line_factors(frame: &Frame, background: &Frame, gain: f32) -> LineFactors {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let black = frame.color.black();
    let (luma, base) = (frame.luma(), background.luma());
    let ratio = |at: usize| {
        let below = f32::from(base[at]) - black;
        (below > DARKEST as f32).then(|| (f32::from(luma[at]) - black) / (gain * below))
    };
    let step_x = width.div_ceil(MAX_PER_LINE);
    let rows = smoothed((0..height).map(|y| {
        let along = (y % step_x..width).step_by(step_x);
        median_factor(along.filter_map(|x| ratio(y * width + x)))
    }));
    let step_y = height.div_ceil(MAX_PER_LINE);
    let columns = smoothed((0..width).map(|x| {
        let along = (x % step_y..height).step_by(step_y);
        median_factor(along.filter_map(|y| Some(ratio(y * width + x)? / rows[y])))
    }));
    LineFactors { rows, columns }
}

/// Returns the median of the ratios that light can cause; `None` for fewer than `MIN_PER_LINE`.
fn median_factor(ratios: impl Iterator<Item = f32>) -> Option<f32> {
    let mut ratios: Vec<f32> = ratios.filter(|r| (0.4..2.5).contains(r)).collect();
    if ratios.len() < MIN_PER_LINE {
        return None;
    }
    let middle = ratios.len() / 2;
    Some(*ratios.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Replaces each factor by the mean of the known factors around it; 1 where none is known.
fn smoothed(factors: impl Iterator<Item = Option<f32>>) -> Vec<f32> {
    let factors: Vec<Option<f32>> = factors.collect();
    let near = |k: usize| {
        k.saturating_sub(SMOOTHING_RADIUS)..(k + SMOOTHING_RADIUS + 1).min(factors.len())
    };
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
    use crate::random;
    use crate::raster::ColorSpec;

    #[test]
    fn bands_and_a_slope_of_light_are_measured_and_undone() {
        let mut background = Frame::new(160, 120, ColorSpec::default());
        for (k, value) in background.planes.iter_mut().enumerate() {
            *value = 90 + (random::bits(1, &[k as u64]) % 40) as u8;
        }
        let light = |x: usize, y: usize| {
            (1.0 + 0.1 * libm::sin(y as f64 / 9.0)) * libm::exp(-0.002 * x as f64)
        };
        let mut frame = background.clone();
        for (k, value) in frame.planes[..160 * 120].iter_mut().enumerate() {
            let lit = (f64::from(*value) - 16.0) * light(k % 160, k / 160);
            // An animal covers a fifth of the rows.
            *value = if (40..64).contains(&(k / 160)) && k % 160 < 60 {
                30
            } else {
                (16.0 + lit).round() as u8
            };
        }
        let mut found = Light {
            rgb: [1.0; 3],
            line_factors: Some(line_factors(&frame, &background, 1.0)),
        };
        found.undo(&mut frame);
        let off = |k: usize| frame.planes[k].abs_diff(background.planes[k]);
        let worst = (0..160 * 120)
            .filter(|k| !(38..66).contains(&(k / 160)))
            .map(off)
            .max();
        assert!(worst.is_some_and(|worst| worst <= 4), "{worst:?}");
        found.line_factors = None;
        assert!(!found.is_uneven());
    }
}
