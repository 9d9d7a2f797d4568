//! Costs of showing each station at the frames of a block, with one lane per frame
//! (docs/explanation/algorithms.md, "Planning").
//!
//! `Weights::total` defines the costs. The vector code in this file returns the same integers, faster.

use super::cost::{CEILING, Feature, Weights};
use super::landings::Pass;
#[cfg(target_arch = "x86_64")]
use super::lanes::store;
use super::viterbi::{Block, FRAMES};
use crate::cpu::Level;
use crate::flock::params::MatchBy;

impl Weights {
    /// Writes `Weights::total` for the stations from `first` on. `wanted` has the feature asked for in each
    /// lane, `features` the features of all states.
    #[inline(always)]
    pub(super) fn fill(
        &self,
        wanted: &[Feature; FRAMES],
        features: &[Feature],
        block: &Block,
        first: usize,
        out: &mut [[u32; FRAMES]],
    ) {
        let features = &features[block.states(first..first + out.len())];
        let (pairs, rest) = match block.pass {
            Pass::Forward => features.as_chunks::<2>(),
            Pass::Backward => {
                let (rest, pairs) = features.as_rchunks::<2>();
                (pairs, rest)
            }
        };
        let (of_pairs, of_rest) = out.split_at_mut(features.len() - rest.len());
        let of_pairs = of_pairs.as_chunks_mut::<2>().0.iter_mut();
        match block.pass {
            Pass::Forward => self.fill_pairs(block, wanted, pairs.iter().zip(of_pairs)),
            Pass::Backward => self.fill_pairs(block, wanted, pairs.iter().rev().zip(of_pairs)),
        }
        for (out, &state) in of_rest.iter_mut().zip(rest) {
            *out = wanted.map(|wanted| self.total(wanted, state));
        }
    }

    /// Writes the costs of pairs of consecutive states. `pairs` yields the features of two states and the
    /// places for their costs.
    #[inline(always)]
    fn fill_pairs<'a>(
        &self,
        block: &Block,
        wanted: &[Feature; FRAMES],
        pairs: impl Iterator<Item = (&'a [Feature; 2], &'a mut [[u32; FRAMES]; 2])>,
    ) {
        let [heading, rotation, speed] = [self.heading, self.rotation, self.speed].map(i64::from);
        let fits = [heading, rotation - heading, speed, self.rho_turns.into()].map(i16::try_from);
        match (block.cpu, fits) {
            #[cfg(target_arch = "x86_64")]
            (Level::Avx2 | Level::Avx512, [Ok(heading), Ok(rotation), Ok(speed), Ok(rho)])
                if self.by != MatchBy::Direction && is_x86_feature_detected!("avx2") =>
            {
                let weights = [heading, rotation, speed];
                #[expect(unsafe_code, reason = "vectors of AVX2")]
                // SAFETY: the guard of this match arm checks for AVX2.
                unsafe {
                    fill_avx2(block.pass, weights, rho, wanted, pairs);
                }
            }
            _ => {
                for (&states, out) in pairs {
                    let [first, second] = block.pass.in_station_order(states);
                    *out =
                        [first, second].map(|state| wanted.map(|wanted| self.total(wanted, state)));
                }
            }
        }
    }
}

/// AVX2 version of `total` without directions in depth, for two stations at a time. It takes three 16-bit
/// weights: that of the whole heading gap, that added for the part of the gap within `rho`, and that of the
/// speed gap.
///
/// Gaps are reduced by half of their range, so that signed 16-bit products can hold them. The reduction
/// changes the cost by a whole number of turns, which is added again.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn fill_avx2<'a>(
    pass: Pass,
    [whole, within, speed]: [i16; 3],
    rho: i16,
    wanted: &[Feature; FRAMES],
    pairs: impl Iterator<Item = (&'a [Feature; 2], &'a mut [[u32; FRAMES]; 2])>,
) {
    use std::arch::x86_64::*;
    // Copies two bytes of a station's feature, at offset 0 or 8 of the pair, to all lanes of that station.
    // If the compiler saw the constant, it would use three instructions in place of one.
    let spread = |byte: u8| {
        let both = |at: u8| _mm_set1_epi16(i16::from_le_bytes([at + byte, at + byte + 1]));
        let [first, second] = pass.in_station_order([0, 8]).map(both);
        std::hint::black_box(_mm256_setr_m128i(first, second))
    };
    let lanes = |of: &dyn Fn(Feature) -> u16| {
        let [a, b, c, d, e, f, g, h] = wanted.map(|wanted| of(wanted) as i16);
        _mm256_broadcastsi128_si256(_mm_setr_epi16(a, b, c, d, e, f, g, h))
    };
    let (turns_of, speed_of) = (spread(0), spread(2));
    let (turns, speeds) = (lanes(&|f| f.turns), lanes(&|f| f.log_speed));
    let rho = _mm256_set1_epi16(rho);
    let (half, top) = (_mm256_set1_epi16(1 << 14), _mm256_set1_epi16(i16::MIN));
    let of_gaps = _mm256_unpacklo_epi16(_mm256_set1_epi16(whole), _mm256_set1_epi16(within));
    let of_speed = _mm256_set1_epi16(speed);
    let taken_off = (i32::from(whole) << (14 - 8)) + (i32::from(speed) << (15 - 8));
    let (taken_off, ceiling) = (
        _mm256_set1_epi32(taken_off),
        _mm256_set1_epi32(CEILING as i32 - 1),
    );
    for (states, out) in pairs {
        let states = _mm256_broadcastsi128_si256(load_pair(states));
        let gap = _mm256_sub_epi16(turns, _mm256_shuffle_epi8(states, turns_of));
        let gap = _mm256_abs_epi16(gap);
        let within = _mm256_min_epu16(gap, rho);
        let gap = _mm256_sub_epi16(gap, half);
        let theirs = _mm256_shuffle_epi8(states, speed_of);
        let apart = _mm256_sub_epi16(
            _mm256_max_epu16(speeds, theirs),
            _mm256_min_epu16(speeds, theirs),
        );
        let apart = _mm256_xor_si256(apart, top);
        let total = |gaps: __m256i, apart: __m256i| {
            let of_gaps = _mm256_srai_epi32::<8>(_mm256_madd_epi16(gaps, of_gaps));
            let of_speed = _mm256_srai_epi32::<8>(_mm256_madd_epi16(apart, of_speed));
            let total = _mm256_add_epi32(_mm256_add_epi32(of_gaps, of_speed), taken_off);
            _mm256_min_epu32(total, ceiling)
        };
        // The first four frames of both stations, then the last four.
        let zero = _mm256_setzero_si256();
        let early = total(
            _mm256_unpacklo_epi16(gap, within),
            _mm256_unpacklo_epi16(apart, zero),
        );
        let late = total(
            _mm256_unpackhi_epi16(gap, within),
            _mm256_unpackhi_epi16(apart, zero),
        );
        store(&mut out[0], _mm256_permute2x128_si256::<0x20>(early, late));
        store(&mut out[1], _mm256_permute2x128_si256::<0x31>(early, late));
    }
}

/// Loads two consecutive features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
#[expect(unsafe_code, reason = "vectors of AVX2")]
fn load_pair(pair: &[Feature; 2]) -> std::arch::x86_64::__m128i {
    const { assert!(size_of::<Feature>() == 8) };
    // SAFETY: two features have the size of a vector, and the instruction needs no alignment.
    unsafe { std::arch::x86_64::_mm_loadu_si128(std::ptr::from_ref(pair).cast()) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::flock::params::Matching;
    use crate::flock::synthetic::library;
    use crate::library::View;

    fn features(n: usize) -> impl Strategy<Value = Vec<Feature>> {
        let any_turns = prop_oneof![Just(0), Just(1 << 15), any::<u16>()];
        let feature = (any_turns, any::<u16>()).prop_map(|(turns, log_speed)| Feature {
            turns,
            log_speed,
            ..Feature::default()
        });
        proptest::collection::vec(feature, n)
    }

    /// Generates weights, some of which do not fit 16 bits.
    fn weights() -> impl Strategy<Value = Weights> {
        let weight = || prop_oneof![0u32..600, Just(32_767), Just(40_000)];
        let rho = prop_oneof![Just(0), 0u16..4000, Just(32_767), Just(1 << 15)];
        let usual = Weights::new(&Matching::default(), &library(View::Side));
        let weights = [weight(), weight(), weight()];
        (weights, rho).prop_map(move |([heading, rotation, speed], rho_turns)| {
            let mut weights = usual;
            (weights.heading, weights.rotation) = (heading, rotation);
            (weights.speed, weights.rho_turns) = (speed, rho_turns);
            weights
        })
    }

    proptest! {
        #[test]
        fn filled_costs_equal_the_definition(
            all in features(41), wanted in features(FRAMES), weights in weights(),
            first in 0usize..30, n in 1usize..12,
        ) {
            let wanted: [Feature; FRAMES] = wanted.try_into().expect("as many");
            let passes = |cpu| [(cpu, Pass::Forward), (cpu, Pass::Backward)];
            for (cpu, pass) in Level::available().into_iter().flat_map(passes) {
                let block = Block { pass, cpu, n_states: all.len(), times: [0; FRAMES] };
                let mut found = vec![[0; FRAMES]; n];
                weights.fill(&wanted, &all, &block, first, &mut found);
                for (station, found) in (first..).zip(found) {
                    let state = all[block.state(station)];
                    prop_assert_eq!(found, wanted.map(|wanted| weights.total(wanted, state)));
                }
            }
        }
    }
}
