//! Counter-based random numbers: each number is a hash of (seed, key words such as id and step).
//!
//! There is no generator state, so results do not depend on the order of calls or on the number of threads
//! (docs/explanation/algorithms.md, "Boids"). The mixing function is the finalizer of SplitMix64 (Steele, Lea
//! & Flood 2014), applied once for each word.

use std::f64::consts::TAU;

/// Increment of SplitMix64: 2^64 divided by the golden ratio.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Returns 64 random bits that depend on the seed and on every word of the key.
pub fn bits(seed: u64, key: &[u64]) -> u64 {
    Sequence::new(seed, key).0
}

/// Returns a uniform random number in [0, 1).
pub fn uniform(seed: u64, key: &[u64]) -> f64 {
    (bits(seed, key) >> 11) as f64 / (1u64 << 53) as f64
}

/// Returns a random number of the standard normal distribution (Box-Muller transform, cosine branch).
pub fn normal(seed: u64, key: &[u64]) -> f64 {
    let word = bits(seed, key);
    let radius_from = ((word >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let angle_from = (mix(word) >> 11) as f64 / (1u64 << 53) as f64;
    libm::sqrt(-2.0 * libm::log(radius_from)) * libm::cos(TAU * angle_from)
}

/// A prepared sequence of random numbers: the hash of the seed and of a key prefix that they share.
#[derive(Clone, Copy, Debug)]
pub struct Sequence(u64);

impl Sequence {
    /// Returns the sequence of random numbers whose keys are `key` followed by one more word.
    pub fn new(seed: u64, key: &[u64]) -> Sequence {
        let start = Sequence(mix(seed ^ GOLDEN));
        key.iter()
            .fold(start, |prefix, &word| Sequence(prefix.bits(word)))
    }

    /// Returns the same bits as the function `bits` with `word` appended to the key.
    pub fn bits(self, word: u64) -> u64 {
        mix(self.0 ^ mix(word.wrapping_add(GOLDEN)))
    }

    /// Returns an approximately normal number: mean 0, variance 1, at most 3.5 in magnitude.
    ///
    /// The value is the sum of four uniform numbers (Irwin-Hall distribution). It takes a tenth of the time
    /// of `normal`. Use it where many numbers are summed: the sum is then normal (central limit theorem).
    pub fn irwin_hall(self, word: u64) -> f64 {
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
    fn irwin_hall_numbers_have_the_moments_and_quartiles_of_normal_ones() {
        let sequence = Sequence::new(7, &[1]);
        let mut draws: Vec<f64> = (0..20_000).map(|k| sequence.irwin_hall(k)).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / draws.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04);
        draws.sort_by(f64::total_cmp);
        let quartiles = [draws[5_000], draws[10_000], draws[15_000]];
        for (found, normal) in quartiles.into_iter().zip([-0.674, 0.0, 0.674]) {
            assert!((found - normal).abs() < 0.04, "{quartiles:?}");
        }
        assert_eq!(sequence.bits(9), bits(7, &[1, 9]));
    }

    #[test]
    fn every_word_of_the_key_changes_the_bits() {
        assert_ne!(bits(1, &[2, 3]), bits(1, &[3, 2]));
        assert_ne!(bits(1, &[2, 3]), bits(2, &[2, 3]));
        assert_ne!(bits(1, &[2]), bits(1, &[2, 0]));
    }
}
