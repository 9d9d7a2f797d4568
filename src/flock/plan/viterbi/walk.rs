//! Trace of the recursion, and the walk back through it (docs/explanation/algorithms.md, "Planning").
//!
//! For each block, the trace has the cheapest jump of each landing, and the stations at which a landing was
//! cheaper than playing on.

use super::meeting::Stand;
use super::shelf::{Sheets, Shelf};
use super::{FRAMES, Film, block};
use crate::flock::plan::landings::Way;

/// Place for the trace of one block.
#[derive(Default)]
pub(super) struct Steps<'a> {
    /// By rank of the landing station: index of its cheapest jump after each frame.
    pub(super) ranks: &'a mut [[u16; FRAMES]],
    /// By station, one bit per frame: set where a path that landed `dwell - 1` frames ago is cheaper than
    /// all paths that may jump already.
    pub(super) wins: &'a mut [u8],
}

/// Trace of some consecutive blocks.
pub(super) struct Trace<'a> {
    shelf: &'a Shelf,
    /// Clocks of the first block in the trace and of the next block.
    clocks: std::ops::Range<usize>,
    width: usize,
    n_landings: usize,
    n_stations: usize,
    /// Trace by block, as in `Steps`.
    sheets: Sheets,
}

impl<'a> Trace<'a> {
    /// Returns a trace with room for `n_blocks` blocks.
    pub(super) fn new(film: &Film<'a>, way: Way, n_blocks: usize) -> Trace<'a> {
        let n_landings = film.trellis.landings(way).n_landings();
        let (n_stations, shelf) = (film.trellis.n_states(), film.shelf);
        let sheets = shelf.take(n_blocks * n_landings * FRAMES, n_blocks * n_stations);
        Trace {
            shelf,
            clocks: 0..0,
            width: block::width(film.dwell),
            n_landings,
            n_stations,
            sheets,
        }
    }

    /// Returns the memory of a block, in bytes.
    pub(super) fn block_bytes(film: &Film<'_>, way: Way) -> usize {
        2 * FRAMES * film.trellis.landings(way).n_landings() + film.trellis.n_states()
    }

    /// Removes all blocks. The next block begins at `clock`.
    pub(super) fn restart(&mut self, clock: usize) {
        self.clocks = clock..clock;
    }

    /// Returns the place for the next block. The caller must overwrite all of it.
    #[inline(always)]
    pub(super) fn next_block(&mut self) -> Steps<'_> {
        let block = self.clocks.len() / self.width;
        self.clocks.end += self.width;
        let (ranks, _) = self.sheets.ranks.as_chunks_mut();
        Steps {
            ranks: &mut ranks[block * self.n_landings..][..self.n_landings],
            wins: &mut self.sheets.wins[block * self.n_stations..][..self.n_stations],
        }
    }

    /// Returns the block and the lane of a clock.
    fn place(&self, clock: usize) -> (usize, usize) {
        let age = clock - self.clocks.start;
        (age / self.width, age % self.width)
    }

    /// Returns whether at `clock` a path that landed `dwell - 1` frames before was the cheapest.
    fn has_landed(&self, clock: usize, station: usize) -> bool {
        let (block, lane) = self.place(clock);
        self.sheets.wins[block * self.n_stations + station] >> lane & 1 != 0
    }

    /// Returns the index of the cheapest jump after `clock` to the landing station of rank `order`.
    fn rank(&self, clock: usize, order: usize) -> usize {
        let (block, lane) = self.place(clock);
        let place = (block * self.n_landings + order) * FRAMES + lane;
        usize::from(self.sheets.ranks[place])
    }
}

impl Drop for Trace<'_> {
    fn drop(&mut self) {
        self.shelf.give_back(std::mem::take(&mut self.sheets));
    }
}

/// Walk along a path, from its end backward.
pub(super) struct Walk {
    /// States of the path, by age: the number of frames processed before.
    states: Vec<u32>,
    /// Clock of the first frame.
    opening: usize,
    /// Number of frames whose states are not known yet.
    n_left: usize,
    at: At,
}

/// Position of a walk at the last frame whose state is not known yet.
#[derive(Clone, Copy)]
enum At {
    /// At a station, where a jump is allowed.
    Free(usize),
    /// At a station (first value), a number of frames after a landing (second value).
    Landed(usize, usize),
    /// At the origin of the cheapest jump to the landing station of this rank.
    Origin(usize),
}

impl Walk {
    /// Returns a walk that begins at the end of a path.
    pub(super) fn new(film: &Film<'_>, n_frames: usize, end: Stand) -> Walk {
        Walk {
            states: vec![0; n_frames],
            opening: n_frames.next_multiple_of(block::width(film.dwell)) - n_frames,
            n_left: n_frames,
            at: match end.ago + 1 == film.dwell {
                true => At::Free(end.station),
                false => At::Landed(end.station, end.ago),
            },
        }
    }

    /// Walks back through all traced blocks.
    pub(super) fn back(&mut self, film: &Film<'_>, way: Way, trace: &Trace<'_>) {
        let landings = film.trellis.landings(way);
        while self.n_left > 0 && self.opening + self.n_left > trace.clocks.start {
            let age = self.n_left - 1;
            let clock = self.opening + age;
            if let At::Origin(order) = self.at {
                self.at = At::Free(landings.origin(order, trace.rank(clock, order)));
            }
            if let At::Free(station) = self.at
                && age > 0
                && trace.has_landed(clock, station)
            {
                self.at = At::Landed(station, film.dwell - 1);
            }
            let (station, before) = match self.at {
                At::Landed(station, 0) => (station, At::Origin(landings.order(station))),
                At::Landed(station, ago) => (station, At::Landed(station.wrapping_sub(1), ago - 1)),
                At::Free(station) | At::Origin(station) => {
                    (station, At::Free(station.wrapping_sub(1)))
                }
            };
            self.states[age] = way.station(film.trellis.n_states(), station) as u32;
            self.at = before;
            self.n_left = age;
        }
    }

    /// Returns the states by age. The walk must be complete.
    pub(super) fn finish(self) -> Vec<u32> {
        debug_assert_eq!(self.n_left, 0);
        self.states
    }
}
