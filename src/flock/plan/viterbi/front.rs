//! What goes on, from station to station (ALGORITHMS.md 6): the hot loop of the recursion's first stroke.
//!
//! `Front::go_on` is the definition; the way for AVX2 is there to be fast, and gives the same.

use super::{FRAMES, UNREACHED};

/// The lead of a station that no path leads to. Sums stay below 2^31, so V fits 32 bits.
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
/// the next lane of the next station. On that way costs add to the sum, and V, the sum of both parts, keeps
/// its lead over it until a landing has a lower one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Front {
    leads: [i32; FRAMES],
    sums: [u32; FRAMES],
    /// Lead and sum at the end of the block before.
    before: (i32, u32),
    /// All bits of the lanes that stand for frames of the film, and of that in which it begins.
    in_film: [u32; FRAMES],
    begins: [i32; FRAMES],
    /// Frames of a block, at most `FRAMES`.
    width: usize,
    /// Frames after a landing in which none may jump.
    landed: usize,
}

impl Tally {
    /// Where no path comes.
    pub(super) const NOWHERE: Tally = Tally {
        values: [UNREACHED; FRAMES],
        sums: [0; FRAMES],
    };

    fn parts(&self, lane: usize) -> (i32, u32) {
        (lead(self.values[lane], self.sums[lane]), self.sums[lane])
    }
}

impl Front {
    /// Before the first station, to which no path goes on.
    ///
    /// `opening`: the lane in which the film begins, if it does in this block.
    pub(super) fn new(width: usize, dwell: usize, opening: Option<usize>) -> Front {
        let bits = |is_set: bool| -i32::from(is_set);
        let first = opening.unwrap_or(0);
        Front {
            in_film: std::array::from_fn(|lane| bits(lane >= first) as u32),
            begins: std::array::from_fn(|lane| bits(Some(lane) == opening)),
            leads: [NO_LEAD; FRAMES],
            sums: [0; FRAMES],
            before: (NO_LEAD, 0),
            width,
            landed: dwell - 1,
        }
    }

    /// Goes on over a stretch.
    pub(super) fn go_on(&mut self, stretch: Stretch<'_>) {
        let parts = stretch.offers.iter().zip(stretch.costs).zip(stretch.wins);
        let tallies = stretch.tallies.iter_mut().zip(stretch.gone_through);
        for ((tally, &gone), ((offers, costs), win)) in tallies.zip(parts) {
            self.leads.rotate_right(1);
            self.sums.rotate_right(1);
            (self.leads[0], self.sums[0]) = self.before;
            self.before = tally.parts(self.width - 1);
            *win = 0;
            for lane in 0..FRAMES {
                // Lanes past the block's width stand for no frame, and may wrap.
                self.sums[lane] = self.sums[lane].wrapping_add(costs[lane] & self.in_film[lane]);
                self.leads[lane] &= !self.begins[lane];
                if gone as usize > self.landed {
                    *win |= u8::from(offers[lane] < self.leads[lane]) << lane;
                    self.leads[lane] = self.leads[lane].min(offers[lane]);
                }
            }
            if gone == 0 {
                self.leads = [NO_LEAD; FRAMES];
            }
            tally.sums = self.sums;
            for lane in 0..FRAMES {
                tally.values[lane] = (self.leads[lane] as u32).wrapping_add(self.sums[lane]);
            }
        }
    }

    /// The same.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline(never)]
    pub(super) fn go_on_avx2(&mut self, stretch: Stretch<'_>) {
        use std::arch::x86_64::*;
        let no_lead = _mm256_set1_epi32(NO_LEAD);
        let onward = _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6);
        let next = |lanes: __m256i, first: i32| {
            let first = _mm256_castsi128_si256(_mm_cvtsi32_si128(first));
            _mm256_blend_epi32::<1>(_mm256_permutevar8x32_epi32(lanes, onward), first)
        };
        let (mut leads, mut sums) = (load(&self.leads), load_costs(&self.sums));
        let (in_film, begins) = (load_costs(&self.in_film), load(&self.begins));
        let (mut before, last) = (self.before, self.width - 1);
        let landed = self.landed as u32;
        let parts = stretch.offers.iter().zip(stretch.costs).zip(stretch.wins);
        let tallies = stretch.tallies.iter_mut().zip(stretch.gone_through);
        for ((tally, &gone), ((offers, costs), win)) in tallies.zip(parts) {
            leads = _mm256_andnot_si256(begins, next(leads, before.0));
            let costs = _mm256_and_si256(load_costs(costs), in_film);
            sums = _mm256_add_epi32(next(sums, before.1 as i32), costs);
            before = tally.parts(last);
            let offers = match gone > landed {
                true => load(offers),
                false => no_lead,
            };
            let won = _mm256_cmpgt_epi32(leads, offers);
            *win = _mm256_movemask_ps(_mm256_castsi256_ps(won)) as u8;
            leads = _mm256_min_epi32(leads, offers);
            if gone == 0 {
                leads = no_lead;
            }
            tally.sums = stored(sums);
            tally.values = stored(_mm256_add_epi32(leads, sums));
        }
        self.before = before;
        self.leads = stored(leads).map(|lead| lead as i32);
        self.sums = stored(sums);
    }
}

/// The lead of what costs `value` where the sum is `sum`.
#[inline(always)]
pub(super) fn lead(value: u32, sum: u32) -> i32 {
    value.wrapping_sub(sum) as i32
}

#[cfg(target_arch = "x86_64")]
use self::avx2::{load, load_costs, stored};

/// Eight numbers and a vector of them.
#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "vectors of AVX2")]
mod avx2 {
    use std::arch::x86_64::*;

    use super::FRAMES;

    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) fn load(lanes: &[i32; FRAMES]) -> __m256i {
        // SAFETY: eight numbers are as long as a vector, which may lie anywhere.
        unsafe { _mm256_loadu_si256(std::ptr::from_ref(lanes).cast()) }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) fn load_costs(lanes: &[u32; FRAMES]) -> __m256i {
        // SAFETY: eight numbers are as long as a vector, which may lie anywhere.
        unsafe { _mm256_loadu_si256(std::ptr::from_ref(lanes).cast()) }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) fn stored(vector: __m256i) -> [u32; FRAMES] {
        let mut lanes = [0; FRAMES];
        // SAFETY: eight numbers are as long as a vector, which may lie anywhere.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), vector) };
        lanes
    }
}
