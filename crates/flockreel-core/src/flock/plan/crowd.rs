//! Crowd cost: looking like a near neighbor has a cost, so that neighbors do not appear as clones
//! (docs/explanation/algorithms.md, "Planning").
//!
//! Each individual watches those of smaller id whose plans were final when its own was made. The crowd cost
//! can therefore be recomputed from the files. Distances are whole 32nds of a body length and the costs are
//! a table, so results are the same on every machine.

use super::trellis::Trellis;
use crate::flock::individual::BoidTrack;
use crate::geometry::Turns;

/// Source frames less than this time apart look alike, in seconds. Free choice.
const LOOKALIKE_S: f64 = 0.3;
/// Standard deviation of the Gaussian by which the cost falls with distance, in body lengths. Free choice.
const WIDTH_BL: f64 = 4.0;
/// Distance from which looking alike costs nothing, in body lengths. Free choice.
const REACH_BL: f64 = 8.0;
/// Resolution of positions, in parts per body length. Free choice.
const PARTS_PER_BL: f64 = 32.0;
/// Table entries per squared body length. Free choice.
const STEPS_PER_SQUARE_BL: usize = 16;
/// Number of table entries within reach. One more entry holds 0.
const N_STEPS: usize = (REACH_BL * REACH_BL) as usize * STEPS_PER_SQUARE_BL;
/// Number of individuals that are planned one after the other, each watching all before it. Later ones are
/// planned `ROUND_SIZE` at a time and watch the rounds before. Free choice.
const N_SEQUENTIAL: usize = 64;
/// Number of individuals in a round. Free choice.
const ROUND_SIZE: usize = 16;

/// Position of a boid, in 32nds of a body length.
pub type Place = [i32; 3];

/// Parameters of the crowd cost, in frames, 32nds of a body length, and turns.
#[derive(Clone, Debug)]
pub struct Crowd {
    /// Cost of looking alike by squared distance, in turns, below 2^16.
    costs: Box<[u32; N_STEPS + 1]>,
    /// Largest difference of source frames that look alike.
    window: u32,
    length_px: f64,
}

impl Crowd {
    /// Returns the crowd cost of weight `w_c`, in radians. `length_px` is the body length in pixels.
    pub fn new(w_c: f64, fps: f64, length_px: f64) -> Crowd {
        let cost = |step: usize| {
            if step == N_STEPS {
                return 0;
            }
            let square_bl = (step as f64 + 0.5) / STEPS_PER_SQUARE_BL as f64;
            let near = libm::exp(-square_bl / (2.0 * WIDTH_BL * WIDTH_BL));
            u32::from((w_c * Turns::PER_RAD * near).round() as u16)
        };
        Crowd {
            costs: Box::new(std::array::from_fn(cost)),
            window: ((LOOKALIKE_S * fps).ceil() as u32).saturating_sub(1),
            length_px,
        }
    }

    /// Returns the number of individuals that individual `id` watches: all ids below this number. The first
    /// 64 individuals watch all of smaller id, later ones all before their round of 16. The number is 0 if
    /// looking alike costs nothing.
    pub fn n_watched(&self, id: usize) -> usize {
        match id {
            _ if self.costs[0] == 0 => 0,
            0..N_SEQUENTIAL => id,
            _ => id / ROUND_SIZE * ROUND_SIZE,
        }
    }

    /// Returns the position of a boid at frame `t`.
    pub fn place(&self, boid: &BoidTrack, t: usize) -> Place {
        boid.position_px[t].map(|px| (px / self.length_px * PARTS_PER_BL).round() as i32)
    }

    /// Returns the cost of an individual at `a` for looking like one at `b`, in turns.
    #[inline(always)]
    pub fn cost_at(&self, a: Place, b: Place) -> u32 {
        self.costs[self.step(a, b) as usize]
    }

    /// Returns the table entry for the distance between two positions.
    #[inline(always)]
    fn step(&self, a: Place, b: Place) -> u32 {
        let mut square = 0;
        for axis in 0..3 {
            let gap = (a[axis] - b[axis]).clamp(-8191, 8191);
            square += gap * gap;
        }
        // A squared body length has 32 x 32 squared parts and 16 table entries.
        (square as u32 >> 6).min(N_STEPS as u32)
    }

    /// Returns for each state the states that look like it: first, and one past the last.
    pub fn alike(&self, trellis: &Trellis) -> Vec<[u32; 2]> {
        let n = trellis.n_states();
        let near = |at: usize, other: usize| match (trellis.shown(at), trellis.shown(other)) {
            (Some(a), Some(b)) => a.1 == b.1 && a.0.abs_diff(b.0) <= self.window,
            // A barrier counts as alike. That is harmless, because no individual shows a barrier.
            _ => true,
        };
        (0..n)
            .map(|at| {
                if trellis.shown(at).is_none() {
                    return [at as u32; 2];
                }
                let reach = self.window as usize * 2 + 2;
                let low = (at.saturating_sub(reach)..at)
                    .rev()
                    .find(|&other| !near(at, other));
                let high = (at..(at + reach).min(n)).find(|&other| !near(at, other));
                let low = low.map_or(at.saturating_sub(reach), |other| other + 1);
                [low as u32, high.unwrap_or((at + reach).min(n)) as u32]
            })
            .collect()
    }
}
