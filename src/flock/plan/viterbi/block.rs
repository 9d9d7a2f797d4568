//! Frames side by side (ALGORITHMS.md 6).

use std::ops::Range;

use crate::cpu::Level;
use crate::flock::plan::landings::Way;

/// Frames in the lanes of a vector.
pub const FRAMES: usize = 8;

/// Some frames of a film in a row, in the order in which they are gone through.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Which way.
    pub way: Way,
    /// Which instructions to use; this machine must have them.
    pub cpu: Level,
    /// States of the trellis.
    pub n_states: usize,
    /// The output frame in each lane. Lanes that stand for none come first and repeat that of the first that
    /// does, or come last and repeat that of the last.
    pub times: [usize; FRAMES],
}

impl Block {
    /// The lanes that stand for frames below `n_frames`.
    pub fn moments(&self, n_frames: usize) -> Moments {
        let steps = self.times.windows(2);
        let n_before = steps.clone().take_while(|t| t[0] == t[1]).count();
        let n_after = steps.rev().take_while(|t| t[0] == t[1]).count();
        let end = (FRAMES - n_after).max(n_before + 1);
        let (lanes, first) = (n_before..end, self.times[n_before].min(self.times[end - 1]));
        let range = match self.way {
            Way::Ahead => lanes,
            Way::Back => FRAMES - lanes.end..FRAMES - lanes.start,
        };
        let n = range.len().min(n_frames.saturating_sub(first));
        Moments {
            range: range.start..range.start + n,
            first,
        }
    }

    /// The state of a station.
    pub fn state(&self, station: usize) -> usize {
        self.way.station(self.n_states, station)
    }

    /// The states of stations in a row; going back, the last comes first.
    pub fn states(&self, stations: Range<usize>) -> Range<usize> {
        self.way.stations(self.n_states, stations)
    }

    /// The stations of states in a row.
    pub fn stations(&self, states: Range<usize>) -> Range<usize> {
        self.way.stations(self.n_states, states)
    }
}

/// The frames that lanes stand for, in the order of time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moments {
    /// Moment k is lane k as time runs, and lane `FRAMES - 1 - k` against it.
    pub range: Range<usize>,
    /// The output frame of the first of the range.
    first: usize,
}

impl Moments {
    /// The output frame of a moment of the range.
    pub fn frame(&self, moment: usize) -> usize {
        self.first + moment - self.range.start
    }
}

/// Frames of a block: no jump of one of them may lead to another that could jump.
pub(super) fn width(dwell: usize) -> usize {
    dwell.min(FRAMES)
}
