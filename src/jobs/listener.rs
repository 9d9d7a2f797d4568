//! Communication between a worker and the task that follows the process of its job. The task passes on progress
//! and learns when to stop. The worker decides how often progress is written to the database, and reads the times
//! of the stages at the end.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio_util::sync::{CancellationToken, WaitForCancellationFuture};

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

/// Progress and cancellation of one computation. Clones share them.
#[derive(Clone, Debug)]
pub struct Listener {
    stages: Stages,
    stop: CancellationToken,
    state: Arc<Mutex<State>>,
}

#[derive(Debug)]
struct State {
    position: Position,
    /// Time at which the last part of the result was kept.
    advanced: Option<Instant>,
    times: Times,
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
        let state = State {
            position: Position {
                stage: "starting",
                progress: 0.0,
            },
            advanced: None,
            times: Times {
                past: Vec::new(),
                since: Instant::now(),
                n_decoded: 0,
                decoding: Duration::ZERO,
            },
        };
        Listener {
            stages,
            stop: CancellationToken::new(),
            state: Arc::new(Mutex::new(state)),
        }
    }

    /// Asks the computation to stop.
    pub fn cancel(&self) {
        self.stop.cancel();
    }

    /// Returns whether the computation was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.stop.is_cancelled()
    }

    /// Waits until the computation is asked to stop.
    pub fn stopped(&self) -> WaitForCancellationFuture<'_> {
        self.stop.cancelled()
    }

    /// Takes note of the current stage, and of the completed share of it. A stage of no table is ignored.
    pub fn report(&self, stage: &str, fraction: f64) {
        let Some((stage, progress)) = self.overall(stage, fraction) else {
            return;
        };
        let mut state = self.state();
        if state.position.stage != stage {
            let before = state.position.stage;
            state.times.end_stage(before);
        }
        state.position = Position {
            stage,
            progress: state.position.progress.max(progress).min(1.0),
        };
    }

    /// Returns the position of the computation.
    pub fn position(&self) -> Position {
        self.state().position
    }

    /// Takes note that a part of the result was kept, which no later attempt makes again.
    pub fn note_advance(&self) {
        self.state().advanced = Some(Instant::now());
    }

    /// Returns when the last part of the result was kept; `None` if none was.
    pub fn advanced_at(&self) -> Option<Instant> {
        self.state().advanced
    }

    /// Returns the time spent in each stage so far. Only the stages of the job are included.
    pub fn stage_times(&self) -> Vec<(&'static str, Duration)> {
        let state = self.state();
        let mut all = state.times.past.clone();
        add(&mut all, state.position.stage, state.times.since.elapsed());
        all.retain(|(stage, _)| self.stages.iter().any(|(name, _)| name == stage));
        all
    }

    /// Adds decoded frames and the time that they took.
    pub fn count_decoded(&self, n_frames: u64, took: Duration) {
        let times = &mut self.state().times;
        times.n_decoded += n_frames;
        times.decoding += took;
    }

    /// Returns the number of decoded frames and the time that they took.
    pub fn decoded(&self) -> (u64, Duration) {
        let times = &self.state().times;
        (times.n_decoded, times.decoding)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change is complete in itself, so a panic cannot leave half of one.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the stage, and the completed share of the job at a fraction of it; `None` for an unknown stage.
    fn overall(&self, stage: &str, fraction: f64) -> Option<(&'static str, f64)> {
        let at = self.stages.iter().position(|(name, _)| *name == stage)?;
        let before: f64 = self.stages[..at].iter().map(|(_, share)| share).sum();
        let (stage, share) = self.stages[at];
        Some((stage, before + share * fraction.clamp(0.0, 1.0)))
    }
}

impl Times {
    fn end_stage(&mut self, stage: &'static str) {
        add(&mut self.past, stage, self.since.elapsed());
        self.since = Instant::now();
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
