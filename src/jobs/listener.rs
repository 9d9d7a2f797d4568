//! Communication between a running computation and its worker. The computation reports its progress and asks
//! whether to stop. The worker reads the progress, cancels, and finally reads the times of the stages. Both
//! sides are cheap; the worker decides how often it writes to the database.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use flockreel_core::progress::Progress;

/// Stages of a kind of job, in order, with the share of the running time of each. The shares add up to 1.
pub type Stages = &'static [(&'static str, f64)];

/// Position of a computation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Current stage.
    pub stage: &'static str,
    /// Completed share of the whole job, 0..=1; never decreases.
    pub progress: f64,
}

/// Progress and cancellation of one computation.
#[derive(Debug)]
pub struct Listener {
    stages: Stages,
    cancelled: AtomicBool,
    position: Mutex<Position>,
    times: Mutex<Times>,
}

/// Time spent in past stages, start of the current one, and statistics of decoding.
#[derive(Debug)]
struct Times {
    past: Vec<(&'static str, Duration)>,
    since: Instant,
    n_decoded: u64,
    decoding: Duration,
}

impl Listener {
    /// Returns the listener of a computation with these stages.
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

    /// Returns the position of the computation.
    pub fn position(&self) -> Position {
        // The position is written as a whole, so a panic cannot leave it incomplete.
        *self
            .position
            .lock()
            .unwrap_or_else(|broken| broken.into_inner())
    }

    /// Returns the time spent in each stage so far. Only the stages of the job are included.
    pub fn stage_times(&self) -> Vec<(&'static str, Duration)> {
        let under_way = self.position().stage;
        let times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        let mut all = times.past.clone();
        add(&mut all, under_way, times.since.elapsed());
        all.retain(|(stage, _)| self.stages.iter().any(|(name, _)| name == stage));
        all
    }

    /// Adds decoded frames and the time that they took.
    pub fn count_decoded(&self, n_frames: u64, took: Duration) {
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        times.n_decoded += n_frames;
        times.decoding += took;
    }

    /// Returns the number of decoded frames and the time that they took.
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

    /// Returns the completed share of the job at a fraction of a stage; `None` for an unknown stage.
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
    fn progress_follows_the_stages_and_never_decreases() {
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
    fn stage_times_add_up_all_parts_of_a_stage() {
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
