//! Working state of all boids from step to step, in the order of the grid.

use super::grid::{Boid, Grid};

/// State of a boid that other boids do not perceive.
#[derive(Clone, Copy, Debug)]
pub(super) struct InternalState {
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

/// Boids and their internal states.
#[derive(Default)]
pub(super) struct Population {
    pub(super) boids: Vec<Boid>,
    pub(super) internals: Vec<InternalState>,
}

/// All boids, in the order of the cells of the previous step. Boids that are near each other are near in
/// memory.
#[derive(Default)]
pub(super) struct Workspace {
    pub(super) current: Population,
    /// Index of each boid in `current`, by id.
    pub(super) index_by_id: Vec<u32>,
    /// Boids after the step, in the order of their cells before it.
    pub(super) next: Population,
    pub(super) grid: Grid,
}

impl Workspace {
    /// Returns the state of `n` boids before their first step, in order of id.
    pub(super) fn new(n: usize) -> Workspace {
        let ids: Vec<u32> = (0..n as u32).collect();
        let boid = |&id: &u32| Boid {
            id,
            ..Boid::default()
        };
        Workspace {
            current: Population {
                boids: ids.iter().map(boid).collect(),
                internals: vec![InternalState::default(); n],
            },
            index_by_id: ids,
            ..Workspace::default()
        }
    }
}

impl Default for InternalState {
    fn default() -> InternalState {
        InternalState {
            wander: [0.0; 2],
            leads_for_s: 0.0,
            sight_bl: f64::INFINITY,
            nearest_bl2: 0.0,
            is_blocked: false,
        }
    }
}
