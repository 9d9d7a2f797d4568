//! Numbers of several boids side by side: what steers one boid is written once, for as many as the machine reckons
//! with at a time.
//!
//! Every lane is reckoned as if it were alone, operation by operation, so that the bits are the same for any number of
//! lanes: no sum goes across them, and no product is fused with a sum.
//!
//! What reckons with lanes is inlined, always, into a function that is compiled for their instructions. A closure is
//! not, nor what `map` and `fold` are made of, so there are no lanes in those, unless they are rarely called.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

#[cfg(target_arch = "x86_64")]
pub(super) use self::{avx2::Four, avx512::Eight};

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::grid::Boid;
use super::vector::Vec3;

/// No machine has more.
pub const MOST: usize = 8;

/// A number of each of `N` boids; `f64` is that of one.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Which of the boids.
    type Mask: Copy;
    /// How many, at most `MOST`.
    const N: usize;

    /// The same of all.
    fn splat(number: f64) -> Self;
    /// Lane by lane, `MOST` are asked for.
    fn from_fn(number: impl FnMut(usize) -> f64) -> Self;
    /// Of each; those from `N` on mean nothing.
    fn numbers(self) -> [f64; MOST];
    /// Positions and velocities of `N` boids out of many.
    fn gather(boids: &[Boid], slots: &[u32]) -> ([Self; 3], [Self; 3]);

    /// As `f64::sqrt`.
    fn sqrt(self) -> Self;
    /// As `f64::abs`.
    fn abs(self) -> Self;
    /// As `f64::copysign`.
    fn copysign(self, sign: Self) -> Self;
    /// The smaller one; neither is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater one; neither is NaN.
    fn max(self, other: Self) -> Self;

    /// Where it is less than the other.
    fn less(self, other: Self) -> Self::Mask;
    /// Where it is no less than the other.
    fn at_least(self, other: Self) -> Self::Mask;
    /// Lane by lane.
    fn mask(is: impl FnMut(usize) -> bool) -> Self::Mask;
    /// Where both are.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Whether there is one at all.
    fn any(mask: Self::Mask) -> bool;
    /// One number where the mask is, the other elsewhere.
    fn select(mask: Self::Mask, then: Self, otherwise: Self) -> Self;

    /// 1 where the mask is, 0 elsewhere.
    #[inline(always)]
    fn one_where(mask: Self::Mask) -> Self {
        Self::select(mask, Self::splat(1.0), Self::splat(0.0))
    }

    /// Neither less nor greater than these.
    #[inline(always)]
    fn clamp(self, least: Self, most: Self) -> Self {
        self.max(least).min(most)
    }
}

/// An operator of two vectors that is one instruction.
#[cfg(target_arch = "x86_64")]
macro_rules! operator {
    ($of:ident, $operator:ident, $name:ident, $instruction:ident) => {
        impl $operator for $of {
            type Output = $of;

            #[inline(always)]
            fn $name(self, other: $of) -> $of {
                // SAFETY: whoever has one runs on a machine that has the instruction (the module's head).
                $of(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}
#[cfg(target_arch = "x86_64")]
use operator;

/// The same vector of all.
#[inline(always)]
pub fn splat3<L: Lanes>(vector: Vec3) -> [L; 3] {
    [
        L::splat(vector[0]),
        L::splat(vector[1]),
        L::splat(vector[2]),
    ]
}

/// A vector of each, lane by lane.
#[inline(always)]
pub fn by_lane<L: Lanes>(mut vector: impl FnMut(usize) -> Vec3) -> [L; 3] {
    let mut vectors = [[0.0; 3]; MOST];
    for lane in 0..L::N {
        vectors[lane] = vector(lane);
    }
    [
        L::from_fn(|lane| vectors[lane][0]),
        L::from_fn(|lane| vectors[lane][1]),
        L::from_fn(|lane| vectors[lane][2]),
    ]
}

/// The vector of one lane.
#[inline(always)]
pub fn in_lane<L: Lanes>(vectors: [L; 3], lane: usize) -> Vec3 {
    let [x, y, z] = vectors;
    [x.numbers()[lane], y.numbers()[lane], z.numbers()[lane]]
}

/// One vector where the mask is, the other elsewhere.
#[inline(always)]
pub fn select3<L: Lanes>(mask: L::Mask, then: [L; 3], otherwise: [L; 3]) -> [L; 3] {
    [
        L::select(mask, then[0], otherwise[0]),
        L::select(mask, then[1], otherwise[1]),
        L::select(mask, then[2], otherwise[2]),
    ]
}

impl Lanes for f64 {
    type Mask = bool;
    const N: usize = 1;

    #[inline(always)]
    fn splat(number: f64) -> f64 {
        number
    }

    #[inline(always)]
    fn from_fn(mut number: impl FnMut(usize) -> f64) -> f64 {
        number(0)
    }

    #[inline(always)]
    fn numbers(self) -> [f64; MOST] {
        [self; MOST]
    }

    #[inline(always)]
    fn gather(boids: &[Boid], slots: &[u32]) -> (Vec3, Vec3) {
        let boid = &boids[slots[0] as usize];
        (boid.position, boid.velocity)
    }

    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: f64) -> f64 {
        f64::copysign(self, sign)
    }

    #[inline(always)]
    fn min(self, other: f64) -> f64 {
        if self < other { self } else { other }
    }

    #[inline(always)]
    fn max(self, other: f64) -> f64 {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn less(self, other: f64) -> bool {
        self < other
    }

    #[inline(always)]
    fn at_least(self, other: f64) -> bool {
        self >= other
    }

    #[inline(always)]
    fn mask(mut is: impl FnMut(usize) -> bool) -> bool {
        is(0)
    }

    #[inline(always)]
    fn and(a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }

    #[inline(always)]
    fn select(mask: bool, then: f64, otherwise: f64) -> f64 {
        if mask { then } else { otherwise }
    }
}
