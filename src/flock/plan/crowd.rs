//! Against clones: looking like a near neighbor costs (ALGORITHMS.md 6). Each individual looks out
//! for those of smaller id whose plans were final when its own was made, so that anyone can recompute
//! the cost. Distances are whole 32nds of a body length, weights a table: the same on any machine.

use std::ops::Range;

use super::trellis::Trellis;
use super::viterbi::FRAMES;
use crate::flock::individual::BoidTrack;
use crate::geometry::Turns;

/// Nearer in the footage than this looks the same.
const LOOKALIKE_S: f64 = 0.3;
/// The weight falls off as a Gaussian of this width.
const WIDTH_BL: f64 = 4.0;
/// Farther than this costs nothing.
const REACH_BL: f64 = 8.0;
/// Places are rounded to so many parts of a body length.
const PARTS: f64 = 32.0;
/// Steps of the table to a squared body length.
const STEPS: usize = 16;
/// Steps within reach; what comes after them costs nothing.
const N_STEPS: usize = (REACH_BL * REACH_BL) as usize * STEPS;
/// So many are planned one after the other, each looking out for all before it; after them
/// `ROUND` at a time, who look out for the rounds before.
const ONE_BY_ONE: usize = 64;
/// Individuals in a round.
const ROUND: usize = 16;

/// So many distances are computed before any is looked up.
const IN_A_ROW: usize = 32;

/// Where a boid is, in 32nds of a body length.
pub type Place = [i32; 3];

/// Where boids are at one moment, by id, axis after axis.
#[derive(Clone, Debug, Default)]
pub struct Places {
    axes: [Vec<i32>; 3],
}

/// The crowd term's measures, in frames, parts and turns.
#[derive(Clone, Debug)]
pub struct Crowd {
    /// What looking alike costs by squared distance, turns below 2^16.
    costs: Box<[u32; N_STEPS + 1]>,
    /// Frames apart that still look alike.
    window: u32,
    length_px: f64,
}

/// A neighbor that an individual should not look like at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lookalike {
    /// The neighbor's state.
    pub state: u32,
    /// What looking like it costs, turns.
    pub cost: u32,
}

impl Crowd {
    /// `w_c` in radians; the animal's length in pixels.
    pub fn new(w_c: f64, fps: f64, length_px: f64) -> Crowd {
        let cost = |step: usize| {
            if step == N_STEPS {
                return 0;
            }
            let square_bl = (step as f64 + 0.5) / STEPS as f64;
            let near = libm::exp(-square_bl / (2.0 * WIDTH_BL * WIDTH_BL));
            u32::from((w_c * Turns::PER_RAD * near).round() as u16)
        };
        Crowd {
            costs: Box::new(std::array::from_fn(cost)),
            window: ((LOOKALIKE_S * fps).ceil() as u32).saturating_sub(1),
            length_px,
        }
    }

    /// How many individuals number `id` looks out for: all of smaller id up to the 64th, from there on
    /// those before its round of 16; nobody, when looking alike costs nothing.
    pub fn n_watched(&self, id: usize) -> usize {
        match id {
            _ if self.costs[0] == 0 => 0,
            0..ONE_BY_ONE => id,
            _ => id / ROUND * ROUND,
        }
    }

    /// The place at frame `t`.
    pub fn place(&self, boid: &BoidTrack, t: usize) -> Place {
        boid.position_px[t].map(|px| (px / self.length_px * PARTS).round() as i32)
    }

    /// What looking like one at `b` costs one at `a`, turns.
    #[inline(always)]
    pub fn cost_at(&self, a: Place, b: Place) -> u32 {
        self.costs[self.step(a, b) as usize]
    }

    /// The same of some others at `places`, at moment `moment` of what is told of each.
    #[inline(always)]
    pub fn costs_at(
        &self,
        (id, others): (usize, Range<usize>),
        places: &Places,
        moment: usize,
        costs: &mut [[u32; FRAMES]],
    ) {
        let here = places.of(id);
        let axes = places.axes.each_ref();
        let [x, y, z] = axes.map(|axis| axis[others.clone()].chunks(IN_A_ROW));
        for (costs, ((x, y), z)) in costs.chunks_mut(IN_A_ROW).zip(x.zip(y).zip(z)) {
            // First the arithmetic of all, then the table.
            let mut steps = [0; IN_A_ROW];
            for (step, ((&x, &y), &z)) in steps.iter_mut().zip(x.iter().zip(y).zip(z)) {
                *step = self.step(here, [x, y, z]);
            }
            for (costs, step) in costs.iter_mut().zip(steps) {
                costs[moment] = self.costs[step as usize];
            }
        }
    }

    /// Where in the table two places are.
    #[inline(always)]
    fn step(&self, a: Place, b: Place) -> u32 {
        let mut square = 0;
        for axis in 0..3 {
            let gap = (a[axis] - b[axis]).clamp(-8191, 8191);
            square += gap * gap;
        }
        // 32 x 32 parts to the squared body length, 16 steps to it as well.
        (square as u32 >> 6).min(N_STEPS as u32)
    }

    /// Whom to avoid looking like at frame `t`, of the planned others: (boid, states).
    pub fn lookalikes<'a>(
        &self,
        boid: &BoidTrack,
        others: impl Iterator<Item = (&'a BoidTrack, &'a [u32])>,
        t: usize,
    ) -> Vec<Lookalike> {
        let here = self.place(boid, t);
        others
            .filter_map(|(other, states)| {
                let cost = self.cost_at(here, self.place(other, t));
                let state = states[t];
                (cost > 0).then_some(Lookalike { state, cost })
            })
            .collect()
    }

    /// What being in `state` costs among `lookalikes`, turns.
    pub fn cost_of(&self, trellis: &Trellis, lookalikes: &[Lookalike], state: u32) -> u32 {
        let Some((frame, side)) = trellis.shown(state as usize) else {
            return 0;
        };
        lookalikes
            .iter()
            .filter(|other| {
                trellis
                    .shown(other.state as usize)
                    .is_some_and(|shown| shown.1 == side && shown.0.abs_diff(frame) <= self.window)
            })
            .map(|other| other.cost)
            .sum()
    }

    /// The states that look like each state: first, and one past the last.
    pub fn alike(&self, trellis: &Trellis) -> Vec<[u32; 2]> {
        let n = trellis.n_states();
        let near = |at: usize, other: usize| match (trellis.shown(at), trellis.shown(other)) {
            (Some(a), Some(b)) => a.1 == b.1 && a.0.abs_diff(b.0) <= self.window,
            // A barrier is passed over; one at the edge does no harm.
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

impl Places {
    /// Where one is.
    pub fn of(&self, id: usize) -> Place {
        self.axes.each_ref().map(|axis| axis[id])
    }
}

impl FromIterator<Place> for Places {
    fn from_iter<I: IntoIterator<Item = Place>>(places: I) -> Places {
        let mut all = Places::default();
        for place in places {
            for (axis, at) in all.axes.iter_mut().zip(place) {
                axis.push(at);
            }
        }
        all
    }
}

/// Plans that are final, as others look out for them.
#[derive(Clone, Debug)]
pub struct Settled {
    /// `[t][id]`: the state shown.
    states: Vec<Vec<u32>>,
    /// `[t][id]`: for how many frames from this one on, at most `FRAMES`, what looks like it moves on by one a
    /// frame.
    n_steady: Vec<Vec<u8>>,
}

impl Settled {
    /// Nobody's.
    pub fn new(n_frames: usize) -> Settled {
        Settled {
            states: vec![Vec::new(); n_frames],
            n_steady: vec![Vec::new(); n_frames],
        }
    }

    /// The next individual's states, given what looks like each.
    pub fn push(&mut self, states: &[u32], alike: &[[u32; 2]]) {
        let alike = |t: usize| alike[states[t] as usize];
        let mut n_steady = 0;
        for (t, &state) in states.iter().enumerate().rev() {
            let goes_on = t + 1 < states.len() && alike(t + 1) == alike(t).map(|end| end + 1);
            n_steady = if goes_on { n_steady + 1 } else { 1 }.min(FRAMES as u8);
            self.states[t].push(state);
            self.n_steady[t].push(n_steady);
        }
    }

    /// The states shown at frame `t`, by id.
    pub fn at(&self, t: usize) -> &[u32] {
        &self.states[t]
    }

    /// For how many frames from `t` on, at most `FRAMES`, what looks like them moves on by one a frame.
    pub fn steady_at(&self, t: usize) -> &[u8] {
        &self.n_steady[t]
    }
}
