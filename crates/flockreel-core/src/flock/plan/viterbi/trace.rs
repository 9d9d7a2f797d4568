//! Trace of the recursion, from which the cheapest path is read (docs/explanation/algorithms.md, "Planning").
//!
//! For each block, the trace has the cheapest jump of each landing, and the stations at which a landing was
//! cheaper than playing on.

use super::trace_pool::{TraceMemory, TracePool};
use super::{FRAMES, PathSearch, block};
use crate::flock::plan::landings::Pass;

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
    trace_pool: &'a TracePool,
    /// Clocks of the first block in the trace and of the next block.
    clocks: std::ops::Range<usize>,
    width: usize,
    n_landings: usize,
    n_stations: usize,
    /// Trace by block, as in `Steps`.
    memory: TraceMemory,
}

impl<'a> Trace<'a> {
    /// Returns a trace with room for `n_blocks` blocks.
    pub(super) fn new(search: &PathSearch<'a>, pass: Pass, n_blocks: usize) -> Trace<'a> {
        let n_landings = search.trellis.landings(pass).n_landings();
        let (n_stations, trace_pool) = (search.trellis.n_states(), search.trace_pool);
        let memory = trace_pool.take(n_blocks * n_landings * FRAMES, n_blocks * n_stations);
        Trace {
            trace_pool,
            clocks: 0..0,
            width: block::width(search.dwell),
            n_landings,
            n_stations,
            memory,
        }
    }

    /// Returns the clock of the first block in the trace.
    pub(super) fn start(&self) -> usize {
        self.clocks.start
    }

    /// Returns the memory of a block, in bytes.
    pub(super) fn block_bytes(search: &PathSearch<'_>, pass: Pass) -> usize {
        2 * FRAMES * search.trellis.landings(pass).n_landings() + search.trellis.n_states()
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
        let (ranks, _) = self.memory.ranks.as_chunks_mut();
        Steps {
            ranks: &mut ranks[block * self.n_landings..][..self.n_landings],
            wins: &mut self.memory.wins[block * self.n_stations..][..self.n_stations],
        }
    }

    /// Returns the block and the lane of a clock.
    fn place(&self, clock: usize) -> (usize, usize) {
        let age = clock - self.clocks.start;
        (age / self.width, age % self.width)
    }

    /// Returns whether at `clock` a path that landed `dwell - 1` frames before was the cheapest.
    pub(super) fn has_landed(&self, clock: usize, station: usize) -> bool {
        let (block, lane) = self.place(clock);
        self.memory.wins[block * self.n_stations + station] >> lane & 1 != 0
    }

    /// Returns the index of the cheapest jump after `clock` to the landing station of rank `order`.
    pub(super) fn rank(&self, clock: usize, order: usize) -> usize {
        let (block, lane) = self.place(clock);
        let place = (block * self.n_landings + order) * FRAMES + lane;
        usize::from(self.memory.ranks[place])
    }
}

impl Drop for Trace<'_> {
    fn drop(&mut self) {
        self.trace_pool.give_back(std::mem::take(&mut self.memory));
    }
}
