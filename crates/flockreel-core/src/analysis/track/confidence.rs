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

/// Returns the probability that a candidate of this misfit is right, 0..=1: one half at a misfit of `FITS`.
pub(super) fn from_misfit(misfit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(BASE * (misfit / FITS - 1.0)))
}
