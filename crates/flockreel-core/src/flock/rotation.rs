//! Smoothing of sprite rotations without delay (docs/explanation/algorithms.md, "Placement").
//!
//! A one-sided low-pass lags behind an animal that turns, and the lag is heading error. This filter looks
//! both ways. It minimizes sum (r_t - wanted_t)^2 + stiffness * sum (r_t - r_(t-1))^2, which is a tridiagonal
//! system. Its impulse response falls by a constant factor per frame on both sides.

/// Time constant of the filter, seconds. An oscillation whose period is 2 pi times this is halved. Derived
/// from a one-sided low-pass with a time constant of 0.1 s (docs/explanation/algorithms.md, "Placement"),
/// which halves the same oscillation.
const TIME_CONSTANT_S: f64 = 0.1 / 1.732_050_807_568_877_2;

/// Returns the weight of steps from frame to frame against distances from the wanted rotation.
pub(super) fn stiffness(fps: f64) -> f64 {
    let decay = libm::exp(-1.0 / (TIME_CONSTANT_S * fps));
    decay / ((1.0 - decay) * (1.0 - decay))
}

/// Returns the smoothed rotations of successive frames, radians. `before` is the rotation of the frame before
/// the first one.
pub(super) fn smoothed(wanted_rad: &[f64], before: Option<f64>, stiffness: f64) -> Vec<f64> {
    let n = wanted_rad.len();
    // Thomas algorithm: the coefficient of the next unknown in each equation, and the right side.
    let mut next = Vec::with_capacity(n);
    let mut smoothed: Vec<f64> = Vec::with_capacity(n);
    for (t, &wanted) in wanted_rad.iter().enumerate() {
        let last = match t {
            0 => before.map(|before| (0.0, before)),
            t => Some((next[t - 1], smoothed[t - 1])),
        };
        let (ahead, right) = (if t + 1 < n { stiffness } else { 0.0 }, wanted);
        let (diagonal, right) = match last {
            None => (1.0 + ahead, right),
            Some((left_over, value)) => (
                1.0 + ahead + stiffness * (1.0 - left_over),
                right + stiffness * value,
            ),
        };
        next.push(ahead / diagonal);
        smoothed.push(right / diagonal);
    }
    for t in (1..n).rev() {
        smoothed[t - 1] += next[t - 1] * smoothed[t];
    }
    smoothed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_rotation_is_kept_and_the_frame_before_draws_the_first_frames() {
        let still = smoothed(&[0.1; 20], None, stiffness(30.0));
        assert!(still.iter().all(|r| (r - 0.1).abs() < 1e-12), "{still:?}");
        let drawn = smoothed(&[0.1; 20], Some(-0.1), stiffness(30.0));
        assert!(drawn.is_sorted() && drawn[0] < 0.08, "{drawn:?}");
        assert!(drawn[0] > -0.1 && drawn[19] > 0.0999, "{drawn:?}");
    }

    #[test]
    fn result_minimizes_the_cost() {
        let wanted: Vec<f64> = (0..30).map(|t| libm::sin(f64::from(t * t))).collect();
        let (before, stiffness) = (0.3, 2.5);
        let cost = |r: &[f64]| {
            let off: f64 = r.iter().zip(&wanted).map(|(r, w)| (r - w) * (r - w)).sum();
            let earlier = std::iter::once(&before).chain(r);
            let steps: f64 = earlier.zip(r).map(|(a, b)| (a - b) * (a - b)).sum();
            off + stiffness * steps
        };
        let found = smoothed(&wanted, Some(before), stiffness);
        for t in 0..30 {
            for by in [-1e-3, 1e-3] {
                let mut other = found.clone();
                other[t] += by;
                assert!(cost(&found) < cost(&other), "frame {t}");
            }
        }
    }

    #[test]
    fn turn_is_followed_without_delay() {
        let turning: Vec<f64> = (0..90).map(|t| f64::from(t) * 0.01).collect();
        let found = smoothed(&turning, None, stiffness(30.0));
        for t in 20..70 {
            assert!(
                (found[t] - turning[t]).abs() < 1e-4,
                "frame {t}: {}",
                found[t]
            );
        }
    }

    #[test]
    fn oscillation_of_the_time_constant_is_halved() {
        let fps = 240.0;
        let wave = |t: usize| libm::sin(t as f64 / (TIME_CONSTANT_S * fps));
        let wanted: Vec<f64> = (0..2000).map(wave).collect();
        let found = smoothed(&wanted, None, stiffness(fps));
        let highest = found[500..1500].iter().fold(0.0, |a: f64, b| a.max(*b));
        assert!((highest - 0.5).abs() < 0.01, "{highest}");
    }
}
