//! Motion of a virtual fish: position, rotation and bend in every frame. The renderer draws it, and a GLB
//! file stores it.

use glam::{DMat3, DQuat, DVec3};

use super::spine::{N_JOINTS, ORIGIN_S};
use crate::geometry::Camera;
use crate::library::Animal;

/// Motion of a virtual fish over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Frames a second, > 0.
    pub fps: f64,
    /// Width and height of the footage, in pixels.
    pub image_size_px: [u32; 2],
    /// Camera that films the fish: that of the footage, or an assumed one.
    pub camera: Camera,
    /// Size of the fish.
    pub size: Animal,
    /// Position along the body of the centroid of its silhouette: 0 = nose, 1 = tip of the tail.
    pub center_s: f64,
    /// Posture in each frame, in order.
    pub frames: Vec<Posture>,
    /// Rate of the tail beat over the film, hertz; 0 if no frame shows it.
    pub beat_hz: f64,
    /// Measured beat of the tail in each frame; `None` where it does not show.
    pub beats: Vec<Option<Beat>>,
}

impl Motion {
    /// Returns how far the origin of the fish lies ahead of the centroid of its silhouette, in metres.
    pub fn origin_ahead_m(&self) -> f64 {
        (self.center_s - ORIGIN_S) * self.size.length_m
    }
}

/// Beat of the tail in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beat {
    /// Bend of the body to the animal's left, in body lengths: the factor of (s - 0.2) squared.
    pub bend_bl: f64,
    /// Angle between the body's axis and the line from the first joint to the tail tip, radians; positive to the
    /// animal's left.
    pub tail_tip_rad: f64,
    /// Probability that this angle, or with an unknown side its size, is within 8 degrees of the true one.
    pub tail_tip_confidence: f64,
    /// Phase of the tail beat, 0..1 turns: 0 when the wave of `Swimming` begins at the nose. `None` if it is not surely
    /// within 45 degrees of the true one.
    pub phase_turns: Option<f64>,
    /// Probability that the phase is within 45 degrees of the true one.
    pub phase_confidence: f64,
    /// Probability that left and right are right, 0.5..=1. 0.5 = unknown.
    pub side_confidence: f64,
}

/// Posture of the fish in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// Position of the middle of the silhouette, in the camera frame, in metres.
    pub position_m: DVec3,
    /// Rotation from the fish's own frame (x forward, y down, z left) to the camera frame, a unit
    /// quaternion.
    pub rotation: DQuat,
    /// Angle of each joint of the spine, in radians (see `spine`).
    pub joint_angles_rad: [f64; N_JOINTS],
    /// Whether the fish is drawn; false where the pose of the animal is unknown.
    pub visible: bool,
}

impl Posture {
    /// Returns a straight, visible fish at a position.
    pub fn at(position_m: DVec3, rotation: DQuat) -> Posture {
        Posture {
            position_m,
            rotation,
            joint_angles_rad: [0.0; N_JOINTS],
            visible: true,
        }
    }

    /// Returns the direction of the fish in the camera frame, a unit vector.
    pub fn forward(&self) -> DVec3 {
        self.rotation * DVec3::X
    }
}

/// Returns the rotation of a fish that points along yaw and pitch (docs/reference/formats.md,
/// "Conventions") and is rolled by `roll_rad` about its own axis. A positive roll moves the back to the
/// fish's right.
pub fn rotation_of(yaw_rad: f64, pitch_rad: f64, roll_rad: f64) -> DQuat {
    let (sy, cy) = (libm::sin(yaw_rad), libm::cos(yaw_rad));
    let (sp, cp) = (libm::sin(pitch_rad), libm::cos(pitch_rad));
    let forward = DVec3::new(cy * cp, sp, sy * cp);
    let left = DVec3::new(-sy, 0.0, cy);
    let upright = DQuat::from_mat3(&DMat3::from_cols(forward, left.cross(forward), left));
    let half = 0.5 * roll_rad;
    upright * DQuat::from_xyzw(libm::sin(half), 0.0, 0.0, libm::cos(half))
}

/// Returns the rotation of a fish that points along a unit vector, with its back up.
pub fn upright_along(forward: DVec3) -> DQuat {
    let pitch = libm::asin(forward.y.clamp(-1.0, 1.0));
    rotation_of(libm::atan2(forward.z, forward.x), pitch, 0.0)
}

/// Returns the shortest rotation from the optical axis to the line of sight at a position. Multiplied by it, a rotation
/// relative to the line of sight is one in the camera frame.
pub fn toward_sight(camera: &Camera, position_m: DVec3) -> DQuat {
    let beyond_m = camera.medium_index * camera.apparent_from_true_depth_m(position_m.z);
    let sight = DVec3::new(position_m.x, position_m.y, beyond_m);
    DQuat::from_rotation_arc(DVec3::Z, sight.normalize())
}

/// Returns the roll angle, in radians, of a fish that turns at `turn_rad_per_s` (positive = to its left)
/// and swims at `speed_m_per_s`. The fish rolls into the turn like a banking aircraft, six times as far,
/// and at most by `limit_rad`.
pub fn bank_rad(turn_rad_per_s: f64, speed_m_per_s: f64, limit_rad: f64) -> f64 {
    const GRAVITY_M_PER_S2: f64 = 9.81;
    const EXAGGERATION: f64 = 6.0;
    let lean = EXAGGERATION * libm::atan(turn_rad_per_s * speed_m_per_s / GRAVITY_M_PER_S2);
    -lean.clamp(-limit_rad, limit_rad)
}

/// Returns `rotation` with the sign that is nearer to `previous`. Both signs are the same rotation, but
/// only the nearer one interpolates the short way.
pub fn nearest_sign(previous: DQuat, rotation: DQuat) -> DQuat {
    if previous.dot(rotation) < 0.0 {
        -rotation
    } else {
        rotation
    }
}

/// Returns the rotation at `share` of the short way from `a` to `b`, at a constant angular rate.
pub fn slerp(a: DQuat, b: DQuat, share: f64) -> DQuat {
    let b = nearest_sign(a, b);
    let angle = libm::acos(a.dot(b).clamp(-1.0, 1.0));
    if angle < 1e-6 {
        return (a * (1.0 - share) + b * share).normalize();
    }
    let weight = |part: f64| libm::sin(part * angle) / libm::sin(angle);
    (a * weight(1.0 - share) + b * weight(share)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn yaw_turns_right_to_away_and_pitch_points_the_nose_down() {
        let close = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} {b}");
        close(rotation_of(0.0, 0.0, 0.0) * DVec3::X, DVec3::X);
        let away = rotation_of(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
        close(away * DVec3::X, DVec3::Z);
        assert!((rotation_of(0.3, 0.4, 0.0) * DVec3::X).y > 0.3);
    }

    #[test]
    fn belly_stays_below_at_every_yaw() {
        for k in 0..24 {
            let yaw = f64::from(k) * 0.27 - 3.1;
            assert!((rotation_of(yaw, 0.5, 0.15) * DVec3::Y).y > 0.8);
        }
    }

    #[test]
    fn fish_rolls_into_its_turn() {
        let lean = bank_rad(2.0, 0.2, 0.3);
        let back = rotation_of(0.0, 0.0, lean) * -DVec3::Y;
        assert!(
            back.z > 0.05,
            "turning left, toward +z, the back leans to +z: {back}"
        );
        assert_eq!(bank_rad(100.0, 1.0, 0.2), -0.2);
    }

    #[test]
    fn slerp_takes_the_short_way_at_a_constant_rate() {
        let (a, b) = (rotation_of(0.0, 0.0, 0.0), -rotation_of(1.0, 0.0, 0.0));
        for k in 0..=4 {
            let share = f64::from(k) / 4.0;
            let forward = slerp(a, b, share) * DVec3::X;
            assert!((libm::atan2(forward.z, forward.x) - share).abs() < 1e-9);
        }
    }
}
