//! Against clones: looking like a near neighbor costs (ALGORITHMS.md 6). Each individual looks out
//! for those of smaller id, whose plans are final, so that anyone can recompute the cost.

use super::trellis::Trellis;
use crate::flock::individual::BoidTrack;
use crate::geometry::Turns;

/// Nearer in the footage than this looks the same.
const LOOKALIKE_S: f64 = 0.3;
/// The weight falls off as a Gaussian of this width.
const WIDTH_BL: f64 = 4.0;
/// Farther than this costs nothing.
const REACH_BL: f64 = 8.0;

/// The crowd term's measures, in frames, pixels and turns.
#[derive(Clone, Copy, Debug)]
pub struct Crowd {
    weight_turns: f64,
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
    pub cost: u16,
}

impl Crowd {
    /// `w_c` in radians; the animal's length in pixels.
    pub fn new(w_c: f64, fps: f64, length_px: f64) -> Crowd {
        Crowd {
            weight_turns: w_c * Turns::PER_RAD,
            window: ((LOOKALIKE_S * fps).ceil() as u32).saturating_sub(1),
            length_px,
        }
    }

    /// Whom to avoid looking like at frame `t`, of the planned others: (boid, states).
    pub fn lookalikes<'a>(
        &self,
        boid: &BoidTrack,
        others: impl Iterator<Item = (&'a BoidTrack, &'a [u32])>,
        t: usize,
    ) -> Vec<Lookalike> {
        others
            .filter_map(|(other, states)| {
                let cost = self.cost_at(boid.position_px[t], other.position_px[t]);
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
            .map(|other| u32::from(other.cost))
            .sum()
    }

    /// Adds the same costs to every state of a row at once.
    pub fn add_to_row(&self, trellis: &Trellis, lookalikes: &[Lookalike], row: &mut [[u32; 1]]) {
        for other in lookalikes {
            let Some((frame, side)) = trellis.shown(other.state as usize) else {
                continue;
            };
            for near in frame.saturating_sub(self.window)..=frame + self.window {
                if let Some(state) = trellis.state(near, side) {
                    row[state as usize][0] += u32::from(other.cost);
                }
            }
        }
    }

    fn cost_at(&self, a_px: [f64; 3], b_px: [f64; 3]) -> u16 {
        let square: f64 = a_px.iter().zip(b_px).map(|(a, b)| (a - b) * (a - b)).sum();
        let square_bl = square / (self.length_px * self.length_px);
        if square_bl > REACH_BL * REACH_BL {
            return 0;
        }
        let near = libm::exp(-square_bl / (2.0 * WIDTH_BL * WIDTH_BL));
        (self.weight_turns * near).round() as u16
    }
}
