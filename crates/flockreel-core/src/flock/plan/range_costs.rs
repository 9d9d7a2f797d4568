//! Crowd costs that are added to states at the frames of a block
//! (docs/explanation/algorithms.md, "Planning").
//!
//! Each cost is added to a range of consecutive states. Only its beginning and end are recorded, as
//! differences; the costs are summed while the stations are processed. When a neighbor plays on, its range
//! moves by one state per frame.

use super::cost::CEILING;
use super::landings::Pass;
#[cfg(target_arch = "x86_64")]
use super::lanes::{load, store};
use super::viterbi::{Block, FRAMES};
#[cfg(target_arch = "x86_64")]
use crate::cpu::Level;

/// Costs added to each state of a trellis at the frames of one block.
#[derive(Clone)]
pub(super) struct RangeCosts {
    /// By state, and one past the last: difference between the costs added to this state and to the state
    /// before. One value per frame of the block, in order of time, modulo 2^32.
    differences: Vec<[u32; FRAMES]>,
    /// Cost added to the station processed last.
    running: [u32; FRAMES],
    /// Whether any cost was added.
    is_any: bool,
}

impl RangeCosts {
    /// Returns an empty set of costs.
    pub(super) fn new(n_states: usize) -> RangeCosts {
        RangeCosts {
            differences: vec![[0; FRAMES]; n_states + 1],
            running: [0; FRAMES],
            is_any: false,
        }
    }

    /// Removes all costs, after all stations were processed.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        // `apply` resets the entries that it processes. One of these two is not among them, depending on the
        // direction.
        let n_states = self.differences.len() - 1;
        self.differences[0] = [0; FRAMES];
        self.differences[n_states] = [0; FRAMES];
        self.running = [0; FRAMES];
        self.is_any = false;
    }

    /// Adds `costs[k]` at moment `first + k` to a range of states, given as first and one past the last.
    /// The range moves on by one state per moment.
    #[inline(always)]
    pub(super) fn add(&mut self, [low, high]: [u32; 2], first: usize, costs: &[u32]) {
        self.is_any = true;
        let n = costs.len();
        for (at, sign) in [(low as usize, 1), (high as usize, u32::MAX)] {
            let differences = &mut self.differences[at..at + n];
            for ((differences, &cost), moment) in differences.iter_mut().zip(costs).zip(first..) {
                differences[moment] = differences[moment].wrapping_add(cost.wrapping_mul(sign));
            }
        }
    }

    /// Adds the costs to `out` for the stations from `first` on, and resets the entries that it processes.
    #[inline(always)]
    pub(super) fn apply(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        if !self.is_any {
            return;
        }
        let states = block.states(first..first + out.len());
        match block.pass {
            Pass::Forward => {
                let differences = self.differences[states].iter_mut();
                apply_sums::<false>(block, &mut self.running, differences, out);
            }
            Pass::Backward => {
                let differences = self.differences[states.start + 1..states.end + 1].iter_mut();
                apply_sums::<true>(block, &mut self.running, differences.rev(), out);
            }
        }
    }
}

/// Adds the running sums to `out`. Backward in time the sum of a state is that of the next state minus the
/// difference there, and lanes run against time.
#[inline(always)]
fn apply_sums<'a, const BACKWARD: bool>(
    block: &Block,
    running: &mut [u32; FRAMES],
    differences: impl Iterator<Item = &'a mut [u32; FRAMES]>,
    out: &mut [[u32; FRAMES]],
) {
    match block.cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
            #[expect(unsafe_code, reason = "vectors of AVX2")]
            // SAFETY: the guard of this match arm checks for AVX2.
            unsafe {
                apply_avx2::<BACKWARD>(running, differences, out);
            }
        }
        _ => {
            for (differences, out) in differences.zip(out) {
                for (moment, differences) in differences.iter_mut().enumerate() {
                    let differences = std::mem::take(differences);
                    running[moment] = if BACKWARD {
                        running[moment].wrapping_sub(differences)
                    } else {
                        running[moment].wrapping_add(differences)
                    };
                    let lane = if BACKWARD {
                        FRAMES - 1 - moment
                    } else {
                        moment
                    };
                    out[lane] = out[lane].wrapping_add(running[moment]).min(CEILING - 1);
                }
            }
        }
    }
}

/// AVX2 version of the portable code in `apply_sums`.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn apply_avx2<'a, const BACKWARD: bool>(
    running: &mut [u32; FRAMES],
    differences: impl Iterator<Item = &'a mut [u32; FRAMES]>,
    out: &mut [[u32; FRAMES]],
) {
    use std::arch::x86_64::*;
    let against = _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0);
    let ceiling = _mm256_set1_epi32(CEILING as i32 - 1);
    let mut sums = load(running);
    for (differences, out) in differences.zip(out) {
        let lanes = if BACKWARD {
            sums = _mm256_sub_epi32(sums, load(differences));
            _mm256_permutevar8x32_epi32(sums, against)
        } else {
            sums = _mm256_add_epi32(sums, load(differences));
            sums
        };
        store(differences, _mm256_setzero_si256());
        let total = _mm256_add_epi32(load(out), lanes);
        store(out, _mm256_min_epu32(total, ceiling));
    }
    store(running, sums);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const N_STATES: usize = 60;

    proptest! {
        #[test]
        fn costs_of_a_block_are_added_once(
            rows in proptest::collection::vec((0u32..40, 0u32..12, 0..FRAMES, 1..=FRAMES, 1u32..900), 0..20),
            chunk in 1usize..70,
        ) {
            let passes = |cpu| [(cpu, Pass::Forward), (cpu, Pass::Backward)];
            for (cpu, pass) in Level::available().into_iter().flat_map(passes) {
                let block = Block { pass, cpu, n_states: N_STATES, times: [0; FRAMES] };
                let mut added = RangeCosts::new(N_STATES);
                let mut expected = [[7; FRAMES]; N_STATES];
                for &(low, n_states, first, n, cost) in &rows {
                    let n = n.min(FRAMES - first);
                    added.add([low, low + n_states], first, &vec![cost; n]);
                    for k in 0..n {
                        let lane = if pass == Pass::Backward { FRAMES - 1 - first - k } else { first + k };
                        for state in low as usize + k..(low + n_states) as usize + k {
                            expected[pass.station(N_STATES, state)][lane] += cost;
                        }
                    }
                }
                let apply = |added: &mut RangeCosts| {
                    let mut found = vec![[7; FRAMES]; N_STATES];
                    for (first, out) in (0..).step_by(chunk).zip(found.chunks_mut(chunk)) {
                        added.apply(&block, first, out);
                    }
                    added.clear();
                    found
                };
                prop_assert_eq!(apply(&mut added), expected);
                added.add([0, 0], 0, &[1]);
                prop_assert_eq!(apply(&mut added), [[7; FRAMES]; N_STATES]);
            }
        }
    }
}
