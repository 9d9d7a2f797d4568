//! Color distributions of animal and scene, and how much likelier a color is in one than in the other.

/// Bins of a channel. Free choice.
const N_BINS: usize = 16;

/// Histogram of RGB colors, smoothed over neighboring bins.
pub(super) struct Palette {
    /// Density of each bin relative to that of even colors.
    density: Vec<f32>,
}

impl Palette {
    /// Returns the palette of colors, levels of 255. Rare and unseen colors have a small density.
    pub(super) fn new(colors: impl Iterator<Item = [f32; 3]>) -> Palette {
        let mut counts = vec![0f32; N_BINS * N_BINS * N_BINS];
        let mut n = 0.0;
        for color in colors {
            counts[bin(color)] += 1.0;
            n += 1.0;
        }
        for stride in [1, N_BINS, N_BINS * N_BINS] {
            counts = blurred(&counts, stride);
        }
        // One even color in a hundred keeps the ratio of two palettes finite.
        let even = 0.01 / counts.len() as f32;
        let density = counts
            .iter()
            .map(|count| 0.99 * count / f32::max(n, 1.0) + even);
        Palette {
            density: density.collect(),
        }
    }

    /// Returns the logarithm of the ratio of a color's densities in this palette and in `other`.
    pub(super) fn log_ratio(&self, other: &Palette, color: [f32; 3]) -> f32 {
        let at = bin(color);
        libm::logf(self.density[at] / other.density[at])
    }
}

fn bin(color: [f32; 3]) -> usize {
    let of = |value: f32| ((value * N_BINS as f32 / 256.0) as usize).min(N_BINS - 1);
    (of(color[2]) * N_BINS + of(color[1])) * N_BINS + of(color[0])
}

/// Returns the counts blurred with weights 1/4, 1/2, 1/4 along one channel.
fn blurred(counts: &[f32], stride: usize) -> Vec<f32> {
    let along = |at: usize| at / stride % N_BINS;
    (0..counts.len())
        .map(|at| {
            let below = if along(at) > 0 { at - stride } else { at };
            let above = if along(at) + 1 < N_BINS {
                at + stride
            } else {
                at
            };
            0.25 * (counts[below] + counts[above]) + 0.5 * counts[at]
        })
        .collect()
}
