//! AVX-512 BW kernel: 64 bytes per instruction and a register tile of 4 x 4 sprites in 32 registers.
//!
//! It is used where most pairs of a tile are needed. For few pairs, `avx2` skips more. The 16 steps of a
//! block keep every 64-bit lane below 2^15 and a total below 2^18.
#![expect(
    unsafe_code,
    reason = "vector loads and the call into code for AVX-512"
)]

use std::arch::x86_64::*;

use super::{SadTile, Tile};
use crate::analysis::similarity::group::{BLOCK_BYTES, Block};

/// Number of 64-byte loads per block.
const STEPS: usize = BLOCK_BYTES / 64;

/// Works like `scalar::sad_tile`. Panics without AVX-512 BW.
pub(super) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    assert!(
        is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw"),
        "this machine has no AVX-512 BW"
    );
    // SAFETY: the assertion above ensures what the callee requires.
    unsafe { sad_tile_avx512(tile, sums) }
}

#[target_feature(enable = "avx512f,avx512bw")]
fn sad_tile_avx512(tile: Tile<'_>, sums: &mut SadTile) {
    *sums = tile.disjoint_sums();
    // Groups are padded to 48 sprites, so all four rows and columns exist.
    let subtiles = tile.subtiles::<4, 4>();
    for block in 0..tile.rows.n_blocks() {
        for &[row, column] in &subtiles {
            let pairs = [&(row..row + 4), &(column..column + 4)];
            if !tile.overlap(block, pairs) {
                continue;
            }
            let a = std::array::from_fn(|k| tile.rows.block(block, row + k));
            let b = std::array::from_fn(|k| tile.columns.block(block, column + k));
            for (r, totals) in sad_4x4(a, b).into_iter().enumerate() {
                for (k, total) in totals.into_iter().enumerate() {
                    tile.correct(block, [row + r, column + k], total, sums);
                }
            }
        }
    }
}

/// Returns the sums of four blocks against four: `[row][column]`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn sad_4x4(a: [&Block; 4], b: [&Block; 4]) -> [[u64; 4]; 4] {
    let mut sums = [[_mm512_setzero_si512(); 4]; 4];
    for step in 0..STEPS {
        let a = [
            load(a[0], step),
            load(a[1], step),
            load(a[2], step),
            load(a[3], step),
        ];
        let b = [
            load(b[0], step),
            load(b[1], step),
            load(b[2], step),
            load(b[3], step),
        ];
        for row in 0..4 {
            for column in 0..4 {
                let sad = _mm512_sad_epu8(a[row], b[column]);
                sums[row][column] = _mm512_add_epi64(sums[row][column], sad);
            }
        }
    }
    let mut totals = [[0; 4]; 4];
    for row in 0..4 {
        for column in 0..4 {
            totals[row][column] = _mm512_reduce_add_epi64(sums[row][column]) as u64;
        }
    }
    totals
}

/// Loads 64 bytes of a block.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn load(block: &Block, step: usize) -> __m512i {
    debug_assert!(step < STEPS, "a block has 16 steps");
    // SAFETY: callers keep `step` below STEPS, so the 64 bytes are inside the block, which is aligned to 64
    // bytes.
    unsafe { _mm512_load_si512(block.0.as_ptr().cast::<__m512i>().add(step)) }
}
