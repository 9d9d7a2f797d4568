//! The cheapest jump to each state of a group: the hot loop of the recursion (ALGORITHMS.md 6). A vector
//! holds several individuals, or, of an individual alone, its landings on several states.
//!
//! `lanes` is the definition; the way for one individual on AVX2 is there to be fast, and gives the same.

use super::UNREACHED;
use crate::flock::plan::landings::{GROUP, Jumps};

/// The least V, its own cost aside, with which each of a group of states is landed on, and by which of
/// its jumps; `RANKED`, or the latter is left as it was.
///
/// # Safety
///
/// All sources of the jumps lie below `values.len()`.
#[inline(always)]
#[expect(unsafe_code, reason = "to look at its bounds takes longer than a jump")]
pub(super) unsafe fn lanes<const LANES: usize, const RANKED: bool>(
    jumps: &[Jumps],
    values: &[[u32; LANES]],
    ranks: &mut [[u16; LANES]; GROUP],
) -> [[u32; LANES]; GROUP] {
    let mut landed = [[UNREACHED; LANES]; GROUP];
    for (k, (landed, ranks)) in landed.iter_mut().zip(ranks).enumerate() {
        let mut best = [UNREACHED; LANES];
        let mut best_rank = [0u32; LANES];
        for (rank, jumps) in (0u32..).zip(jumps) {
            // SAFETY: the caller owes that all sources lie below `values.len()`.
            let from = unsafe { values.get_unchecked(jumps.sources[k] as usize) };
            for lane in 0..LANES {
                let through = from[lane] + jumps.costs[k];
                let better = through < best[lane];
                best[lane] = if better { through } else { best[lane] };
                best_rank[lane] = if better { rank } else { best_rank[lane] };
            }
        }
        *landed = best;
        if RANKED {
            *ranks = best_rank.map(|rank| rank as u16);
        }
    }
    landed
}

/// The same of one individual.
///
/// # Safety
///
/// All sources of the jumps lie below `values.len()`.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[expect(unsafe_code, reason = "vectors of AVX2")]
pub(super) unsafe fn alone_avx2(
    jumps: &[Jumps],
    values: &[u32],
    ranks: &mut [u16; GROUP],
) -> [u32; GROUP] {
    use std::arch::x86_64::*;
    let mut best = _mm256_set1_epi32(UNREACHED as i32);
    let mut best_rank = _mm256_setzero_si256();
    for (rank, jumps) in (0..).zip(jumps) {
        // SAFETY: the caller owes that all sources lie below `values.len()`.
        let value = |k: usize| unsafe { *values.get_unchecked(jumps.sources[k] as usize) as i32 };
        let [a, b, c, d, e, f, g, h] = std::array::from_fn(value);
        // Faster than the instruction that gathers.
        let from = _mm256_setr_epi32(a, b, c, d, e, f, g, h);
        // SAFETY: there are eight costs.
        let cost = unsafe { _mm256_loadu_si256(jumps.costs.as_ptr().cast()) };
        let least = _mm256_min_epu32(best, _mm256_add_epi32(from, cost));
        let stays = _mm256_cmpeq_epi32(least, best);
        best_rank = _mm256_blendv_epi8(_mm256_set1_epi32(rank), best_rank, stays);
        best = least;
    }
    let mut landed = [0; GROUP];
    let halves = [
        _mm256_castsi256_si128(best_rank),
        _mm256_extracti128_si256::<1>(best_rank),
    ];
    // SAFETY: both places are of eight numbers.
    unsafe {
        _mm256_storeu_si256(landed.as_mut_ptr().cast(), best);
        _mm_storeu_si128(
            ranks.as_mut_ptr().cast(),
            _mm_packus_epi32(halves[0], halves[1]),
        );
    }
    landed
}
