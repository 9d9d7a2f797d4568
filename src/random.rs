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
    fn every_word_of_the_key_counts() {
        assert_ne!(bits(1, &[2, 3]), bits(1, &[3, 2]));
        assert_ne!(bits(1, &[2, 3]), bits(2, &[2, 3]));
        assert_ne!(bits(1, &[2]), bits(1, &[2, 0]));
    }
}
