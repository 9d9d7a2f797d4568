//! Playing on from station to station: the inner loop of the first step of the recursion
//! (docs/explanation/algorithms.md, "Planning").
//!
//! `Front::play_on` defines the results. The AVX2 version returns the same integers, faster.

use super::{FRAMES, UNREACHED};
#[cfg(target_arch = "x86_64")]
use crate::flock::plan::lanes::{load, store};

/// Lead of a missing offer. Running sums stay below 2^31, so V fits 32 bits.
pub(super) const NO_LEAD: i32 = UNREACHED as i32;

/// Costs of one station at the frames of a block.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct StationCosts {
    /// V: least cost of paths that may jump, in turns. `UNREACHED` or more if there is no path.
    pub(super) values: [u32; FRAMES],
    /// Running sum of the costs along continuous playback to this station since the film began, in turns.
    pub(super) sums: [u32; FRAMES],
}

/// Consecutive stations with their inputs and outputs.
pub(super) struct Chunk<'a> {
    /// Input: the block before. Output: this block.
    pub(super) station_costs: &'a mut [StationCosts],
    /// Number of stations of its run up to each station, itself included; 0 for barriers.
    pub(super) run_lengths: &'a [u32],
    /// Offers as leads, by station: paths that jumped `Front::landed` frames ago, have played on to the station, and
    /// may jump again from here.
    pub(super) offers: &'a [[i32; FRAMES]],
    /// Cost of showing each station.
    pub(super) costs: &'a [[u32; FRAMES]],
    /// Output: one bit per lane, set where the offer is lower.
    pub(super) wins: &'a mut [u8],
}

/// V and running sum on their way from one station to the next.
///
/// The next station is reached one frame later, so the successor of each lane is the next lane of the next
/// station. The cost of each station is added to the sum and to V. Where an offer is lower than V, it
/// replaces V.
#[derive(Clone, Copy, Debug)]
pub(super) struct Front {
    at: StationCosts,
    /// Costs of the station before, in the last block.
    before: StationCosts,
    /// All bits set in lanes that hold frames of the film.
    in_film: [u32; FRAMES],
    /// All bits set in lanes other than that of the film's first frame.
    goes_on: [u32; FRAMES],
    /// Number of frames in a block, at most `FRAMES`.
    width: usize,
    /// Number of frames after a landing in which no jump is allowed.
    landed: u32,
    /// Whether every lane holds a frame and none holds the film's first frame.
    is_plain: bool,
}

impl StationCosts {
    /// Costs of a station that no path reaches.
    pub(super) const UNREACHABLE: StationCosts = StationCosts {
        values: [UNREACHED; FRAMES],
        sums: [0; FRAMES],
    };
}

impl Front {
    /// Returns the front before the first station, which no path reaches by playing on.
    ///
    /// `opening` is the lane of the film's first frame, if that frame is in this block.
    pub(super) fn new(width: usize, dwell: usize, opening: Option<usize>) -> Front {
        let bits = |is_set: bool| -i32::from(is_set) as u32;
        let first = opening.unwrap_or(0);
        Front {
            at: StationCosts::UNREACHABLE,
            before: StationCosts::UNREACHABLE,
            in_film: std::array::from_fn(|lane| bits(lane >= first)),
            goes_on: std::array::from_fn(|lane| bits(Some(lane) != opening)),
            width,
            landed: dwell as u32 - 1,
            is_plain: width == FRAMES && opening.is_none(),
        }
    }

    /// Processes a range of stations.
    pub(super) fn play_on(&mut self, chunk: Chunk<'_>) {
        let last = self.width - 1;
        let parts = chunk.offers.iter().zip(chunk.costs).zip(chunk.wins);
        let station_costs = chunk.station_costs.iter_mut().zip(chunk.run_lengths);
        for ((costs_here, &run_length), ((offers, costs), win)) in station_costs.zip(parts) {
            let (values, sums) = (&mut self.at.values, &mut self.at.sums);
            values.rotate_right(1);
            sums.rotate_right(1);
            (values[0], sums[0]) = (self.before.values[last], self.before.sums[last]);
            *win = 0;
            for lane in 0..FRAMES {
                // Unused lanes may wrap.
                let cost = costs[lane] & self.in_film[lane];
                sums[lane] = sums[lane].wrapping_add(cost);
                values[lane] = (values[lane] & self.goes_on[lane]).wrapping_add(cost);
                if run_length > self.landed {
                    let offer = value(offers[lane], sums[lane]);
                    *win |= u8::from(offer < values[lane]) << lane;
                    values[lane] = values[lane].min(offer);
                }
            }
            if run_length == 0 {
                *values = [UNREACHED; FRAMES];
            }
            self.before = std::mem::replace(costs_here, self.at);
        }
    }

    /// AVX2 version of `play_on`.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    pub(super) fn play_on_avx2<const TRACED: bool>(&mut self, chunk: Chunk<'_>) {
        if self.is_plain {
            self.play_on_lanes::<TRACED, true>(chunk);
        } else {
            self.play_on_lanes::<TRACED, false>(chunk);
        }
    }

    /// AVX2 version of `play_on`. Without `TRACED` the output `wins` is not written.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline(never)]
    fn play_on_lanes<const TRACED: bool, const PLAIN: bool>(&mut self, chunk: Chunk<'_>) {
        use std::arch::x86_64::*;
        let unreached = _mm256_set1_epi32(UNREACHED as i32);
        let last = _mm256_set1_epi32(self.width as i32 - 1);
        // Shifts the lanes by one. The first lane comes from the last lane of the block before.
        let next = |lanes: __m256i, before: __m256i| {
            let before = if PLAIN {
                before
            } else {
                _mm256_permutevar8x32_epi32(before, last)
            };
            let halves = _mm256_permute2x128_si256::<0x21>(before, lanes);
            _mm256_alignr_epi8::<12>(lanes, halves)
        };
        let (in_film, goes_on) = (load(&self.in_film), load(&self.goes_on));
        let (mut values, mut sums) = (load(&self.at.values), load(&self.at.sums));
        let mut before = [load(&self.before.values), load(&self.before.sums)];
        let parts = chunk.offers.iter().zip(chunk.costs).zip(chunk.wins);
        let station_costs = chunk.station_costs.iter_mut().zip(chunk.run_lengths);
        for ((costs_here, &run_length), ((offers, costs), win)) in station_costs.zip(parts) {
            (values, sums) = (next(values, before[0]), next(sums, before[1]));
            before = [load(&costs_here.values), load(&costs_here.sums)];
            let mut costs = load(costs);
            if !PLAIN {
                costs = _mm256_and_si256(costs, in_film);
                values = _mm256_and_si256(values, goes_on);
            }
            sums = _mm256_add_epi32(sums, costs);
            values = _mm256_add_epi32(values, costs);
            let mut won = 0;
            if run_length > self.landed {
                let least = _mm256_min_epu32(values, _mm256_add_epi32(load(offers), sums));
                if TRACED {
                    let same = _mm256_cmpeq_epi32(least, values);
                    won = !_mm256_movemask_ps(_mm256_castsi256_ps(same));
                }
                values = least;
            } else if run_length == 0 {
                values = unreached;
            }
            if TRACED {
                *win = won as u8;
            }
            store(&mut costs_here.sums, sums);
            store(&mut costs_here.values, values);
        }
        store(&mut self.at.values, values);
        store(&mut self.at.sums, sums);
        store(&mut self.before.values, before[0]);
        store(&mut self.before.sums, before[1]);
    }
}

/// Returns the lead of a cost `value` over the running sum `sum`.
#[inline(always)]
pub(super) fn lead(value: u32, sum: u32) -> i32 {
    value.wrapping_sub(sum) as i32
}

/// Returns V from a lead and the running sum.
#[inline(always)]
pub(super) fn value(lead: i32, sum: u32) -> u32 {
    (lead as u32).wrapping_add(sum)
}
