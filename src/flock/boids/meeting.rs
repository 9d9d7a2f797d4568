//! Where a flock is drawn to so that its film repeats without a seam (ALGORITHMS.md 7).

use super::vector::{Vec3, add_scaled, minus};

/// Who is to meet a place closes in on it with this time constant.
const MEETING_S: f64 = 0.6;

/// Where everybody is to be a frame later and how fast, by id: places in body lengths and velocities.
#[derive(Clone, Debug)]
pub struct Meeting {
    /// How much of each wish it is, 0..=1.
    pub share: f64,
    /// Place and velocity.
    pub places: Vec<(Vec3, Vec3)>,
}

impl Meeting {
    /// The velocity wished for instead of `wished`.
    pub(super) fn wish(&self, id: usize, position: Vec3, wished: Vec3) -> Vec3 {
        let (place, velocity) = self.places[id];
        let there = add_scaled(velocity, 1.0 / MEETING_S, minus(place, position));
        add_scaled(wished, self.share, minus(there, wished))
    }
}
