//! The unknowns of the estimate, five for each frame.

/// Number of unknowns per frame.
pub(super) const N_STATE: usize = 5;

/// The unknowns of a frame, in their order.
#[derive(Clone, Copy)]
pub(super) enum Unknown {
    LogZ,
    Yaw,
    Pitch,
    Speed,
    Sway,
}

/// The unknowns of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    /// Logarithm of the apparent depth in metres.
    pub(super) log_z: f64,
    /// Yaw, radians.
    pub(super) yaw: f64,
    /// Pitch, radians.
    pub(super) pitch: f64,
    /// Speed along the forward axis, metres per second.
    pub(super) speed: f64,
    /// Covariance of the body's forward and side axes, square metres. It is large where the tail lies to one
    /// side.
    pub(super) sway: f64,
}

impl State {
    /// Returns the state after a step, which has one value for each unknown.
    pub(super) fn moved(&self, step: &[f64]) -> State {
        State {
            log_z: self.log_z + step[Unknown::LogZ as usize],
            yaw: self.yaw + step[Unknown::Yaw as usize],
            pitch: self.pitch + step[Unknown::Pitch as usize],
            speed: self.speed + step[Unknown::Speed as usize],
            sway: self.sway + step[Unknown::Sway as usize],
        }
    }
}
