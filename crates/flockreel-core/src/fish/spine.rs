//! Spine of the virtual fish: 8 joints, bent by the measured midline or by a swimming wave.
//!
//! The wave is A(s) sin(2 pi (f t - s / 0.95)) with A(s) = a0 + a2 s^2
//! (docs/explanation/algorithms.md, "Virtual fish").
//!
//! The fish's own frame: x forward, y down (toward the belly), z to its left; the origin is the middle of
//! the silhouette. `s` runs from the nose (0) to the tip of the tail (1). A joint angle rotates the part
//! behind the joint about the y axis. A positive angle moves the tail to the fish's left.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

use crate::geometry::wrap_rad;

/// Number of joints of the spine.
pub const N_JOINTS: usize = 8;

/// Positions of the joints along the body, from the nose (0) to the tip of the tail (1). The first joint
/// carries the head, which is stiff. Free choice.
pub const JOINT_S: [f64; N_JOINTS] = [0.27, 0.36, 0.45, 0.54, 0.63, 0.72, 0.81, 0.90];

/// Position along the body of the origin of the fish's own frame: the middle of the silhouette.
pub const ORIGIN_S: f64 = 0.466;

/// Distance of the spine below the middle of the silhouette, in body lengths. The dorsal fin, the tallest
/// fin, moves the middle up.
pub const SPINE_DOWN_BL: f64 = 0.017;

/// Wavelength of the swimming wave, in body lengths. Free choice.
const WAVELENGTH_BL: f64 = 0.95;
/// Amplitude a0 of the wave at the nose, in body lengths. Free choice.
const A0_BL: f64 = 0.012;
/// Growth a2 of the amplitude with s squared, in body lengths. The amplitude of the tail tip is a0 + a2.
/// Free choice.
const A2_BL: f64 = 0.085;
/// Sideways bend in a turn, in body lengths per radian a second: the factor of (s - 0.2) squared. Free
/// choice.
const TURN_BEND_BL: f64 = 0.055;

/// Phase and strength of swimming at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swimming {
    /// Phase f t of the tail beat, in beats.
    pub phase_turns: f64,
    /// Share of the full amplitude, 0..=1.5; small while the fish glides.
    pub effort: f64,
    /// Sideways bend of the whole body, in body lengths: the factor of (s - 0.2) squared; positive = to the left.
    pub bend_bl: f64,
}

impl Swimming {
    /// Returns the swimming whose wave has the given parts: effort times cosine and sine of the phase.
    pub fn of_wave(bend_bl: f64, [cosine, sine]: [f64; 2]) -> Swimming {
        Swimming {
            phase_turns: libm::atan2(sine, cosine) / TAU,
            effort: cosine.hypot(sine),
            bend_bl,
        }
    }

    /// Returns the sideways displacement of the spine at `s`, in body lengths, positive to the fish's left.
    pub fn lateral_bl(&self, s: f64) -> f64 {
        let amplitude = self.effort * (A0_BL + A2_BL * s * s);
        let wave = amplitude * libm::sin(TAU * (self.phase_turns - s / WAVELENGTH_BL));
        let behind = (s - 0.2).max(0.0);
        wave + self.bend_bl * behind * behind
    }

    /// Returns the joint angles that bend the spine along this curve, in radians.
    pub fn joint_angles_rad(&self) -> [f64; N_JOINTS] {
        angles_of_tangents(|from, to| {
            libm::atan2(self.lateral_bl(to) - self.lateral_bl(from), to - from)
        })
    }
}

/// Returns how far the spine at `s` lies to the left of the first joint, in body lengths, for a bend of 1 and for each
/// part of the wave (`Swimming::of_wave`). The head is stiff.
pub(super) fn lateral_parts_bl(s: f64) -> [f64; 3] {
    [(1.0, [0.0; 2]), (0.0, [1.0, 0.0]), (0.0, [0.0, 1.0])].map(|(bend_bl, wave)| {
        let swimming = Swimming::of_wave(bend_bl, wave);
        swimming.lateral_bl(s) - swimming.lateral_bl(JOINT_S[0])
    })
}

/// Returns the angle between the body's axis and the line from the first joint to the tail tip, in radians; positive
/// to the animal's left.
pub fn tail_tip_rad(angles_rad: &[f64; N_JOINTS]) -> f64 {
    let joints = joint_frames(1.0, angles_rad);
    let tail = spine_at_m(1.0, &joints, 1.0) - joints[0].0;
    libm::atan2(tail.z, -tail.x)
}

/// Returns the bend of a body that turns to the left at a rate in radians a second.
pub fn bend_of_turn_bl(turn_rad_per_s: f64) -> f64 {
    TURN_BEND_BL * turn_rad_per_s.clamp(-3.0, 3.0)
}

/// Returns the frequency of the tail beat at a speed in body lengths a second, at most 12 Hz. Bainbridge
/// (1958): v = (3 f - 4) / 4.
pub fn tail_beat_hz(speed_bl_per_s: f64) -> f64 {
    (4.0 / 3.0 * (1.0 + speed_bl_per_s.max(0.0))).min(12.0)
}

/// Returns the share of the full amplitude at a speed in body lengths a second: 0.5 at rest, 1.1 from 1.5
/// body lengths a second on.
pub fn effort_at(speed_bl_per_s: f64) -> f64 {
    0.5 + 0.6 * (speed_bl_per_s / 1.5).clamp(0.0, 1.0)
}

/// Returns the joint angles, in radians, of a midline in top view. The midline begins at the head;
/// `heading_rad` is the heading of the fish in image axes. `None` if the midline has fewer than two points
/// or no length.
pub fn joint_angles_of_midline_rad(
    midline_px: &[[f64; 2]],
    heading_rad: f64,
) -> Option<[f64; N_JOINTS]> {
    let mut along_px = vec![0.0];
    for pair in midline_px.windows(2) {
        let step = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        along_px.push(along_px[along_px.len() - 1] + step);
    }
    let total_px = *along_px.last()?;
    if midline_px.len() < 2 || total_px <= 0.0 || !total_px.is_finite() {
        return None;
    }
    let at = |s: f64| point_at(midline_px, &along_px, s * total_px);
    let angles_rad = angles_of_tangents(|from, to| {
        let (from, to) = (at(from), at(to));
        let tailward = libm::atan2(to[1] - from[1], to[0] - from[0]);
        wrap_rad(tailward - heading_rad - PI)
    });
    Some(angles_rad.map(wrap_rad))
}

/// Returns the position (in metres) and the rotation of each joint in the fish's own frame, for a fish of
/// `length_m`.
pub fn joint_frames(length_m: f64, angles_rad: &[f64; N_JOINTS]) -> [(DVec3, DQuat); N_JOINTS] {
    let mut pivot = joint_at_rest_m(length_m, 0);
    let mut turned_rad = 0.0;
    std::array::from_fn(|j| {
        turned_rad += angles_rad[j];
        let rotation = about_y(turned_rad);
        let frame = (pivot, rotation);
        pivot += rotation * DVec3::new((JOINT_S[j] - segment_end(j)) * length_m, 0.0, 0.0);
        frame
    })
}

/// Returns the point of the spine at `s` in the fish's own frame, in metres. `joints` are the joint frames of
/// a fish of `length_m`.
pub fn spine_at_m(length_m: f64, joints: &[(DVec3, DQuat); N_JOINTS], s: f64) -> DVec3 {
    let j = JOINT_S.partition_point(|&at| at <= s).max(1) - 1;
    let (pivot, rotation) = joints[j];
    pivot + rotation * DVec3::new((JOINT_S[j] - s) * length_m, 0.0, 0.0)
}

/// Returns the position of joint `j` in the fish's own frame when the body is straight, in metres.
pub fn joint_at_rest_m(length_m: f64, j: usize) -> DVec3 {
    DVec3::new((ORIGIN_S - JOINT_S[j]) * length_m, 0.0, 0.0)
}

/// Returns the rotation about the y axis by `angle_rad`.
pub fn about_y(angle_rad: f64) -> DQuat {
    let half = 0.5 * angle_rad;
    DQuat::from_xyzw(0.0, libm::sin(half), 0.0, libm::cos(half))
}

/// The two joints that move a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointWeights {
    /// Indices of the joints.
    pub joints: [u8; 2],
    /// Weight of the second joint, 0..=1.
    pub second_weight: f32,
}

impl JointWeights {
    /// Returns the joints that move a point at `s`.
    pub fn at(s: f64) -> JointWeights {
        const LAST: usize = N_JOINTS - 1;
        let middle = |j: usize| 0.5 * (JOINT_S[j] + segment_end(j));
        let next = (0..N_JOINTS).find(|&j| s < middle(j)).unwrap_or(N_JOINTS);
        let (joints, second_weight) = match next {
            0 => ([0, 0], 0.0),
            N_JOINTS => ([LAST, LAST], 0.0),
            j => {
                let share = (s - middle(j - 1)) / (middle(j) - middle(j - 1));
                ([j - 1, j], share)
            }
        };
        JointWeights {
            joints: joints.map(|j| j as u8),
            second_weight: second_weight as f32,
        }
    }
}

fn segment_end(j: usize) -> f64 {
    JOINT_S.get(j + 1).copied().unwrap_or(1.0)
}

/// Returns the joint angles for the tangents of the segments. `tangent` gets start and end of a segment. The
/// first segment begins at the nose.
fn angles_of_tangents(tangent: impl Fn(f64, f64) -> f64) -> [f64; N_JOINTS] {
    let tangents: [f64; N_JOINTS] = std::array::from_fn(|j| {
        let from = if j == 0 { 0.0 } else { JOINT_S[j] };
        tangent(from, segment_end(j))
    });
    std::array::from_fn(|j| tangents[j] - if j == 0 { 0.0 } else { tangents[j - 1] })
}

fn point_at(points: &[[f64; 2]], along: &[f64], target: f64) -> [f64; 2] {
    let after = along.partition_point(|&a| a < target);
    let k = after.clamp(1, points.len() - 1);
    let span = along[k] - along[k - 1];
    let share = if span > 0.0 {
        ((target - along[k - 1]) / span).clamp(0.0, 1.0)
    } else {
        0.0
    };
    std::array::from_fn(|c| points[k - 1][c] + share * (points[k][c] - points[k - 1][c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cruising(phase_turns: f64) -> Swimming {
        Swimming {
            phase_turns,
            effort: 1.0,
            bend_bl: 0.0,
        }
    }

    #[test]
    fn wave_travels_from_head_to_tail_and_grows() {
        let phase_of_crest = |s: f64| {
            (0..1000)
                .map(|k| f64::from(k) / 1000.0)
                .max_by(|a, b| {
                    let at = |p: &f64| cruising(*p).lateral_bl(s);
                    at(a).total_cmp(&at(b))
                })
                .expect("a thousand phases")
        };
        let (at_half, at_seven) = (phase_of_crest(0.5), phase_of_crest(0.7));
        let delay = (at_seven - at_half).rem_euclid(1.0);
        assert!((delay - 0.2 / WAVELENGTH_BL).abs() < 3e-3, "{delay}");
        let swing = |s| cruising(phase_of_crest(s)).lateral_bl(s);
        assert!(swing(0.0) < swing(0.5) && swing(0.5) < swing(1.0));
        assert!((swing(1.0) - 0.097).abs() < 1e-3);
    }

    #[test]
    fn joints_lie_on_the_wave() {
        let swimming = cruising(0.3);
        let frames = joint_frames(1.0, &swimming.joint_angles_rad());
        let at_root = swimming.lateral_bl(JOINT_S[0]);
        for (j, (pivot, _)) in frames.iter().enumerate().skip(2) {
            let want = swimming.lateral_bl(JOINT_S[j]) - at_root;
            assert!(
                (pivot.z - want).abs() < 0.02,
                "joint {j}: {} {want}",
                pivot.z
            );
        }
    }

    #[test]
    fn left_turn_bends_the_tail_to_the_left() {
        let turning = Swimming {
            phase_turns: 0.0,
            effort: 0.0,
            bend_bl: bend_of_turn_bl(2.0),
        };
        let frames = joint_frames(0.1, &turning.joint_angles_rad());
        assert!(frames[N_JOINTS - 1].0.z > 0.002);
    }

    #[test]
    fn spine_bends_as_the_midline_does() {
        let heading: f64 = 2.5;
        let straight: Vec<[f64; 2]> = (0..11)
            .map(|k| {
                [
                    -10.0 * f64::from(k) * heading.cos(),
                    -10.0 * f64::from(k) * heading.sin(),
                ]
            })
            .collect();
        let angles = joint_angles_of_midline_rad(&straight, heading).expect("it has a length");
        assert!(angles.iter().all(|a| a.abs() < 1e-9), "{angles:?}");
        // A quarter circle. The head points along +x. The tail curves up in the picture, to the fish's
        // left.
        let arc: Vec<[f64; 2]> = (0..=40)
            .map(|k| f64::from(k) / 40.0 * PI / 2.0)
            .map(|t| [-100.0 * t.sin(), -100.0 * (1.0 - t.cos())])
            .collect();
        let angles = joint_angles_of_midline_rad(&arc, 0.0).expect("it has a length");
        assert!(angles.iter().all(|a| *a > 0.0), "{angles:?}");
        assert!((angles.iter().sum::<f64>() - 0.95 * PI / 2.0).abs() < 0.03);
        assert_eq!(joint_angles_of_midline_rad(&[[1.0, 1.0]], 0.0), None);
    }

    #[test]
    fn joint_weights_change_linearly_between_joints() {
        let at = |s| {
            let weights = JointWeights::at(s);
            (weights.joints, weights.second_weight)
        };
        assert_eq!(at(0.0), ([0, 0], 0.0));
        assert_eq!(at(1.0), ([7, 7], 0.0));
        assert_eq!(at(0.45), ([1, 2], 0.5));
    }
}
