//! AVX-512 BW: a line of 64 bytes to an instruction, a register tile of 4 x 4 sprites out of the 32
//! registers. A block of 16 lines keeps every 64-bit lane below 2^15, a total below 2^18.
#![expect(
    unsafe_code,
    reason = "vector loads and the call into code for AVX-512"
)]

use std::arch::x86_64::*;

use super::{SadTile, Tile};
use crate::analysis::distance::pixels::Line;

/// As `scalar::sad_tile`. Panics where AVX-512 BW is missing.
pub(super) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    assert!(
        is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw"),
        "this machine has no AVX-512 BW"
    );
    // SAFETY: the line above made sure of what the callee asks for.
    unsafe { sad_tile_avx512(tile, sums) }
}

#[target_feature(enable = "avx512f,avx512bw")]
fn sad_tile_avx512(tile: Tile<'_>, sums: &mut SadTile) {
    for block in 0..tile.rows.n_blocks() {
        // Groups are padded to 48 sprites, so steps of 4 never leave them.
        for row in (0..tile.rows.n_sprites).step_by(4) {
            let a = [0, 1, 2, 3].map(|k| tile.rows.strip(block, row + k));
            for column in tile.columns_of(row).step_by(4) {
                let b = [0, 1, 2, 3].map(|k| tile.columns.strip(block, column + k));
                for (r, totals) in sad_4x4(a, b).into_iter().enumerate() {
                    for (k, total) in totals.into_iter().enumerate() {
                        sums[row + r][column + k] += total;
                    }
                }
            }
        }
    }
}

/// The sums of four strips against four: `[row][column]`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn sad_4x4(a: [&[Line]; 4], b: [&[Line]; 4]) -> [[u64; 4]; 4] {
    let mut sums = [[_mm512_setzero_si512(); 4]; 4];
    let depth = b[0].len();
    // Slices of one length, so that the loop needs no bounds checks.
    let [a0, a1, a2, a3] = a.map(|strip| &strip[..depth]);
    let [b0, b1, b2, b3] = b.map(|strip| &strip[..depth]);
    for line in 0..depth {
        let a = [
            load(&a0[line]),
            load(&a1[line]),
            load(&a2[line]),
            load(&a3[line]),
        ];
        let b = [
            load(&b0[line]),
            load(&b1[line]),
            load(&b2[line]),
            load(&b3[line]),
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

/// A line.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn load(line: &Line) -> __m512i {
    // SAFETY: a line is 64 bytes on a boundary of 64.
    unsafe { _mm512_load_si512(line.0.as_ptr().cast()) }
}
