//! Offers: the costs of paths that have just jumped, kept until they may jump again
//! (docs/explanation/algorithms.md, "Planning").
//!
//! An offer is stored as a lead: its cost minus the running sum of costs along continuous playback. The
//! lead stays constant while the path plays on.

use std::ops::Range;

use super::FRAMES;
use super::front::NO_LEAD;

/// Leads of the landings of at least the last `dwell` frames. They are stored by the clock of the frame
/// before the landing, and by the station reached `dwell - 1` frames after the landing.
#[derive(Clone, Debug)]
pub(super) struct Offers {
    /// `[station][slot]`: blocks one after the other. If eight lanes may span two blocks, the first block
    /// is repeated at the end.
    leads: Vec<[i32; FRAMES]>,
    n_slots: usize,
    /// Number of clocks that the slots hold, without the repeated block.
    n_clocks: usize,
    dwell: usize,
}

impl Offers {
    /// Returns an empty store for blocks of `width` frames.
    pub(super) fn new(n_stations: usize, dwell: usize, width: usize) -> Offers {
        let n_clocks = dwell.next_multiple_of(width);
        let n_slots = n_clocks / width + usize::from(!dwell.is_multiple_of(width));
        Offers {
            // Entries past the last station take landings whose run ends before the dwell.
            leads: vec![[NO_LEAD; FRAMES]; (n_stations + dwell - 1) * n_slots],
            n_slots,
            n_clocks,
            dwell,
        }
    }

    /// Returns the place for the offers of a block's landings.
    #[inline(always)]
    pub(super) fn of_block(&mut self, clock: usize) -> OffersOfBlock<'_> {
        let slot = clock % self.n_clocks / FRAMES;
        let has_copy = self.n_slots * FRAMES > self.n_clocks.max(FRAMES);
        let (n_slots, landed) = (self.n_slots, self.dwell - 1);
        OffersOfBlock {
            slot,
            n_slots,
            copy_slot: (slot == 0 && has_copy).then_some(n_slots - 1),
            leads: &mut self.leads[landed * n_slots..],
        }
    }

    /// Returns the offers of paths that may jump again, at a range of stations, in the block that begins at
    /// `clock`. `scratch` has one entry per station.
    #[inline(always)]
    pub(super) fn ready<'a>(
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

    /// Returns the offers of landings after `clock`, by landing station.
    pub(super) fn after(&self, clock: usize) -> impl Iterator<Item = i32> {
        let (slot, lane) = (
            clock % self.n_clocks / FRAMES,
            clock % self.n_clocks % FRAMES,
        );
        let rows = self.leads[(self.dwell - 1) * self.n_slots..].chunks_exact(self.n_slots);
        rows.map(move |row| row[slot][lane])
    }
}

/// Place for the offers of a block.
pub(super) struct OffersOfBlock<'a> {
    /// Entries from that of landing station 0 on.
    leads: &'a mut [[i32; FRAMES]],
    n_slots: usize,
    slot: usize,
    copy_slot: Option<usize>,
}

impl OffersOfBlock<'_> {
    /// Stores the leads of landings at a station.
    #[inline(always)]
    pub(super) fn store(&mut self, station: usize, leads: [i32; FRAMES]) {
        let row = station * self.n_slots;
        self.leads[row + self.slot] = leads;
        if let Some(copy_slot) = self.copy_slot {
            self.leads[row + copy_slot] = leads;
        }
    }
}
