//! Probability that a sighting is right: its centroid lies within a tenth of the body length of the true one.
//!
//! The input is the misfit: the median cost of the candidates (`Subject::cost`) over the frames in which the
//! same thing is followed. It is a sum of squared standard deviations, so the log-odds fall linearly with it.
//! The reliability is in docs/measurements.md.

use crate::analysis::subject::FITS;

/// Least probability of a sighting; below it the animal counts as not found. Free choice: more right than
/// wrong.
pub(super) const FOUND: f64 = 0.5;
/// Log-odds at misfit 0. Measured on 150 films of bench/cases.py: one frame in 150 is wrong.
const BASE: f64 = 5.0;

/// Probability that the measured animal is the whole one although a part of it never left its place. Free choice:
/// below 0.9, so that no such measurement counts as sure.
const WITH_STILL_PART: f64 = 0.88;

/// Returns the probability that the measured animal is the whole one, 0..=1.
pub(super) fn that_whole(has_still_part: bool) -> f64 {
    if has_still_part { WITH_STILL_PART } else { 1.0 }
}

/// Fall of the log-odds with the logarithm of the extent, where no point of the outline is an edge. Free
/// choice.
const EXTENT: f64 = 12.0;

/// Returns the probability of a sighting whose area is `share` of the usual one and whose outline lies on edges in
/// the share `edges`. A part of the animal, or the animal with something attached, differs in area, and its outline
/// has no edge where it was cut.
pub(super) fn of_extent(confidence: f64, share: f64, edges: f64) -> f64 {
    let odds = confidence / (1.0 - confidence);
    let doubt = libm::exp(EXTENT * libm::log(share).abs() * (1.0 - edges));
    odds / (odds + doubt)
}

/// Returns the probability that a candidate of this misfit is right, 0..=1: one half at a misfit of `FITS`.
pub(super) fn from_misfit(misfit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(BASE * (misfit / FITS - 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unusual_extent_matters_only_where_the_outline_has_no_edge() {
        assert!((of_extent(0.99, 0.3, 1.0) - 0.99).abs() < 1e-9);
        assert!((of_extent(0.99, 1.0, 0.3) - 0.99).abs() < 1e-9);
        assert!(of_extent(0.99, 0.5, 0.6) < 0.9);
        assert!(of_extent(0.99, 2.0, 0.6) < 0.9);
    }
}
