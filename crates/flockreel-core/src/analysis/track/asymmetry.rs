//! Measures how the two ends of an animal differ, and its upper side from its lower side.
//!
//! The animal's length is divided into bins. Each bin holds its mass and its color difference from the
//! animal's mean. Subtracting the bin at the same distance from the other end leaves numbers that only change
//! sign when the head changes ends. So all frames together can separate heads from tails (`pose::ends`).

use super::super::pose::moments::Moments;
use crate::geometry::Rect;
use crate::raster::RgbaImage;

/// Number of bins from the centroid to one end. Free choice.
const N_BINS: usize = 6;
/// Distance from the centroid to the end of the last bin, standard deviations along the axis. Free choice.
const REACH: f64 = 2.5;
/// Color difference that has the weight of all mass, levels of 255. Free choice.
const COLOR_LEVELS: f64 = 60.0;
/// Length of the vector that separates the ends: mass, R, G and B of each bin.
pub const N_NUMBERS: usize = 4 * N_BINS;

/// Differences between the ends and between the sides of an animal.
#[derive(Clone, Debug, PartialEq)]
pub struct Asymmetry {
    /// Each bin toward +axis minus its counterpart toward -axis, from the centroid outward. The axis is that
    /// of the moments.
    pub ends: [f32; N_NUMBERS],
    /// Correlation of brightness with the position across the axis, -1..=1; positive when the lower side is
    /// brighter.
    pub shade: f64,
}

impl Asymmetry {
    /// Returns the asymmetry of a matte at `rect`; `None` when the moments have no axis.
    pub fn measure(rect: Rect, matte: &RgbaImage, moments: &Moments) -> Option<Asymmetry> {
        let axis = moments.major_rad?;
        let (c, s) = (libm::cos(axis), libm::sin(axis));
        let [xx, xy, yy] = moments.covariance_px2;
        let along_px = (c * c * xx + 2.0 * c * s * xy + s * s * yy).sqrt();
        let pixels = || {
            let seen = matte.pixels.as_chunks::<4>().0.iter().enumerate();
            seen.filter(|(_, rgba)| rgba[3] > 0).map(|(k, rgba)| {
                let dx = f64::from(rect.x + k as u32 % rect.w) + 0.5 - moments.centroid_px[0];
                let dy = f64::from(rect.y + k as u32 / rect.w) + 0.5 - moments.centroid_px[1];
                let color = [0, 1, 2].map(|channel| f64::from(rgba[channel]));
                (
                    f64::from(rgba[3]) / 255.0,
                    dx * c + dy * s,
                    dy * c - dx * s,
                    color,
                )
            })
        };
        let mut mean = [0.0; 3];
        for (weight, _, _, color) in pixels() {
            (0..3).for_each(|channel| mean[channel] += weight * color[channel] / moments.area_px);
        }
        let mut ends = [0.0; N_NUMBERS];
        let [mut square, mut across, mut both] = [0.0; 3];
        for (weight, u, v, color) in pixels() {
            let deviation = [0, 1, 2].map(|channel| color[channel] - mean[channel]);
            let luma = 0.3 * deviation[0] + 0.59 * deviation[1] + 0.11 * deviation[2];
            square += weight * luma * luma;
            across += weight * v * v;
            both += weight * luma * v;
            let numbers = [1.0, deviation[0], deviation[1], deviation[2]];
            add(&mut ends, weight * u.signum(), u.abs() / along_px, numbers);
        }
        let share = N_BINS as f64 / moments.area_px;
        Some(Asymmetry {
            ends: ends.map(|number| (share * number) as f32),
            shade: both / (square * across).sqrt().max(1e-9),
        })
    }
}

/// Adds a pixel to the two bins around it; `at` is its distance in standard deviations along the axis.
fn add(ends: &mut [f64; N_NUMBERS], weight: f64, at: f64, numbers: [f64; 4]) {
    let at = (at / REACH * N_BINS as f64).min(N_BINS as f64 - 0.5) - 0.5;
    let low = at.floor();
    for (bin, share) in [(low, 1.0 - (at - low)), (low + 1.0, at - low)] {
        if bin < 0.0 || bin >= N_BINS as f64 {
            continue;
        }
        for (channel, number) in numbers.into_iter().enumerate() {
            let unit = if channel == 0 { 1.0 } else { COLOR_LEVELS };
            ends[4 * bin as usize + channel] += weight * share * number / unit;
        }
    }
}
