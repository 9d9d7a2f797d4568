//! Vectors of three numbers: positions, velocities and wishes of boids. In a flat tank the third number
//! stays 0.

/// x right, y down, z away from the camera.
pub type Vec3 = [f64; 3];

/// a . b
#[inline]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// |a|
#[inline]
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// a + k b
#[inline]
pub fn add_scaled(a: Vec3, k: f64, b: Vec3) -> Vec3 {
    [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]]
}

/// a + b
#[inline]
pub fn plus(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b
#[inline]
pub fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// k a
#[inline]
pub fn scaled(k: f64, a: Vec3) -> Vec3 {
    [k * a[0], k * a[1], k * a[2]]
}

/// a / |a|, or 0 if |a| is nearly 0.
#[inline]
pub fn unit(a: Vec3) -> Vec3 {
    let length = norm(a);
    let share = if length > 1e-12 { 1.0 / length } else { 0.0 };
    scaled(share, a)
}

/// Returns the angle between two directions, 0..=pi.
pub fn angle_between(a: Vec3, b: Vec3) -> f64 {
    libm::atan2(norm(cross(a, b)), dot(a, b))
}

/// a x b
#[inline]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns `to`, turned toward `from` until the angle between them is at most the one with this (cos, sin).
/// The length of `to` is kept. Opposite directions turn toward `aside`.
#[inline]
pub fn turned_at_most(from: Vec3, to: Vec3, (cos, sin): (f64, f64), aside: Vec3) -> Vec3 {
    let (speed, u, course) = (norm(to), unit(from), unit(to));
    let along = dot(course, u);
    if along >= cos || norm(u) == 0.0 {
        return to;
    }
    let mut across = add_scaled(course, -along, u);
    if norm(across) < 1e-6 {
        across = add_scaled(aside, -dot(aside, u), u);
    }
    scaled(speed, add_scaled(scaled(cos, u), sin, unit(across)))
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
