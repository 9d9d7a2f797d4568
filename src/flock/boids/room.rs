//! Working state of all boids from step to step, in the order of the grid.

use super::grid::{Boid, Grid};

/// State of a boid that other boids do not perceive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inner {
    /// Wandering turn rate, radians per second, and wanted slope in standard deviations from the usual one.
    pub(super) wander: [f64; 2],
    /// Remaining time of its lead, seconds; 0 if it does not lead.
    pub(super) leads_for_s: f64,
    /// Distance of the farthest neighbor that counted, body lengths. It only sets the first search radius.
    pub(super) sight_bl: f64,
    /// Squared distance of the nearest neighbor before the step, at most the squared reach.
    pub(super) nearest_bl2: f64,
    /// Whether others pushed it back by more than half of its displacement. It then turns round, to the side
    /// to which it wanders.
    pub(super) is_blocked: bool,
}

/// Boids and their inner states.
#[derive(Default)]
pub(super) struct Crowd {
    pub(super) boids: Vec<Boid>,
    pub(super) inners: Vec<Inner>,
}

/// All boids, in the order of the cells of the previous step. Boids that are near each other are near in
/// memory.
#[derive(Default)]
pub(super) struct Room {
    pub(super) now: Crowd,
    /// Index of each boid in `now`, by id.
    pub(super) places: Vec<u32>,
    /// Boids after the step, in the order of their cells before it.
    pub(super) next: Crowd,
    pub(super) grid: Grid,
}

impl Room {
    /// Returns the state of boids before their first step, in order of id.
    pub(super) fn of(n: usize) -> Room {
        let boid = |id| Boid {
            id,
            ..Boid::default()
        };
        Room {
            now: Crowd {
                boids: (0..n as u32).map(boid).collect(),
                inners: vec![Inner::default(); n],
            },
            places: (0..n as u32).collect(),
            ..Room::default()
        }
    }
}

impl Default for Inner {
    fn default() -> Inner {
        Inner {
            wander: [0.0; 2],
            leads_for_s: 0.0,
            sight_bl: f64::INFINITY,
            nearest_bl2: 0.0,
            is_blocked: false,
        }
    }
}
