//! Rates of change of a smoothed time series: constant-velocity Kalman filter and Rauch-Tung-Striebel
//! smoother (1965).
//!
//! Large innovations get Huber weights. Second differences of the data give the measurement noise. The
//! process noise is the candidate with the greatest likelihood. See docs/explanation/algorithms.md, "Pose".

use crate::order::median;

/// Standard deviations beyond which an innovation counts less. Free choice.
const HUBER: f64 = 2.5;
/// Longest gap that is bridged, seconds. Free choice.
const BRIDGE_S: f64 = 0.5;

/// Returns the rates of change of measurements taken every `1 / fps` seconds, per second. `None` marks a
/// missing measurement.
///
/// Gaps up to half a second are bridged. Longer gaps stay empty, as do the times before the first and after
/// the last measurement.
pub(super) fn smoothed_rates(measured: &[Option<f64>], fps: f64) -> Vec<Option<f64>> {
    let noise = measurement_variance(measured);
    let dt = 1.0 / fps;
    let likelihood = |q: f64| filter(measured, dt, q, noise).log_likelihood;
    // Candidates: 1/100 to 100 times the acceleration noise that moves the value by its measurement noise in
    // 0.1 s.
    let unit = noise / libm::pow(0.1, 3.0);
    let candidates = (0..=16).map(|k| unit * libm::pow(10.0, -2.0 + 0.25 * f64::from(k)));
    let best =
        candidates
            .map(|q| (likelihood(q), q))
            .fold((f64::NEG_INFINITY, unit), |best, next| {
                if next.0 > best.0 { next } else { best }
            });
    let filtered = filter(measured, dt, best.1, noise);
    let max_gap = (BRIDGE_S * fps).round() as usize;
    smooth_backward(&filtered, measured, dt, max_gap)
}

/// Returns the variance of white noise on a smooth signal.
///
/// Second differences of such noise have six times its variance. Their median absolute value is robust.
fn measurement_variance(measured: &[Option<f64>]) -> f64 {
    let second_differences =
        (measured.windows(3)).filter_map(|w| Some((w[0]? - 2.0 * w[1]? + w[2]?).abs()));
    median(second_differences).map_or(1e-12, |median| (1.4826 * median).powi(2).max(1e-12) / 6.0)
}

/// A state (value, rate) and its covariance.
#[derive(Clone, Copy)]
struct State {
    x: [f64; 2],
    p: [[f64; 2]; 2],
}

struct Filtered {
    /// States before and after each measurement.
    predicted: Vec<State>,
    updated: Vec<State>,
    log_likelihood: f64,
}

fn filter(measured: &[Option<f64>], dt: f64, q: f64, r: f64) -> Filtered {
    let first = measured.iter().flatten().next().copied().unwrap_or(0.0);
    // A wide prior: any value near the data and any rate.
    let mut state = State {
        x: [first, 0.0],
        p: [[1e6 * r, 0.0], [0.0, 1e6 * r / dt]],
    };
    let mut filtered = Filtered {
        predicted: Vec::with_capacity(measured.len()),
        updated: Vec::with_capacity(measured.len()),
        log_likelihood: 0.0,
    };
    for (idx, z) in measured.iter().enumerate() {
        if idx > 0 {
            state = predict(&state, dt, q);
        }
        filtered.predicted.push(state);
        if let Some(z) = z {
            let innovation = z - state.x[0];
            let expected = state.p[0][0] + r;
            let sigmas = innovation.abs() / expected.sqrt();
            let loss = if sigmas > HUBER {
                2.0 * HUBER * sigmas - HUBER * HUBER
            } else {
                sigmas * sigmas
            };
            filtered.log_likelihood -= 0.5 * (loss + libm::log(expected));
            // Huber weight: a large innovation counts as a measurement with more noise.
            let weight = if sigmas > HUBER { HUBER / sigmas } else { 1.0 };
            let s = state.p[0][0] + r / weight;
            let k = [state.p[0][0] / s, state.p[1][0] / s];
            let [[a, b], [_, d]] = state.p;
            state = State {
                x: [
                    state.x[0] + k[0] * innovation,
                    state.x[1] + k[1] * innovation,
                ],
                p: [
                    [(1.0 - k[0]) * a, (1.0 - k[0]) * b],
                    [(1.0 - k[0]) * b, d - k[1] * b],
                ],
            };
        }
        filtered.updated.push(state);
    }
    filtered
}

/// Returns the state one step later, for constant velocity and white acceleration of spectral density `q`.
fn predict(state: &State, dt: f64, q: f64) -> State {
    let [[a, b], [c, d]] = state.p;
    State {
        x: [state.x[0] + dt * state.x[1], state.x[1]],
        p: [
            [
                a + dt * (b + c) + dt * dt * d + q * dt * dt * dt / 3.0,
                b + dt * d + q * dt * dt / 2.0,
            ],
            [c + dt * d + q * dt * dt / 2.0, d + q * dt],
        ],
    }
}

/// Runs the backward pass and removes the gaps longer than `max_gap` frames.
fn smooth_backward(
    filtered: &Filtered,
    measured: &[Option<f64>],
    dt: f64,
    max_gap: usize,
) -> Vec<Option<f64>> {
    let n = measured.len();
    let mut smoothed: Vec<[f64; 2]> = filtered.updated.iter().map(|s| s.x).collect();
    for k in (0..n.saturating_sub(1)).rev() {
        let (u, p) = (&filtered.updated[k], &filtered.predicted[k + 1]);
        // G = P F' (P predicted)^-1.
        let pf = [
            [u.p[0][0] + dt * u.p[0][1], u.p[0][1]],
            [u.p[1][0] + dt * u.p[1][1], u.p[1][1]],
        ];
        let det = p.p[0][0] * p.p[1][1] - p.p[0][1] * p.p[1][0];
        let inv = [
            [p.p[1][1] / det, -p.p[0][1] / det],
            [-p.p[1][0] / det, p.p[0][0] / det],
        ];
        let gap = [smoothed[k + 1][0] - p.x[0], smoothed[k + 1][1] - p.x[1]];
        let step = [
            inv[0][0] * gap[0] + inv[0][1] * gap[1],
            inv[1][0] * gap[0] + inv[1][1] * gap[1],
        ];
        for (row, value) in pf.iter().zip(&mut smoothed[k]) {
            *value += row[0] * step[0] + row[1] * step[1];
        }
    }
    let known = bridged(measured, max_gap);
    (smoothed.iter().zip(known))
        .map(|(&[_, rate], known)| known.then_some(rate))
        .collect()
}

/// Returns true for measurements and for gaps of at most `max_gap` frames between two of them.
fn bridged(measured: &[Option<f64>], max_gap: usize) -> Vec<bool> {
    let mut known: Vec<bool> = measured.iter().map(Option::is_some).collect();
    let mut last = None;
    for (idx, value) in measured.iter().enumerate() {
        if value.is_some() {
            if let Some(last) = last
                && idx - last - 1 <= max_gap
            {
                known[last..idx].fill(true);
            }
            last = Some(idx);
        }
    }
    known
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random;

    fn wave(k: usize) -> f64 {
        libm::sin(k as f64 * 0.05) * 10.0
    }

    fn noisy(k: usize) -> Option<f64> {
        Some(wave(k) + 0.5 * random::normal(3, &[k as u64]))
    }

    /// Returns the rate of the wave, per second.
    fn wave_rate(k: usize) -> f64 {
        15.0 * libm::cos(k as f64 * 0.05)
    }

    fn rmse(rates: &[Option<f64>]) -> f64 {
        let error =
            |(k, rate): (usize, &Option<f64>)| Some((rate.as_ref()? - wave_rate(k)).powi(2));
        let errors = rates.iter().enumerate().filter_map(error);
        (errors.clone().sum::<f64>() / errors.count() as f64).sqrt()
    }

    #[test]
    fn noise_is_reduced_and_the_signal_kept() {
        let measured: Vec<Option<f64>> = (0..400).map(noisy).collect();
        let difference =
            |k: usize| Some((measured.get(k + 1)?.as_ref()? - measured[k].as_ref()?) * 30.0);
        let differences: Vec<Option<f64>> = (0..400).map(difference).collect();
        let rates = smoothed_rates(&measured, 30.0);
        assert!(rmse(&rates) < 0.2 * rmse(&differences), "{}", rmse(&rates));
    }

    #[test]
    fn an_outlier_hardly_counts() {
        let mut measured: Vec<Option<f64>> = (0..200).map(noisy).collect();
        measured[100] = Some(80.0);
        let rates = smoothed_rates(&measured, 30.0);
        // Differences between neighbors are off by about 2000 per second.
        assert!(rmse(&rates) < 10.0, "{}", rmse(&rates));
    }

    #[test]
    fn short_gaps_are_bridged_and_long_ones_stay_empty() {
        let mut measured: Vec<Option<f64>> = (0..200).map(noisy).collect();
        measured[50..60].fill(None);
        measured[100..140].fill(None);
        measured[..3].fill(None);
        let rates = smoothed_rates(&measured, 30.0);
        assert!((rates[55].expect("bridged") - wave_rate(55)).abs() < 8.0);
        assert_eq!((rates[120], rates[1]), (None, None));
    }

    #[test]
    fn rates_are_per_second() {
        let measured: Vec<Option<f64>> = (0..100).map(|k| Some(k as f64 * 0.1)).collect();
        let rate = smoothed_rates(&measured, 30.0)[50].expect("measured");
        assert!((rate - 3.0).abs() < 1e-3, "{rate}");
    }
}
