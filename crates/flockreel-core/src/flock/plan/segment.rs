//! Playback across segments (`flock::follow`): the frames shown before a segment, and the future cost of its last
//! state.
//!
//! A plan continues from the state shown last, which may have to play on before the next jump. Its last
//! state adds a future cost F(s) = min over successors s' of (cost of the jump + 0.995 F(s')) (Schoedl et
//! al., Video Textures, 2000).

use super::trellis::Trellis;

/// Least cost of a plan that is not allowed, in turns. Sums of this and all costs of a plan stay below 2^31.
pub(super) const FORBIDDEN: u32 = 1 << 28;
/// Factor by which costs count less per frame in the future. Free choice.
const DISCOUNT: f64 = 0.995;
/// Maximum number of iterations of the future cost. A future cost that has not converged by then is
/// slightly too low. Free choice.
const MAX_ITERATIONS: usize = 256;

/// State of an individual before a segment.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlaybackStatus {
    /// State shown last; `None` before the first segment.
    pub state: Option<u32>,
    /// Number of frames that it must play on before it may jump.
    pub n_forced: usize,
}

impl PlaybackStatus {
    /// Updates the status after a segment that shows `states`. Two jumps are at least `dwell` frames
    /// apart, but a flock may begin in the middle of a run.
    pub fn update(&mut self, states: &[u32], dwell: usize) {
        let is_first = self.state.is_none();
        let followed: Vec<u32> = (self.state.into_iter().chain(states.iter().copied())).collect();
        let steps = followed.windows(2).rev();
        let since = steps.take_while(|step| step[1] == step[0] + 1).count();
        let has_jumped = since + 1 < followed.len();
        self.n_forced = match (has_jumped, is_first) {
            (true, _) => dwell.saturating_sub(since + 1),
            (false, true) => 0,
            (false, false) => self.n_forced.saturating_sub(states.len()),
        };
        self.state = followed.last().copied();
    }
}

/// Returns the future cost of each state, in turns: the cost of the jumps that endless playback cannot
/// avoid, discounted by when they come. `FORBIDDEN` if playback cannot continue from a state.
pub(super) fn future_costs(trellis: &Trellis, dwell: usize) -> Vec<u32> {
    let after_dwell = (0..dwell).fold(1.0, |share, _| share * DISCOUNT);
    let mut future = vec![0.0f64; trellis.n_states()];
    for _ in 0..MAX_ITERATIONS {
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
        let has_converged = next == future;
        future = next;
        if has_converged {
            break;
        }
    }
    let whole = |cost: f64| {
        if cost.is_infinite() {
            return FORBIDDEN;
        }
        cost.min(f64::from(FORBIDDEN / 2)).round() as u32
    };
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
    fn frames_forced_after_a_jump_count_down_over_segments() {
        let mut status = PlaybackStatus::default();
        status.update(&[5, 6, 7], 4);
        assert_eq!(
            (status.state, status.n_forced),
            (Some(7), 0),
            "it began in a run"
        );
        status.update(&[20, 21], 4);
        assert_eq!((status.state, status.n_forced), (Some(21), 2));
        status.update(&[22], 4);
        assert_eq!((status.state, status.n_forced), (Some(22), 1));
        status.update(&[23, 24, 25], 4);
        assert_eq!(status.n_forced, 0);
    }

    #[test]
    fn future_cost_rises_toward_an_unavoidable_jump() {
        let trellis = trellis();
        let future = future_costs(&trellis, 4);
        let of = |frame| future[trellis.state(frame, false).expect("a state") as usize];
        assert!(of(39) > of(10) && of(10) > of(0), "{future:?}");
        // One jump for 7 turns every forty frames: about 7 / (1 - 0.995^40) at the jump.
        assert!((36..=42).contains(&of(39)));
        assert_eq!(future[0], FORBIDDEN, "nothing leaves a barrier");
    }
}
