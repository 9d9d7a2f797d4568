//! Motion of the animal in the picture: the speed at each frame, and a summary of the whole film: distance,
//! speeds, rest and turns (docs/reference/formats.md, "Motion"). Lengths are pixels here; `formats::csv::motion`
//! converts them to body lengths and centimetres.

use std::f64::consts::FRAC_PI_2;

use super::Poses;
use crate::geometry::wrap_rad;
use crate::order::percentile;

/// Half of the time over which a speed is measured, seconds. Free choice: over less, the silhouette's jitter
/// shows, over more, a dart is flattened. `static/js/desk/columns.js` has the same for the plot.
const SPEED_HALF_S: f64 = 0.07;
/// Least step of the path, body lengths. Free choice: several times the jitter of a resting animal's centroid,
/// which therefore adds nothing to the distance.
const STEP_BL: f64 = 0.1;
/// Speed below which the animal rests, body lengths per second. Free choice, as in flocks.
const REST_BL_PER_S: f64 = 0.1;
/// Least duration of a rest, seconds. Free choice: shorter than that, animals turn.
const REST_S: f64 = 0.5;
/// Share of the speeds that are at most the peak speed. The rest may be single wrong frames. Free choice.
const PEAK_SHARE: f64 = 0.99;
/// Change of the heading that counts as a turn, radians.
const TURN_RAD: f64 = FRAC_PI_2;

/// Summary of the motion in a film. `None` is a value that the film does not show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionSummary {
    /// Time in which the animal was seen, seconds.
    pub seen_s: f64,
    /// Length of the path, pixels: the sum of the steps from each place to the next one at least a tenth of a
    /// body length away. Gaps add nothing. If the body length is unknown, every step counts.
    pub distance_px: f64,
    /// Distance divided by the time seen, pixels per second.
    pub mean_speed_px_per_s: Option<f64>,
    /// Median speed, pixels per second.
    pub median_speed_px_per_s: Option<f64>,
    /// 99th percentile of the speed, pixels per second.
    pub peak_speed_px_per_s: Option<f64>,
    /// Time at rest: the total of the bouts. `None` if the body length is unknown.
    pub rest: Option<Rest>,
    /// Turns per minute in which the animal was seen. A turn is a change of the heading by 90 degrees since the
    /// turn before, so an about-turn is two turns, and a circle four.
    pub turns_per_min: Option<f64>,
}

/// Bouts of rest: at least half a second in which the speed stays below 0.1 body lengths per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rest {
    /// Total duration, seconds.
    pub time_s: f64,
    /// Number of bouts.
    pub n_bouts: usize,
}

/// Returns the speed of the centroid at each frame, pixels per second: the distance between the centroids 0.07 s
/// before and after the frame, over the time between them. `None` if the animal was not found in one of the three
/// frames. At 10 frames per second, a centroid that moves from 0 to 6 px in two frames has 30 px/s in between.
pub fn speeds_px_per_s(poses: &Poses) -> Vec<Option<f64>> {
    let half = ((SPEED_HALF_S * poses.fps).round() as usize).max(1);
    let frames = &poses.frames;
    let speed = |k: usize| {
        let before = &frames[k.saturating_sub(half)];
        let after = &frames[(k + half).min(frames.len() - 1)];
        let (from, to) = (before.centroid_px?, after.centroid_px?);
        frames[k].centroid_px?;
        let time_s = after.time_s - before.time_s;
        (time_s > 0.0).then(|| distance(from, to) / time_s)
    };
    (0..frames.len()).map(speed).collect()
}

/// Returns the summary of a film. `length_px` is the body length.
pub fn summarize_motion(poses: &Poses, length_px: Option<f64>) -> MotionSummary {
    let speeds = speeds_px_per_s(poses);
    let durations_s = durations_s(poses);
    let seen = poses.frames.iter().zip(&durations_s);
    let seen_s = seen
        .filter(|(pose, _)| pose.detected())
        .map(|(_, s)| s)
        .sum();
    let places = poses.frames.iter().map(|pose| pose.centroid_px);
    let distance_px = path_px(places, step_px(length_px));
    let mut known: Vec<f64> = speeds.iter().flatten().copied().collect();
    let is_seen = seen_s > 0.0;
    MotionSummary {
        seen_s,
        distance_px,
        mean_speed_px_per_s: is_seen.then(|| distance_px / seen_s),
        median_speed_px_per_s: percentile(&mut known, 0.5),
        peak_speed_px_per_s: percentile(&mut known, PEAK_SHARE),
        rest: length_px.map(|length| rest(&speeds, &durations_s, REST_BL_PER_S * length)),
        turns_per_min: n_turns(poses)
            .filter(|_| is_seen)
            .map(|n| 60.0 * n as f64 / seen_s),
    }
}

/// Returns the time until the next frame, seconds, for each frame.
pub(super) fn durations_s(poses: &Poses) -> Vec<f64> {
    let times = poses.frames.windows(2);
    let gaps = times.map(|pair| (pair[1].time_s - pair[0].time_s).max(0.0));
    let last = (!poses.frames.is_empty()).then_some(1.0 / poses.fps);
    gaps.chain(last).collect()
}

/// Returns the least step of the path of an animal with this body length, pixels.
pub fn step_px(length_px: Option<f64>) -> f64 {
    length_px.map_or(0.0, |length| STEP_BL * length)
}

/// Returns the length of the path through places in steps of at least `step_px`, pixels. `None` is a gap.
pub(super) fn path_px(places: impl Iterator<Item = Option<[f64; 2]>>, step_px: f64) -> f64 {
    let (mut sum, mut last) = (0.0, None);
    for place in places {
        let step = (last.zip(place)).map(|(from, to)| distance(from, to));
        match step {
            Some(step) if step < step_px => continue,
            step => sum += step.unwrap_or(0.0),
        }
        last = place;
    }
    sum
}

fn rest(speeds: &[Option<f64>], durations_s: &[f64], below: f64) -> Rest {
    let is_slow = |k: &usize| speeds[*k].is_some_and(|speed| speed < below);
    let frames: Vec<usize> = (0..speeds.len()).collect();
    let runs = frames.chunk_by(|a, b| is_slow(a) == is_slow(b));
    let mut rest = Rest::default();
    for run in runs.filter(|run| is_slow(&run[0])) {
        let time_s: f64 = run.iter().map(|k| durations_s[*k]).sum();
        if time_s >= REST_S {
            rest.time_s += time_s;
            rest.n_bouts += 1;
        }
    }
    rest
}

/// Returns the number of turns; `None` without any heading.
fn n_turns(poses: &Poses) -> Option<usize> {
    let mut headings = poses.frames.iter().filter_map(|pose| pose.heading_rad);
    let mut since = headings.next()?;
    let mut n_turns = 0;
    for heading in headings {
        let change = wrap_rad(heading - since);
        let turns = (change / TURN_RAD).trunc();
        since = wrap_rad(since + turns * TURN_RAD);
        n_turns += turns.abs() as usize;
    }
    Some(n_turns)
}

fn distance([x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> f64 {
    libm::hypot(x1 - x0, y1 - y0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Pose, View};

    /// Returns poses at 10 frames per second with these centroids and headings in degrees.
    fn poses(frames: impl IntoIterator<Item = (Option<[f64; 2]>, f64)>) -> Poses {
        let pose = |(k, (centroid_px, degrees)): (usize, (Option<[f64; 2]>, f64))| Pose {
            time_s: k as f64 / 10.0,
            centroid_px,
            heading_rad: centroid_px.map(|_| wrap_rad(degrees.to_radians())),
            ..Pose::default()
        };
        Poses {
            fps: 10.0,
            image_size_px: [1000, 1000],
            view: View::Top,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: frames.into_iter().enumerate().map(pose).collect(),
            tail_beat: None,
        }
    }

    fn at(x: f64) -> (Option<[f64; 2]>, f64) {
        (Some([x, 0.0]), 0.0)
    }

    fn is_near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    #[test]
    fn a_straight_path_has_its_length_and_speed() {
        let summary = summarize_motion(&poses((0..51).map(|k| at(3.0 * f64::from(k)))), Some(20.0));
        assert!(is_near(summary.seen_s, 5.1));
        assert!(is_near(summary.distance_px, 150.0));
        assert!(is_near(summary.mean_speed_px_per_s.unwrap(), 150.0 / 5.1));
        assert!(is_near(summary.median_speed_px_per_s.unwrap(), 30.0));
        assert!(is_near(summary.peak_speed_px_per_s.unwrap(), 30.0));
        assert_eq!(summary.rest, Some(Rest::default()));
        assert_eq!(summary.turns_per_min, Some(0.0));
    }

    #[test]
    fn jitter_of_a_resting_animal_is_no_distance() {
        // It rests for 2 s, swims 60 px in 1 s, and rests for 3 s.
        let places = (0..60).map(|k: i32| 6.0 * f64::from((k - 20).clamp(0, 10)));
        let jitter = |(k, x): (usize, f64)| at(x + [0.0, 0.1][k % 2]);
        let summary = summarize_motion(&poses(places.enumerate().map(jitter)), Some(40.0));
        assert!((summary.distance_px - 60.0).abs() < 0.2, "{summary:?}");
        let rest = summary.rest.unwrap();
        assert_eq!(rest.n_bouts, 2);
        assert!((rest.time_s - 4.8).abs() < 0.21, "{rest:?}");
    }

    #[test]
    fn short_stops_are_no_rest() {
        // It stops for 0.4 s.
        let places = (0..40).map(|k: i32| at(9.0 * f64::from(k - (k - 20).clamp(0, 4))));
        let summary = summarize_motion(&poses(places), Some(40.0));
        assert_eq!(summary.rest, Some(Rest::default()));
    }

    #[test]
    fn gaps_add_neither_distance_nor_time() {
        let places = (0..30).map(|k| at(10.0 * f64::from(k)));
        let frames = places.enumerate().map(|(k, frame)| match k {
            10..20 => (None, 0.0),
            _ => frame,
        });
        let poses = poses(frames);
        let summary = summarize_motion(&poses, Some(20.0));
        assert!(is_near(summary.distance_px, 180.0));
        assert!(is_near(summary.seen_s, 2.0));
        let speeds = speeds_px_per_s(&poses);
        assert!(
            (9..21).all(|k| speeds[k].is_none()) && speeds[8].is_some() && speeds[21].is_some()
        );
    }

    #[test]
    fn turns_count_by_quarters_and_not_by_noise() {
        let turns = |degrees: &[f64]| {
            let frames = degrees.iter().map(|&degrees| (Some([0.0; 2]), degrees));
            n_turns(&poses(frames))
        };
        assert_eq!(turns(&[0.0, 180.0]), Some(2));
        assert_eq!(turns(&[0.0, 45.0, 91.0, 135.0, 181.0]), Some(2));
        assert_eq!(turns(&[0.0, 95.0, 85.0, 95.0, 85.0]), Some(1));
        let circle: Vec<f64> = (0..=37).map(|k| 10.0 * f64::from(k)).collect();
        assert_eq!(turns(&circle), Some(4));
        assert_eq!(turns(&[0.0, -100.0, 0.0]), Some(2));
        assert_eq!(n_turns(&poses([(None, 0.0)])), None);
    }

    #[test]
    fn unknown_values_are_none() {
        let nothing = summarize_motion(&poses([(None, 0.0); 5]), None);
        assert_eq!(nothing, MotionSummary::default());
        assert_eq!(
            summarize_motion(&poses([]), Some(1.0)).mean_speed_px_per_s,
            None
        );
    }
}
