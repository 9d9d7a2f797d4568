//! Vectors of three numbers, for one boid or for several in the lanes of a vector register. In a flat tank
//! the third number stays 0.

use super::lanes::{Lanes, select3};

/// x right, y down, z away from the camera.
pub type Vec3 = [f64; 3];

/// a . b
#[inline(always)]
pub fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// |a|
#[inline(always)]
pub fn norm<L: Lanes>(a: [L; 3]) -> L {
    dot(a, a).sqrt()
}

/// a + k b
#[inline(always)]
pub fn add_scaled<L: Lanes>(a: [L; 3], k: L, b: [L; 3]) -> [L; 3] {
    [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]]
}

/// a + b
#[inline(always)]
pub fn plus<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b
#[inline(always)]
pub fn minus<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// k a
#[inline(always)]
pub fn scaled<L: Lanes>(k: L, a: [L; 3]) -> [L; 3] {
    [k * a[0], k * a[1], k * a[2]]
}

/// a / |a|, or 0 if |a| is nearly 0.
#[inline(always)]
pub fn unit<L: Lanes>(a: [L; 3]) -> [L; 3] {
    let length = norm(a);
    let is_long = L::splat(1e-12).less(length);
    let share = L::select(is_long, L::splat(1.0) / length, L::splat(0.0));
    scaled(share, a)
}

/// Returns the angle between two directions, 0..=pi.
pub fn angle_between(a: Vec3, b: Vec3) -> f64 {
    libm::atan2(norm(cross(a, b)), dot(a, b))
}

/// a x b
#[inline(always)]
pub fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns `to`, turned toward `from` until the angle between them is at most the one with this (cos, sin).
/// The length of `to` is kept. Opposite directions turn toward `aside`.
#[inline(always)]
pub fn turned_at_most<L: Lanes>(
    from: [L; 3],
    to: [L; 3],
    (cos, sin): (L, L),
    aside: [L; 3],
) -> [L; 3] {
    let (speed, u, course) = (norm(to), unit(from), unit(to));
    let along = dot(course, u);
    let turns = L::and(along.less(cos), L::splat(0.0).less(norm(u)));
    if !L::any(turns) {
        return to;
    }
    let across = add_scaled(course, -along, u);
    let is_opposite = norm(across).less(L::splat(1e-6));
    let across = select3::<L>(is_opposite, add_scaled(aside, -dot(aside, u), u), across);
    let turned = add_scaled(scaled(cos, u), sin, unit(across));
    select3::<L>(turns, scaled(speed, turned), to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_cut_to_the_limit_and_keep_the_speed() {
        let limit = 0.2f64;
        let cos_sin = (libm::cos(limit), libm::sin(limit));
        let turned = turned_at_most([1.0, 0.0, 0.0], [0.0, 2.0, 0.0], cos_sin, [0.0, 1.0, 0.0]);
        assert!((norm(turned) - 2.0).abs() < 1e-12);
        assert!((libm::atan2(turned[1], turned[0]) - limit).abs() < 1e-12);
        let about = turned_at_most([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], cos_sin, [0.0, 0.0, 1.0]);
        assert!((about[2] - libm::sin(limit)).abs() < 1e-12);
        let small = [1.0, 0.1, 0.0];
        assert_eq!(
            turned_at_most([1.0, 0.0, 0.0], small, cos_sin, [0.0, 1.0, 0.0]),
            small
        );
    }
}
