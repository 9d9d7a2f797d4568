//! The body axes in the camera frame, their derivatives, and their projection into the image.
//!
//! The body does not roll: its sideways axis stays horizontal. Yaw and pitch then define all three axes.

/// Orthonormal body axes in the camera frame: forward, down and side. The side axis is horizontal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BodyAxes {
    pub(super) forward: [f64; 3],
    pub(super) down: [f64; 3],
    pub(super) side: [f64; 3],
}

impl BodyAxes {
    /// Returns the axes for a yaw and a pitch. Yaw is atan2(z, x) and pitch is asin(y) of the forward vector.
    pub(super) fn new(yaw_rad: f64, pitch_rad: f64) -> BodyAxes {
        let (sin_yaw, cos_yaw) = libm::sincos(yaw_rad);
        let (sin_pitch, cos_pitch) = libm::sincos(pitch_rad);
        BodyAxes {
            forward: [cos_pitch * cos_yaw, sin_pitch, cos_pitch * sin_yaw],
            down: [-sin_pitch * cos_yaw, cos_pitch, -sin_pitch * sin_yaw],
            side: [-sin_yaw, 0.0, cos_yaw],
        }
    }

    /// Returns the derivative of the axes with respect to yaw.
    pub(super) fn by_yaw(&self) -> BodyAxes {
        let rotated = |v: [f64; 3]| [-v[2], 0.0, v[0]];
        BodyAxes {
            forward: rotated(self.forward),
            down: rotated(self.down),
            side: rotated(self.side),
        }
    }

    /// Returns the derivative of the axes with respect to pitch.
    pub(super) fn by_pitch(&self) -> BodyAxes {
        BodyAxes {
            forward: self.down,
            down: self.forward.map(|c| -c),
            side: [0.0; 3],
        }
    }

    /// Returns the projection of the axes at a point whose line of sight has the given slope.
    ///
    /// The rows are x and y in the image, the columns forward, down and side. `depth_factor` is the factor by
    /// which the medium shortens apparent depth.
    pub(super) fn projected(&self, slope: [f64; 2], depth_factor: f64) -> [[f64; 3]; 2] {
        let columns = [&self.forward, &self.down, &self.side];
        [0, 1].map(|row| columns.map(|v| v[row] - slope[row] * depth_factor * v[2]))
    }
}

/// The pairs of image axes of the second moments xx, xy and yy.
pub(super) const MOMENT_AXES: [(usize, usize); 3] = [(0, 0), (0, 1), (1, 1)];

/// Returns `a C b'`, for row vectors `a` and `b` and the symmetric covariance matrix C of the body.
///
/// `c` lists the entries [ll, vv, ww, lv, lw], with l forward, v down and w side. The entry vw is 0.
pub(super) fn bilinear_form(a: &[f64; 3], b: &[f64; 3], c: &[f64; 5]) -> f64 {
    c[0] * a[0] * b[0]
        + c[1] * a[1] * b[1]
        + c[2] * a[2] * b[2]
        + c[3] * (a[0] * b[1] + a[1] * b[0])
        + c[4] * (a[0] * b[2] + a[2] * b[0])
}
