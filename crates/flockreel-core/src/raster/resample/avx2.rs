//! Interpolation with AVX2: four taps of a row at a time. Results equal those of the scalar code in
//! `catmull_rom`.

#![expect(unsafe_code, reason = "vector loads and stores go through pointers")]

use std::arch::x86_64::*;

use super::catmull_rom::{HALF_PHASE, PAIRED_WEIGHTS, WIDE_WEIGHTS};
use super::map::Map;
use super::{ONE, Premultiplied, Quad, Surface, draw_rows_with};
use crate::geometry::Rect;

/// Draws all rows of a sprite.
#[target_feature(enable = "avx2")]
pub(super) fn draw_rows(surface: &mut impl Surface, rect: Rect, map: &Map) {
    let interpolate = |sprite: &_, row: &mut _, start, step| interpolate(sprite, row, start, step);
    let prefetch = |sprite: &_, start, step, n| prefetch(sprite, start, step, n);
    draw_rows_with(surface, rect, map, interpolate, prefetch);
}

/// Prefetches the last row of taps of positions that are interpolated soon.
#[inline]
#[target_feature(enable = "avx2")]
fn prefetch(sprite: &Premultiplied, start: [i32; 2], step: [i32; 2], n: usize) {
    const LINE: usize = 64 / size_of::<Quad>();
    let (pixels, stride) = (sprite.pixels.as_ptr(), sprite.stride() as isize);
    let [mut u, mut v] = start;
    for _ in 0..n.div_ceil(LINE) {
        let at = ((v >> 16) as isize + 2) * stride + (u >> 16) as isize;
        // Addresses outside the sprite are harmless in a prefetch.
        _mm_prefetch::<_MM_HINT_T0>(pixels.wrapping_offset(at).cast());
        u = u.wrapping_add(LINE as i32 * step[0]);
        v = v.wrapping_add(LINE as i32 * step[1]);
    }
}

/// Interpolates a run of pixels. Not inlined, because the loop needs all registers.
#[inline(never)]
#[target_feature(enable = "avx2")]
fn interpolate(sprite: &Premultiplied, row: &mut [Quad], start: [i32; 2], step: [i32; 2]) {
    // The first tap of a position is one pixel to the left and above.
    let first = start.map(|at| at + HALF_PHASE - (1 << 16));
    let n_steps = row.len() as i64 - 1;
    let last = [0, 1].map(|k| i64::from(first[k]) + i64::from(step[k]) * n_steps);
    assert!(sprite.contains_taps(first.map(i64::from)) && sprite.contains_taps(last));
    let (pixels, stride) = (sprite.pixels.as_ptr(), sprite.stride());
    let lane = _mm_setr_epi32(0, 1, 2, 3);
    let [mut u, mut v] = [0, 1].map(|k| {
        let ahead = _mm_mullo_epi32(_mm_set1_epi32(step[k]), lane);
        _mm_add_epi32(_mm_set1_epi32(first[k]), ahead)
    });
    let four_on = step.map(|step| _mm_set1_epi32(step.wrapping_mul(4)));
    let (fours, rest) = row.as_chunks_mut::<4>();
    for four in fours {
        let positions = Positions::new(u, v, stride);
        // SAFETY: all four positions lie between the first and the last, whose taps the sprite holds.
        let taps = unsafe {
            let tap = |k| positions.weighted(k, pixels, stride);
            [tap(0), tap(1), tap(2), tap(3)]
        };
        store(four, summed(taps));
        u = _mm_add_epi32(u, four_on[0]);
        v = _mm_add_epi32(v, four_on[1]);
    }
    if rest.is_empty() {
        return;
    }
    let positions = Positions::new(u, v, stride);
    let mut taps = [_mm256_setzero_si256(); 4];
    for (k, taps) in taps[..rest.len()].iter_mut().enumerate() {
        // SAFETY: as above; positions after the last are not read.
        *taps = unsafe { positions.weighted(k, pixels, stride) };
    }
    let mut four = [[0; 4]; 4];
    store(&mut four, summed(taps));
    rest.copy_from_slice(&four[..rest.len()]);
}

impl Premultiplied {
    /// Returns whether the sprite holds all 16 taps of a position, given by its first tap.
    fn contains_taps(&self, [u, v]: [i64; 2]) -> bool {
        let (stride, n_rows) = (self.stride(), self.spans.len());
        let is_held = |first: i64, n: usize| first >= 0 && (first >> 16) + 4 <= n as i64;
        is_held(u, stride) && is_held(v, n_rows) && stride * n_rows <= self.pixels.len()
    }
}

/// Four positions in a sprite, each given by its first tap.
struct Positions {
    /// Index of the first tap among the pixels.
    first: [i32; 4],
    /// Index of the interpolation position, in the lowest byte.
    across: [i32; 4],
    down: [i32; 4],
}

impl Positions {
    #[inline]
    #[target_feature(enable = "avx2")]
    fn new(u: __m128i, v: __m128i, stride: usize) -> Positions {
        let [x, y] = [_mm_srai_epi32::<16>(u), _mm_srai_epi32::<16>(v)];
        let above = _mm_mullo_epi32(y, _mm_set1_epi32(stride as i32));
        let lanes_of = |values: __m128i| {
            let mut lanes = [0; 4];
            // SAFETY: `lanes` is an owned buffer of 16 bytes.
            unsafe { _mm_storeu_si128(lanes.as_mut_ptr().cast(), values) };
            lanes
        };
        Positions {
            first: lanes_of(_mm_add_epi32(above, x)),
            across: lanes_of(_mm_srai_epi32::<8>(u)),
            down: lanes_of(_mm_srai_epi32::<8>(v)),
        }
    }

    /// Returns the 16 taps of position `k`, summed along columns and multiplied by the weights along the row.
    ///
    /// # Safety
    ///
    /// `pixels`, in rows of `stride`, must hold the taps of position `k`.
    #[inline]
    #[target_feature(enable = "avx2")]
    unsafe fn weighted(&self, k: usize, pixels: *const Quad, stride: usize) -> __m256i {
        let down = &PAIRED_WEIGHTS[usize::from(self.down[k] as u8)];
        // SAFETY: the caller guarantees the first tap.
        let first = unsafe { pixels.add(self.first[k] as usize) };
        let tap = |row: usize| {
            // SAFETY: the caller guarantees four rows of four pixels, 32 bytes each.
            let taps = unsafe { _mm256_loadu_si256(first.add(row * stride).cast()) };
            _mm256_mulhrs_epi16(taps, _mm256_set1_epi32(down[row]))
        };
        let column = _mm256_add_epi16(
            _mm256_add_epi16(tap(0), tap(1)),
            _mm256_add_epi16(tap(2), tap(3)),
        );
        let across = WIDE_WEIGHTS[usize::from(self.across[k] as u8)].as_ptr();
        // SAFETY: sixteen weights are 32 readable bytes.
        let across = unsafe { _mm256_loadu_si256(across.cast()) };
        _mm256_mulhrs_epi16(column, across)
    }
}

/// Sums the taps of four pixels along the row, and limits alpha to 1 and each color to alpha.
#[inline]
#[target_feature(enable = "avx2")]
fn summed([a, b, c, d]: [__m256i; 4]) -> __m256i {
    // Sums of the first two taps of each pixel in the lower half, of the last two in the upper half.
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
    // SAFETY: `pixels` is 32 writable bytes.
    unsafe { _mm256_storeu_si256(pixels.as_mut_ptr().cast(), values) };
}
