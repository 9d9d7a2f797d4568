//! What landings offer, until those who landed may leave again (ALGORITHMS.md 6).

use std::ops::Range;

use super::FRAMES;
use super::front::NO_LEAD;

/// The leads of landings of at least the last `dwell` frames, by the clock of the frame before the
/// landing and by the station that is come to `dwell - 1` frames after it.
#[derive(Clone, Debug)]
pub(super) struct Offers {
    /// `[station][slot]`: blocks one after the other, the first once more at the end where eight lanes of
    /// two blocks are asked for.
    leads: Vec<[i32; FRAMES]>,
    n_slots: usize,
    /// Clocks that the slots hold, the last aside if it is the first once more.
    n_clocks: usize,
    dwell: usize,
}

impl Offers {
    /// None yet; blocks are of `width` frames.
    pub(super) fn new(n_stations: usize, dwell: usize, width: usize) -> Offers {
        let n_clocks = dwell.next_multiple_of(width);
        let n_slots = n_clocks / width + usize::from(!dwell.is_multiple_of(width));
        Offers {
            // Past the last station lie those who would have left the last run.
            leads: vec![[NO_LEAD; FRAMES]; (n_stations + dwell - 1) * n_slots],
            n_slots,
            n_clocks,
            dwell,
        }
    }

    /// A place for the offers of a block's landings.
    #[inline(always)]
    pub(super) fn block(&mut self, clock: usize) -> OffersOfBlock<'_> {
        let slot = clock % self.n_clocks / FRAMES;
        let has_more = self.n_slots * FRAMES > self.n_clocks.max(FRAMES);
        let (n_slots, landed) = (self.n_slots, self.dwell - 1);
        OffersOfBlock {
            slot,
            n_slots,
            more: (slot == 0 && has_more).then_some(n_slots - 1),
            leads: &mut self.leads[landed * n_slots..],
        }
    }

    /// Those of who may leave each of some stations in a row, in the block that begins at `clock`;
    /// `scratch` is as long.
    #[inline(always)]
    pub(super) fn of<'a>(
        &'a self,
        stations: Range<usize>,
        clock: usize,
        scratch: &'a mut [[i32; FRAMES]],
    ) -> &'a [[i32; FRAMES]] {
        if self.n_slots == 1 {
            return &self.leads[stations];
        }
        let lane = (clock + self.n_clocks - self.dwell) % self.n_clocks;
        let rows = self.leads[stations.start * self.n_slots..].chunks_exact(self.n_slots);
        for (out, row) in scratch.iter_mut().zip(rows) {
            out.copy_from_slice(&row.as_flattened()[lane..][..FRAMES]);
        }
        scratch
    }

    /// Those of landings after `clock`, by station.
    pub(super) fn after(&self, clock: usize) -> impl Iterator<Item = i32> {
        let (slot, lane) = (
            clock % self.n_clocks / FRAMES,
            clock % self.n_clocks % FRAMES,
        );
        let rows = self.leads[(self.dwell - 1) * self.n_slots..].chunks_exact(self.n_slots);
        rows.map(move |row| row[slot][lane])
    }
}

/// Where the offers of a block are kept.
pub(super) struct OffersOfBlock<'a> {
    /// From the first station landed on.
    leads: &'a mut [[i32; FRAMES]],
    n_slots: usize,
    slot: usize,
    more: Option<usize>,
}

impl OffersOfBlock<'_> {
    /// Keeps the leads of landings on a station.
    #[inline(always)]
    pub(super) fn put(&mut self, station: usize, leads: [i32; FRAMES]) {
        let row = station * self.n_slots;
        self.leads[row + self.slot] = leads;
        if let Some(more) = self.more {
            self.leads[row + more] = leads;
        }
    }
}
