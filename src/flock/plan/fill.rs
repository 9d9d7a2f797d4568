//! What showing each station costs at the frames of a block, all of which want something (ALGORITHMS.md 6):
//! a lane for each frame.
//!
//! `Weights::total` is the definition; the ways here are there to be fast, and give the same.

use super::cost::{CEILING, Feature, Weights};
use super::landings::Way;
use super::viterbi::{Block, FRAMES};
use crate::cpu::Level;
use crate::flock::params::MatchBy;

impl Weights {
    /// Fills in the `total` of the stations from `first` on, given the features of all states.
    #[inline(always)]
    pub(super) fn fill(
        &self,
        wanted: &[Feature; FRAMES],
        features: &[Feature],
        (block, first): (&Block, usize),
        out: &mut [[u32; FRAMES]],
    ) {
        let features = &features[block.states(first..first + out.len())];
        match block.way {
            Way::Ahead => self.fill_on(block.cpu, wanted, features.iter(), out),
            Way::Back => self.fill_on(block.cpu, wanted, features.iter().rev(), out),
        }
    }

    #[inline(always)]
    fn fill_on<'a>(
        &self,
        cpu: Level,
        wanted: &[Feature; FRAMES],
        features: impl Iterator<Item = &'a Feature>,
        out: &mut [[u32; FRAMES]],
    ) {
        match cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512
                if self.by != MatchBy::Direction && is_x86_feature_detected!("avx2") =>
            {
                #[expect(unsafe_code, reason = "vectors of AVX2")]
                // SAFETY: the line above made sure of AVX2.
                unsafe {
                    self.fill_avx2(wanted, features, out);
                }
            }
            _ => {
                for (out, &state) in out.iter_mut().zip(features) {
                    *out = wanted.map(|wanted| self.total(wanted, state));
                }
            }
        }
    }

    /// The same where no depth counts. Turns are shifted up, so that they wrap as they should.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline]
    fn fill_avx2<'a>(
        &self,
        wanted: &[Feature; FRAMES],
        features: impl Iterator<Item = &'a Feature>,
        out: &mut [[u32; FRAMES]],
    ) {
        use std::arch::x86_64::*;
        let lanes = |of: &dyn Fn(Feature) -> i32| {
            let [a, b, c, d, e, f, g, h] = wanted.map(of);
            _mm256_setr_epi32(a, b, c, d, e, f, g, h)
        };
        let all = |number: u32| _mm256_set1_epi32(number as i32);
        let turns = lanes(&|wanted| i32::from(wanted.turns) << 16);
        let log_speeds = lanes(&|wanted| i32::from(wanted.log_speed));
        let (rho, ceiling) = (all(u32::from(self.rho_turns)), all(CEILING - 1));
        let (heading, speed) = (all(self.heading), all(self.speed));
        // heading * beyond + rotation * within, where beyond is the gap less what is within.
        let rotation = all(self.rotation.wrapping_sub(self.heading));
        for (out, state) in out.iter_mut().zip(features) {
            let state = all(u32::from(state.turns) | u32::from(state.log_speed) << 16);
            let gap = _mm256_abs_epi32(_mm256_sub_epi32(turns, _mm256_slli_epi32::<16>(state)));
            let gap = _mm256_srli_epi32::<16>(gap);
            let within = _mm256_min_epu32(gap, rho);
            let of_heading = _mm256_add_epi32(
                _mm256_mullo_epi32(gap, heading),
                _mm256_mullo_epi32(within, rotation),
            );
            let speeds = _mm256_sub_epi32(log_speeds, _mm256_srli_epi32::<16>(state));
            let of_speed = _mm256_mullo_epi32(_mm256_abs_epi32(speeds), speed);
            let total = _mm256_add_epi32(
                _mm256_srli_epi32::<8>(of_heading),
                _mm256_srli_epi32::<8>(of_speed),
            );
            let total = _mm256_min_epu32(total, ceiling);
            #[expect(unsafe_code, reason = "vectors of AVX2")]
            // SAFETY: eight numbers are as long as a vector, which may lie anywhere.
            unsafe {
                _mm256_storeu_si256(std::ptr::from_mut(out).cast(), total);
            }
        }
    }
}
