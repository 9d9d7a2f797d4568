//! Traceback: the states of a path, read from the trace from its end backward
//! (docs/explanation/algorithms.md, "Planning").

use super::trace::Trace;
use super::{PathSearch, block};
use crate::flock::plan::landings::Pass;

/// End of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathEnd {
    pub(super) station: usize,
    /// Number of frames since the landing. `dwell - 1` stands for this number or more; the path may then
    /// jump.
    pub(super) ago: usize,
}

/// Traceback of a path.
pub(super) struct Traceback {
    /// States of the path, by age: the number of frames processed before.
    states: Vec<u32>,
    /// Clock of the first frame.
    opening: usize,
    /// Number of frames whose states are not known yet.
    n_left: usize,
    at: Cursor,
}

/// Position of a traceback at the last frame whose state is not known yet.
#[derive(Clone, Copy)]
enum Cursor {
    /// At a station, where a jump is allowed.
    Free(usize),
    /// At a station (first value), a number of frames after a landing (second value).
    Landed(usize, usize),
    /// At the origin of the cheapest jump to the landing station of this rank.
    Origin(usize),
}

impl Traceback {
    /// Returns a traceback that begins at the end of a path.
    pub(super) fn new(search: &PathSearch<'_>, n_frames: usize, end: PathEnd) -> Traceback {
        Traceback {
            states: vec![0; n_frames],
            opening: n_frames.next_multiple_of(block::width(search.dwell)) - n_frames,
            n_left: n_frames,
            at: if end.ago + 1 == search.dwell {
                Cursor::Free(end.station)
            } else {
                Cursor::Landed(end.station, end.ago)
            },
        }
    }

    /// Follows the path back through all traced blocks.
    pub(super) fn back(&mut self, search: &PathSearch<'_>, pass: Pass, trace: &Trace<'_>) {
        let landings = search.trellis.landings(pass);
        while self.n_left > 0 && self.opening + self.n_left > trace.start() {
            let age = self.n_left - 1;
            let clock = self.opening + age;
            if let Cursor::Origin(order) = self.at {
                self.at = Cursor::Free(landings.origin(order, trace.rank(clock, order)));
            }
            if let Cursor::Free(station) = self.at
                && age > 0
                && trace.has_landed(clock, station)
            {
                self.at = Cursor::Landed(station, search.dwell - 1);
            }
            let (station, before) = match self.at {
                Cursor::Landed(station, 0) => (station, Cursor::Origin(landings.order(station))),
                Cursor::Landed(station, ago) => {
                    (station, Cursor::Landed(station.wrapping_sub(1), ago - 1))
                }
                Cursor::Free(station) | Cursor::Origin(station) => {
                    (station, Cursor::Free(station.wrapping_sub(1)))
                }
            };
            self.states[age] = pass.station(search.trellis.n_states(), station) as u32;
            self.at = before;
            self.n_left = age;
        }
    }

    /// Returns the states by age. The traceback must be complete.
    pub(super) fn finish(self) -> Vec<u32> {
        debug_assert_eq!(self.n_left, 0);
        self.states
    }
}
