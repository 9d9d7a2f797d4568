//! AVX2: four boids to a vector.
//!
//! A [`Four`] is made and used only in functions that are compiled for AVX2 (`step`), which is what makes its
//! operations sound and, as all is inlined there, fast.
#![expect(unsafe_code, reason = "vector operations as operators")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Lanes, MOST, operator};
use crate::flock::boids::grid::Boid;

/// Numbers of four boids.
#[derive(Clone, Copy, Debug)]
pub(in crate::flock::boids) struct Four(__m256d);

operator!(Four, Add, add, _mm256_add_pd);
operator!(Four, Sub, sub, _mm256_sub_pd);
operator!(Four, Mul, mul, _mm256_mul_pd);
operator!(Four, Div, div, _mm256_div_pd);

// Of all blocks below, SAFETY: whoever calls is compiled for AVX2 (above).

impl Neg for Four {
    type Output = Four;

    #[inline(always)]
    fn neg(self) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
    }
}

impl Lanes for Four {
    type Mask = __m256d;
    const N: usize = 4;

    #[inline(always)]
    fn splat(number: f64) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_set1_pd(number) })
    }

    #[inline(always)]
    fn from_fn(mut number: impl FnMut(usize) -> f64) -> Four {
        let [a, b, c, d] = [number(0), number(1), number(2), number(3)];
        // SAFETY: as above.
        Four(unsafe { _mm256_setr_pd(a, b, c, d) })
    }

    #[inline(always)]
    fn numbers(self) -> [f64; MOST] {
        let mut numbers = [0.0; MOST];
        // SAFETY: four are written to an array of eight; else as above.
        unsafe { _mm256_storeu_pd(numbers.as_mut_ptr(), self.0) };
        numbers
    }

    #[inline(always)]
    fn gather(boids: &[Boid], slots: &[u32]) -> ([Four; 3], [Four; 3]) {
        let boid = |lane: usize| &boids[slots[lane] as usize];
        // SAFETY: as above.
        unsafe {
            let ([x, y, z], velocity) = of_four([boid(0), boid(1), boid(2), boid(3)]);
            ([Four(x), Four(y), Four(z)], velocity.map(Four))
        }
    }

    #[inline(always)]
    fn sqrt(self) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_sqrt_pd(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }

    #[inline(always)]
    fn copysign(self, sign: Four) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_or_pd(self.abs().0, _mm256_and_pd(_mm256_set1_pd(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn min(self, other: Four) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_min_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Four) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_max_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn less(self, other: Four) -> __m256d {
        // SAFETY: as above.
        unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn at_least(self, other: Four) -> __m256d {
        // SAFETY: as above.
        unsafe { _mm256_cmp_pd::<_CMP_GE_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn mask(mut is: impl FnMut(usize) -> bool) -> __m256d {
        Four::from_fn(|lane| f64::from(u8::from(is(lane)))).at_least(Four::splat(1.0))
    }

    #[inline(always)]
    fn and(a: __m256d, b: __m256d) -> __m256d {
        // SAFETY: as above.
        unsafe { _mm256_and_pd(a, b) }
    }

    #[inline(always)]
    fn any(mask: __m256d) -> bool {
        // SAFETY: as above.
        unsafe { _mm256_movemask_pd(mask) != 0 }
    }

    #[inline(always)]
    fn select(mask: __m256d, then: Four, otherwise: Four) -> Four {
        // SAFETY: as above.
        Four(unsafe { _mm256_blendv_pd(otherwise.0, then.0, mask) })
    }
}

/// Positions and velocities of four boids, axis by axis.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn of_four(boids: [&Boid; 4]) -> ([__m256d; 3], [__m256d; 3]) {
    let mut heads = [_mm256_setzero_pd(); 4];
    let mut tails = [_mm256_setzero_pd(); 4];
    for lane in 0..4 {
        // SAFETY: six numbers follow one another there; four from the first and from the third are read.
        unsafe {
            let numbers = std::ptr::from_ref(boids[lane]).cast::<f64>();
            heads[lane] = _mm256_loadu_pd(numbers);
            tails[lane] = _mm256_loadu_pd(numbers.add(2));
        }
    }
    let ([x, y, z, _], [_, vx, vy, vz]) = (turned(heads), turned(tails));
    ([x, y, z], [vx, vy, vz])
}

/// Rows as columns.
#[inline]
#[target_feature(enable = "avx2")]
fn turned([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
    let (low_ab, high_ab) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
    let (low_cd, high_cd) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
    [
        _mm256_permute2f128_pd::<0x20>(low_ab, low_cd),
        _mm256_permute2f128_pd::<0x20>(high_ab, high_cd),
        _mm256_permute2f128_pd::<0x31>(low_ab, low_cd),
        _mm256_permute2f128_pd::<0x31>(high_ab, high_cd),
    ]
}
