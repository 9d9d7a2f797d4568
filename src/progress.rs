//! How far a computation is, and whether it should go on. Algorithms report, doors listen.

/// Listens to a computation. Called often and from any thread: implementations must be cheap.
pub trait Progress: Sync {
    /// The stage under way (a plain word such as `tracking`) and how much of that stage is done, 0..=1.
    fn report(&self, stage: &'static str, fraction: f64);

    /// True once the computation should stop at the next convenient point.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Nobody listens, nobody cancels.
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _stage: &'static str, _fraction: f64) {}
}

/// Nobody listens to a trial run, but whoever may cancel the computation cancels it.
pub struct Quiet<'a>(pub &'a dyn Progress);

impl Progress for Quiet<'_> {
    fn report(&self, _stage: &'static str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
