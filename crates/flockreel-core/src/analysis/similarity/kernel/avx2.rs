//! AVX2 kernel: 32 bytes per instruction (`vpsadbw`) and a register tile of 6 x 2 sprites, so that eight
//! loads feed twelve sums. The blocks of 1 KB stay in the L1 cache.
//!
//! Twelve sums, two columns, one row and one difference fill the sixteen registers. With eight sums, the
//! loads would limit the speed. The partial sums of a block stay below 2^32 (32 steps of at most 4 * 2040).
//! Two of them therefore share a 64-bit lane in the final addition.
#![expect(unsafe_code, reason = "vector loads and the call into code for AVX2")]

use std::arch::x86_64::*;
use std::ops::Range;

use super::{LANES, SadTile, Tile};
use crate::analysis::similarity::group::{BLOCK_BYTES, Block};

/// Largest number of rows that are compared with two columns at once. The sums (two for each row), two columns,
/// one row and one difference fill the registers.
const MAX_ROWS: usize = 6;
/// Number of 32-byte loads per block.
const STEPS: usize = BLOCK_BYTES / 32;

/// Works like `scalar::sad_tile`. Panics without AVX2.
pub(super) fn sad_tile(tile: Tile<'_>, sums: &mut SadTile) {
    assert!(is_x86_feature_detected!("avx2"), "this machine has no AVX2");
    // SAFETY: the assertion above ensures AVX2, the only requirement of the callee.
    unsafe { sad_tile_avx2(tile, sums) }
}

#[target_feature(enable = "avx2")]
fn sad_tile_avx2(tile: Tile<'_>, sums: &mut SadTile) {
    *sums = tile.disjoint_sums();
    let strips = strips(&tile);
    for block in 0..tile.rows.n_blocks() {
        for strip in &strips {
            // Groups are padded to 48 sprites, so both columns exist.
            let columns = strip.column..strip.column + 2;
            if !tile.overlap(block, [&strip.rows, &columns]) {
                continue;
            }
            match strip.rows.len() {
                1 => add_strip::<1>(tile, block, strip, sums),
                2 => add_strip::<2>(tile, block, strip, sums),
                3 => add_strip::<3>(tile, block, strip, sums),
                4 => add_strip::<4>(tile, block, strip, sums),
                5 => add_strip::<5>(tile, block, strip, sums),
                _ => add_strip::<MAX_ROWS>(tile, block, strip, sums),
            }
        }
    }
}

/// Successive rows, at most [`MAX_ROWS`], against two columns.
struct Strip {
    rows: Range<usize>,
    column: usize,
}

/// Returns the needed rows of every two columns, in strips of similar length, sorted by rows, then by
/// columns.
fn strips(tile: &Tile<'_>) -> Vec<Strip> {
    let mut strips = Vec::new();
    for column in (0..tile.columns.n_sprites).step_by(2) {
        let rows = (0..).zip(tile.wanted);
        let mut rest = rows.fold(0u64, |rows, (row, wanted)| {
            rows | u64::from(wanted >> column & 3 != 0) << row
        });
        while rest != 0 {
            let start = rest.trailing_zeros() as usize;
            let n_rows = (!(rest >> start)).trailing_zeros() as usize;
            rest &= !(((1 << n_rows) - 1) << start);
            let n_pieces = n_rows.div_ceil(MAX_ROWS);
            let cut = |k: usize| start + k * n_rows / n_pieces;
            let pieces = (0..n_pieces).map(|k| cut(k)..cut(k + 1));
            strips.extend(pieces.map(|rows| Strip { rows, column }));
        }
    }
    strips.sort_by_key(|strip| (strip.rows.start, strip.column));
    strips
}

#[inline]
#[target_feature(enable = "avx2")]
fn add_strip<const R: usize>(tile: Tile<'_>, block: usize, strip: &Strip, sums: &mut SadTile) {
    let (row, column) = (strip.rows.start, strip.column);
    let a = std::array::from_fn(|k| tile.rows.block(block, row + k));
    let b = std::array::from_fn(|k| tile.columns.block(block, column + k));
    for (row, of_row) in (row..).zip(sad_rows::<R>(a, b)) {
        for (column, d) in (column..).zip(of_row) {
            tile.correct(block, [row, column], d.into(), sums);
        }
    }
}

/// Returns the sums of up to six blocks against two.
#[inline]
#[target_feature(enable = "avx2")]
fn sad_rows<const R: usize>(a: [&Block; R], b: [&Block; 2]) -> [[u32; 2]; R] {
    let mut sums = [[_mm256_setzero_si256(); 2]; R];
    for step in 0..STEPS {
        prefetch_next(b[1], step);
        let b = [load(b[0], step), load(b[1], step)];
        for row in 0..R {
            let a = load(a[row], step);
            for column in 0..2 {
                let sad = _mm256_sad_epu8(a, b[column]);
                sums[row][column] = _mm256_add_epi64(sums[row][column], sad);
            }
        }
    }
    let mut each = [[0; 2]; R];
    for (each, sums) in each.chunks_mut(2).zip(sums.chunks(2)) {
        let (first, second) = (sums[0], sums.last().copied().unwrap_or(sums[0]));
        let [a, b, c, d] = totals([first[0], first[1], second[0], second[1]]);
        each.iter_mut()
            .zip([[a, b], [c, d]])
            .for_each(|(each, of_row)| *each = of_row);
    }
    each
}

/// Prefetches one of the 32 cache lines after this block: usually those of the next two columns.
#[inline]
#[target_feature(enable = "avx2")]
fn prefetch_next(block: &Block, step: usize) {
    let line = block.0.as_ptr().wrapping_add(BLOCK_BYTES + step * 64);
    // A prefetch reads nothing, so any address is allowed.
    _mm_prefetch::<_MM_HINT_T0>(line.cast());
}

/// Returns the totals of four vectors of four 64-bit sums, each below 2^32.
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
    // SAFETY: `totals` is 16 bytes long, and the store needs no alignment.
    unsafe { _mm_storeu_si128(totals.as_mut_ptr().cast(), abcd) };
    totals
}

/// Loads 32 bytes of a block.
#[inline]
#[target_feature(enable = "avx2")]
fn load(block: &Block, step: usize) -> __m256i {
    debug_assert!(step < STEPS, "a block has 32 steps");
    // SAFETY: callers keep `step` below STEPS, so the 32 bytes are inside the block, which is aligned to 64
    // bytes.
    unsafe { _mm256_load_si256(block.0.as_ptr().cast::<__m256i>().add(step)) }
}

/// Works like `scalar::sad_u16`. Panics without AVX2.
pub(super) fn sad_u16(row: &[u16], others: &[u16], sums: &mut [u32]) {
    assert!(is_x86_feature_detected!("avx2"), "this machine has no AVX2");
    // SAFETY: the assertion above ensures AVX2, the only requirement of the callee.
    unsafe { sad_u16_avx2(row.as_chunks().0, others, sums) }
}

#[target_feature(enable = "avx2")]
fn sad_u16_avx2(row: &[[u16; LANES]], others: &[u16], sums: &mut [u32]) {
    let ones = _mm256_set1_epi16(1);
    let others = others.as_chunks().0.chunks_exact(row.len().max(1));
    for (sum, other) in sums.iter_mut().zip(others) {
        // Eight lanes. Each sums fewer than 2^15 differences below 2^16.
        let mut lanes = _mm256_setzero_si256();
        for (a, b) in row.iter().zip(other) {
            let difference = _mm256_abs_epi16(_mm256_sub_epi16(values(a), values(b)));
            lanes = _mm256_add_epi32(lanes, _mm256_madd_epi16(difference, ones));
        }
        let mut each = [0u32; 8];
        // SAFETY: `each` is 32 bytes long, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(each.as_mut_ptr().cast(), lanes) };
        let total: u64 = each.iter().map(|&lane| u64::from(lane)).sum();
        *sum = u32::try_from(total).unwrap_or(u32::MAX);
    }
}

/// Loads sixteen values.
#[inline]
#[target_feature(enable = "avx2")]
fn values(values: &[u16; LANES]) -> __m256i {
    // SAFETY: the array has 32 bytes, and the load needs no alignment.
    unsafe { _mm256_loadu_si256(values.as_ptr().cast()) }
}
