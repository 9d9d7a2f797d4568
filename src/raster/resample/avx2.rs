//! Interpolation with AVX2: the four taps of a row at a time, the same integers as the plain code of
//! `catmull_rom` (ALGORITHMS.md 8).

#![expect(unsafe_code, reason = "vector loads and stores go through pointers")]

use std::arch::x86_64::*;

use super::catmull_rom::{HALF_PLACE, PLACES, WEIGHTS, WIDE};
use super::{ONE, Premultiplied, Quad};

impl Premultiplied {
    #[target_feature(enable = "avx2")]
    pub(super) fn interpolate_avx2(&self, row: &mut [Quad], start: [i32; 2], step: [i32; 2]) {
        let [mut u, mut v] = start.map(|at| at + HALF_PLACE);
        let stride = self.stride();
        for pixel in row {
            let [from, to] = self.spans[(v >> 16) as usize];
            *pixel = if u > from && u < to {
                let (x, y) = ((u >> 16) as usize, (v >> 16) as usize);
                let first = (y - 1) * stride + x - 1;
                let down = &WEIGHTS[(v >> 8) as usize % PLACES];
                let block = &self.pixels[first..first + 3 * stride + 4];
                let tap = |k: usize| {
                    // SAFETY: k is at most 3, so the four pixels read lie within `block`.
                    let taps = unsafe { block.as_ptr().add(k * stride) };
                    // SAFETY: four pixels are 32 bytes that can be read.
                    let taps = unsafe { _mm256_loadu_si256(taps.cast()) };
                    _mm256_mulhrs_epi16(taps, _mm256_set1_epi16(down[k]))
                };
                let column = _mm256_add_epi16(
                    _mm256_add_epi16(tap(0), tap(1)),
                    _mm256_add_epi16(tap(2), tap(3)),
                );
                across(column, &WIDE[(u >> 8) as usize % PLACES])
            } else {
                [0; 4]
            };
            u += step[0];
            v += step[1];
        }
    }
}

/// The weighted sum of four taps, no more than opaque and no color without its alpha.
#[target_feature(enable = "avx2")]
fn across(column: __m256i, weights: &[i16; 16]) -> Quad {
    // SAFETY: sixteen weights are 32 bytes that can be read.
    let weights = unsafe { _mm256_loadu_si256(weights.as_ptr().cast()) };
    let weighted = _mm256_mulhrs_epi16(column, weights);
    let halves = _mm_add_epi16(
        _mm256_castsi256_si128(weighted),
        _mm256_extracti128_si256::<1>(weighted),
    );
    let sum = _mm_add_epi16(halves, _mm_unpackhi_epi64(halves, halves));
    let visible = _mm_max_epi16(sum, _mm_setzero_si128());
    let alpha = _mm_min_epi16(_mm_shufflelo_epi16::<0xff>(visible), _mm_set1_epi16(ONE));
    let mut pixel = [0; 4];
    // SAFETY: `pixel` is 8 bytes that are ours to write.
    unsafe { _mm_storel_epi64(pixel.as_mut_ptr().cast(), _mm_min_epi16(visible, alpha)) };
    pixel
}
