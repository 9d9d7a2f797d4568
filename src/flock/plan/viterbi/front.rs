//! What goes on, from station to station (ALGORITHMS.md 6): the hot loop of the recursion's first stroke.
//!
//! `Front::go_on` is the definition; the way for AVX2 is there to be fast, and gives the same.

use super::{FRAMES, UNREACHED};
#[cfg(target_arch = "x86_64")]
use crate::flock::plan::lanes::{load, store};

/// The lead that nobody offers. Sums stay below 2^31, so V fits 32 bits.
pub(super) const NO_LEAD: i32 = UNREACHED as i32;

/// A station at the frames of a block.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Tally {
    /// V of who may jump, turns; `UNREACHED` or more where no path comes.
    pub(super) values: [u32; FRAMES],
    /// Costs of all that goes on to here since the film began, turns.
    pub(super) sums: [u32; FRAMES],
}

/// Stations in a row.
pub(super) struct Stretch<'a> {
    /// As they were in the block before, and as they become.
    pub(super) tallies: &'a mut [Tally],
    /// How many stations of its run one has gone through to each; 0 for barriers.
    pub(super) gone_through: &'a [u32],
    /// Leads of those who landed `landed` frames ago, and have gone on to here.
    pub(super) offers: &'a [[i32; FRAMES]],
    /// What each costs.
    pub(super) costs: &'a [[u32; FRAMES]],
    /// In bits, where an offer is lower.
    pub(super) wins: &'a mut [u8],
}

/// V on its way from one station to the next, which it comes to a frame later: each lane's successor is
/// the next lane of the next station. On that way costs add to the sum and to V, until a landing has a lower one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Front {
    at: Tally,
    /// At the station before, in the last block.
    before: Tally,
    /// All bits of the lanes that stand for frames of the film, and of those but that in which it begins.
    in_film: [u32; FRAMES],
    goes_on: [u32; FRAMES],
    /// Frames of a block, at most `FRAMES`.
    width: usize,
    /// Frames after a landing in which none may jump.
    landed: u32,
    /// Whether every lane stands for a frame, none of them the film's first.
    is_plain: bool,
}

impl Tally {
    /// Where no path comes.
    pub(super) const NOWHERE: Tally = Tally {
        values: [UNREACHED; FRAMES],
        sums: [0; FRAMES],
    };
}

impl Front {
    /// Before the first station, to which no path goes on.
    ///
    /// `opening`: the lane in which the film begins, if it does in this block.
    pub(super) fn new(width: usize, dwell: usize, opening: Option<usize>) -> Front {
        let bits = |is_set: bool| -i32::from(is_set) as u32;
        let first = opening.unwrap_or(0);
        Front {
            at: Tally::NOWHERE,
            before: Tally::NOWHERE,
            in_film: std::array::from_fn(|lane| bits(lane >= first)),
            goes_on: std::array::from_fn(|lane| bits(Some(lane) != opening)),
            width,
            landed: dwell as u32 - 1,
            is_plain: width == FRAMES && opening.is_none(),
        }
    }

    /// Goes on over a stretch.
    pub(super) fn go_on(&mut self, stretch: Stretch<'_>) {
        let last = self.width - 1;
        let parts = stretch.offers.iter().zip(stretch.costs).zip(stretch.wins);
        let tallies = stretch.tallies.iter_mut().zip(stretch.gone_through);
        for ((tally, &gone), ((offers, costs), win)) in tallies.zip(parts) {
            let (values, sums) = (&mut self.at.values, &mut self.at.sums);
            values.rotate_right(1);
            sums.rotate_right(1);
            (values[0], sums[0]) = (self.before.values[last], self.before.sums[last]);
            *win = 0;
            for lane in 0..FRAMES {
                // Lanes that stand for no frame may wrap.
                let cost = costs[lane] & self.in_film[lane];
                sums[lane] = sums[lane].wrapping_add(cost);
                values[lane] = (values[lane] & self.goes_on[lane]).wrapping_add(cost);
                if gone > self.landed {
                    let offer = value(offers[lane], sums[lane]);
                    *win |= u8::from(offer < values[lane]) << lane;
                    values[lane] = values[lane].min(offer);
                }
            }
            if gone == 0 {
                *values = [UNREACHED; FRAMES];
            }
            self.before = std::mem::replace(tally, self.at);
        }
    }

    /// The same.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    pub(super) fn go_on_avx2<const TRACED: bool>(&mut self, stretch: Stretch<'_>) {
        match self.is_plain {
            true => self.go_on_lanes::<TRACED, true>(stretch),
            false => self.go_on_lanes::<TRACED, false>(stretch),
        }
    }

    /// The same; if not `TRACED`, it is not told where an offer is lower.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline(never)]
    fn go_on_lanes<const TRACED: bool, const PLAIN: bool>(&mut self, stretch: Stretch<'_>) {
        use std::arch::x86_64::*;
        let unreached = _mm256_set1_epi32(UNREACHED as i32);
        let last = _mm256_set1_epi32(self.width as i32 - 1);
        // The last lane of the block before, then all but the last.
        let next = |lanes: __m256i, before: __m256i| {
            let before = match PLAIN {
                true => before,
                false => _mm256_permutevar8x32_epi32(before, last),
            };
            let halves = _mm256_permute2x128_si256::<0x21>(before, lanes);
            _mm256_alignr_epi8::<12>(lanes, halves)
        };
        let (in_film, goes_on) = (load(&self.in_film), load(&self.goes_on));
        let (mut values, mut sums) = (load(&self.at.values), load(&self.at.sums));
        let mut before = [load(&self.before.values), load(&self.before.sums)];
        let parts = stretch.offers.iter().zip(stretch.costs).zip(stretch.wins);
        let tallies = stretch.tallies.iter_mut().zip(stretch.gone_through);
        for ((tally, &gone), ((offers, costs), win)) in tallies.zip(parts) {
            (values, sums) = (next(values, before[0]), next(sums, before[1]));
            before = [load(&tally.values), load(&tally.sums)];
            let mut costs = load(costs);
            if !PLAIN {
                costs = _mm256_and_si256(costs, in_film);
                values = _mm256_and_si256(values, goes_on);
            }
            sums = _mm256_add_epi32(sums, costs);
            values = _mm256_add_epi32(values, costs);
            let mut won = 0;
            if gone > self.landed {
                let least = _mm256_min_epu32(values, _mm256_add_epi32(load(offers), sums));
                if TRACED {
                    let same = _mm256_cmpeq_epi32(least, values);
                    won = !_mm256_movemask_ps(_mm256_castsi256_ps(same));
                }
                values = least;
            } else if gone == 0 {
                values = unreached;
            }
            if TRACED {
                *win = won as u8;
            }
            store(&mut tally.sums, sums);
            store(&mut tally.values, values);
        }
        store(&mut self.at.values, values);
        store(&mut self.at.sums, sums);
        store(&mut self.before.values, before[0]);
        store(&mut self.before.sums, before[1]);
    }
}

/// The lead of what costs `value` where the sum is `sum`.
#[inline(always)]
pub(super) fn lead(value: u32, sum: u32) -> i32 {
    value.wrapping_sub(sum) as i32
}

/// V of what has a lead over the sum.
#[inline(always)]
pub(super) fn value(lead: i32, sum: u32) -> u32 {
    (lead as u32).wrapping_add(sum)
}
