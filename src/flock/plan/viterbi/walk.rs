//! What led where, and the way back through it (ALGORITHMS.md 6): for each frame the source that
//! won each jump target, and the runs that ended there cheaper than what continued.

use super::Path;
use crate::flock::plan::trellis::Trellis;

/// What led where, for some frames in a row.
#[derive(Default)]
pub(super) struct Trace<const LANES: usize> {
    first: usize,
    n_targets: usize,
    /// `[(t - first) * n_targets + order]`: which of a target's sources.
    winners: Vec<[u16; LANES]>,
    /// Where each frame's arrivals begin.
    arrivals: Vec<usize>,
    /// States where a run ended, rising; bit `lane`: cheaper than continuing.
    arrived: Vec<(u32, u8)>,
}

impl<const LANES: usize> Trace<LANES> {
    /// Forgets all, to begin at frame `first`.
    pub(super) fn restart(&mut self, first: usize) {
        self.first = first;
        self.winners.clear();
        self.arrivals.clear();
        self.arrived.clear();
    }

    /// The next frame; gives the place for its winners, in the trellis's order. Its arrivals come now.
    #[inline(always)]
    pub(super) fn next_frame(&mut self, n_targets: usize) -> &mut [[u16; LANES]] {
        self.n_targets = n_targets;
        self.arrivals.push(self.arrived.len());
        let from = self.winners.len();
        self.winners.resize(from + n_targets, [0; LANES]);
        &mut self.winners[from..]
    }

    /// Gives the place for up to `most` arrivals of the frame, states rising; `keep` says how many
    /// of them there are.
    #[inline(always)]
    pub(super) fn arrivals(&mut self, most: usize) -> &mut [(u32, u8)] {
        let from = self.arrived.len();
        self.arrived.resize(from + most, (0, 0));
        &mut self.arrived[from..]
    }

    /// Keeps the first `n_arrived` of the frame's arrivals.
    #[inline(always)]
    pub(super) fn keep(&mut self, n_arrived: usize) {
        let from = self.arrivals.last().copied().unwrap_or(0);
        self.arrived.truncate(from + n_arrived);
    }

    fn is_arrival(&self, t: usize, state: u32, lane: usize) -> bool {
        let idx = t - self.first;
        let end = self.arrivals.get(idx + 1).copied();
        let arrived = &self.arrived[self.arrivals[idx]..end.unwrap_or(self.arrived.len())];
        let found = arrived.binary_search_by_key(&state, |arrival| arrival.0);
        found.is_ok_and(|at| arrived[at].1 >> lane & 1 == 1)
    }

    fn winner(&self, t: usize, order: usize, lane: usize) -> usize {
        usize::from(self.winners[(t - self.first) * self.n_targets + order][lane])
    }
}

/// Where a walk back stands.
#[derive(Clone, Copy)]
pub(super) enum Back {
    /// Free in state `at` at frame `t`.
    Free { at: usize, t: usize },
    /// Just landed on target `k` at frame `t`.
    Landed { k: usize, t: usize },
}

/// A path read backward.
pub(super) struct Walk {
    path: Path,
    back: Back,
}

impl Walk {
    /// From the end of the cheapest path.
    pub(super) fn from_end(trellis: &Trellis, n_frames: usize, (cost, back): (u32, Back)) -> Walk {
        let mut states = vec![0; n_frames];
        if let Back::Landed { k, t } = back {
            lay_run(&mut states[t..], trellis.targets()[k]);
        }
        Walk {
            path: Path { states, cost },
            back,
        }
    }

    /// Goes on until what led here lies before frame `start`.
    pub(super) fn back_to<const LANES: usize>(
        &mut self,
        start: usize,
        trellis: &Trellis,
        dwell: usize,
        trace: &Trace<LANES>,
        lane: usize,
    ) {
        loop {
            match self.back {
                Back::Free { at, t } if t >= start => {
                    if trace.is_arrival(t, at as u32, lane) {
                        let (target, t) = ((at + 1 - dwell) as u32, t + 1 - dwell);
                        lay_run(&mut self.path.states[t..t + dwell], target);
                        let k = trellis.targets().partition_point(|&other| other < target);
                        self.back = Back::Landed { k, t };
                    } else {
                        self.path.states[t] = at as u32;
                        let (at, t) = (at - 1, t - 1);
                        self.back = Back::Free { at, t };
                    }
                }
                Back::Landed { k, t } if t >= start => {
                    let winner = trace.winner(t, trellis.order(k), lane);
                    let at = trellis.sources(k)[winner].0 as usize;
                    self.back = Back::Free { at, t: t - 1 };
                }
                _ => return,
            }
        }
    }

    pub(super) fn finish(mut self) -> Path {
        if let Back::Free { at, t } = self.back {
            self.path.states[t] = at as u32;
        }
        self.path
    }
}

fn lay_run(states: &mut [u32], target: u32) {
    for (state, shown) in states.iter_mut().zip(target..) {
        *state = shown;
    }
}
