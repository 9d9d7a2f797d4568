//! Catmull-Rom interpolation of a row of pixels (docs/explanation/algorithms.md, "Compositing"). Each output
//! pixel is a weighted sum of 4 x 4 taps. Positions are rounded to 1/256 of a pixel and weights to 1/32768.
//! The scalar code here defines the result of the AVX2 kernel.

use super::{ONE, Premultiplied, Quad};

/// Number of interpolation positions between two pixels.
pub(super) const N_PHASES: usize = 256;
/// Half an interpolation position, in 1/65536 of a pixel. Added before truncation, so that positions round to
/// the nearest.
pub(super) const HALF_PHASE: i32 = (1 << 16) / (2 * N_PHASES as i32);

/// The weights of the four taps at each position; their sum is 32767.
pub(super) static WEIGHTS: [[i16; 4]; N_PHASES] = all_weights();
/// Weights as above, each repeated for the four values of a pixel.
pub(super) static WIDE_WEIGHTS: [[i16; 16]; N_PHASES] = wide_weights();
/// Weights as above, each stored twice in 32 bits, ready for a broadcast to a vector register.
#[cfg(target_arch = "x86_64")]
pub(super) static PAIRED_WEIGHTS: [[i32; 4]; N_PHASES] = paired_weights();

impl Premultiplied {
    /// Interpolates a row of pixels, the first at `start`, the next ones at intervals of `step`, in 1/65536
    /// of a pixel of the padded sprite. All positions must lie within `REACH` of the sprite. Defines the
    /// result of the vector kernels.
    pub(super) fn interpolate(&self, row: &mut [Quad], start: [i32; 2], step: [i32; 2]) {
        let [mut u, mut v] = start.map(|at| at + HALF_PHASE);
        let stride = self.stride();
        let taps = self.pixels.as_flattened();
        for pixel in row {
            let (x, y) = ((u >> 16) as usize, (v >> 16) as usize);
            let first = 4 * ((y - 1) * stride + x - 1);
            *pixel = blend(
                std::array::from_fn(|row| &taps[first + 4 * row * stride..][..16]),
                &WIDE_WEIGHTS[(u >> 8) as usize % N_PHASES],
                &WEIGHTS[(v >> 8) as usize % N_PHASES],
            );
            u += step[0];
            v += step[1];
        }
    }
}

/// Sums the taps along columns first, then along the row.
#[inline(always)]
fn blend(rows: [&[i16]; 4], across: &[i16; 16], down: &[i16; 4]) -> Quad {
    let mut column = [0i16; 16];
    for (row, &weight) in rows.iter().zip(down) {
        let row: &[i16; 16] = (*row).try_into().unwrap_or(&[0; 16]);
        for k in 0..16 {
            column[k] = column[k].wrapping_add(scaled(row[k], weight));
        }
    }
    let mut weighted = [0i16; 16];
    for k in 0..16 {
        weighted[k] = scaled(column[k], across[k]);
    }
    let mut sum = [0i16; 4];
    for k in 0..4 {
        sum[k] = (weighted[k].wrapping_add(weighted[4 + k]))
            .wrapping_add(weighted[8 + k].wrapping_add(weighted[12 + k]));
    }
    // The kernel may overshoot: limit alpha to 1 and each color to alpha.
    let alpha = sum[3].clamp(0, ONE);
    let color = |k: usize| sum[k].clamp(0, alpha);
    [color(0), color(1), color(2), alpha]
}

/// Returns a value times a weight in 1/32768, rounded.
#[inline(always)]
pub(in crate::raster) fn scaled(value: i16, weight: i16) -> i16 {
    ((((i32::from(value) * i32::from(weight)) >> 14) + 1) >> 1) as i16
}

const fn all_weights() -> [[i16; 4]; N_PHASES] {
    let mut all = [[0; 4]; N_PHASES];
    let mut phase = 0;
    while phase < N_PHASES {
        all[phase] = weights(phase as i64);
        phase += 1;
    }
    all
}

/// Returns the weights at `f`/256 of the distance from the second tap to the third.
const fn weights(f: i64) -> [i16; 4] {
    // In units of 2^-25, in which the coefficients of the cubic are whole numbers.
    let (f1, f2, f3) = (f << 16, (f * f) << 8, f * f * f);
    let exact = [
        -f1 + 2 * f2 - f3,
        (2 << 24) - 5 * f2 + 3 * f3,
        f1 + 4 * f2 - 3 * f3,
        f3 - f2,
    ];
    let mut rounded = [0i16; 4];
    let mut sum = 0i32;
    let mut tap = 0;
    while tap < 4 {
        rounded[tap] = ((exact[tap] * 32767 + (1 << 24)) >> 25) as i16;
        sum += rounded[tap] as i32;
        tap += 1;
    }
    // The largest weight absorbs the rounding error.
    let greatest = if f < 128 { 1 } else { 2 };
    rounded[greatest] += (32767 - sum) as i16;
    rounded
}

const fn wide_weights() -> [[i16; 16]; N_PHASES] {
    let narrow = all_weights();
    let mut wide = [[0; 16]; N_PHASES];
    let mut phase = 0;
    while phase < N_PHASES {
        let mut k = 0;
        while k < 16 {
            wide[phase][k] = narrow[phase][k / 4];
            k += 1;
        }
        phase += 1;
    }
    wide
}

#[cfg(target_arch = "x86_64")]
const fn paired_weights() -> [[i32; 4]; N_PHASES] {
    let narrow = all_weights();
    let mut twice = [[0; 4]; N_PHASES];
    let mut phase = 0;
    while phase < N_PHASES {
        let mut tap = 0;
        while tap < 4 {
            let weight = narrow[phase][tap];
            twice[phase][tap] = (weight as i32) << 16 | (weight as u16 as i32);
            tap += 1;
        }
        phase += 1;
    }
    twice
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_textbook_and_add_up() {
        assert_eq!(WEIGHTS[0], [0, 32767, 0, 0]);
        // Half way: -1, 9, 9, -1 sixteenths.
        let sixteenths = WEIGHTS[128].map(|w| (f64::from(w) / 2048.0).round());
        assert_eq!(sixteenths, [-1.0, 9.0, 9.0, -1.0]);
        for (phase, weights) in WEIGHTS.iter().enumerate() {
            let f = phase as f64 / 256.0;
            let exact = 1.0 - 2.5 * f * f + 1.5 * f * f * f;
            assert!(
                (f64::from(weights[1]) / 32767.0 - exact).abs() < 1e-4,
                "{phase}"
            );
            assert_eq!(weights.iter().map(|&w| i32::from(w)).sum::<i32>(), 32767);
        }
    }

    #[test]
    fn weight_of_one_changes_nothing() {
        assert!((0..=ONE).all(|value| scaled(value, 32767) == value));
    }
}
