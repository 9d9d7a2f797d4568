//! AVX-512 F: eight boids to a vector.
//!
//! An [`Eight`] is made and used only in functions that are compiled for AVX-512 F (`step`), which is what makes its
//! operations sound and, as all is inlined there, fast.
#![expect(unsafe_code, reason = "vector operations as operators")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::avx2::of_four;
use super::{Lanes, MOST, operator};
use crate::flock::boids::grid::Boid;

/// Numbers of eight boids.
#[derive(Clone, Copy, Debug)]
pub(in crate::flock::boids) struct Eight(__m512d);

operator!(Eight, Add, add, _mm512_add_pd);
operator!(Eight, Sub, sub, _mm512_sub_pd);
operator!(Eight, Mul, mul, _mm512_mul_pd);
operator!(Eight, Div, div, _mm512_div_pd);

// Of all blocks below, SAFETY: whoever calls is compiled for AVX-512 F (above).

impl Neg for Eight {
    type Output = Eight;

    #[inline(always)]
    fn neg(self) -> Eight {
        // SAFETY: as above.
        unsafe {
            let sign = _mm512_castpd_si512(_mm512_set1_pd(-0.0));
            let bits = _mm512_xor_si512(_mm512_castpd_si512(self.0), sign);
            Eight(_mm512_castsi512_pd(bits))
        }
    }
}

impl Lanes for Eight {
    type Mask = __mmask8;
    const N: usize = 8;

    #[inline(always)]
    fn splat(number: f64) -> Eight {
        // SAFETY: as above.
        Eight(unsafe { _mm512_set1_pd(number) })
    }

    #[inline(always)]
    fn from_fn(mut number: impl FnMut(usize) -> f64) -> Eight {
        let mut numbers = [0.0; MOST];
        for lane in 0..MOST {
            numbers[lane] = number(lane);
        }
        // SAFETY: eight are read from an array of eight; else as above.
        Eight(unsafe { _mm512_loadu_pd(numbers.as_ptr()) })
    }

    #[inline(always)]
    fn numbers(self) -> [f64; MOST] {
        let mut numbers = [0.0; MOST];
        // SAFETY: eight are written to an array of eight; else as above.
        unsafe { _mm512_storeu_pd(numbers.as_mut_ptr(), self.0) };
        numbers
    }

    #[inline(always)]
    fn gather(boids: &[Boid], slots: &[u32]) -> ([Eight; 3], [Eight; 3]) {
        let boid = |lane: usize| &boids[slots[lane] as usize];
        // SAFETY: AVX-512 F includes AVX2; else as above.
        unsafe {
            let first = of_four([boid(0), boid(1), boid(2), boid(3)]);
            let last = of_four([boid(4), boid(5), boid(6), boid(7)]);
            (side_by_side(first.0, last.0), side_by_side(first.1, last.1))
        }
    }

    #[inline(always)]
    fn sqrt(self) -> Eight {
        // SAFETY: as above.
        Eight(unsafe { _mm512_sqrt_pd(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> Eight {
        // SAFETY: as above.
        Eight(unsafe { _mm512_abs_pd(self.0) })
    }

    #[inline(always)]
    fn copysign(self, sign: Eight) -> Eight {
        // SAFETY: as above.
        unsafe {
            let mask = _mm512_castpd_si512(_mm512_set1_pd(-0.0));
            let sign = _mm512_and_si512(_mm512_castpd_si512(sign.0), mask);
            let bits = _mm512_or_si512(_mm512_castpd_si512(self.abs().0), sign);
            Eight(_mm512_castsi512_pd(bits))
        }
    }

    #[inline(always)]
    fn min(self, other: Eight) -> Eight {
        // SAFETY: as above.
        Eight(unsafe { _mm512_min_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Eight) -> Eight {
        // SAFETY: as above.
        Eight(unsafe { _mm512_max_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn less(self, other: Eight) -> __mmask8 {
        // SAFETY: as above.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn at_least(self, other: Eight) -> __mmask8 {
        // SAFETY: as above.
        unsafe { _mm512_cmp_pd_mask::<_CMP_GE_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn mask(mut is: impl FnMut(usize) -> bool) -> __mmask8 {
        let mut mask = 0;
        for lane in 0..MOST {
            mask |= __mmask8::from(is(lane)) << lane;
        }
        mask
    }

    #[inline(always)]
    fn and(a: __mmask8, b: __mmask8) -> __mmask8 {
        a & b
    }

    #[inline(always)]
    fn any(mask: __mmask8) -> bool {
        mask != 0
    }

    #[inline(always)]
    fn select(mask: __mmask8, then: Eight, otherwise: Eight) -> Eight {
        // SAFETY: as above.
        Eight(unsafe { _mm512_mask_blend_pd(mask, otherwise.0, then.0) })
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn side_by_side(first: [__m256d; 3], last: [__m256d; 3]) -> [Eight; 3] {
    let mut all = [Eight(_mm512_setzero_pd()); 3];
    for axis in 0..3 {
        let low = _mm512_castpd256_pd512(first[axis]);
        all[axis] = Eight(_mm512_insertf64x4::<1>(low, last[axis]));
    }
    all
}
