//! Progress and cancellation of a computation. Algorithms report through this trait; jobs and commands
//! implement it.

/// Receives progress reports. Called often and from any thread, so implementations must be cheap.
pub trait Progress: Sync {
    /// Reports the current stage (a plain word such as `tracking`) and the share of that stage done, 0..=1.
    fn report(&self, stage: &'static str, fraction: f64);

    /// Returns true once the computation should stop at the next convenient point.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Ignores all reports and never cancels.
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _stage: &'static str, _fraction: f64) {}
}

/// Ignores the reports of a trial run but passes on cancellation.
pub struct CancelOnly<'a>(pub &'a dyn Progress);

impl Progress for CancelOnly<'_> {
    fn report(&self, _stage: &'static str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
