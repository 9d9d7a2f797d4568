//! All boids as they lie in memory, from step to step.

use super::grid::{Boid, Grid};

/// What of a boid nobody sees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inner {
    /// The wandering turn rate, and the wished slope in standard deviations.
    pub(super) wander: [f64; 2],
    /// Seconds; 0 when it does not lead.
    pub(super) leads_for_s: f64,
    /// How far off the last neighbor was that counted. It only tells where to look first.
    pub(super) sight_bl: f64,
    /// How far off the nearest other was before the step, squared; the reach when there was none.
    pub(super) nearest_bl2: f64,
    /// Others pushed it back by more than half of its way: it turns round, to the side that it wanders to.
    pub(super) is_blocked: bool,
}

/// Boids, and what goes on in each.
#[derive(Default)]
pub(super) struct Crowd {
    pub(super) boids: Vec<Boid>,
    pub(super) inners: Vec<Inner>,
}

/// All boids, in the order of the cells that they were in a step ago: who is near whom in the tank is so in memory.
#[derive(Default)]
pub(super) struct Room {
    pub(super) now: Crowd,
    /// Where each stands in `now`, by id.
    pub(super) places: Vec<u32>,
    /// In the order of the cells that they are in before the step.
    pub(super) next: Crowd,
    pub(super) grid: Grid,
}

impl Room {
    /// Boids that have not swum yet, by id.
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

/// Some of a crowd, to be filled.
pub(super) type Part<'a> = (&'a mut [Boid], &'a mut [Inner]);

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
