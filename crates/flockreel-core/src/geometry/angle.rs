//! Angles: radians wrapped to (-pi, pi], and 16-bit integers that wrap by themselves.
//!
//! Planning compares headings as integers, 65536 to the circle, so that every machine computes the same plan
//! (docs/explanation/algorithms.md, "Planning").

use std::f64::consts::{PI, TAU};

/// Returns the angle wrapped to (-pi, pi].
///
/// ```
/// use flockreel_core::geometry::wrap_rad;
/// assert!((wrap_rad(3.5 * std::f64::consts::PI) + 0.5 * std::f64::consts::PI).abs() < 1e-12);
/// assert_eq!(wrap_rad(-std::f64::consts::PI), std::f64::consts::PI);
/// ```
pub fn wrap_rad(angle_rad: f64) -> f64 {
    let wrapped = angle_rad - TAU * ((angle_rad + PI) / TAU).floor();
    if wrapped <= -PI { PI } else { wrapped }
}

/// Returns the heading after a left-right mirror: pi - heading, wrapped.
pub fn mirrored_rad(heading_rad: f64) -> f64 {
    wrap_rad(PI - heading_rad)
}

/// Returns the mean direction of the angles, in (-pi, pi]. Returns `None` if there are none or if they
/// cancel.
pub fn mean_rad(angles_rad: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut x, mut y) = (0.0, 0.0);
    for angle in angles_rad {
        x += libm::cos(angle);
        y += libm::sin(angle);
    }
    (libm::hypot(x, y) > 1e-9).then(|| libm::atan2(y, x))
}

/// A heading or a difference of headings, in units of 1/65536 of a circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Turns(pub u16);

impl Turns {
    /// Units per radian: 65536 / (2 pi).
    pub const PER_RAD: f64 = 65536.0 / TAU;

    /// Converts from radians, rounding to the nearest unit.
    pub fn from_rad(angle_rad: f64) -> Turns {
        // Wrapping first makes the product fit an i32. The cast to u16 then wraps modulo 65536.
        Turns((wrap_rad(angle_rad) * Self::PER_RAD).round() as i32 as u16)
    }

    /// Converts to radians in (-pi, pi].
    pub fn to_rad(self) -> f64 {
        wrap_rad(f64::from(self.0) / Self::PER_RAD)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_survive_the_round_trip_through_radians() {
        for k in 0..65536u32 {
            let turns = Turns(k as u16);
            assert_eq!(Turns::from_rad(turns.to_rad()), turns);
        }
    }

    #[test]
    fn mirroring_a_heading_twice_returns_it() {
        assert!((mirrored_rad(mirrored_rad(1.234)) - 1.234).abs() < 1e-12);
        assert!((mirrored_rad(0.0) - PI).abs() < 1e-12);
    }

    #[test]
    fn mean_of_angles_across_the_seam_lies_on_the_seam() {
        let mean = mean_rad([3.0, -3.0]).expect("the two do not cancel");
        assert!((mean.abs() - PI).abs() < 1e-12);
        assert_eq!(mean_rad([]), None);
    }
}
