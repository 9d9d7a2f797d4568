//! AVX2: four others at a time, the near ones moved together; the ranks of 24 at a time.
#![expect(
    unsafe_code,
    reason = "vector loads and stores and the call into code for AVX2"
)]

use std::arch::x86_64::*;

use super::Near;
use crate::flock::boids::grid::{BLOCK, Boid, Grid};

/// Vectors of ranks at a time: with the squares that they belong to, most of the registers.
const RANKS: usize = 6;

/// How to move together those of four that are near, as bits, in 32-bit halves; and how many they are.
const TOGETHER: [([u32; 8], usize); 16] = {
    let mut all = [([0; 8], 0); 16];
    let mut bits = 0;
    while bits < 16 {
        let mut lane = 0;
        while lane < 4 {
            if bits >> lane & 1 == 1 {
                let (halves, n) = &mut all[bits];
                halves[2 * *n] = 2 * lane;
                halves[2 * *n + 1] = 2 * lane + 1;
                *n += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    all
};

/// As `scalar::gather`. Panics where AVX2 is missing.
#[inline(always)]
pub(super) fn gather(grid: &Grid, (slot, radius_bl): (usize, f64), near: &mut Near) {
    assert!(is_x86_feature_detected!("avx2"), "this machine has no AVX2");
    // SAFETY: the line above made sure of AVX2, which is all that the callee asks for.
    unsafe { gather_avx2(grid, (slot, radius_bl), near) }
}

/// As `scalar::rank`. Panics where AVX2 is missing.
#[inline(always)]
pub(super) fn rank(near: &mut Near) {
    assert!(is_x86_feature_detected!("avx2"), "this machine has no AVX2");
    // SAFETY: the line above made sure of AVX2, which is all that the callee asks for.
    unsafe { rank_avx2(near) }
}

/// Has the memory fetch a boid that is looked at soon.
#[inline(always)]
pub(super) fn prefetch(boid: &Boid) {
    // SAFETY: whatever is hinted at, nothing of it is read; every x86-64 has it.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(boid).cast()) };
}

// No closures here: what is called with them is not compiled for AVX2.
#[target_feature(enable = "avx2")]
fn gather_avx2(grid: &Grid, (slot, radius_bl): (usize, f64), near: &mut Near) {
    let place = grid.at(slot).position;
    let [x, y, z] = [
        _mm256_set1_pd(place[0]),
        _mm256_set1_pd(place[1]),
        _mm256_set1_pd(place[2]),
    ];
    let most_bl2 = _mm256_set1_pd(radius_bl * radius_bl);
    let own = _mm256_set1_epi64x(slot as i64);
    let lanes = _mm256_setr_epi64x(0, 1, 2, 3);
    let is_flat = grid.is_flat();
    near.n = 0;
    for (from, to) in grid.rows(place, radius_bl) {
        near.make_room(to - from);
        let end = _mm256_set1_epi64x(to as i64);
        let blocks = from..from + (to - from).next_multiple_of(BLOCK);
        let (xs, _) = grid.along(0)[blocks.clone()].as_chunks::<BLOCK>();
        let (ys, _) = grid.along(1)[blocks.clone()].as_chunks::<BLOCK>();
        let (zs, _) = grid.along(2)[blocks].as_chunks::<BLOCK>();
        let mut slots = _mm256_add_epi64(_mm256_set1_epi64x(from as i64), lanes);
        for ((xs, ys), zs) in xs.iter().zip(ys).zip(zs) {
            let mut squares = _mm256_add_pd(square(xs, x), square(ys, y));
            if !is_flat {
                squares = _mm256_add_pd(squares, square(zs, z));
            }
            let is_other = _mm256_andnot_si256(
                _mm256_cmpeq_epi64(slots, own),
                _mm256_cmpgt_epi64(end, slots),
            );
            let is_near = _mm256_cmp_pd::<_CMP_LT_OQ>(squares, most_bl2);
            let is_near = _mm256_and_pd(is_near, _mm256_castsi256_pd(is_other));
            // SAFETY: there was room for the row and a block more, and no more is kept than of the row before these.
            unsafe { keep(near, _mm256_movemask_pd(is_near) as usize, (squares, slots)) };
            slots = _mm256_add_epi64(slots, _mm256_set1_epi64x(BLOCK as i64));
        }
    }
}

/// Keeps those of four whose bits are set. There must be room for all four.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn keep(near: &mut Near, bits: usize, (squares, slots): (__m256d, __m256i)) {
    let (halves, n) = &TOGETHER[bits];
    // SAFETY: eight halves are read from an array of eight; the caller made sure of what is written.
    unsafe {
        let halves = _mm256_loadu_si256(halves.as_ptr().cast());
        let squares = _mm256_permutevar8x32_epi32(_mm256_castpd_si256(squares), halves);
        let slots = _mm256_permutevar8x32_epi32(slots, halves);
        _mm256_storeu_si256(near.squares_bl2.as_mut_ptr().add(near.n).cast(), squares);
        _mm256_storeu_si256(near.slots.as_mut_ptr().add(near.n).cast(), slots);
    }
    near.n += n;
}

#[inline]
#[target_feature(enable = "avx2")]
fn square(along: &[f64; BLOCK], own: __m256d) -> __m256d {
    let offset = _mm256_sub_pd(load(along), own);
    _mm256_mul_pd(offset, offset)
}

#[target_feature(enable = "avx2")]
fn rank_avx2(near: &mut Near) {
    let n = near.n;
    // Whoever is ranked besides them is of no matter.
    let squares = near.squares_bl2.as_chunks::<{ RANKS * BLOCK }>().0.iter();
    let ranks = near.ranks.as_chunks_mut::<{ RANKS * BLOCK }>().0.iter_mut();
    for (squares, ranks) in squares.zip(ranks).take(n.div_ceil(RANKS * BLOCK)) {
        let mut own = [_mm256_setzero_pd(); RANKS];
        for (own, squares) in own.iter_mut().zip(squares.as_chunks().0) {
            *own = load(squares);
        }
        let mut nearer = [_mm256_setzero_si256(); RANKS];
        for &other in &near.squares_bl2[..n] {
            let other = _mm256_set1_pd(other);
            for (nearer, own) in nearer.iter_mut().zip(own) {
                // True is all bits, -1.
                let is_nearer = _mm256_castpd_si256(_mm256_cmp_pd::<_CMP_LT_OQ>(other, own));
                *nearer = _mm256_sub_epi64(*nearer, is_nearer);
            }
        }
        for (ranks, nearer) in ranks.as_chunks_mut::<BLOCK>().0.iter_mut().zip(nearer) {
            // SAFETY: four are written to an array of four.
            unsafe { _mm256_storeu_si256(ranks.as_mut_ptr().cast(), nearer) };
        }
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn load(four: &[f64; BLOCK]) -> __m256d {
    // SAFETY: four are read from an array of four.
    unsafe { _mm256_loadu_pd(four.as_ptr()) }
}
