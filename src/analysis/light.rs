//! How much brighter a frame is than the plate: flicker, slow exposure and mains beat go away when a
//! frame is divided by its gain (ALGORITHMS.md 2.3).

use std::ops::Range;

use super::background::Plate;
use crate::random;
use crate::raster::{Frame, RgbImage};

/// Pixels compared per frame, at places fixed once and for all.
const N_SAMPLES: u64 = 4096;
/// Ratios are counted in steps of 1 / 1024, from 0 to 4.
const STEPS: usize = 1024;
/// A channel of the plate must be brighter than this for its ratio to mean anything.
const DARKEST: u32 = 16;

/// The median ratio of a frame to the plate, per channel; 1 where they are equally bright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// R, G, B.
    pub rgb: [f32; 3],
}

impl Gain {
    /// No change.
    pub const ONE: Gain = Gain { rgb: [1.0; 3] };

    /// The gain of luma, near enough for telling where to look.
    pub fn luma(&self) -> f32 {
        0.3 * self.rgb[0] + 0.59 * self.rgb[1] + 0.11 * self.rgb[2]
    }

    /// 1 / gain per channel in 12-bit fixed point: `(value * factor + 2048) >> 12` is in the
    /// plate's light.
    pub fn to_plate(&self) -> [i32; 3] {
        self.rgb.map(|g| (4096.0 / g).round() as i32)
    }

    /// Divides a frame's luma by the gain.
    pub fn undo(&self, frame: &mut Frame) {
        if (self.luma() - 1.0).abs() < 0.002 {
            return;
        }
        let black = if frame.color.range == crate::raster::Range::Limited {
            16.0
        } else {
            0.0
        };
        let table: Vec<u8> = (0..=255u8)
            .map(|y| {
                (black + (f32::from(y) - black) / self.luma())
                    .round()
                    .clamp(0.0, 255.0) as u8
            })
            .collect();
        let n_px = frame.width as usize * frame.height as usize;
        for value in &mut frame.planes[..n_px] {
            *value = table[usize::from(*value)];
        }
    }
}

/// A pixel whose light is compared in every frame.
pub struct Probe {
    /// Its luma and its chroma in the planes.
    luma_at: u32,
    chroma_at: u32,
    /// R, G, B of the plate.
    base: [u32; 3],
    /// 2^32 / base, rounded up: dividing by it is a multiplication; 0 where the plate is too dark to say.
    inverse: [u32; 3],
}

/// The pixels compared with this plate, in the order of their places.
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

/// The gain of a frame. What differs by more than a quarter from the median of all probes (the animal,
/// wherever it is) has no say, so that the gain is a matter of the frame and the plate alone.
pub fn gain(frame: &Frame, plate: &Plate) -> Gain {
    let convert = frame.color.to_rgb();
    let (luma, (u, v)) = (frame.luma(), frame.chroma());
    let mut counts = [[0u16; 4 * STEPS]; 3];
    for probe in &plate.probes {
        let chroma = probe.chroma_at as usize;
        let rgb = convert.convert(luma[probe.luma_at as usize], u[chroma], v[chroma]);
        for channel in 0..3 {
            // (value * STEPS + base / 2) / base, exact because the dividend is below 2^19.
            let dividend = u32::from(rgb[channel]) * STEPS as u32 + probe.base[channel] / 2;
            let ratio = u64::from(dividend) * u64::from(probe.inverse[channel]) >> 32;
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
    Gain {
        rgb: [0, 1, 2].map(median),
    }
}

/// The median of the counted ratios near their median; 1 when too few pixels are bright enough to say.
fn median_ratio(counts: &[u16; 4 * STEPS]) -> f32 {
    let n: u32 = counts.iter().map(|&count| u32::from(count)).sum();
    if n < 64 {
        return 1.0;
    }
    let middle = median_step(counts, 0..4 * STEPS);
    let near = middle - middle / 4..(middle + middle / 4 + 1).min(4 * STEPS);
    (median_step(counts, near) as f32 / STEPS as f32).clamp(0.25, 3.9)
}

/// The step at which half of what is counted within `steps` is reached.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_divides_exactly() {
        for base in DARKEST + 1..256 {
            let inverse = (1u64 << 32).div_ceil(u64::from(base));
            for value in 0..256 {
                let dividend = value * STEPS as u32 + base / 2;
                assert_eq!(
                    u64::from(dividend) * inverse >> 32,
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
        assert_eq!(median_ratio(&counts), 1126.0 / 1024.0);
    }
}
