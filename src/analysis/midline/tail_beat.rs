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

use crate::library::{BeatSpan, Poses, TailBeat, TailBeatMethod, View};

/// Half the length of a window, seconds. Free choice.
const HALF_S: f64 = 1.0;
/// Distance between windows, seconds. Free choice.
const HOP_S: f64 = 0.25;
/// Range of frequencies, Hz. The upper end is also limited to 0.45 of the frame rate. Free choice.
const BAND_HZ: [f64; 2] = [0.5, 12.0];
/// Logarithm of the ratio of neighboring frequencies. Free choice.
const STEP: f64 = 0.04;
/// Cost of a change in frequency between windows, per factor of e. Free choice.
const CHANGE: f64 = 32.0;
/// Smallest ratio of power to noise floor for which a beat is reported. Free choice.
const LEVEL: f64 = 4.0;
/// Smallest number of successive windows for which a beat is reported. Free choice.
const LEAST_WINDOWS: usize = 4;
/// Smallest share of measured frames in a window. Free choice.
const LEAST_SHARE: f64 = 0.6;
/// Smallest number of frames in a window: four for the cubic trend, two for the wave, three to test the fit.
/// Below 4 frames per second a window has fewer, and no beat is measured.
const LEAST_WINDOW_FRAMES: usize = 9;

/// Returns the tail beat, or `None` if no part of the footage shows one.
pub fn measure(poses: &Poses) -> Option<TailBeat> {
    let bends = poses.frames.iter().any(|pose| pose.bend_rad.is_some());
    let (method, signals) = match (poses.view, bends) {
        (View::Top, true) => (TailBeatMethod::Bend, vec![bend(poses)]),
        (View::Top, false) => return None,
        (View::Side, _) => (
            TailBeatMethod::LengthAndSkew,
            vec![length(poses), skew(poses)],
        ),
    };
    let spans = spans(&signals, poses.fps);
    (!spans.is_empty()).then_some(TailBeat { method, spans })
}

type Signal = Vec<Option<f64>>;

fn bend(poses: &Poses) -> Signal {
    poses.frames.iter().map(|pose| pose.bend_rad).collect()
}

/// Returns the logarithm of the length. An oscillation is then relative to the length at any distance.
fn length(poses: &Poses) -> Signal {
    let one = |pose: &crate::library::Pose| pose.length_px.filter(|&l| l > 0.0 && !pose.cut);
    (poses.frames.iter())
        .map(|pose| one(pose).map(libm::log))
        .collect()
}

/// Returns the skew, positive toward the head.
fn skew(poses: &Poses) -> Signal {
    let one = |pose: &crate::library::Pose| {
        let toward = libm::cos(pose.heading_rad? - pose.axis_rad?).signum();
        pose.skew.filter(|_| !pose.cut).map(|skew| toward * skew)
    };
    poses.frames.iter().map(one).collect()
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
            match self.amplitude[other] > self.amplitude[best] {
                true => other,
                false => best,
            }
        })
    }
}

fn spans(signals: &[Signal], fps: f64) -> Vec<BeatSpan> {
    let band = Band::new(fps);
    if band.weights.len() < LEAST_WINDOW_FRAMES {
        return Vec::new();
    }
    let hop = ((HOP_S * fps).round() as usize).max(1);
    let n_frames = signals[0].len();
    let middles = (band.half..n_frames.saturating_sub(band.half)).step_by(hop);
    let mut spans = Vec::new();
    let mut run: Vec<Window> = Vec::new();
    for window in middles.map(|middle| band.look(signals, middle)) {
        match window {
            Some(window) => run.push(window),
            None => follow(&std::mem::take(&mut run), &band, hop, &mut spans),
        }
    }
    follow(&run, &band, hop, &mut spans);
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
        let half = ((HALF_S * fps).round() as usize).max(1);
        let most = BAND_HZ[1].min(0.45 * fps);
        let n = (libm::log(most / BAND_HZ[0]) / STEP).floor().max(-1.0) as i32 + 1;
        let frequencies_hz: Vec<f64> = (0..n)
            .map(|k| BAND_HZ[0] * libm::exp(STEP * f64::from(k)))
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
    fn look(&self, signals: &[Signal], middle: usize) -> Option<Window> {
        let mut evidence = vec![0.0; self.frequencies_hz.len()];
        let mut first = None;
        for signal in signals {
            let samples = self.detrended(&signal[middle - self.half..=middle + self.half])?;
            let amplitude: Vec<f64> = (self.waves.iter())
                .map(|wave| self.amplitude(&samples, wave))
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
        let wandering = mean_of_noise(squared.collect());
        let noise = mean_of_noise(power[power.len() - high.len()..].to_vec());
        (self.frequencies_hz.iter())
            .map(|f| (wandering / (f * f)).max(noise).max(1e-15))
            .collect()
    }

    /// Returns the samples of a window as (index, weight, value), without their weighted cubic trend.
    fn detrended(&self, window: &[Option<f64>]) -> Option<Vec<(usize, f64, f64)>> {
        let mut samples: Vec<(usize, f64, f64)> = (window.iter().enumerate())
            .filter_map(|(k, value)| Some((k, self.weights[k], (*value)?)))
            .collect();
        if (samples.len() as f64) < LEAST_SHARE * window.len() as f64 {
            return None;
        }
        let mut powers: Vec<Vec<f64>> = Vec::new();
        for degree in 0..4 {
            let at = |k: usize| (k as f64 / self.half as f64 - 1.0).powi(degree);
            let mut power: Vec<f64> = samples.iter().map(|&(k, ..)| at(k)).collect();
            let dot = |p: &[f64], q: &[f64]| -> f64 {
                let terms = samples.iter().zip(p).zip(q);
                terms.map(|(((_, w, _), p), q)| w * p * q).sum()
            };
            for earlier in &powers {
                let share = dot(&power, earlier);
                (power.iter_mut().zip(earlier)).for_each(|(p, e)| *p -= share * e);
            }
            let norm = dot(&power, &power).sqrt().max(1e-9);
            power.iter_mut().for_each(|p| *p /= norm);
            powers.push(power);
        }
        for power in &powers {
            let share: f64 = samples
                .iter()
                .zip(power)
                .map(|((_, w, y), p)| w * y * p)
                .sum();
            (samples.iter_mut().zip(power)).for_each(|(sample, p)| sample.2 -= share * p);
        }
        Some(samples)
    }

    /// Returns the amplitude of the sinusoid that fits the weighted samples best.
    fn amplitude(&self, samples: &[(usize, f64, f64)], wave: &[[f64; 2]]) -> f64 {
        let [mut cc, mut cs, mut ss, mut yc, mut ys] = [0.0; 5];
        for &(k, w, y) in samples {
            let [c, s] = wave[k];
            cc += w * c * c;
            cs += w * c * s;
            ss += w * s * s;
            yc += w * y * c;
            ys += w * y * s;
        }
        let determinant = (cc * ss - cs * cs).max(1e-12);
        libm::hypot(yc * ss - ys * cs, ys * cc - yc * cs) / determinant
    }
}

/// Returns the mean power of noise. Noise power is distributed exponentially: the mean is the median / ln 2.
fn mean_of_noise(mut power: Vec<f64>) -> f64 {
    power.sort_by(f64::total_cmp);
    power
        .get(power.len() / 2)
        .map_or(0.0, |median| median / LN_2)
}

/// Tracks one frequency through successive windows and adds the spans in which it stands out.
fn follow(run: &[Window], band: &Band, hop: usize, spans: &mut Vec<BeatSpan>) {
    let path = path(run);
    let stands_out = |k: usize| libm::exp(run[k].evidence[path[k]]) > LEVEL;
    let mut from = 0;
    while from < run.len() {
        let to = (from..run.len())
            .find(|&k| !stands_out(k))
            .unwrap_or(run.len());
        if to - from >= LEAST_WINDOWS {
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
    let mean = |of: &dyn Fn(&Window, usize) -> f64| -> f64 {
        windows
            .iter()
            .zip(path)
            .map(|(w, &k)| of(w, k))
            .sum::<f64>()
            / n
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
fn path(run: &[Window]) -> Vec<usize> {
    let Some(n) = run.first().map(|window| window.evidence.len()) else {
        return Vec::new();
    };
    let mut gains = vec![0.0; n];
    let mut came_from: Vec<Vec<usize>> = Vec::with_capacity(run.len());
    for window in run {
        // The cost grows with the distance, so one upward and one downward sweep find the best predecessors.
        let mut from: Vec<usize> = (0..n).collect();
        for k in 1..n {
            if gains[k - 1] - CHANGE * STEP > gains[k] {
                (gains[k], from[k]) = (gains[k - 1] - CHANGE * STEP, from[k - 1]);
            }
        }
        for k in (0..n.saturating_sub(1)).rev() {
            if gains[k + 1] - CHANGE * STEP > gains[k] {
                (gains[k], from[k]) = (gains[k + 1] - CHANGE * STEP, from[k + 1]);
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
    fn a_beat_under_wandering_and_noise_is_found_with_its_rate_and_amplitude() {
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
    fn wandering_and_noise_alone_are_hardly_ever_taken_for_a_beat() {
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
    fn what_was_not_measured_has_no_beat_and_a_gap_ends_a_span() {
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
