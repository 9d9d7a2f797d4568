//! Between a job's computation and its worker: the computation reports and asks whether to go on,
//! the worker reads and cancels, and at the end learns how long each stage took. Cheap on both sides; the worker decides how often rows are written.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::progress::Progress;

/// The stages of a kind of job, in order, with the share of the whole that each takes; the shares
/// add up to 1.
pub type Stages = &'static [(&'static str, f64)];

/// Where a computation is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// The stage under way.
    pub stage: &'static str,
    /// How much of the whole is done, 0..=1; never falls.
    pub progress: f64,
}

/// One computation's line to its worker.
#[derive(Debug)]
pub struct Listener {
    stages: Stages,
    cancelled: AtomicBool,
    position: Mutex<Position>,
    times: Mutex<Times>,
}

/// How long each stage took so far, and since when the one under way goes on.
#[derive(Debug)]
struct Times {
    past: Vec<(&'static str, Duration)>,
    since: Instant,
    n_decoded: u64,
    decoding: Duration,
}

impl Listener {
    /// A computation that goes through these stages.
    pub fn new(stages: Stages) -> Listener {
        Listener {
            stages,
            cancelled: AtomicBool::new(false),
            position: Mutex::new(Position {
                stage: "starting",
                progress: 0.0,
            }),
            times: Mutex::new(Times {
                past: Vec::new(),
                since: Instant::now(),
                n_decoded: 0,
                decoding: Duration::ZERO,
            }),
        }
    }

    /// Asks the computation to stop at the next convenient point.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Where the computation is.
    pub fn position(&self) -> Position {
        // A panic while reporting cannot leave half a position: it is written whole.
        *self
            .position
            .lock()
            .unwrap_or_else(|broken| broken.into_inner())
    }

    /// How long each stage took so far: those of the table, the one under way last.
    pub fn stage_times(&self) -> Vec<(&'static str, Duration)> {
        let under_way = self.position().stage;
        let times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        let mut all = times.past.clone();
        add(&mut all, under_way, times.since.elapsed());
        all.retain(|(stage, _)| self.stages.iter().any(|(name, _)| name == stage));
        all
    }

    /// Notes frames that were decoded in a time.
    pub fn count_decoded(&self, n_frames: u64, took: Duration) {
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        times.n_decoded += n_frames;
        times.decoding += took;
    }

    /// Frames decoded, and the time that took.
    pub fn decoded(&self) -> (u64, Duration) {
        let times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        (times.n_decoded, times.decoding)
    }

    fn end_stage(&self, stage: &'static str) {
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        let took = times.since.elapsed();
        add(&mut times.past, stage, took);
        times.since = Instant::now();
    }

    /// The share of the whole at a point of a stage; nothing for a stage that is not in the table.
    fn overall(&self, stage: &str, fraction: f64) -> Option<f64> {
        let at = self.stages.iter().position(|(name, _)| *name == stage)?;
        let before: f64 = self.stages[..at].iter().map(|(_, share)| share).sum();
        Some(before + self.stages[at].1 * fraction.clamp(0.0, 1.0))
    }
}

impl Progress for Listener {
    fn report(&self, stage: &'static str, fraction: f64) {
        let overall = self.overall(stage, fraction);
        let mut position = self
            .position
            .lock()
            .unwrap_or_else(|broken| broken.into_inner());
        if position.stage != stage {
            self.end_stage(position.stage);
        }
        position.stage = stage;
        position.progress = position.progress.max(overall.unwrap_or(0.0)).min(1.0);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

fn add(times: &mut Vec<(&'static str, Duration)>, stage: &'static str, took: Duration) {
    match times.iter_mut().find(|(known, _)| *known == stage) {
        Some((_, sum)) => *sum += took,
        None => times.push((stage, took)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_runs_through_the_stages_and_never_falls() {
        let listener = Listener::new(&[("background", 0.25), ("tracking", 0.75)]);
        let after = |stage, fraction| {
            listener.report(stage, fraction);
            listener.position().progress
        };
        assert_eq!(after("background", 1.0), 0.25);
        assert_eq!(after("tracking", 0.5), 0.625);
        assert_eq!(after("background", 0.0), 0.625);
        assert_eq!(after("a stage of no table", 1.0), 0.625);
    }

    #[test]
    fn a_stage_has_the_time_until_the_next_and_all_of_its_parts() {
        let listener = Listener::new(&[("background", 0.25), ("tracking", 0.75)]);
        let pause = || std::thread::sleep(Duration::from_millis(20));
        for stage in ["background", "tracking", "background", "of no table"] {
            listener.report(stage, 0.0);
            pause();
        }
        let times = listener.stage_times();
        let names: Vec<_> = times.iter().map(|(stage, _)| *stage).collect();
        assert_eq!(names, ["background", "tracking"]);
        assert!(times[0].1 >= Duration::from_millis(40), "{times:?}");
        assert!(times[1].1 >= Duration::from_millis(20), "{times:?}");
    }
}
