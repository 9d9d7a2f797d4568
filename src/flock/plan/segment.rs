//! Costs of a segment's plan that come from outside the segment: from frames shown before it and from the
//! future.
//!
//! A plan continues from the state shown last, which may have to play on before the next jump. Its last
//! state adds a future cost F(s) = min over successors s' of (cost of the jump + 0.995 F(s')) (Schoedl et
//! al., Video Textures, 2000). The plan of a segment is exact with these costs.

use super::circle::FORBIDDEN;
use super::trellis::Trellis;
use super::viterbi::{Block, FRAMES, Rows};

/// Factor by which costs count less per frame in the future. Free choice.
const DISCOUNT: f64 = 0.995;
/// Maximum number of iterations of the future cost. A future cost that has not converged by then is
/// slightly too low. Free choice.
const MOST_ROUNDS: usize = 256;

/// State of an individual before a segment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Standing {
    /// State shown last; `None` before the first segment.
    pub state: Option<u32>,
    /// Number of frames that it must play on before it may jump.
    pub held: usize,
}

impl Standing {
    /// Updates the standing after a segment that shows `states`. Two jumps are at least `dwell` frames
    /// apart, but a flock may begin in the middle of a run.
    pub fn go_on(&mut self, states: &[u32], dwell: usize) {
        let is_first = self.state.is_none();
        let followed: Vec<u32> = (self.state.into_iter().chain(states.iter().copied())).collect();
        let steps = followed.windows(2).rev();
        let since = steps.take_while(|step| step[1] == step[0] + 1).count();
        let has_jumped = since + 1 < followed.len();
        self.held = match (has_jumped, is_first) {
            (true, _) => dwell.saturating_sub(since + 1),
            (false, true) => 0,
            (false, false) => self.held.saturating_sub(states.len()),
        };
        self.state = followed.last().copied();
    }
}

/// Costs of the frames of a segment. With `from`, frame 0 is the last frame of the segment before; there
/// only the state shown last is allowed, at no cost.
#[derive(Clone)]
pub(super) struct Begun<'a, R> {
    pub(super) rows: R,
    /// State shown last before the segment, and the number of frames for which it must play on.
    pub(super) from: Option<(u32, usize)>,
    pub(super) n_frames: usize,
    /// Future cost by state, in turns; `None` for the last segment.
    pub(super) future: Option<&'a [Option<u32>]>,
}

impl<R: Rows> Rows for Begun<'_, R> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        self.rows.fill(block, first, out);
        for (lane, &t) in block.times.iter().enumerate() {
            // The state at frame 0 is given, and so is the state after the frames that it must play on.
            // Only one path connects them.
            let only = |(state, held): (u32, usize)| match held.min(self.n_frames - 1) {
                held if t == 0 || t == held => Some(state as usize + t),
                _ => None,
            };
            if let Some(only) = self.from.and_then(only) {
                for (station, out) in (first..).zip(&mut *out) {
                    out[lane] = match block.state(station) == only {
                        true if t == 0 => 0,
                        true => out[lane],
                        false => FORBIDDEN,
                    };
                }
            }
            if let Some(future) = self.future.filter(|_| t + 1 == self.n_frames) {
                for (station, out) in (first..).zip(&mut *out) {
                    out[lane] += future[block.state(station)].unwrap_or(FORBIDDEN);
                }
            }
        }
    }
}

/// Returns the future cost of each state, in turns: the cost of the jumps that endless playback cannot
/// avoid, discounted by when they come. `None` if playback cannot continue from a state.
pub(in crate::flock) fn future_costs(trellis: &Trellis, dwell: usize) -> Vec<Option<u32>> {
    let after_dwell = (0..dwell).fold(1.0, |share, _| share * DISCOUNT);
    let mut future = vec![0.0f64; trellis.n_states()];
    for _ in 0..MOST_ROUNDS {
        let mut next = vec![f64::INFINITY; future.len()];
        for (k, &target) in trellis.targets().iter().enumerate() {
            let landed = target as usize;
            if !trellis.continues(landed, dwell - 1) {
                continue;
            }
            let later = after_dwell * future[landed + dwell - 1];
            for &(source, cost) in trellis.sources(k) {
                let through = f64::from(cost) + later;
                next[source as usize] = next[source as usize].min(through);
            }
        }
        for state in (0..next.len().saturating_sub(1)).rev() {
            if trellis.continues(state, 1) {
                next[state] = next[state].min(DISCOUNT * next[state + 1]);
            }
        }
        let settled = next == future;
        future = next;
        if settled {
            break;
        }
    }
    let most = f64::from(FORBIDDEN / 2);
    let whole = |cost: f64| cost.is_finite().then(|| cost.min(most).round() as u32);
    future.into_iter().map(whole).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Jump, Playback};

    /// Returns the trellis of frames 0 to 39 with two jumps: from 39 to 0 for 7 turns, from 20 to 2 for 50
    /// turns.
    fn trellis() -> Trellis {
        let jump = |from, to, cost| Jump {
            from,
            to,
            cost,
            mirrored: false,
        };
        let playback = Playback {
            jumps: vec![jump(20, 2, 50), jump(39, 0, 7)],
            component: (0..40).collect(),
        };
        Trellis::new(&playback, false, |jump| jump.cost as u32)
    }

    #[test]
    fn who_has_jumped_must_play_on_and_remembers_what_it_showed_last() {
        let mut standing = Standing::default();
        standing.go_on(&[5, 6, 7], 4);
        assert_eq!(
            (standing.state, standing.held),
            (Some(7), 0),
            "it began in a run"
        );
        standing.go_on(&[20, 21], 4);
        assert_eq!((standing.state, standing.held), (Some(21), 2));
        standing.go_on(&[22], 4);
        assert_eq!((standing.state, standing.held), (Some(22), 1));
        standing.go_on(&[23, 24, 25], 4);
        assert_eq!(standing.held, 0);
    }

    #[test]
    fn what_must_be_jumped_is_dearer_the_sooner_it_comes() {
        let trellis = trellis();
        let future = future_costs(&trellis, 4);
        let of = |frame| future[trellis.state(frame, false).expect("a state") as usize];
        assert!(of(39) > of(10) && of(10) > of(0), "{future:?}");
        // One jump for 7 turns every forty frames: about 7 / (1 - 0.995^40) at the jump.
        assert!((36..=42).contains(&of(39).expect("playback goes on")));
        assert_eq!(future[0], None, "nothing leaves a barrier");
    }
}
