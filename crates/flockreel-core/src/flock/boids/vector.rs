//! Vectors of three numbers: positions, velocities and accelerations of boids. In a flat tank the third number
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

/// Cosine and sine of an angle.
#[derive(Clone, Copy, Debug)]
pub struct CosSin {
    /// Cosine.
    pub cos: f64,
    /// Sine.
    pub sin: f64,
}

impl CosSin {
    /// Returns cosine and sine of an angle, the same on every machine.
    pub fn new(angle_rad: f64) -> CosSin {
        CosSin {
            cos: libm::cos(angle_rad),
            sin: libm::sin(angle_rad),
        }
    }
}

/// Returns `to`, turned toward `from` until the angle between them is at most `limit`. The length of `to` is
/// kept. Opposite directions turn toward `sideways`.
#[inline]
pub fn turned_at_most(from: Vec3, to: Vec3, limit: CosSin, sideways: Vec3) -> Vec3 {
    let CosSin { cos, sin } = limit;
    let (speed, u, course) = (norm(to), unit(from), unit(to));
    let along = dot(course, u);
    if along >= cos || norm(u) == 0.0 {
        return to;
    }
    let mut across = add_scaled(course, -along, u);
    if norm(across) < 1e-6 {
        across = add_scaled(sideways, -dot(sideways, u), u);
    }
    scaled(speed, add_scaled(scaled(cos, u), sin, unit(across)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_limited_and_keep_the_speed() {
        let (limit, right) = (0.2, [1.0, 0.0, 0.0]);
        let turned = |to, sideways| turned_at_most(right, to, CosSin::new(limit), sideways);
        let down = [0.0, 1.0, 0.0];
        let aside = turned([0.0, 2.0, 0.0], down);
        assert!((norm(aside) - 2.0).abs() < 1e-12);
        assert!((libm::atan2(aside[1], aside[0]) - limit).abs() < 1e-12);
        let reversed = turned([-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        assert!((reversed[2] - libm::sin(limit)).abs() < 1e-12);
        let small = [1.0, 0.1, 0.0];
        assert_eq!(turned(small, down), small);
    }
}
