//! Counter-based random numbers: (seed, id, step) -> number, with no state to share or to order, so
//! that the same bytes come out for any number of threads (ALGORITHMS.md 7).
//!
//! The mixing function is SplitMix64's finaliser (Steele, Lea & Flood 2014), applied once per word.

use std::f64::consts::TAU;

/// 64 random bits that depend on the seed and on every word of the key.
pub fn bits(seed: u64, key: &[u64]) -> u64 {
    key.iter()
        .fold(mix(seed ^ 0x9e37_79b9_7f4a_7c15), |state, &word| {
            mix(state ^ mix(word.wrapping_add(0x9e37_79b9_7f4a_7c15)))
        })
}

/// A number in [0, 1).
pub fn unit(seed: u64, key: &[u64]) -> f64 {
    (bits(seed, key) >> 11) as f64 / (1u64 << 53) as f64
}

/// A number of the standard normal distribution (Box and Muller's cosine half).
pub fn normal(seed: u64, key: &[u64]) -> f64 {
    let word = bits(seed, key);
    let radius_from = ((word >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let angle_from = (mix(word) >> 11) as f64 / (1u64 << 53) as f64;
    libm::sqrt(-2.0 * libm::log(radius_from)) * libm::cos(TAU * angle_from)
}

/// The numbers whose keys begin alike, that beginning worked out.
#[derive(Clone, Copy, Debug)]
pub struct Row(u64);

/// The numbers whose keys are `key` and one word more.
pub fn row(seed: u64, key: &[u64]) -> Row {
    Row(bits(seed, key))
}

impl Row {
    /// As `bits` with that word behind the key.
    pub fn bits(self, word: u64) -> u64 {
        mix(self.0 ^ mix(word.wrapping_add(0x9e37_79b9_7f4a_7c15)))
    }

    /// A number of mean 0 and variance 1, at most 3.5 either way: the sum of four even ones (Irwin and Hall). For
    /// what adds up many of them, which is then as normal as can be, at a tenth of the time of `normal`.
    pub fn bell(self, word: u64) -> f64 {
        let bits = self.bits(word);
        let sum: u64 = (0..4).map(|k| bits >> (16 * k) & 0xffff).sum();
        (sum as f64 - 2.0 * 65535.0) * (3f64.sqrt() / 65536.0)
    }
}

fn mix(mut word: u64) -> u64 {
    word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let draws: Vec<f64> = (0..20_000).map(|k| normal(7, &[1, k])).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / draws.len() as f64;
        assert!(
            mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04,
            "{mean} {variance}"
        );
    }

    #[test]
    fn bell_shaped_numbers_have_mean_zero_variance_one_and_the_quarters_of_normal_ones() {
        let row = row(7, &[1]);
        let mut draws: Vec<f64> = (0..20_000).map(|k| row.bell(k)).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / draws.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04);
        draws.sort_by(f64::total_cmp);
        let quarters = [draws[5_000], draws[10_000], draws[15_000]];
        for (found, normal) in quarters.into_iter().zip([-0.674, 0.0, 0.674]) {
            assert!((found - normal).abs() < 0.04, "{quarters:?}");
        }
        assert_eq!(row.bits(9), bits(7, &[1, 9]));
    }

    #[test]
    fn every_word_of_the_key_counts() {
        assert_ne!(bits(1, &[2, 3]), bits(1, &[3, 2]));
        assert_ne!(bits(1, &[2, 3]), bits(2, &[2, 3]));
        assert_ne!(bits(1, &[2]), bits(1, &[2, 0]));
    }
}
