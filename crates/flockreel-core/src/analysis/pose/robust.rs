//! What the estimates over many frames share: outliers, gaps, and the least number of frames.

/// Standard deviations beyond which a residual counts less (Huber 1964). Free choice.
const HUBER: f64 = 2.5;
/// Time in which slow values hardly change, seconds: gaps up to it are bridged, and means and medians are taken over
/// it. Free choice.
pub(super) const SPAN_S: f64 = 0.5;
/// Half the time span over which speed and turning rate are measured, seconds. Free choice.
const HALF_SPAN_S: f64 = 0.1;
/// Least number of frames for an estimate. Free choice.
pub(super) const MIN_FRAMES: usize = 8;

/// Returns the loss of a residual in standard deviations: its square, but a line beyond `HUBER`.
pub(super) fn loss(sigmas: f64) -> f64 {
    let sigmas = sigmas.abs();
    let square = sigmas.min(HUBER);
    square * (2.0 * sigmas - square)
}

/// Returns the weight with which the square of a residual in standard deviations has the slope of its loss.
pub(super) fn weight(sigmas: f64) -> f64 {
    HUBER / sigmas.abs().max(HUBER)
}

/// Returns the half span, at least one frame.
pub(in crate::analysis) fn half_span(fps: f64) -> usize {
    ((fps * HALF_SPAN_S).round() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loss_is_a_square_and_then_a_line_of_the_same_slope() {
        assert_eq!(loss(-2.0), 4.0);
        assert_eq!(weight(2.0), 1.0);
        let slope = (loss(5.0) - loss(4.0)) / 1.0;
        assert_eq!(slope, 2.0 * HUBER);
        assert_eq!(2.0 * weight(-5.0) * 5.0, slope);
    }
}
