//! What led where, and the way back through it (ALGORITHMS.md 6): for each block the jumps that won each
//! landing, and the stations at which a landing was cheaper than going on.

use super::meeting::Stand;
use super::shelf::{Sheets, Shelf};
use super::{FRAMES, Film, block};
use crate::flock::plan::landings::Way;

/// Places for what led where in a block.
#[derive(Default)]
pub(super) struct Steps<'a> {
    /// By the landings' order, which of a station's jumps is the cheapest after each frame.
    pub(super) ranks: &'a mut [[u16; FRAMES]],
    /// By station, in bits, the frames at which who landed `dwell - 1` frames ago is cheaper than who
    /// may jump already.
    pub(super) wins: &'a mut [u8],
}

/// What led where, for some blocks in a row.
pub(super) struct Trace<'a> {
    shelf: &'a Shelf,
    /// The clock at which the first block kept begins, and where the next will.
    clocks: std::ops::Range<usize>,
    width: usize,
    n_landings: usize,
    n_stations: usize,
    /// By block, as in `Steps`.
    sheets: Sheets,
}

impl<'a> Trace<'a> {
    /// With room for so many blocks.
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

    /// Bytes that a block takes.
    pub(super) fn block_bytes(film: &Film<'_>, way: Way) -> usize {
        2 * FRAMES * film.trellis.landings(way).n_landings() + film.trellis.n_states()
    }

    /// Forgets all, to begin at `clock`.
    pub(super) fn restart(&mut self, clock: usize) {
        self.clocks = clock..clock;
    }

    /// The places of the next block, all to be written.
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

    /// The block and the lane of a clock.
    fn place(&self, clock: usize) -> (usize, usize) {
        let age = clock - self.clocks.start;
        (age / self.width, age % self.width)
    }

    /// Whether who landed `dwell - 1` frames before `clock` won.
    fn has_landed(&self, clock: usize, station: usize) -> bool {
        let (block, lane) = self.place(clock);
        self.sheets.wins[block * self.n_stations + station] >> lane & 1 != 0
    }

    /// Which jump to the station at `order` was the cheapest after `clock`.
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

/// A path read backward.
pub(super) struct Walk {
    /// The states gone through, by age.
    states: Vec<u32>,
    /// The clock of the first of them.
    opening: usize,
    /// Frames whose states are not known yet.
    n_left: usize,
    at: At,
}

/// Where a walk stands at the last frame whose state is not known yet.
#[derive(Clone, Copy)]
enum At {
    /// At a station, free to jump.
    Free(usize),
    /// At a station that was landed on so many frames before.
    Landed(usize, usize),
    /// Where the cheapest jump to the station at this order comes from.
    Origin(usize),
}

impl Walk {
    /// From a path's end.
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

    /// Goes back through all that is traced.
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

    /// The states by age, all of which have been gone back through.
    pub(super) fn finish(self) -> Vec<u32> {
        debug_assert_eq!(self.n_left, 0);
        self.states
    }
}
