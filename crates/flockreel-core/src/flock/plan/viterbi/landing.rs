//! The cheapest jump to each station: the inner loop of the second step of the recursion
//! (docs/explanation/algorithms.md, "Planning").

use super::front::{StationCosts, lead};
use super::offers::OffersOfBlock;
use super::{FRAMES, UNREACHED};
use crate::flock::plan::landings::Origin;
#[cfg(target_arch = "x86_64")]
use crate::flock::plan::lanes::{load, store, store_half};

/// Inputs and outputs of the landings of a block.
pub(super) struct Landing<'a> {
    /// Costs by station plus one.
    pub(super) station_costs: &'a [StationCosts],
    pub(super) offers: OffersOfBlock<'a>,
    /// Output: index of the cheapest jump, landing station after landing station.
    pub(super) ranks: std::slice::IterMut<'a, [u16; FRAMES]>,
}

impl Landing<'_> {
    /// Computes the landings at some stations, given the jumps to each. Without `RANKED` the index of the
    /// cheapest jump is not stored.
    #[inline(always)]
    pub(super) fn process<const AVX2: bool, const RANKED: bool>(
        &mut self,
        stations: &[u32],
        jumps: impl IntoIterator<Item = impl AsRef<[Origin]>>,
    ) {
        #[cfg(target_arch = "x86_64")]
        if AVX2 {
            #[expect(unsafe_code, reason = "the same, for AVX2")]
            // SAFETY: callers set `AVX2` only after checking for it.
            unsafe {
                self.process_avx2::<RANKED>(stations, jumps);
            }
            return;
        }
        self.process_portable::<RANKED>(stations, jumps);
    }

    /// Portable version of `process`, which defines its results.
    fn process_portable<const RANKED: bool>(
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
            // This entry belongs to the station before, from which playing on leads here.
            let sums = &self.station_costs[station].sums;
            let leads = std::array::from_fn(|lane| lead(landed[lane], sums[lane]));
            self.offers.store(station, leads);
        }
    }

    /// Returns the least V of a landing at a station after each frame of the block, and the index of the
    /// cheapest jump. The cost of showing the station is not included.
    #[inline(always)]
    fn cheapest(&self, jumps: &[Origin]) -> ([u32; FRAMES], [u32; FRAMES]) {
        let mut best = [UNREACHED; FRAMES];
        let mut ranks = [0; FRAMES];
        for (rank, jump) in (0u32..).zip(jumps) {
            let from = &self.station_costs[jump.from as usize + 1].values;
            for lane in 0..FRAMES {
                // Only unused lanes may wrap.
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

    /// AVX2 version of `process_portable`.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline(never)]
    fn process_avx2<const RANKED: bool>(
        &mut self,
        stations: &[u32],
        jumps: impl IntoIterator<Item = impl AsRef<[Origin]>>,
    ) {
        use std::arch::x86_64::*;
        let all = |number: u32| _mm256_set1_epi32(number as i32);
        for (&station, jumps) in stations.iter().zip(jumps) {
            let (mut best, mut ranks) = (all(UNREACHED), _mm256_setzero_si256());
            for (rank, jump) in (0u32..).zip(jumps.as_ref()) {
                let values = load(&self.station_costs[jump.from as usize + 1].values);
                let least = _mm256_min_epu32(_mm256_add_epi32(values, all(jump.cost)), best);
                if RANKED && rank > 0 {
                    let same = _mm256_cmpeq_epi32(least, best);
                    ranks = _mm256_blendv_epi8(all(rank), ranks, same);
                }
                best = least;
            }
            if RANKED && let Some(out) = self.ranks.next() {
                let packed = _mm256_packus_epi32(ranks, ranks);
                let packed = _mm256_permute4x64_epi64::<0b1000>(packed);
                store_half(out, _mm256_castsi256_si128(packed));
            }
            let sums = load(&self.station_costs[station as usize].sums);
            let mut leads = [0; FRAMES];
            store(&mut leads, _mm256_sub_epi32(best, sums));
            self.offers.store(station as usize, leads);
        }
    }
}
