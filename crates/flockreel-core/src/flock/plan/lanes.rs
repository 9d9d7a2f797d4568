//! Vectors of eight 32-bit integers (AVX2).
#![expect(unsafe_code, reason = "vectors of AVX2")]

use std::arch::x86_64::*;

use super::viterbi::FRAMES;

/// Integers of 32 bits.
pub(super) trait Number {}

impl Number for u32 {}
impl Number for i32 {}

#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn load<T: Number>(lanes: &[T; FRAMES]) -> __m256i {
    // SAFETY: the array has the size of a vector, and the instruction needs no alignment.
    unsafe { _mm256_loadu_si256(std::ptr::from_ref(lanes).cast()) }
}

#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store<T: Number>(lanes: &mut [T; FRAMES], vector: __m256i) {
    // SAFETY: the array has the size of a vector, and the instruction needs no alignment.
    unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), vector) };
}

#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store_half(lanes: &mut [u16; FRAMES], vector: __m128i) {
    // SAFETY: the array has the size of half a vector, and the instruction needs no alignment.
    unsafe { _mm_storeu_si128(lanes.as_mut_ptr().cast(), vector) };
}
