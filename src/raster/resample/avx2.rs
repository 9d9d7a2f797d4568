//! Interpolation with AVX2: the four taps of a row at a time, the same integers as the plain code of
//! `catmull_rom` (ALGORITHMS.md 8).

#![expect(unsafe_code, reason = "vector loads and stores go through pointers")]

use std::arch::x86_64::*;

use super::catmull_rom::{HALF_PLACE, PLACES, TWICE, WIDE};
use super::{ONE, Premultiplied, Quad};

impl Premultiplied {
    #[target_feature(enable = "avx2")]
    pub(super) fn interpolate_avx2(&self, row: &mut [Quad], start: [i32; 2], step: [i32; 2]) {
        let mut at = start.map(|at| at + HALF_PLACE);
        let mut next = || {
            let taps = self.weighted(at);
            at = [at[0] + step[0], at[1] + step[1]];
            taps
        };
        let (fours, rest) = row.as_chunks_mut::<4>();
        for four in fours {
            let taps = [next(), next(), next(), next()];
            store(four, summed(taps));
        }
        let mut taps = [_mm256_setzero_si256(); 4];
        for taps in &mut taps[..rest.len()] {
            *taps = next();
        }
        let mut four = [[0; 4]; 4];
        store(&mut four, summed(taps));
        rest.copy_from_slice(&four[..rest.len()]);
    }

    /// Four taps, of each the column weighted and summed, and its weight across.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn weighted(&self, [u, v]: [i32; 2]) -> __m256i {
        let (x, y, stride) = ((u >> 16) as usize, (v >> 16) as usize, self.stride());
        let first = (y - 1) * stride + x - 1;
        let block = &self.pixels[first..first + 3 * stride + 4];
        let down = &TWICE[(v >> 8) as usize % PLACES];
        let tap = |k: usize| {
            // SAFETY: k is at most 3, so the four pixels read lie within `block`.
            let taps = unsafe { block.as_ptr().add(k * stride) };
            // SAFETY: four pixels are 32 bytes that can be read.
            let taps = unsafe { _mm256_loadu_si256(taps.cast()) };
            _mm256_mulhrs_epi16(taps, _mm256_set1_epi32(down[k]))
        };
        let column = _mm256_add_epi16(
            _mm256_add_epi16(tap(0), tap(1)),
            _mm256_add_epi16(tap(2), tap(3)),
        );
        // SAFETY: sixteen weights are 32 bytes that can be read.
        let across =
            unsafe { _mm256_loadu_si256(WIDE[(u >> 8) as usize % PLACES].as_ptr().cast()) };
        _mm256_mulhrs_epi16(column, across)
    }
}

/// The sums of four pixels' taps, none more than opaque and no color without its alpha.
#[inline]
#[target_feature(enable = "avx2")]
fn summed([a, b, c, d]: [__m256i; 4]) -> __m256i {
    // The first two taps of each pixel in the lower half, the last two in the upper.
    let ab = _mm256_add_epi16(_mm256_unpacklo_epi64(a, b), _mm256_unpackhi_epi64(a, b));
    let cd = _mm256_add_epi16(_mm256_unpacklo_epi64(c, d), _mm256_unpackhi_epi64(c, d));
    let sum = _mm256_add_epi16(
        _mm256_permute2x128_si256::<0x20>(ab, cd),
        _mm256_permute2x128_si256::<0x31>(ab, cd),
    );
    let visible = _mm256_max_epi16(sum, _mm256_setzero_si256());
    let alpha = _mm256_shufflehi_epi16::<0xff>(_mm256_shufflelo_epi16::<0xff>(visible));
    _mm256_min_epi16(visible, _mm256_min_epi16(alpha, _mm256_set1_epi16(ONE)))
}

#[inline]
#[target_feature(enable = "avx2")]
fn store(pixels: &mut [Quad; 4], values: __m256i) {
    // SAFETY: `pixels` is 32 bytes that are ours to write.
    unsafe { _mm256_storeu_si256(pixels.as_mut_ptr().cast(), values) };
}
