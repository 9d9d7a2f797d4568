//! Trunk and eyes of the virtual fish: elliptical cross-sections along the spine.
//!
//! The profile is that of a common goldfish: a blunt nose, the greatest depth behind the head, and a
//! slender tail root.

use std::f64::consts::{PI, TAU};

use super::colors::Colors;
use super::mesh::{Layer, Material, MeshBuilder, SurfacePoint};

/// Position along the body where the trunk ends and the tail fin begins: 0 = nose, 1 = tip of the tail.
/// Free choice.
pub(super) const TRUNK_END_S: f64 = 0.76;
/// Half of the greatest depth of the trunk, in body lengths. Free choice.
const HALF_DEPTH_BL: f64 = 0.152;

/// Number of cross-sections along the trunk. Free choice.
const RINGS: usize = 88;
/// Number of points around a cross-section; the last repeats the first. Free choice.
const SPOKES: usize = 41;

/// Knots of the profile: (u, extent above the spine, extent below the spine, half width), with u = s /
/// TRUNK_END_S and extents as multiples of HALF_DEPTH_BL. Free choice.
const PROFILE: [[f64; 4]; 12] = [
    [0.00, 0.00, 0.00, 0.00],
    [0.012, 0.15, 0.17, 0.15],
    [0.035, 0.28, 0.29, 0.27],
    [0.09, 0.48, 0.44, 0.41],
    [0.17, 0.70, 0.64, 0.53],
    [0.28, 0.89, 0.87, 0.60],
    [0.42, 1.00, 1.00, 0.63],
    [0.56, 0.93, 0.97, 0.54],
    [0.70, 0.72, 0.74, 0.38],
    [0.82, 0.50, 0.47, 0.23],
    [0.92, 0.38, 0.34, 0.14],
    [1.00, 0.37, 0.34, 0.00],
];

/// Returns the extent of the trunk above the spine, below the spine and to each side at `s`, in body
/// lengths.
pub(super) fn profile_bl(s: f64) -> [f64; 3] {
    let u = (s / TRUNK_END_S).clamp(0.0, 1.0);
    let after = PROFILE.partition_point(|knot| knot[0] <= u);
    let k = after.clamp(1, PROFILE.len() - 1);
    std::array::from_fn(|column| HALF_DEPTH_BL * hermite(k - 1, column + 1, u))
}

/// Returns how far the middle of the trunk lies below the spine at `s`, in body lengths. The nose points
/// slightly down.
fn sag_bl(s: f64) -> f64 {
    let ahead = (0.2 - s).max(0.0);
    0.55 * ahead * ahead
}

/// Adds the trunk to the mesh.
pub(super) fn add_trunk(builder: &mut MeshBuilder, colors: &Colors) {
    builder.add_grid(Layer::Body, RINGS, SPOKES, |i, j| {
        let s = TRUNK_END_S * ring_u(i);
        let angle = TAU * j as f64 / (SPOKES - 1) as f64;
        // The last point equals the first, so the seam closes exactly.
        let (sin, cos) = if j == SPOKES - 1 {
            (0.0, 1.0)
        } else {
            (libm::sin(angle), libm::cos(angle))
        };
        let [above, below, side] = profile_bl(s);
        let down = -sin * if sin > 0.0 { above } else { below };
        let material = Material {
            color: colors.skin(s, sin),
            shine: 0.55,
            grain: [(s * 44.0) as f32, (angle / TAU * 40.0) as f32],
            grain_depth: 0.16 * (((s - 0.19) / 0.05).clamp(0.0, 1.0) as f32),
        };
        SurfacePoint {
            at: [s, sag_bl(s) + down, cos * side],
            material,
        }
    });
}

/// Adds an eye on each side to the mesh.
pub(super) fn add_eyes(builder: &mut MeshBuilder, colors: &Colors) {
    const AT: [f64; 2] = [0.098, -0.016];
    const RADIUS: f64 = 0.0235;
    let [above, _, side] = profile_bl(AT[0]);
    let height_share = (sag_bl(AT[0]) - AT[1]) / above;
    let skin = side * (1.0 - height_share * height_share).sqrt();
    for sign in [1.0, -1.0] {
        builder.add_grid(Layer::Body, 10, 21, |i, j| {
            let polar = 0.5 * PI * i as f64 / 9.0;
            let angle = if j == 20 { 0.0 } else { TAU * j as f64 / 20.0 };
            let (sin, cos) = (libm::sin(polar), libm::cos(polar));
            let rise = RADIUS * (0.62 * cos - 0.20);
            let up = sin * libm::sin(angle);
            let lean = -0.35 * RADIUS * up;
            SurfacePoint {
                at: [
                    AT[0] + RADIUS * sin * libm::cos(angle) * sign,
                    AT[1] - RADIUS * up,
                    sign * (skin + rise + lean),
                ],
                material: Material {
                    color: colors.eye(cos, up),
                    shine: 1.0,
                    grain: [0.0; 2],
                    grain_depth: 0.0,
                },
            }
        });
    }
}

/// Returns the position of ring `i` along the trunk, 0..=1. Rings are denser toward the nose.
fn ring_u(i: usize) -> f64 {
    let t = i as f64 / (RINGS - 1) as f64;
    t * (0.35 + 0.65 * t)
}

/// Returns the monotone cubic interpolation of one column of the profile between knots k and k + 1 (Fritsch
/// & Butland 1984). Monotone interpolation makes no dents.
fn hermite(k: usize, column: usize, u: f64) -> f64 {
    let knot = |i: usize| (PROFILE[i][0], PROFILE[i][column]);
    let secant = |i: usize| (knot(i + 1).1 - knot(i).1) / (knot(i + 1).0 - knot(i).0);
    let slope = |i: usize| match i {
        0 => secant(0),
        i if i == PROFILE.len() - 1 => secant(i - 1),
        i if secant(i - 1) * secant(i) <= 0.0 => 0.0,
        i => 2.0 * secant(i - 1) * secant(i) / (secant(i - 1) + secant(i)),
    };
    let ((u0, v0), (u1, v1)) = (knot(k), knot(k + 1));
    let (h, t) = (u1 - u0, (u - u0) / (u1 - u0));
    let (t2, t3) = (t * t, t * t * t);
    let value = (2.0 * t3 - 3.0 * t2 + 1.0) * v0
        + (t3 - 2.0 * t2 + t) * h * slope(k)
        + (3.0 * t2 - 2.0 * t3) * v1
        + (t3 - t2) * h * slope(k + 1);
    value.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_passes_through_its_knots_without_dents() {
        for knot in PROFILE {
            let got = profile_bl(knot[0] * TRUNK_END_S);
            for (g, want) in got.iter().zip(&knot[1..]) {
                assert!((g - HALF_DEPTH_BL * want).abs() < 1e-12);
            }
        }
        let above = |k: i32| profile_bl(f64::from(k) * 0.001)[0];
        assert!(
            (1..=319).all(|k| above(k) >= above(k - 1)),
            "rises to the nape"
        );
        assert!(
            (321..=740).all(|k| above(k) <= above(k - 1) + 1e-9),
            "falls to the tail"
        );
    }
}
