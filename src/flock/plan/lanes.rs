//! Eight numbers and a vector of them.
#![expect(unsafe_code, reason = "vectors of AVX2")]

use std::arch::x86_64::*;

use super::viterbi::FRAMES;

/// Numbers of 32 bits.
pub(super) trait Number {}

impl Number for u32 {}
impl Number for i32 {}

#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn load<T: Number>(lanes: &[T; FRAMES]) -> __m256i {
    // SAFETY: eight numbers are as long as a vector, which may lie anywhere.
    unsafe { _mm256_loadu_si256(std::ptr::from_ref(lanes).cast()) }
}

#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store<T: Number>(lanes: &mut [T; FRAMES], vector: __m256i) {
    // SAFETY: eight numbers are as long as a vector, which may lie anywhere.
    unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), vector) };
}

#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store_half(lanes: &mut [u16; FRAMES], vector: __m128i) {
    // SAFETY: eight numbers are as long as half a vector, which may lie anywhere.
    unsafe { _mm_storeu_si128(lanes.as_mut_ptr().cast(), vector) };
}
