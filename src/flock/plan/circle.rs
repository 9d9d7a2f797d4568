//! Plans that play into one another: the last frame of each into the first of whom it becomes
//! (ALGORITHMS.md 6, loop).
//!
//! Plans without that give each individual its first state, that of an heir from the plan before it; from
//! there on the plan is found anew, exact among all that begin so, jump no sooner than a dwell after the first
//! frame (as if it had just been jumped to), and end where the heir's first state follows. The recursion
//! sees one frame more than the film has, at which only that state may be shown.

use super::trellis::Trellis;
use super::viterbi::{Block, FRAMES, Rows};

/// What a plan that may not be costs at least. Three of these and all costs of a loop's plan stay below
/// 2^31.
pub(super) const FORBIDDEN: u32 = 1 << 28;

/// Where a plan begins, and what follows its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// The state at the first frame.
    pub first: u32,
    /// The state after the last.
    pub next: u32,
}

/// The state that a loop's plan begins with, given one that is none: its own first, if that goes on for
/// `dwell` frames; else the one that would have led to where it jumps; else the nearest that goes on
/// so long. `None` when no run is so long.
pub fn first_of(trellis: &Trellis, dwell: usize, states: &[u32]) -> Option<u32> {
    let goes_on = |state: u32| trellis.continues(state as usize, dwell - 1);
    let jump = (1..states.len()).find(|&t| states[t] != states[t - 1] + 1);
    let first = match jump {
        Some(t) if t < dwell => (states[t].checked_sub(t as u32))
            .filter(|&first| goes_on(first))
            .unwrap_or(states[0]),
        _ => states[0],
    };
    if goes_on(first) {
        return Some(first);
    }
    let others = (0..trellis.n_states() as u32).filter(|&state| goes_on(state));
    others.min_by_key(|other| other.abs_diff(first))
}

/// What each state costs in a plan that must begin and go on so.
#[derive(Clone)]
pub(super) struct Closed<R> {
    pub(super) rows: R,
    /// Nothing is asked of a plan that is no part of a loop.
    pub(super) ends: Option<Ends>,
    /// The frame after the film's last.
    pub(super) n_frames: usize,
    pub(super) dwell: usize,
}

impl<R: Rows> Rows for Closed<R> {
    #[inline(always)]
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        self.rows.fill(block, first, out);
        let Some(ends) = self.ends else {
            return;
        };
        for (lane, &t) in block.times.iter().enumerate() {
            let only = match t {
                _ if t == self.n_frames => ends.next as usize,
                _ if t == 0 || t == self.dwell - 1 => ends.first as usize + t,
                _ => continue,
            };
            for (station, out) in (first..).zip(&mut *out) {
                // Nothing else costs anything after the film.
                if t == self.n_frames {
                    out[lane] = 0;
                }
                if block.state(station) != only {
                    out[lane] += FORBIDDEN;
                }
            }
        }
    }
}

impl Ends {
    /// Whether a plan, with what follows it, is one.
    pub fn holds(&self, states: &[u32]) -> bool {
        states.first() == Some(&self.first) && states.last() == Some(&self.next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Jump, Playback};

    #[test]
    fn a_first_state_goes_on_for_a_dwell_and_is_the_plans_own_where_it_may_be() {
        let jump = Jump {
            from: 4,
            to: 11,
            cost: 7,
            mirrored: false,
        };
        let playback = Playback {
            jumps: vec![jump],
            component: vec![3, 4, 10, 11, 12, 13],
        };
        // States: barrier, 3, 4, barrier, 10, 11, 12, 13.
        let trellis = Trellis::new(&playback, false, |d| d as u32);
        assert_eq!(first_of(&trellis, 3, &[4, 5, 6, 7]), Some(4));
        assert_eq!(first_of(&trellis, 3, &[2, 5, 6, 7]), Some(4), "led to 5");
        assert_eq!(first_of(&trellis, 3, &[1, 2, 5, 6]), Some(4), "the nearest");
        assert_eq!(first_of(&trellis, 5, &[4, 5, 6, 7]), None);
    }
}
