//! The body's own axes in the camera frame, and how they are projected and turned.
//!
//! A fish in side view does not roll: its side stays level. Then yaw and pitch say everything.

/// Forward, down and side: an orthonormal triple. The side is level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axes {
    pub(super) forward: [f64; 3],
    pub(super) down: [f64; 3],
    pub(super) side: [f64; 3],
}

impl Axes {
    /// `yaw_rad` = atan2(dz, dx), `pitch_rad` = asin(dy) of the forward vector (DESIGN.md).
    pub(super) fn of(yaw_rad: f64, pitch_rad: f64) -> Axes {
        let (sin_yaw, cos_yaw) = libm::sincos(yaw_rad);
        let (sin_pitch, cos_pitch) = libm::sincos(pitch_rad);
        Axes {
            forward: [cos_pitch * cos_yaw, sin_pitch, cos_pitch * sin_yaw],
            down: [-sin_pitch * cos_yaw, cos_pitch, -sin_pitch * sin_yaw],
            side: [-sin_yaw, 0.0, cos_yaw],
        }
    }

    /// How the axes move as the yaw grows: about the vertical.
    pub(super) fn by_yaw(&self) -> Axes {
        let turned = |v: [f64; 3]| [-v[2], 0.0, v[0]];
        Axes {
            forward: turned(self.forward),
            down: turned(self.down),
            side: turned(self.side),
        }
    }

    /// How the axes move as the pitch grows: forward goes down, down goes backward.
    pub(super) fn by_pitch(&self) -> Axes {
        Axes {
            forward: self.down,
            down: self.forward.map(|c| -c),
            side: [0.0; 3],
        }
    }

    /// What is seen of them at a place whose line of sight has the given slope: rows x and y of the
    /// picture, columns forward, down, side. `flatten` is how much shorter the medium makes depths look.
    pub(super) fn seen(&self, slope: [f64; 2], flatten: f64) -> [[f64; 3]; 2] {
        let columns = [&self.forward, &self.down, &self.side];
        [0, 1].map(|row| columns.map(|v| v[row] - slope[row] * flatten * v[2]))
    }
}

/// `a C b'` for rows `a`, `b` and the symmetric `c` = [ll, vv, ww, lv, lw] (l forward, v down, w side; v and w are
/// not correlated).
pub(super) fn form(a: &[f64; 3], b: &[f64; 3], c: &[f64; 5]) -> f64 {
    c[0] * a[0] * b[0]
        + c[1] * a[1] * b[1]
        + c[2] * a[2] * b[2]
        + c[3] * (a[0] * b[1] + a[1] * b[0])
        + c[4] * (a[0] * b[2] + a[2] * b[0])
}
