//! AVX2: 32 bytes to an instruction (`vpsadbw`), a register tile of 4 x 2 sprites, so that six loads
//! feed eight sums, over blocks of 1 KB that stay in the nearest cache.
//!
//! A block's partial sums stay below 2^32 (32 steps of at most 4 * 2040), so two of them share a
//! 64-bit lane while they are added up.
#![expect(unsafe_code, reason = "vector loads and the call into code for AVX2")]

use std::arch::x86_64::*;

use super::{SadTile, Tile};
use crate::analysis::distance::pixels::{BLOCK, Block};

/// Loads of 32 bytes in a block.
const STEPS: usize = BLOCK / 32;

/// As `scalar::sad_tile`. Panics where AVX2 is missing.
pub(super) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    assert!(is_x86_feature_detected!("avx2"), "this machine has no AVX2");
    // SAFETY: the line above made sure of AVX2, which is all that the callee asks for.
    unsafe { sad_tile_avx2(tile, sums) }
}

#[target_feature(enable = "avx2")]
fn sad_tile_avx2(tile: Tile<'_>, sums: &mut SadTile) {
    // Groups are padded to 48 sprites, so blocks of 4 and 2 never leave them.
    let corners = tile.corners::<4, 2>();
    for block in 0..tile.rows.n_blocks() {
        for &[row, column] in &corners {
            if tile.add_blank::<4, 2>([block, row, column], sums) {
                continue;
            }
            let a = std::array::from_fn(|k| tile.rows.block(block, row + k));
            let b = std::array::from_fn(|k| tile.columns.block(block, column + k));
            for (k, sums_of_column) in sad_4x2(a, b).into_iter().enumerate() {
                for (r, sum) in sums_of_column.into_iter().enumerate() {
                    sums[row + r][column + k] += u64::from(sum);
                }
            }
        }
    }
}

/// The sums of four blocks against two: `[column][row]`.
#[inline]
#[target_feature(enable = "avx2")]
fn sad_4x2(a: [&Block; 4], b: [&Block; 2]) -> [[u32; 4]; 2] {
    let mut sums = [[_mm256_setzero_si256(); 4]; 2];
    for step in 0..STEPS {
        let a = [
            load(a[0], step),
            load(a[1], step),
            load(a[2], step),
            load(a[3], step),
        ];
        let b = [load(b[0], step), load(b[1], step)];
        for column in 0..2 {
            for row in 0..4 {
                let sad = _mm256_sad_epu8(a[row], b[column]);
                sums[column][row] = _mm256_add_epi64(sums[column][row], sad);
            }
        }
    }
    [totals(sums[0]), totals(sums[1])]
}

/// The totals of four vectors of four 64-bit sums, each below 2^32.
#[inline]
#[target_feature(enable = "avx2")]
fn totals([a, b, c, d]: [__m256i; 4]) -> [u32; 4] {
    let ab = _mm256_or_si256(a, _mm256_slli_epi64::<32>(b));
    let cd = _mm256_or_si256(c, _mm256_slli_epi64::<32>(d));
    let abcd = _mm256_add_epi32(_mm256_unpacklo_epi64(ab, cd), _mm256_unpackhi_epi64(ab, cd));
    let abcd = _mm_add_epi32(
        _mm256_castsi256_si128(abcd),
        _mm256_extracti128_si256::<1>(abcd),
    );
    let mut totals = [0; 4];
    // SAFETY: `totals` is 16 bytes long and the store needs no alignment.
    unsafe { _mm_storeu_si128(totals.as_mut_ptr().cast(), abcd) };
    totals
}

/// 32 bytes of a block.
#[inline]
#[target_feature(enable = "avx2")]
fn load(block: &Block, step: usize) -> __m256i {
    debug_assert!(step < STEPS, "a block has 32 steps");
    // SAFETY: callers count `step` below STEPS, so the 32 bytes lie inside the block, which stands
    // on a boundary of 64.
    unsafe { _mm256_load_si256(block.0.as_ptr().cast::<__m256i>().add(step)) }
}
