//! Rows of a canvas with AVX2, sixteen values at a time. Results equal those of the scalar code in this
//! folder.

#![expect(unsafe_code, reason = "vector loads and stores go through pointers")]

use std::arch::x86_64::*;

use crate::raster::color::FromQuads;
use crate::raster::resample::{ONE, Quad};

/// Draws premultiplied pixels under the pixels of a row.
#[target_feature(enable = "avx2")]
pub(super) fn under_row(row: &mut [Quad], sprite: &[Quad]) {
    let (row_fours, row_rest) = row.as_chunks_mut::<4>();
    let (sprite_fours, sprite_rest) = sprite.as_chunks::<4>();
    for (above, below) in row_fours.iter_mut().zip(sprite_fours) {
        store(above, four_over(load(above), load(below)));
    }
    let n_rest = row_rest.len().min(sprite_rest.len());
    let rest = first_of_four(n_rest);
    let [above, below] = [&*row_rest, sprite_rest].map(|pixels| {
        // SAFETY: `pixels` holds the `n_rest` pixels read, 8 bytes each.
        unsafe { _mm256_maskload_epi64(pixels.as_ptr().cast(), rest) }
    });
    let drawn = four_over(above, below);
    // SAFETY: `row_rest` holds the `n_rest` pixels written, 8 bytes each.
    unsafe { _mm256_maskstore_epi64(row_rest.as_mut_ptr().cast(), rest, drawn) };
}

/// Prefetches pixels that will be drawn under; they are far from the previous row in memory.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn prefetch(row: &[Quad]) {
    const LINE: usize = 64 / size_of::<Quad>();
    for pixel in row.iter().step_by(LINE).chain(row.last()) {
        _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(pixel).cast());
    }
}

/// Returns a mask of the first `n` of four pixels.
#[inline]
#[target_feature(enable = "avx2")]
fn first_of_four(n: usize) -> __m256i {
    _mm256_cmpgt_epi64(_mm256_set1_epi64x(n as i64), _mm256_setr_epi64x(0, 1, 2, 3))
}

#[target_feature(enable = "avx2")]
fn four_over(above: __m256i, below: __m256i) -> __m256i {
    let alpha = _mm256_shufflehi_epi16::<0xff>(_mm256_shufflelo_epi16::<0xff>(above));
    let left = _mm256_sub_epi16(_mm256_set1_epi16(ONE), alpha);
    // Saturated doubling: a weight of 32767/32768 leaves every value unchanged.
    let through = _mm256_adds_epi16(left, left);
    _mm256_add_epi16(above, _mm256_mulhrs_epi16(below, through))
}

/// Converts the first pixels of a row to luma, eight at a time. Returns the number of converted pixels.
#[target_feature(enable = "avx2")]
pub(super) fn luma_row(from: &FromQuads, row: &[Quad], luma: &mut [u8]) -> usize {
    let weights = weights_of(from.y);
    let half = _mm256_set1_epi32(1 << 20);
    let offset = _mm256_set1_epi32(from.y_offset);
    let (eights, _) = row.as_chunks::<8>();
    for (out, pixels) in luma.as_chunks_mut::<8>().0.iter_mut().zip(eights) {
        let dots = eight_dots(pixels, weights);
        let values = _mm256_srai_epi32::<21>(_mm256_add_epi32(dots, half));
        *out = bytes_of(_mm256_add_epi32(values, offset));
    }
    luma.len().min(eights.len() * 8) / 8 * 8
}

/// Converts the first blocks of two rows to chroma, four at a time. Returns the number of converted blocks.
#[target_feature(enable = "avx2")]
pub(super) fn chroma_row(from: &FromQuads, rows: [&[Quad]; 2], planes: [&mut [u8]; 2]) -> usize {
    let (u_weights, v_weights) = (weights_of(from.u), weights_of(from.v));
    let half = _mm256_set1_epi32(1 << 22);
    let middle = _mm256_set1_epi32(128);
    let [us, vs] = planes.map(|plane| plane.as_chunks_mut::<4>().0);
    let [above, below] = rows.map(|row| row.as_chunks::<8>().0);
    for (k, (above, below)) in above.iter().zip(below).enumerate() {
        let dots =
            |weights| _mm256_add_epi32(eight_dots(above, weights), eight_dots(below, weights));
        // Pairs: u u v v of the first four pixels, then of the last four.
        let pairs = _mm256_hadd_epi32(dots(u_weights), dots(v_weights));
        let values = _mm256_srai_epi32::<23>(_mm256_add_epi32(pairs, half));
        let [u0, u1, v0, v1, u2, u3, v2, v3] = bytes_of(_mm256_add_epi32(values, middle));
        us[k] = [u0, u1, u2, u3];
        vs[k] = [v0, v1, v2, v3];
    }
    above.len().min(below.len()) * 4
}

/// Returns the weighted channel sum of each of eight pixels, in order.
#[target_feature(enable = "avx2")]
fn eight_dots(pixels: &[Quad; 8], weights: __m256i) -> __m256i {
    let (halves, _) = pixels.as_chunks::<4>();
    let [first, last] = [0, 1].map(|k| _mm256_madd_epi16(load(&halves[k]), weights));
    let mixed = _mm256_hadd_epi32(first, last);
    _mm256_permute4x64_epi64::<0b11_01_10_00>(mixed)
}

/// Repeats three weights, and 0 for alpha, four times. The weights fit 16 bits: they are below 255 * 128.
#[target_feature(enable = "avx2")]
fn weights_of(weights: [i32; 3]) -> __m256i {
    let [r, g, b] = weights.map(|weight| i64::from(weight as i16 as u16));
    _mm256_set1_epi64x(r | g << 16 | b << 32)
}

/// Returns eight values as bytes, clamped.
#[target_feature(enable = "avx2")]
fn bytes_of(values: __m256i) -> [u8; 8] {
    let words = _mm256_packs_epi32(values, values);
    let bytes = _mm256_packus_epi16(words, words);
    let low = _mm256_extract_epi32::<0>(bytes).to_le_bytes();
    let high = _mm256_extract_epi32::<4>(bytes).to_le_bytes();
    [
        low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3],
    ]
}

#[target_feature(enable = "avx2")]
fn store(pixels: &mut [Quad; 4], values: __m256i) {
    // SAFETY: `pixels` is 32 writable bytes.
    unsafe { _mm256_storeu_si256(pixels.as_mut_ptr().cast(), values) };
}

#[target_feature(enable = "avx2")]
fn load(pixels: &[Quad; 4]) -> __m256i {
    // SAFETY: `pixels` is 32 readable bytes.
    unsafe { _mm256_loadu_si256(pixels.as_ptr().cast()) }
}
