//! Natural continuation of an animal: the frames that follow the one shown, and a random jump where a run
//! ends.
//!
//! A boid takes its speeds from this continuation. Its speeds are thus those of the footage, in the order of
//! the footage. A rest lasts as long as the animal rested.

use crate::flock::boids::ImposedMotion;
use crate::flock::motion::FrameMotion;
use crate::flock::plan::Model;
use crate::random;

/// Number of random states, of which an individual starts with the cheapest. Free choice. More states give a
/// heading nearer to that of the boid, but distort the shares of rest and motion.
const N_START_CANDIDATES: u64 = 24;
/// Additional cost at which a jump is e times as rare, turns. Free choice: a quarter of the default cost of a
/// jump at D = epsilon.
const RARER_TURNS: f64 = 3000.0;

/// Purposes of random numbers, as words of their keys.
mod draw {
    pub(super) const START: u64 = 21;
    pub(super) const JUMP: u64 = 22;
}

/// Natural continuations from all states of a trellis.
pub(super) struct NaturalPlayback<'a> {
    model: &'a Model,
    seed: u64,
    /// Speed and turn rate, by state.
    motions: Vec<ImposedMotion>,
}

impl<'a> NaturalPlayback<'a> {
    pub(super) fn new(model: &'a Model, motion: &[FrameMotion], seed: u64) -> NaturalPlayback<'a> {
        let trellis = &model.trellis;
        let motion_in = |state| {
            let Some((frame, mirrored)) = trellis.shown(state) else {
                return ImposedMotion::default();
            };
            let moved = &motion[frame as usize];
            let side = if mirrored { -1.0 } else { 1.0 };
            ImposedMotion {
                speed_bl_per_s: moved.speed_in_space(),
                turn_rad_per_s: side * moved.turn_rad_per_s,
            }
        };
        NaturalPlayback {
            model,
            seed,
            motions: (0..trellis.n_states()).map(motion_in).collect(),
        }
    }

    /// Returns the first state of individual `id`: the one with the least `cost` among some random states.
    /// Random states show rest and motion in the shares of the footage. Returns `None` if playback cannot
    /// continue from any state.
    pub(super) fn first_state(&self, id: usize, cost: impl Fn(usize) -> u32) -> Option<u32> {
        let goes_on: Vec<u32> = (0..self.motions.len() as u32)
            .filter(|&state| self.model.is_endless(state))
            .collect();
        let drawn = (0..N_START_CANDIDATES).filter_map(|k| {
            let at = random::uniform(self.seed, &[draw::START, id as u64, k]);
            goes_on.get((at * goes_on.len() as f64) as usize).copied()
        });
        drawn.min_by_key(|&state| cost(state as usize))
    }

    /// Returns the states of the `n` frames after `state`. No jump is made in the first `n_forced` frames,
    /// unless the run ends.
    pub(super) fn states(
        &self,
        mut state: u32,
        mut n_forced: usize,
        n: usize,
        key: [u64; 2],
    ) -> Vec<u32> {
        let mut states = Vec::with_capacity(n);
        for t in 0..n as u64 {
            let next = state + 1;
            let goes_on = self.model.trellis.continues(state as usize, 1)
                && (n_forced > 0 || self.model.is_endless(next));
            state = if goes_on {
                next
            } else {
                n_forced = self.model.dwell;
                let key = [draw::JUMP, key[0], key[1], t];
                self.jump(state, key).unwrap_or(state)
            };
            n_forced = n_forced.saturating_sub(1);
            states.push(state);
        }
        states
    }

    /// Returns the target of a random jump from a state, or `None` if it has no jump. Expensive jumps are
    /// rarer.
    fn jump(&self, state: u32, key: [u64; 4]) -> Option<u32> {
        let jumps = self.model.jumps_from(state);
        let least = jumps.iter().map(|jump| jump.1).min()?;
        let share = |cost: u32| libm::exp(-f64::from(cost - least) / RARER_TURNS);
        let sum: f64 = jumps.iter().map(|jump| share(jump.1)).sum();
        let mut left = sum * random::uniform(self.seed, &key);
        let chosen = jumps.iter().find(|jump| {
            left -= share(jump.1);
            left < 0.0
        });
        Some(chosen.or(jumps.last())?.0)
    }

    /// Returns speed and turn rate of the animal in a state.
    pub(super) fn motion(&self, state: u32) -> ImposedMotion {
        self.motions[state as usize]
    }
}
