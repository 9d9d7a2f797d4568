//! Measures the frequency of the tail beat (docs/explanation/algorithms.md, "Midline and tail beat").
//!
//! In top view the bend of the midline oscillates with the tail. In side view the body bends along the line
//! of sight. The length and the skew of the silhouette then oscillate slightly, at the frequency of the beat,
//! while the fish is seen at an angle. The sign of that oscillation depends on the direction of the fish, so
//! only the frequency is reported, not the phase.
//!
//! The method computes Lomb-Scargle spectra (Zechmeister & Kürster 2009) in windows of two seconds. It
//! compares them with a floor of measurement noise and slow movements, and tracks one frequency with Viterbi.
//! A beat is reported where its power exceeds the floor.

use std::f64::consts::{LN_2, TAU};

use crate::library::{BeatSpan, Pose, Poses, TailBeat, TailBeatMethod, View};
use crate::order::median;

/// Half the length of a window, seconds. Free choice.
const HALF_WINDOW_S: f64 = 1.0;
/// Distance between windows, seconds. Free choice.
const HOP_S: f64 = 0.25;
/// Range of frequencies, Hz. The upper end is also limited to 0.45 of the frame rate. Free choice.
const BAND_HZ: [f64; 2] = [0.5, 12.0];
/// Logarithm of the ratio of neighboring frequencies. Free choice.
const LOG_STEP: f64 = 0.04;
/// Cost of a change in frequency between windows, per factor of e. Free choice.
const CHANGE_COST: f64 = 32.0;
/// Smallest ratio of power to noise floor for which a beat is reported. Free choice.
const MIN_POWER_RATIO: f64 = 4.0;
/// Smallest number of successive windows for which a beat is reported. Free choice.
const MIN_WINDOWS: usize = 4;
/// Smallest share of measured frames in a window. Free choice.
const MIN_MEASURED_SHARE: f64 = 0.6;
/// Smallest number of frames in a window: four for the cubic trend, two for the wave, three to test the fit.
/// Below 4 frames per second a window has fewer, and no beat is measured.
const MIN_WINDOW_FRAMES: usize = 9;

/// Returns the tail beat, or `None` if no part of the footage shows one.
pub fn measure(poses: &Poses) -> Option<TailBeat> {
    let signal =
        |value: fn(&Pose) -> Option<f64>| -> Signal { poses.frames.iter().map(value).collect() };
    let bend = signal(|pose| pose.bend_rad);
    let (method, signals) = match poses.view {
        View::Top if bend.iter().all(Option::is_none) => return None,
        View::Top => (TailBeatMethod::Bend, vec![bend]),
        View::Side => (
            TailBeatMethod::LengthAndSkew,
            vec![signal(log_length), signal(skew)],
        ),
    };
    let spans = spans(&signals, poses.fps);
    (!spans.is_empty()).then_some(TailBeat { method, spans })
}

type Signal = Vec<Option<f64>>;

/// Returns the logarithm of the length. An oscillation is then relative to the length at any distance.
fn log_length(pose: &Pose) -> Option<f64> {
    let length_px = pose
        .length_px
        .filter(|&length_px| length_px > 0.0 && !pose.cut);
    length_px.map(libm::log)
}

/// Returns the skew, positive toward the head.
fn skew(pose: &Pose) -> Option<f64> {
    let toward_head = libm::cos(pose.heading_rad? - pose.axis_rad?).signum();
    let skew = pose.skew.filter(|_| !pose.cut)?;
    Some(toward_head * skew)
}

/// The spectrum of one window.
struct Window {
    middle: usize,
    /// Logarithm of the ratio of power to noise floor, by frequency.
    evidence: Vec<f64>,
    /// Amplitude of the first signal, by frequency.
    amplitude: Vec<f64>,
}

impl Window {
    /// Returns the frequency with the largest amplitude within five steps of `k`. The sloped noise floor
    /// shifts the peak of the ratio.
    fn strongest_near(&self, k: usize) -> usize {
        let last = self.amplitude.len() - 1;
        (k.saturating_sub(5)..=(k + 5).min(last)).fold(k, |best, other| {
            if self.amplitude[other] > self.amplitude[best] {
                other
            } else {
                best
            }
        })
    }
}

fn spans(signals: &[Signal], fps: f64) -> Vec<BeatSpan> {
    let band = Band::new(fps);
    if band.weights.len() < MIN_WINDOW_FRAMES {
        return Vec::new();
    }
    let hop = ((HOP_S * fps).round() as usize).max(1);
    let n_frames = signals[0].len();
    let middles = (band.half..n_frames.saturating_sub(band.half)).step_by(hop);
    let mut spans = Vec::new();
    let mut run: Vec<Window> = Vec::new();
    for window in middles.map(|middle| band.spectrum(signals, middle)) {
        match window {
            Some(window) => run.push(window),
            None => add_spans(&std::mem::take(&mut run), &band, hop, &mut spans),
        }
    }
    add_spans(&run, &band, hop, &mut spans);
    spans
}

/// The frequencies and their waves over one window.
struct Band {
    fps: f64,
    half: usize,
    frequencies_hz: Vec<f64>,
    /// Cosine and sine at each frame of the window, by frequency.
    waves: Vec<Vec<[f64; 2]>>,
    /// Hann window.
    weights: Vec<f64>,
}

impl Band {
    fn new(fps: f64) -> Band {
        let half = ((HALF_WINDOW_S * fps).round() as usize).max(1);
        let most = BAND_HZ[1].min(0.45 * fps);
        let n = (libm::log(most / BAND_HZ[0]) / LOG_STEP).floor().max(-1.0) as i32 + 1;
        let frequencies_hz: Vec<f64> = (0..n)
            .map(|k| BAND_HZ[0] * libm::exp(LOG_STEP * f64::from(k)))
            .collect();
        let offsets: Vec<f64> = (0..=2 * half).map(|k| k as f64 - half as f64).collect();
        let wave = |f: &f64| -> Vec<[f64; 2]> {
            let angles = offsets.iter().map(|offset| TAU * f * offset / fps);
            angles.map(|a| [libm::cos(a), libm::sin(a)]).collect()
        };
        let hann = |o: &f64| libm::cos(TAU / 4.0 * o / (half + 1) as f64).powi(2);
        Band {
            fps,
            half,
            waves: frequencies_hz.iter().map(wave).collect(),
            weights: offsets.iter().map(hann).collect(),
            frequencies_hz,
        }
    }

    /// Returns the spectrum around one frame over all signals, or `None` with too few measured frames.
    fn spectrum(&self, signals: &[Signal], middle: usize) -> Option<Window> {
        let mut evidence = vec![0.0; self.frequencies_hz.len()];
        let mut first = None;
        for signal in signals {
            let samples = self.detrended(&signal[middle - self.half..=middle + self.half])?;
            let amplitude: Vec<f64> = (self.waves.iter())
                .map(|wave| amplitude(&samples, wave))
                .collect();
            let power: Vec<f64> = amplitude.iter().map(|a| a * a).collect();
            let floor = self.noise_floor(&power);
            for ((sum, power), floor) in evidence.iter_mut().zip(power).zip(floor) {
                *sum += libm::log((power / floor).max(1e-6)) / signals.len() as f64;
            }
            first.get_or_insert(amplitude);
        }
        Some(Window {
            middle,
            evidence,
            amplitude: first?,
        })
    }

    /// Returns the noise floor, the larger of two parts: slow movements, which fall with the square of the
    /// frequency (from the lower half of the band), and white noise (from the upper half).
    fn noise_floor(&self, power: &[f64]) -> Vec<f64> {
        let (low, high) = self.frequencies_hz.split_at(power.len() / 2);
        let squared = low.iter().zip(power).map(|(f, p)| f * f * p);
        let wandering = mean_of_noise(squared);
        let noise = mean_of_noise(power[power.len() - high.len()..].iter().copied());
        (self.frequencies_hz.iter())
            .map(|f| (wandering / (f * f)).max(noise).max(1e-15))
            .collect()
    }

    /// Returns the weighted samples of a window without their weighted cubic trend.
    fn detrended(&self, window: &[Option<f64>]) -> Option<Vec<Sample>> {
        let n_measured = window.iter().flatten().count();
        if (n_measured as f64) < MIN_MEASURED_SHARE * window.len() as f64 {
            return None;
        }
        let sample = |(value, &weight): (&Option<f64>, &f64)| Sample {
            value: value.unwrap_or(0.0),
            weight: if value.is_some() { weight } else { 0.0 },
        };
        let mut samples: Vec<Sample> = window.iter().zip(&self.weights).map(sample).collect();
        // Orthonormal polynomials (Gram-Schmidt).
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for degree in 0..4 {
            let at = |k: usize| (k as f64 / self.half as f64 - 1.0).powi(degree);
            let mut power: Vec<f64> = (0..window.len()).map(at).collect();
            let dot = |p: &[f64], q: &[f64]| -> f64 {
                let terms = samples.iter().zip(p).zip(q);
                terms.map(|((sample, p), q)| sample.weight * p * q).sum()
            };
            for earlier in &basis {
                let share = dot(&power, earlier);
                (power.iter_mut().zip(earlier)).for_each(|(p, e)| *p -= share * e);
            }
            let norm = dot(&power, &power).sqrt().max(1e-9);
            power.iter_mut().for_each(|p| *p /= norm);
            basis.push(power);
        }
        for power in &basis {
            let terms = samples.iter().zip(power);
            let share: f64 = terms.map(|(s, p)| s.weight * s.value * p).sum();
            (samples.iter_mut().zip(power)).for_each(|(s, p)| s.value -= share * p);
        }
        Some(samples)
    }
}

/// One frame of a window; without a measurement, its weight is 0.
struct Sample {
    weight: f64,
    value: f64,
}

/// Returns the amplitude of the sinusoid that fits the weighted samples best.
fn amplitude(samples: &[Sample], wave: &[[f64; 2]]) -> f64 {
    let [mut cc, mut cs, mut ss, mut yc, mut ys] = [0.0; 5];
    for (sample, [c, s]) in samples.iter().zip(wave) {
        let (w, y) = (sample.weight, sample.value);
        cc += w * c * c;
        cs += w * c * s;
        ss += w * s * s;
        yc += w * y * c;
        ys += w * y * s;
    }
    let determinant = (cc * ss - cs * cs).max(1e-12);
    libm::hypot(yc * ss - ys * cs, ys * cc - yc * cs) / determinant
}

/// Returns the mean power of noise. Noise power is distributed exponentially: the mean is the median / ln 2.
fn mean_of_noise(power: impl Iterator<Item = f64>) -> f64 {
    median(power).map_or(0.0, |median| median / LN_2)
}

/// Tracks one frequency through successive windows and adds the spans in which it stands out.
fn add_spans(run: &[Window], band: &Band, hop: usize, spans: &mut Vec<BeatSpan>) {
    let path = best_path(run);
    let stands_out = |k: usize| libm::exp(run[k].evidence[path[k]]) > MIN_POWER_RATIO;
    let mut from = 0;
    while from < run.len() {
        let to = (from..run.len())
            .find(|&k| !stands_out(k))
            .unwrap_or(run.len());
        if to - from >= MIN_WINDOWS {
            let mut at = from;
            while at < to {
                // Within one span the frequency differs by at most one step.
                let end = (at..to)
                    .find(|&k| path[k].abs_diff(path[at]) > 1)
                    .unwrap_or(to);
                spans.push(span(&run[at..end], &path[at..end], band, hop));
                at = end;
            }
        }
        from = to + 1;
    }
}

fn span(windows: &[Window], path: &[usize], band: &Band, hop: usize) -> BeatSpan {
    let n = windows.len() as f64;
    let mean = |value: &dyn Fn(&Window, usize) -> f64| -> f64 {
        let values = windows.iter().zip(path).map(|(w, &k)| value(w, k));
        values.sum::<f64>() / n
    };
    let first = windows[0].middle - hop / 2;
    let end = windows[windows.len() - 1].middle + hop - hop / 2;
    BeatSpan {
        frames: [first, end],
        start_s: first as f64 / band.fps,
        end_s: end as f64 / band.fps,
        frequency_hz: mean(&|window, k| band.frequencies_hz[window.strongest_near(k)]),
        amplitude: mean(&|window, k| window.amplitude[window.strongest_near(k)]),
        confidence: mean(&|window, k| 1.0 - libm::exp(-window.evidence[k]).min(1.0)),
    }
}

/// Returns the most probable sequence of frequencies, as indices into the band (Viterbi).
fn best_path(run: &[Window]) -> Vec<usize> {
    let Some(n) = run.first().map(|window| window.evidence.len()) else {
        return Vec::new();
    };
    let mut gains = vec![0.0; n];
    let mut came_from: Vec<Vec<usize>> = Vec::with_capacity(run.len());
    for window in run {
        // The cost grows with the distance, so one upward and one downward sweep find the best predecessors.
        let mut from: Vec<usize> = (0..n).collect();
        for k in 1..n {
            if gains[k - 1] - CHANGE_COST * LOG_STEP > gains[k] {
                (gains[k], from[k]) = (gains[k - 1] - CHANGE_COST * LOG_STEP, from[k - 1]);
            }
        }
        for k in (0..n.saturating_sub(1)).rev() {
            if gains[k + 1] - CHANGE_COST * LOG_STEP > gains[k] {
                (gains[k], from[k]) = (gains[k + 1] - CHANGE_COST * LOG_STEP, from[k + 1]);
            }
        }
        (gains.iter_mut().zip(&window.evidence)).for_each(|(gain, e)| *gain += e);
        came_from.push(from);
    }
    let best = (0..n).fold(0, |best, k| if gains[k] > gains[best] { k } else { best });
    let mut path = vec![best; run.len()];
    for k in (1..run.len()).rev() {
        path[k - 1] = came_from[k][path[k]];
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::Pose;
    use crate::random;

    /// Returns 20 s of bends in top view: slow movements, noise, and a beat of `amplitude_rad` at `f` Hz.
    fn bending(f: f64, amplitude_rad: f64, seed: u64) -> Poses {
        let mut wander = 0.0;
        let frames = (0..600u64).map(|k| {
            wander = 0.98 * wander + 0.02 * random::normal(seed, &[0, k]);
            let beat = amplitude_rad * libm::sin(TAU * f * k as f64 / 30.0);
            Pose {
                bend_rad: Some(wander + beat + 0.02 * random::normal(seed, &[1, k])),
                ..Pose::default()
            }
        });
        Poses {
            fps: 30.0,
            image_size_px: [64, 64],
            view: View::Top,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: frames.collect(),
            tail_beat: None,
        }
    }

    #[test]
    fn frequency_and_amplitude_are_found_under_noise() {
        for f in [1.5, 3.0, 7.0] {
            let beat = measure(&bending(f, 0.2, 1)).expect("it beats");
            let n_frames: usize = beat.spans.iter().map(|s| s.frames[1] - s.frames[0]).sum();
            assert!(n_frames > 450, "{f} Hz in {n_frames} frames");
            for span in &beat.spans {
                assert!((span.frequency_hz / f - 1.0).abs() < 0.06, "{f}: {span:?}");
                assert!((span.amplitude / 0.2 - 1.0).abs() < 0.3, "{f}: {span:?}");
            }
        }
    }

    #[test]
    fn noise_is_rarely_taken_for_a_beat() {
        let n_frames: usize = (0..10)
            .filter_map(|seed| measure(&bending(1.0, 0.0, seed)))
            .flat_map(|beat| beat.spans)
            .map(|span| span.frames[1] - span.frames[0])
            .sum();
        assert!(n_frames < 300, "{n_frames} of 6000");
    }

    #[test]
    fn below_4_fps_no_beat_is_measured_and_above_it_is_found() {
        for fps in [0.01, 0.2, 0.45, 1.0, 1.2, 3.0, 10.0, 60.0] {
            let poses = bending(30.0 * 0.2, 0.2, 3);
            let beat = measure(&Poses { fps, ..poses });
            assert_eq!(beat.is_some(), fps > 4.0, "{fps} fps");
        }
    }

    #[test]
    fn gaps_end_spans_and_unmeasured_footage_has_no_beat() {
        let mut poses = bending(3.0, 0.2, 2);
        for pose in &mut poses.frames[250..350] {
            pose.bend_rad = None;
        }
        let spans = measure(&poses).expect("it beats").spans;
        assert!(
            spans
                .iter()
                .all(|s| s.frames[1] <= 262 || s.frames[0] >= 338)
        );
        poses.frames.fill(Pose::default());
        assert_eq!(measure(&poses), None);
    }
}
