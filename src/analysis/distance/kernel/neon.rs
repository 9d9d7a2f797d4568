//! NEON: 16 bytes to an instruction, a register tile of 2 x 4 sprites. Absolute differences are
//! added pairwise into 16-bit lanes: over a block of 1 KB a lane takes 64 steps of at most
//! 2 * 255, below 2^15, and is widened at the block's end.
#![expect(unsafe_code, reason = "vector loads and the call into code for NEON")]

use std::arch::aarch64::*;

use super::{SadTile, Tile};
use crate::analysis::distance::pixels::Line;

/// As `scalar::sad_tile`.
pub(super) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    // SAFETY: NEON, all that the callee asks for, is part of every AArch64 that this is built for.
    unsafe { sad_tile_neon(tile, sums) }
}

#[target_feature(enable = "neon")]
fn sad_tile_neon(tile: Tile<'_>, sums: &mut SadTile) {
    for block in 0..tile.rows.n_blocks() {
        // Groups are padded to 48 sprites, so steps of 2 and 4 never leave them.
        for row in (0..tile.rows.n_sprites).step_by(2) {
            let a = [0, 1].map(|k| tile.rows.strip(block, row + k));
            for column in tile.columns_of(row).step_by(4) {
                let b = [0, 1, 2, 3].map(|k| tile.columns.strip(block, column + k));
                for (r, totals) in sad_2x4(a, b).into_iter().enumerate() {
                    for (k, total) in totals.into_iter().enumerate() {
                        sums[row + r][column + k] += u64::from(total);
                    }
                }
            }
        }
    }
}

/// The sums of two strips against four: `[row][column]`.
#[inline]
#[target_feature(enable = "neon")]
fn sad_2x4(a: [&[Line]; 2], b: [&[Line]; 4]) -> [[u32; 4]; 2] {
    let mut sums = [[vdupq_n_u16(0); 4]; 2];
    let depth = b[0].len();
    // Slices of one length, so that the loop needs no bounds checks.
    let [a0, a1] = a.map(|strip| &strip[..depth]);
    let [b0, b1, b2, b3] = b.map(|strip| &strip[..depth]);
    for line in 0..depth {
        for quarter in 0..4 {
            let a = [load(&a0[line], quarter), load(&a1[line], quarter)];
            let b = [
                load(&b0[line], quarter),
                load(&b1[line], quarter),
                load(&b2[line], quarter),
                load(&b3[line], quarter),
            ];
            for row in 0..2 {
                for column in 0..4 {
                    let difference = vabdq_u8(a[row], b[column]);
                    sums[row][column] = vpadalq_u8(sums[row][column], difference);
                }
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

/// A quarter, 0 to 3, of a line.
#[inline]
#[target_feature(enable = "neon")]
fn load(line: &Line, quarter: usize) -> uint8x16_t {
    assert!(quarter < 4, "a line has four quarters");
    // SAFETY: the line's 64 bytes hold 16 from each quarter on.
    unsafe { vld1q_u8(line.0.as_ptr().add(16 * quarter)) }
}
