//! Between a job's computation and its worker: the computation reports and asks whether to go on,
//! the worker reads and cancels. Cheap on both sides; the worker decides how often rows are written.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

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
        position.stage = stage;
        position.progress = position.progress.max(overall.unwrap_or(0.0)).min(1.0);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
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
}
