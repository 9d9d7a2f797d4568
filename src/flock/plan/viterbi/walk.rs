//! What led where, and the way back through it (ALGORITHMS.md 6): for each frame the source that won
//! each landing, and the states that were landed on cheaper than continued to.

use super::Film;
use super::shelf::{Sheets, Shelf};
use crate::flock::plan::landings::{GROUP, Way};

/// Places for a frame's ranks, and for its wins.
pub(super) type Frame<'a, const LANES: usize> = (&'a mut [[u16; LANES]], &'a mut [[u8; LANES]]);

/// What led where, for some frames in a row.
pub(super) struct Trace<'a, const LANES: usize> {
    shelf: &'a Shelf,
    /// The age of the first frame kept.
    first: usize,
    /// Frames kept, and how many there is room for; past those the last is overwritten.
    n_frames: usize,
    room: usize,
    n_landings: usize,
    n_states: usize,
    /// By frame and the landings' order, which of a state's jumps; and by frame and state, whether
    /// landing was cheaper than continuing.
    sheets: Sheets,
}

impl<'a, const LANES: usize> Trace<'a, LANES> {
    /// With room for so many frames, at least one.
    pub(super) fn new(film: &Film<'a>, way: Way, room: usize) -> Trace<'a, LANES> {
        let n_landings = film.trellis.landings(way).n_groups() * GROUP;
        let n_states = film.trellis.n_states();
        let room = room.max(1);
        let (n_ranks, n_wins) = (room * n_landings * LANES, room * n_states * LANES);
        let (first, n_frames, shelf) = (0, 0, film.shelf);
        let sheets = shelf.take(n_ranks, n_wins);
        Trace {
            shelf,
            first,
            n_frames,
            room,
            n_landings,
            n_states,
            sheets,
        }
    }

    /// Bytes that a frame takes.
    pub(super) fn frame_bytes(film: &Film<'_>, way: Way) -> usize {
        LANES * (2 * film.trellis.landings(way).n_groups() * GROUP + film.trellis.n_states())
    }

    /// Forgets all, to begin at the frame of age `first`.
    pub(super) fn restart(&mut self, first: usize) {
        (self.first, self.n_frames) = (first, 0);
    }

    /// The next frame: the places for its ranks and its wins, all to be written.
    #[inline(always)]
    pub(super) fn next_frame(&mut self) -> Frame<'_, LANES> {
        self.n_frames = (self.n_frames + 1).min(self.room);
        let frame = self.n_frames - 1;
        let (ranks, _) = self.sheets.ranks.as_chunks_mut();
        let (wins, _) = self.sheets.wins.as_chunks_mut();
        (
            &mut ranks[frame * self.n_landings..][..self.n_landings],
            &mut wins[frame * self.n_states..][..self.n_states],
        )
    }

    /// Which of its jumps led to a state, if one did.
    fn landing(&self, age: usize, state: usize, order: usize, lane: usize) -> Option<usize> {
        let frame = age - self.first;
        let won = self.sheets.wins[(frame * self.n_states + state) * LANES + lane] != 0;
        let rank = (frame * self.n_landings + order) * LANES + lane;
        won.then(|| usize::from(self.sheets.ranks[rank]))
    }
}

impl<const LANES: usize> Drop for Trace<'_, LANES> {
    fn drop(&mut self) {
        self.shelf.give_back(std::mem::take(&mut self.sheets));
    }
}

/// A path read backward.
pub(super) struct Walk {
    /// The states gone through, by age.
    states: Vec<u32>,
    age: usize,
    state: usize,
    /// Frames, this one counted, in which nothing landed.
    held: usize,
}

impl Walk {
    /// From a path's last state, before which nothing landed for `held` frames.
    pub(super) fn new(n_frames: usize, state: usize, held: usize) -> Walk {
        Walk {
            states: vec![0; n_frames],
            age: n_frames - 1,
            state,
            held,
        }
    }

    /// Goes back to the age before `start`, or to the first frame.
    pub(super) fn back_to<const LANES: usize>(
        &mut self,
        start: usize,
        film: &Film<'_>,
        way: Way,
        trace: &Trace<'_, LANES>,
        lane: usize,
    ) {
        let landings = film.trellis.landings(way);
        while self.age >= start {
            self.states[self.age] = self.state as u32;
            let order = landings.order(self.state);
            let landing = match self.held {
                0 => trace.landing(self.age, self.state, order, lane),
                _ => None,
            };
            (self.state, self.held) = match (landing, way) {
                (Some(rank), _) => (landings.source(order, rank), film.dwell - 1),
                (None, Way::Ahead) => (self.state - 1, self.held.saturating_sub(1)),
                (None, Way::Back) => (self.state + 1, self.held.saturating_sub(1)),
            };
            self.age -= 1;
        }
    }

    /// The states by age, all of which have been gone back through but the first.
    pub(super) fn finish(mut self) -> Vec<u32> {
        self.states[self.age] = self.state as u32;
        self.states
    }
}
