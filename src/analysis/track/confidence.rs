//! How probable it is that a sighting is right: that its centroid lies within a tenth of the body length of the true one.
//!
//! What tells is how unlike the subject the candidate looks. Its misfit is a sum of squares of standard deviations, and so the
//! logarithm of the odds falls with it in a line. The line was fitted on the films of bench/cases.py, each film weighing the
//! same; docs/ACCURACY.md has the reliability.

/// What is less probable was not found.
pub(super) const FOUND: f64 = 0.5;
/// Logarithm of the odds of what looks just as usual.
const BASE: f64 = 5.5;
/// How much it falls for each unit of misfit.
const PER_MISFIT: f64 = 2.46;

/// The probability that a candidate of this misfit is right.
pub(super) fn of(misfit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(PER_MISFIT * misfit - BASE))
}
