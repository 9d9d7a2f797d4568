//! The unknowns of the estimate, five for each frame.

/// Number of unknowns per frame.
pub(super) const N_STATE: usize = 5;
/// Indices of the unknowns among those of a frame.
pub(super) const LOG_Z: usize = 0;
pub(super) const YAW: usize = 1;
pub(super) const PITCH: usize = 2;
pub(super) const SPEED: usize = 3;
pub(super) const SWAY: usize = 4;

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
            log_z: self.log_z + step[LOG_Z],
            yaw: self.yaw + step[YAW],
            pitch: self.pitch + step[PITCH],
            speed: self.speed + step[SPEED],
            sway: self.sway + step[SWAY],
        }
    }
}
