//! How much brighter a frame is than the plate: flicker, slow exposure and mains beat go away when a
//! frame is divided by its gain (ALGORITHMS.md 2.3).

use super::background::Plate;
use crate::geometry::Rect;
use crate::random;
use crate::raster::Frame;

/// Pixels compared per frame, at places fixed once and for all.
const N_SAMPLES: u64 = 4096;
/// Ratios are counted in steps of 1 / 1024, from 0 to 4.
const STEPS: usize = 1024;

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

/// The pixels compared in every frame of this size.
pub fn probes(width: u32, height: u32) -> Vec<u32> {
    let n_px = u64::from(width) * u64::from(height);
    (0..N_SAMPLES)
        .map(|k| (random::bits(0, &[k]) % n_px) as u32)
        .collect()
}

/// The gain of a frame, from pixels outside `occupied` (where the animal is thought to be).
pub fn gain(frame: &Frame, plate: &Plate, occupied: Rect) -> Gain {
    let convert = frame.color.to_rgb();
    let (u, v) = frame.chroma();
    let mut counts = vec![[0u32; 3]; 4 * STEPS];
    let mut n = [0u32; 3];
    for &at in &plate.probes {
        let (x, y) = (at % frame.width, at / frame.width);
        if occupied.contains(x, y) {
            continue;
        }
        let chroma = (y / 2 * frame.chroma_width() + x / 2) as usize;
        let rgb = convert.convert(frame.luma()[at as usize], u[chroma], v[chroma]);
        for ((channel, value), &base) in rgb
            .iter()
            .enumerate()
            .zip(&plate.rgb.pixels[3 * at as usize..])
        {
            if base > 16 {
                let ratio =
                    (usize::from(*value) * STEPS + usize::from(base) / 2) / usize::from(base);
                counts[ratio.min(4 * STEPS - 1)][channel] += 1;
                n[channel] += 1;
            }
        }
    }
    let median = |channel: usize| median_ratio(&counts, channel, n[channel]);
    Gain {
        rgb: [median(0), median(1), median(2)],
    }
}

/// The median of a channel's counted ratios; 1 when too few pixels are bright enough to say.
fn median_ratio(counts: &[[u32; 3]], channel: usize, n: u32) -> f32 {
    if n < 64 {
        return 1.0;
    }
    let mut below = 0;
    for (step, count) in counts.iter().enumerate() {
        below += count[channel];
        if 2 * below >= n {
            return (step as f32 / STEPS as f32).clamp(0.25, 3.9);
        }
    }
    1.0
}
