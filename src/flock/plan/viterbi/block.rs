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
    /// The output frame in each lane; lanes that stand for none repeat another's.
    pub times: [usize; FRAMES],
}

impl Block {
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

/// Frames of a block: no jump of one of them may lead to another that could jump.
pub(super) fn width(dwell: usize) -> usize {
    dwell.min(FRAMES)
}
