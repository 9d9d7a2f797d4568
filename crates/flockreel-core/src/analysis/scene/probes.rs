//! Probes: the pixels at which the brightness of every frame is compared with the background
//! (docs/explanation/algorithms.md, "Light and noise"). They lie at fixed random places.

use crate::random;
use crate::raster::RgbImage;

/// Number of probes of a background. Free choice.
pub(super) const N_PROBES: u64 = 4096;
/// Largest value of a background channel that is too dark to compare, levels of 255. Free choice.
pub(super) const DARKEST: u32 = 16;
/// Steps per unit in which ratios of brightness are counted.
pub(super) const RATIO_STEPS: usize = 1024;
/// Greatest factor, up or down, that light can cause between two frames of one state. Free choice.
pub(super) const MAX_GAIN: usize = 4;

/// A pixel whose brightness is compared in every frame.
pub struct Probe {
    /// Index of its luma value.
    pub(super) luma_idx: u32,
    /// Index of its chroma values in their planes.
    pub(super) chroma_idx: u32,
    /// R, G and B of the background.
    background: [u32; 3],
    /// 2^32 / background, rounded up, to divide by multiplication; 0 where the background is too dark.
    inverse: [u32; 3],
}

impl Probe {
    /// Returns the ratio of a channel's value to the background's, in `RATIO_STEPS`; 0 where the background is
    /// too dark.
    pub(super) fn ratio(&self, channel: usize, value: u8) -> usize {
        // The quotient is exact because the dividend is below 2^19.
        let dividend = u32::from(value) * RATIO_STEPS as u32 + self.background[channel] / 2;
        ((u64::from(dividend) * u64::from(self.inverse[channel])) >> 32) as usize
    }

    /// Returns whether the background is too dark in a channel.
    pub(super) fn is_dark(&self, channel: usize) -> bool {
        self.inverse[channel] == 0
    }
}

/// Returns the probes of a background, in the order of their indices.
pub(super) fn of_background(background: &RgbImage) -> Vec<Probe> {
    let n_px = u64::from(background.width) * u64::from(background.height);
    let mut pixels: Vec<u32> = (0..N_PROBES)
        .map(|k| (random::bits(0, &[k]) % n_px) as u32)
        .collect();
    pixels.sort_unstable();
    let probe = |luma_idx: u32| {
        let (x, y) = (luma_idx % background.width, luma_idx / background.width);
        let rgb = background.pixel(x, y).map(u32::from);
        Probe {
            luma_idx,
            chroma_idx: y / 2 * background.width.div_ceil(2) + x / 2,
            background: rgb,
            inverse: rgb.map(inverse),
        }
    };
    pixels.into_iter().map(probe).collect()
}

fn inverse(value: u32) -> u32 {
    if value <= DARKEST {
        return 0;
    }
    (1u64 << 32).div_ceil(u64::from(value)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiplication_by_the_inverse_divides_exactly() {
        for background in DARKEST + 1..256 {
            let probe = Probe {
                luma_idx: 0,
                chroma_idx: 0,
                background: [background; 3],
                inverse: [inverse(background); 3],
            };
            for value in 0..=255u8 {
                let dividend = u32::from(value) * RATIO_STEPS as u32 + background / 2;
                assert_eq!(probe.ratio(0, value), (dividend / background) as usize);
            }
        }
    }
}
