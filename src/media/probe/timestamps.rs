//! Correction of picture timestamps from a recorder with a faulty clock. Recorders stall and then write a
//! burst, clocks are set, several pictures share a time or have none. The input is in display order.
//!
//! Steps between 0.5 and 1.5 of the usual step are regular. A run of irregular steps is judged by its end. If
//! a regular clock would reach the same time, the pictures of the run are spaced evenly. Otherwise each step
//! back or far ahead becomes a usual step, and all later times shift with it. Remaining short gaps and dense
//! stretches are kept: pictures were lost, or the rate varies.
//!
//! Example with a usual step of 0.1 s: 0, .1, .6, .61, .62, .63, .7, .8 becomes 0, .1, .22, .34, .46, .58,
//! .7, .8.

/// Deviation of a regular step from the usual step, as a share of it. Cameras with a varying rate deviate
/// less.
const MAX_DEVIATION: f64 = 0.5;

/// Tolerance for the end of a run, usual steps. More than one step, because the first picture of a stall may
/// itself be late.
const END_TOLERANCE: f64 = 1.5;

/// Longest gap that is kept, seconds, or [`MAX_GAP_STEPS`] if longer. Free choice between the tenths of a
/// second that a busy recorder loses and the minutes of a pause.
const MAX_GAP_S: f64 = 1.0;

/// Longest gap that is kept at low frame rates, usual steps. Free choice.
const MAX_GAP_STEPS: f64 = 8.0;

/// Corrected timestamps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RepairedTimes {
    /// Time of each picture, seconds from the first, never decreasing.
    pub(super) times_s: Vec<f64>,
    /// Removed steps back or far ahead: corrected time of the step and its size, both in seconds.
    pub(super) leaps_s: Vec<[f64; 2]>,
}

/// Corrects the times of pictures in display order; `None` marks a picture without a time.
///
/// Returns `None` if no two pictures have different times.
pub(super) fn repair(times_s: &[Option<f64>]) -> Option<RepairedTimes> {
    let stored_s = interpolate_missing(times_s)?;
    let step_s = median_step(&stored_s)?;
    let max_gap_s = MAX_GAP_S.max(MAX_GAP_STEPS * step_s);
    let is_regular = |pair: &[f64]| ((pair[1] - pair[0]) / step_s - 1.0).abs() < MAX_DEVIATION;
    let mut times_s = stored_s.clone();
    let (mut leaps_s, mut first, mut offset_s) = (Vec::new(), 0, -stored_s[0]);
    times_s[0] = 0.0;
    while first + 1 < stored_s.len() {
        let irregular = stored_s[first..]
            .windows(2)
            .take_while(|pair| !is_regular(pair));
        let last = first + irregular.count().max(1);
        let is_on_time =
            last > first + 1 && space_evenly(&mut times_s[first..=last], stored_s[first], step_s);
        for k in first + 1..=last {
            let leap_s = stored_s[k] - stored_s[k - 1];
            if !is_on_time && (leap_s < 0.0 || leap_s > max_gap_s) {
                leaps_s.push([times_s[k - 1], leap_s]);
                offset_s -= leap_s - step_s;
            }
            times_s[k] += offset_s;
        }
        first = last;
    }
    Some(RepairedTimes { times_s, leaps_s })
}

/// Spaces the times of a run evenly if it ends on time; returns whether it does. `start_s` is the original
/// first time, which stays unchanged. Pictures that share the last time continue at the usual step.
fn space_evenly(run: &mut [f64], start_s: f64, step_s: f64) -> bool {
    let end_s = run[run.len() - 1];
    let n_steps = 1 + run[1..].iter().position(|&time| time == end_s).unwrap_or(0);
    let even_s = (end_s - start_s) / n_steps as f64;
    let late_s = (even_s - step_s) * n_steps as f64;
    if even_s <= 0.0 || late_s.abs() > END_TOLERANCE * step_s {
        return false;
    }
    for (k, time) in run.iter_mut().enumerate().skip(1) {
        let n_past = k.saturating_sub(n_steps);
        *time = start_s + k.min(n_steps) as f64 * even_s + n_past as f64 * step_s;
    }
    true
}

/// Interpolates missing times between neighbors, and extrapolates at the ends by the usual step.
fn interpolate_missing(times_s: &[Option<f64>]) -> Option<Vec<f64>> {
    let known: Vec<(usize, f64)> = (times_s.iter().enumerate())
        .filter_map(|(k, time)| Some((k, (*time)?)))
        .collect();
    let slope = |a: (usize, f64), b: (usize, f64)| (b.1 - a.1) / (b.0 - a.0) as f64;
    let slopes: Vec<f64> = known
        .windows(2)
        .map(|pair| slope(pair[0], pair[1]))
        .collect();
    let usual = median(
        slopes
            .iter()
            .copied()
            .filter(|&slope| slope > 0.0)
            .collect(),
    )?;
    let mut next = 0;
    let time_of = |k: usize| {
        while next < known.len() && known[next].0 < k {
            next += 1;
        }
        match (
            next.checked_sub(1).map(|before| known[before]),
            known.get(next),
        ) {
            (_, Some(&(at, time))) if at == k => time,
            (Some(before), Some(&after)) => before.1 + slope(before, after) * (k - before.0) as f64,
            (Some(before), None) => before.1 + usual * (k - before.0) as f64,
            (None, Some(&after)) => after.1 - usual * (after.0 - k) as f64,
            (None, None) => 0.0,
        }
    };
    Some((0..times_s.len()).map(time_of).collect())
}

/// Returns the median over the pictures of the step to the next time. Pictures with equal times share a step.
fn median_step(times_s: &[f64]) -> Option<f64> {
    let groups: Vec<&[f64]> = times_s.chunk_by(|a, b| a == b).collect();
    let steps = groups.windows(2).flat_map(|pair| {
        let step_s = (pair[1][0] - pair[0][0]) / pair[0].len() as f64;
        std::iter::repeat_n(step_s, pair[0].len())
    });
    median(steps.filter(|&step| step > 0.0).collect())
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn repaired(times_s: &[f64]) -> RepairedTimes {
        let times_s: Vec<_> = times_s.iter().copied().map(Some).collect();
        repair(&times_s).expect("times")
    }

    fn grid(n: u32, fps: f64) -> Vec<f64> {
        (0..n).map(|k| f64::from(k) / fps).collect()
    }

    fn assert_even(times_s: &[f64], fps: f64) {
        for (k, time) in times_s.iter().enumerate() {
            assert!((time - k as f64 / fps).abs() < 1.6 / fps, "{k}: {time}");
        }
        let steps = times_s.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(steps.clone().all(|step| step > 0.3 / fps), "{times_s:?}");
    }

    #[test]
    fn stall_and_burst_are_spaced_evenly() {
        let mut times = grid(90, 30.0);
        for (k, time) in times[40..60].iter_mut().enumerate() {
            *time = 59.0 / 30.0 + k as f64 * 1e-4;
        }
        let repaired = repaired(&times);
        assert_even(&repaired.times_s, 30.0);
        assert_eq!(repaired.leaps_s, Vec::<[f64; 2]>::new());
    }

    #[test]
    fn stopped_clock_continues_at_the_usual_step() {
        let mut times = grid(90, 30.0);
        times[40..60].fill(40.0 / 30.0);
        assert_even(&repaired(&times).times_s, 30.0);
        // Some recorders store times in whole seconds.
        let seconds: Vec<f64> = times.iter().map(|time| time.floor()).collect();
        assert_even(&repaired(&seconds).times_s, 30.0);
    }

    #[test]
    fn clock_set_forward_or_back_becomes_a_usual_step() {
        for leap_s in [3600.0, 1e11, 5.0, -0.5, -1.0, -3600.0] {
            let mut times = grid(90, 30.0);
            times[50..].iter_mut().for_each(|time| *time += leap_s);
            let repaired = repaired(&times);
            assert_even(&repaired.times_s, 30.0);
            let [[at_s, by_s]] = repaired.leaps_s[..] else {
                panic!("{leap_s}: {:?}", repaired.leaps_s);
            };
            assert!((at_s - 49.0 / 30.0).abs() < 0.1, "{leap_s} at {at_s}");
            assert!((by_s / leap_s - 1.0).abs() < 0.1, "{leap_s}: {by_s}");
        }
    }

    #[test]
    fn lost_pictures_and_varying_rates_are_kept() {
        let mut lossy = grid(90, 30.0);
        lossy.drain(40..52);
        lossy.remove(20);
        let varies: Vec<f64> = (0..40).map(|k| f64::from(k * k) * 0.01).collect();
        for times in [lossy, varies] {
            assert_eq!(repaired(&times).times_s, times);
        }
    }

    #[test]
    fn missing_times_are_interpolated() {
        let mut times: Vec<_> = grid(30, 10.0).into_iter().map(Some).collect();
        for k in [0, 1, 7, 15, 16, 29] {
            times[k] = None;
        }
        assert_even(&repair(&times).unwrap().times_s, 10.0);
        assert_eq!(repair(&[None, None, Some(1.0)]), None);
        assert_eq!(repair(&[Some(1.0), Some(1.0)]), None);
        assert_eq!(repair(&[]), None);
    }
}
