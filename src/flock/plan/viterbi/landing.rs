//! The cheapest jump to each station: the hot loop of the recursion's second stroke (ALGORITHMS.md 6).

use super::front::{Tally, lead};
use super::offers::OffersOfBlock;
use super::{FRAMES, UNREACHED};
use crate::flock::plan::landings::Origin;

/// The landings of a block.
pub(super) struct Landing<'a> {
    /// By station plus one.
    pub(super) tallies: &'a [Tally],
    pub(super) offers: OffersOfBlock<'a>,
    /// Which jump was the cheapest, landing after landing.
    pub(super) ranks: std::slice::IterMut<'a, [u16; FRAMES]>,
}

impl Landing<'_> {
    /// Lands on some stations, given the jumps to each; `RANKED`, or it is not kept which was the cheapest.
    #[inline(always)]
    pub(super) fn each<const RANKED: bool>(
        &mut self,
        stations: &[u32],
        jumps: impl IntoIterator<Item = impl AsRef<[Origin]>>,
    ) {
        for (&station, jumps) in stations.iter().zip(jumps) {
            let station = station as usize;
            let (landed, ranks) = self.cheapest(jumps.as_ref());
            if RANKED && let Some(out) = self.ranks.next() {
                *out = ranks.map(|rank| rank as u16);
            }
            // What goes on to here has come from the station before.
            let sums = &self.tallies[station].sums;
            let leads = std::array::from_fn(|lane| lead(landed[lane], sums[lane]));
            self.offers.put(station, leads);
        }
    }

    /// The least V, its own cost aside, with which a station is landed on after each frame of the
    /// block, and by which of its jumps.
    #[inline(always)]
    fn cheapest(&self, jumps: &[Origin]) -> ([u32; FRAMES], [u32; FRAMES]) {
        let mut best = [UNREACHED; FRAMES];
        let mut ranks = [0; FRAMES];
        for (rank, jump) in (0u32..).zip(jumps) {
            let from = &self.tallies[jump.from as usize + 1].values;
            for lane in 0..FRAMES {
                // Only a lane that stands for no frame may wrap.
                let least = from[lane].wrapping_add(jump.cost).min(best[lane]);
                ranks[lane] = if least == best[lane] {
                    ranks[lane]
                } else {
                    rank
                };
                best[lane] = least;
            }
        }
        (best, ranks)
    }
}
