//! Conversion of a film's presentation times to a constant frame rate.
//!
//! Phones film at varying rates, but the algorithms need one rate. A film whose times lie on a regular grid,
//! up to the rounding of its clock, stays unchanged. Any other film is resampled at its nominal rate. Each
//! frame is then the one nearest in time and keeps its own true time.

use super::timestamps;
use crate::media::error::Error;
use crate::media::limits::Limits;
use crate::media::notice::Notice;

/// Frame rate of a film without any timing, frames per second: that of most cameras.
const ASSUMED_FPS: f64 = 30.0;

/// Nominal frame rates of cameras, frames per second. A film with a varying rate probably has one of them.
const COMMON_FPS: [f64; 11] = [
    24000.0 / 1001.0,
    24.0,
    25.0,
    30000.0 / 1001.0,
    30.0,
    50.0,
    60000.0 / 1001.0,
    60.0,
    100.0,
    120.0,
    240.0,
];

/// Tolerance between the measured and a nominal rate: 0.5 %. Free choice.
const RATE_TOLERANCE: f64 = 0.005;

/// Number of last frames that may be late in a film of constant rate.
const MAX_LATE_FRAMES: usize = 3;

/// Assignment of decoded frames to times.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::media) enum Timeline {
    /// Every decoded frame once, at this rate.
    Constant {
        /// Frames per second.
        fps: f64,
        /// True times, seconds from the first, of the last few frames, if those are late. A film cut without
        /// re-encoding lacks some of the frames before its last.
        late_s: Vec<f64>,
    },
    /// Frames skipped and repeated to make the rate constant.
    Variable {
        /// Frames per second, after resampling.
        fps: f64,
        /// True time of each decoded frame, seconds from the first.
        times_s: Vec<f64>,
        /// For each output frame, the index of the decoded frame it shows; never decreasing.
        sources: Vec<u32>,
    },
}

/// Claims about a film's frame rate.
#[derive(Clone, Debug)]
pub(in crate::media) struct Claims {
    /// Frame rates from the header, frames per second, most likely first.
    pub(in crate::media) fps: Vec<f64>,
    /// Resolution of the file's timestamps, seconds.
    pub(in crate::media) tick_s: f64,
    /// Frame rate given by the user, which overrides the file.
    pub(in crate::media) given_fps: Option<f64>,
}

impl Timeline {
    /// Returns the timeline of pictures with the given times in the file, in display order. Fails if it
    /// exceeds the limits.
    pub(in crate::media) fn new(
        times_s: &[Option<f64>],
        claims: &Claims,
        limits: &Limits,
    ) -> Result<(Timeline, Vec<Notice>), Error> {
        let n_pictures = times_s.len();
        if n_pictures < limits.min_frames {
            return Err(Error::TooFewFrames {
                n_frames: n_pictures,
            });
        }
        let mut notices = Vec::new();
        let timeline = match claims.given_fps {
            Some(fps) => Timeline::constant(fps),
            None => Timeline::from_times(times_s, claims, limits, &mut notices)?,
        };
        let fps = timeline.fps();
        let duration_s = timeline.n_frames(n_pictures) as f64 / fps;
        check_extent(duration_s, fps, limits)?;
        Ok((timeline, notices))
    }

    /// Returns the timeline of repaired times, with notices about repairs and assumptions.
    fn from_times(
        times_s: &[Option<f64>],
        claims: &Claims,
        limits: &Limits,
        notices: &mut Vec<Notice>,
    ) -> Result<Timeline, Error> {
        let Some(repaired) = timestamps::repair(times_s) else {
            let fps = claims.fps.first().copied().unwrap_or(ASSUMED_FPS);
            if claims.fps.is_empty() {
                notices.push(Notice::RateAssumed { fps });
            }
            return Ok(Timeline::constant(fps));
        };
        if let Some(&[at_s, by_s]) = repaired.leaps_s.first() {
            let n_leaps = repaired.leaps_s.len();
            notices.push(Notice::TimesLeap {
                at_s,
                by_s,
                n_leaps,
            });
        }
        let timeline = Timeline::fit(&repaired.times_s, &claims.fps, claims.tick_s, limits)?;
        timeline.ok_or(Error::TooFewFrames {
            n_frames: times_s.len(),
        })
    }

    fn constant(fps: f64) -> Timeline {
        let late_s = Vec::new();
        Timeline::Constant { fps, late_s }
    }

    /// Returns the timeline of frames shown at `times_s` (ascending), given the claimed rates and the clock
    /// resolution.
    ///
    /// Returns `None` if there are fewer than two times or all are equal. Excessive time spans and rates are
    /// refused before the frames are enumerated, because a few bytes can claim billions of frames.
    fn fit(
        times_s: &[f64],
        claimed_fps: &[f64],
        tick_s: f64,
        limits: &Limits,
    ) -> Result<Option<Timeline>, Error> {
        let (Some(first), Some(last)) = (times_s.first(), times_s.last()) else {
            return Ok(None);
        };
        let span_s = last - first;
        if span_s <= 0.0 {
            return Ok(None);
        }
        let mean_fps = (times_s.len() - 1) as f64 / span_s;
        for n_late in [0, MAX_LATE_FRAMES] {
            let n_regular = times_s.len().saturating_sub(n_late);
            if n_regular <= n_late {
                break;
            }
            let (regular, late) = times_s.split_at(n_regular);
            let rates = claimed_fps.iter().copied().chain([mean_fps]);
            if let Some(fps) = rates
                .into_iter()
                .find(|&fps| is_regular(regular, fps, tick_s))
            {
                let late_s = late.iter().map(|time| time - first).collect();
                return Ok(Some(Timeline::Constant { fps, late_s }));
            }
        }
        let times_s: Vec<f64> = times_s.iter().map(|time| time - first).collect();
        let Some(fps) = nominal_fps(&times_s, claimed_fps) else {
            return Ok(None);
        };
        check_extent(span_s, fps, limits)?;
        let sources = nearest(&times_s, fps);
        Ok(Some(Timeline::Variable {
            fps,
            times_s,
            sources,
        }))
    }

    /// Returns the number of output frames of a film with `n_pictures`.
    pub(in crate::media) fn n_frames(&self, n_pictures: usize) -> usize {
        match self {
            Timeline::Constant { .. } => n_pictures,
            Timeline::Variable { sources, .. } => sources.len(),
        }
    }

    /// Returns the picture that an output frame shows, and its time in seconds from the first. Returns `None` after the
    /// last frame of a variable rate; at a constant rate each picture is a frame, without an end.
    pub(in crate::media) fn picture_at(
        &self,
        frame_idx: usize,
        n_pictures: usize,
    ) -> Option<(usize, f64)> {
        match self {
            Timeline::Constant { fps, late_s } => {
                let late = (frame_idx + late_s.len()).checked_sub(n_pictures);
                let late_s = late.and_then(|k| late_s.get(k));
                let time_s = late_s.copied().unwrap_or(frame_idx as f64 / fps);
                Some((frame_idx, time_s))
            }
            Timeline::Variable {
                times_s, sources, ..
            } => {
                let picture_idx = *sources.get(frame_idx)? as usize;
                Some((picture_idx, *times_s.get(picture_idx)?))
            }
        }
    }

    /// Returns the frame rate of the output, frames per second.
    pub(in crate::media) fn fps(&self) -> f64 {
        match self {
            Timeline::Constant { fps, .. } | Timeline::Variable { fps, .. } => *fps,
        }
    }
}

/// Returns whether frame k is shown at k / fps, within the rounding of two timestamps.
fn is_regular(times_s: &[f64], fps: f64, tick_s: f64) -> bool {
    if !(fps > 0.0 && fps.is_finite()) {
        return false;
    }
    // Times have six decimals. The limit of 0.25 / fps keeps a coarse clock from hiding a missing frame.
    let tolerance_s = (tick_s * 1.01 + 2e-6).min(0.25 / fps);
    let regular =
        |(k, time): (usize, &f64)| (time - times_s[0] - k as f64 / fps).abs() <= tolerance_s;
    times_s.iter().enumerate().all(regular)
}

/// Returns the nominal rate of a film: the mean rate of its ordinary steps, or a claimed or common rate near
/// it.
fn nominal_fps(times_s: &[f64], claimed_fps: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s
        .windows(2)
        .map(|w| w[1] - w[0])
        .filter(|s| *s > 0.0)
        .collect();
    steps.sort_by(f64::total_cmp);
    let median = *steps.get(steps.len() / 2)?;
    steps.retain(|step| (median * 0.5..median * 1.5).contains(step));
    let fps = steps.len() as f64 / steps.iter().sum::<f64>();
    let mut known = claimed_fps.iter().chain(&COMMON_FPS).copied();
    Some(
        known
            .find(|known| (known / fps - 1.0).abs() < RATE_TOLERANCE)
            .unwrap_or(fps),
    )
}

/// Checks that a duration at this rate is within the limits.
fn check_extent(span_s: f64, fps: f64, limits: &Limits) -> Result<(), Error> {
    if fps > limits.max_fps {
        return Err(Error::TooFast { fps });
    }
    if span_s > limits.max_duration_s {
        return Err(Error::TooLong {
            found: span_s,
            unit: "s",
        });
    }
    if span_s * fps >= limits.max_frames as f64 + 0.5 {
        Err(Error::TooManyFrames {
            limit: limits.max_frames,
        })
    } else {
        Ok(())
    }
}

/// Returns, for each instant k / fps, the index of the nearest time; the earlier one at a tie.
fn nearest(times_s: &[f64], fps: f64) -> Vec<u32> {
    let last_s = times_s[times_s.len() - 1];
    let n_frames = (last_s * fps + 0.5) as usize + 1;
    let mut at = 0;
    let nearest_idx = |k: usize| {
        let instant_s = k as f64 / fps;
        let gap = |i: usize| (times_s[i] - instant_s).abs();
        while at + 1 < times_s.len() && (gap(at + 1) < gap(at) || times_s[at + 1] <= instant_s) {
            at += 1;
        }
        at as u32
    };
    (0..n_frames).map(nearest_idx).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use flockreel_core::code::Code;

    fn fit(times_s: &[f64], claimed_fps: &[f64], tick_s: f64) -> Option<Timeline> {
        Timeline::fit(times_s, claimed_fps, tick_s, &Limits::default()).unwrap()
    }

    #[test]
    fn excessive_leap_is_refused_before_frames_are_enumerated() {
        let refusal = |steps_s: [f64; 2]| {
            let times: Vec<f64> = (0..40)
                .map(|k| f64::from(k) * steps_s[0] + f64::from(k / 20) * steps_s[1])
                .collect();
            let timeline = Timeline::fit(&times, &[], 1e-6, &Limits::default());
            timeline.unwrap_err().code()
        };
        assert_eq!(refusal([0.04, 1e11]), Code::TooLong);
        assert_eq!(refusal([1e-6, 1e6]), Code::TooFast);
        assert_eq!(refusal([0.002, 3000.0]), Code::TooManyFrames);
    }

    fn rounded(times_s: impl Iterator<Item = f64>, tick_s: f64) -> Vec<f64> {
        times_s.map(|t| (t / tick_s).round() * tick_s).collect()
    }

    #[test]
    fn times_rounded_to_milliseconds_are_constant() {
        let times = rounded((0..500).map(|k| f64::from(k) / 29.97), 0.001);
        let timeline = fit(&times, &[29.97], 0.001);
        let late_s = Vec::new();
        let constant = Timeline::Constant { fps: 29.97, late_s };
        assert_eq!(timeline, Some(constant));
    }

    #[test]
    fn film_without_its_last_frame_but_one_is_constant() {
        let shown = (0..10).filter(|k| *k != 8);
        let times: Vec<f64> = shown.map(|k| f64::from(k) / 25.0).collect();
        let timeline = fit(&times, &[25.0], 1e-4);
        let late_s = vec![0.24, 0.28, 0.36];
        let constant = Timeline::Constant { fps: 25.0, late_s };
        assert_eq!(timeline, Some(constant));
    }

    #[test]
    fn missing_frame_is_replaced_by_its_neighbor_with_its_true_time() {
        let times: Vec<f64> = (0..10)
            .filter(|k| *k != 4)
            .map(|k| f64::from(k) / 25.0)
            .collect();
        let Some(Timeline::Variable {
            fps,
            times_s,
            sources,
        }) = fit(&times, &[25.0], 1e-4)
        else {
            panic!("a gap is not a constant rate");
        };
        assert_eq!(fps, 25.0);
        assert_eq!(sources, [0, 1, 2, 3, 3, 4, 5, 6, 7, 8]);
        assert_eq!(times_s[4], 0.2);
    }

    #[test]
    fn coarse_clock_does_not_hide_a_missing_frame() {
        let times: Vec<f64> = (0..10)
            .filter(|k| *k != 5)
            .map(|k| f64::from(k) / 30.0)
            .collect();
        let timeline = fit(&times, &[30.0], 1.0 / 30.0);
        assert!(matches!(timeline, Some(Timeline::Variable { .. })));
    }

    proptest! {
        #[test]
        fn every_output_frame_is_the_nearest_in_time(steps in prop::collection::vec(0.001f64..0.2, 2..60)) {
            let mut time = 0.0;
            let times: Vec<f64> = steps.iter().map(|step| { time += step; time }).collect();
            if let Some(Timeline::Variable { fps, times_s, sources }) = fit(&times, &[], 1e-6) {
                for (k, &source) in sources.iter().enumerate() {
                    let instant_s = k as f64 / fps;
                    let least = times_s.iter().map(|t| (t - instant_s).abs()).fold(f64::MAX, f64::min);
                    prop_assert!((times_s[source as usize] - instant_s).abs() <= least + 1e-12);
                }
                prop_assert!(sources.is_sorted());
            }
        }
    }
}
