//! Interpolation with AVX2: the four taps of a row at a time, the same integers as the plain code of
//! `catmull_rom` (ALGORITHMS.md 8).

#![expect(unsafe_code, reason = "vector loads and stores go through pointers")]

use std::arch::x86_64::*;

use super::catmull_rom::{HALF_PLACE, PLACES, TWICE, WIDE};
use super::map::Map;
use super::{ONE, Premultiplied, Quad, Resampled};
use crate::raster::canvas::Cover;

/// All rows of a layer.
#[target_feature(enable = "avx2")]
pub(super) fn draw_rows(
    layer: &mut Resampled,
    sprite: &Premultiplied,
    map: &Map,
    nearer: Option<&Cover>,
) {
    layer.draw_rows(sprite, map, nearer, |sprite, row, start, step| {
        interpolate(sprite, row, start, step);
    });
}

#[inline]
#[target_feature(enable = "avx2")]
fn interpolate(sprite: &Premultiplied, row: &mut [Quad], start: [i32; 2], step: [i32; 2]) {
    // The first of a place's taps lies a pixel to the left and above.
    let mut at = start.map(|at| at + HALF_PLACE - (1 << 16));
    let n_steps = row.len() as i64 - 1;
    let last = [0, 1].map(|k| i64::from(at[k]) + i64::from(step[k]) * n_steps);
    assert!(sprite.holds_taps(at.map(i64::from)) && sprite.holds_taps(last));
    let mut next = || {
        // SAFETY: it lies between the first place and the last, of which the line above made sure.
        let taps = unsafe { weighted(sprite, at) };
        at = [at[0].wrapping_add(step[0]), at[1].wrapping_add(step[1])];
        taps
    };
    let (fours, rest) = row.as_chunks_mut::<4>();
    for four in fours {
        let taps = [next(), next(), next(), next()];
        store(four, summed(taps));
    }
    if rest.is_empty() {
        return;
    }
    let mut taps = [_mm256_setzero_si256(); 4];
    for taps in &mut taps[..rest.len()] {
        *taps = next();
    }
    let mut four = [[0; 4]; 4];
    store(&mut four, summed(taps));
    rest.copy_from_slice(&four[..rest.len()]);
}

impl Premultiplied {
    /// Whether all sixteen taps of a place, given by its first one, are there.
    fn holds_taps(&self, [u, v]: [i64; 2]) -> bool {
        let (stride, n_rows) = (self.stride(), self.spans.len());
        let is_held = |first: i64, n: usize| first >= 0 && (first >> 16) + 4 <= n as i64;
        is_held(u, stride) && is_held(v, n_rows) && stride * n_rows <= self.pixels.len()
    }
}

/// Four taps, of each the column weighted and summed, and its weight across.
///
/// # Safety
/// The sprite must hold the taps of the place.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn weighted(sprite: &Premultiplied, [u, v]: [i32; 2]) -> __m256i {
    let stride = sprite.stride();
    let first = (v >> 16) as usize * stride + (u >> 16) as usize;
    let down = &TWICE[(v >> 8) as usize % PLACES];
    let tap = |k: usize| {
        // SAFETY: the caller made sure that row k of four, k at most 3, has four pixels there.
        let taps = unsafe { sprite.pixels.as_ptr().add(first + k * stride) };
        // SAFETY: four pixels are 32 bytes that can be read.
        let taps = unsafe { _mm256_loadu_si256(taps.cast()) };
        _mm256_mulhrs_epi16(taps, _mm256_set1_epi32(down[k]))
    };
    let column = _mm256_add_epi16(
        _mm256_add_epi16(tap(0), tap(1)),
        _mm256_add_epi16(tap(2), tap(3)),
    );
    let across = WIDE[(u >> 8) as usize % PLACES].as_ptr();
    // SAFETY: sixteen weights are 32 bytes that can be read.
    let across = unsafe { _mm256_loadu_si256(across.cast()) };
    _mm256_mulhrs_epi16(column, across)
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
