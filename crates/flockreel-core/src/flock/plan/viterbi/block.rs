//! Blocks of consecutive frames, processed side by side in the lanes of a vector
//! (docs/explanation/algorithms.md, "Planning").

use std::ops::Range;

use crate::cpu::Level;
use crate::flock::plan::landings::Pass;

/// Number of lanes of a vector, and the most frames of a block.
pub const FRAMES: usize = 8;

/// Consecutive frames of a film, in the order in which they are processed.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Direction of time.
    pub pass: Pass,
    /// Vector instructions to use; this machine must have them.
    pub cpu: Level,
    /// Number of states of the trellis.
    pub n_states: usize,
    /// Output frame of each lane. Unused lanes come first and repeat the frame of the first used lane, or
    /// come last and repeat that of the last used lane.
    pub times: [usize; FRAMES],
}

impl Block {
    /// Returns the lanes with frames below `n_frames`, in order of time.
    pub fn moments(&self, n_frames: usize) -> Moments {
        let steps = self.times.windows(2);
        let n_before = steps.clone().take_while(|t| t[0] == t[1]).count();
        let n_after = steps.rev().take_while(|t| t[0] == t[1]).count();
        let end = (FRAMES - n_after).max(n_before + 1);
        let (lanes, first) = (n_before..end, self.times[n_before].min(self.times[end - 1]));
        let range = match self.pass {
            Pass::Forward => lanes,
            Pass::Backward => FRAMES - lanes.end..FRAMES - lanes.start,
        };
        let n = range.len().min(n_frames.saturating_sub(first));
        Moments {
            range: range.start..range.start + n,
            first,
        }
    }

    /// Returns the state of a station.
    pub fn state(&self, station: usize) -> usize {
        self.pass.station(self.n_states, station)
    }

    /// Returns the states of a range of stations. Backward in time the state of the last station comes
    /// first.
    pub fn states(&self, stations: Range<usize>) -> Range<usize> {
        self.pass.stations(self.n_states, stations)
    }
}

/// Frames of a block in order of time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moments {
    /// Moments in use. Moment k is lane k forward in time, and lane `FRAMES - 1 - k` backward.
    pub range: Range<usize>,
    /// Output frame of the first moment in use.
    first: usize,
}

impl Moments {
    /// Returns the output frame of a moment in use.
    pub fn frame(&self, moment: usize) -> usize {
        self.first + moment - self.range.start
    }
}

/// Returns the number of frames of a block. It is at most the dwell, so that a jump in a block never leads
/// to another jump in the same block.
pub(super) fn width(dwell: usize) -> usize {
    dwell.min(FRAMES)
}
