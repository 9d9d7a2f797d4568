//! Three numbers as a vector: what steering needs and no more. In a flat tank the third stays 0.

/// x right, y down, z away.
pub type Vec3 = [f64; 3];

/// a . b
#[inline(always)]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// |a|
#[inline(always)]
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// a + k b
#[inline(always)]
pub fn add_scaled(a: Vec3, k: f64, b: Vec3) -> Vec3 {
    [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]]
}

/// a - b
#[inline(always)]
pub fn minus(a: Vec3, b: Vec3) -> Vec3 {
    add_scaled(a, -1.0, b)
}

/// k a
#[inline(always)]
pub fn scaled(k: f64, a: Vec3) -> Vec3 {
    [k * a[0], k * a[1], k * a[2]]
}

/// a / |a|, and nothing for (nearly) nothing.
#[inline(always)]
pub fn unit(a: Vec3) -> Vec3 {
    let length = norm(a);
    if length > 1e-12 {
        scaled(1.0 / length, a)
    } else {
        [0.0; 3]
    }
}

/// The angle between two directions, 0..=pi.
pub fn angle_between(a: Vec3, b: Vec3) -> f64 {
    libm::atan2(norm(cross(a, b)), dot(a, b))
}

/// a x b
#[inline(always)]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// `to` turned back toward `from` until the angle between them is at most that of (cos, sin); the
/// length stays that of `to`. Opposite directions turn toward `aside`.
#[inline(always)]
pub fn turned_at_most(from: Vec3, to: Vec3, cos_sin: (f64, f64), aside: Vec3) -> Vec3 {
    let (speed, u) = (norm(to), unit(from));
    let along = dot(unit(to), u);
    if along >= cos_sin.0 || norm(u) == 0.0 {
        return to;
    }
    let mut perpendicular = add_scaled(unit(to), -along, u);
    if norm(perpendicular) < 1e-6 {
        perpendicular = add_scaled(aside, -dot(aside, u), u);
    }
    let turned = add_scaled(scaled(cos_sin.0, u), cos_sin.1, unit(perpendicular));
    scaled(speed, turned)
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
