//! Color distributions of animal and scene, and how much likelier a color is in one than in the other.

/// Bins of a channel. Free choice.
const N_BINS: usize = 16;

/// Histogram of RGB colors, smoothed over neighboring bins.
pub(super) struct Palette {
    /// Logarithm of the density of each bin relative to that of even colors.
    log_density: Vec<f32>,
}

impl Palette {
    /// Returns the palette of colors, levels of 255. Rare and unseen colors have a small density.
    pub(super) fn new(colors: impl Iterator<Item = [f32; 3]>) -> Palette {
        Palette::weighted(colors.map(|color| (color, 1.0)))
    }

    /// Returns the palette of colors that count by weights, 0..=1.
    pub(super) fn weighted(colors: impl Iterator<Item = ([f32; 3], f32)>) -> Palette {
        let mut counts = vec![0f32; N_BINS * N_BINS * N_BINS];
        let mut n = 0.0;
        for (color, weight) in colors {
            counts[bin(color)] += weight;
            n += weight;
        }
        for stride in [1, N_BINS, N_BINS * N_BINS] {
            counts = blurred(&counts, stride);
        }
        // One even color in a hundred keeps the ratio of two palettes finite.
        let per_count = 0.99 * counts.len() as f32 / f32::max(n, 1.0);
        let log_density = counts
            .iter()
            .map(|count| libm::logf(per_count * count + 0.01));
        Palette {
            log_density: log_density.collect(),
        }
    }

    /// Returns the logarithm of a color's density relative to that of even colors.
    pub(super) fn log_density(&self, color: [f32; 3]) -> f32 {
        self.log_density[bin(color)]
    }

    /// Returns the logarithm of the ratio of a color's densities in this palette and in `other`.
    pub(super) fn log_ratio(&self, other: &Palette, color: [f32; 3]) -> f32 {
        self.log_density(color) - other.log_density(color)
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
