//! How probable it is that a sighting is right: that its centroid lies within a tenth of the body length of the true one.
//!
//! What tells is how unlike the subject the candidate looks, in the middle of all frames in which the same thing is followed.
//! This misfit is a sum of squares of standard deviations, and so the logarithm of the odds falls with it in a line.
//! docs/ACCURACY.md has the reliability.

use crate::analysis::subject::FITS;

/// What is less probable was not found.
pub(super) const FOUND: f64 = 0.5;
/// Logarithm of the odds of what looks just as usual: of 150 films of bench/cases.py, one frame of 150 is wrong.
const BASE: f64 = 5.0;

/// The probability that a candidate of this misfit is right: a half where it fits no more.
pub(super) fn of(misfit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(BASE * (misfit / FITS - 1.0)))
}
