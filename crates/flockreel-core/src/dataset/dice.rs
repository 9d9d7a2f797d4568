//! Random numbers of one flock of a data set. Each value has numbers of its own, so that values are independent.

use crate::random;

/// Value of a flock that is drawn at random. Each has random numbers of its own.
#[derive(Clone, Copy)]
pub(super) enum Choice {
    Split,
    Library,
    Seed,
    Count,
    Preset,
    Scale,
    Background,
    Picture,
    Color,
    Haze,
    Shadow,
    Gain,
    Blur,
    Noise,
    Quality,
    NoiseSeed,
}

/// Draws the random numbers of one flock.
#[derive(Clone, Copy)]
pub(super) struct Dice {
    pub(super) seed: u64,
    pub(super) number: u32,
}

impl Dice {
    pub(super) fn bits(self, choice: Choice, k: u64) -> u64 {
        random::bits(self.seed, &[u64::from(self.number), choice as u64, k])
    }

    /// Returns a number in [0, 1).
    pub(super) fn share(self, choice: Choice, k: u64) -> f64 {
        random::uniform(self.seed, &[u64::from(self.number), choice as u64, k])
    }

    pub(super) fn uniform(self, choice: Choice, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.share(choice, 0)
    }

    /// Returns a whole number of a range, its ends included.
    pub(super) fn whole(self, choice: Choice, [low, high]: [f64; 2]) -> u32 {
        (low + (high - low + 1.0) * self.share(choice, 0))
            .floor()
            .min(high) as u32
    }

    /// Returns a factor of a range, uniform in its logarithm.
    pub(super) fn factor(self, choice: Choice, k: u64, [low, high]: [f64; 2]) -> f64 {
        low * libm::pow(high / low, self.share(choice, k))
    }

    pub(super) fn pick(self, choice: Choice, n: usize) -> usize {
        (self.bits(choice, 0) % n as u64) as usize
    }
}
