//! NEON kernel: 16 bytes per instruction and a register tile of 2 x 4 sprites.
//!
//! Absolute differences are added pairwise into 16-bit lanes. In a block of 1 KB, a lane takes 64 steps of at
//! most 2 * 255, which stays below 2^15. Lanes are widened at the end of each block.
#![expect(unsafe_code, reason = "vector loads and the call into code for NEON")]

use std::arch::aarch64::*;

use super::{SadTile, Tile};
use crate::analysis::similarity::group::{BLOCK_BYTES, Block};

/// Number of 16-byte loads per block.
const STEPS: usize = BLOCK_BYTES / 16;

/// Works like `scalar::sad_tile`.
pub(super) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    // SAFETY: NEON, the only requirement of the callee, is part of every AArch64 target of this project.
    unsafe { sad_tile_neon(tile, sums) }
}

#[target_feature(enable = "neon")]
fn sad_tile_neon(tile: Tile<'_>, sums: &mut SadTile) {
    *sums = tile.disjoint_sums();
    // Groups are padded to 48 sprites, so both rows and all four columns exist.
    let subtiles = tile.subtiles::<2, 4>();
    for block in 0..tile.rows.n_blocks() {
        for &[row, column] in &subtiles {
            let pairs = [&(row..row + 2), &(column..column + 4)];
            if !tile.overlap(block, pairs) {
                continue;
            }
            let a = std::array::from_fn(|k| tile.rows.block(block, row + k));
            let b = std::array::from_fn(|k| tile.columns.block(block, column + k));
            for (r, totals) in sad_2x4(a, b).into_iter().enumerate() {
                for (k, total) in totals.into_iter().enumerate() {
                    tile.correct(block, [row + r, column + k], total.into(), sums);
                }
            }
        }
    }
}

/// Returns the sums of two blocks against four: `[row][column]`.
#[inline]
#[target_feature(enable = "neon")]
fn sad_2x4(a: [&Block; 2], b: [&Block; 4]) -> [[u32; 4]; 2] {
    let mut sums = [[vdupq_n_u16(0); 4]; 2];
    for step in 0..STEPS {
        let a = [load(a[0], step), load(a[1], step)];
        let b = [
            load(b[0], step),
            load(b[1], step),
            load(b[2], step),
            load(b[3], step),
        ];
        for row in 0..2 {
            for column in 0..4 {
                let difference = vabdq_u8(a[row], b[column]);
                sums[row][column] = vpadalq_u8(sums[row][column], difference);
            }
        }
    }
    let mut totals = [[0; 4]; 2];
    for row in 0..2 {
        for column in 0..4 {
            totals[row][column] = vaddlvq_u16(sums[row][column]);
        }
    }
    totals
}

/// Loads 16 bytes of a block.
#[inline]
#[target_feature(enable = "neon")]
fn load(block: &Block, step: usize) -> uint8x16_t {
    debug_assert!(step < STEPS, "a block has 64 steps");
    // SAFETY: callers keep `step` below STEPS, so the 16 bytes are inside the block.
    unsafe { vld1q_u8(block.0.as_ptr().add(16 * step)) }
}
