//! A pinhole camera in front of a tank (Nakajima et al., section 5.1), with refraction
//! (docs/explanation/algorithms.md, "Corrections to the papers").
//!
//! Camera coordinates are in metres: origin at the camera, x right, y down, z away. The front pane is the
//! plane `z = z_min_m`. Image sizes are converted to sizes on the pane by `pane_px_per_m`.

/// A calibrated camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Distance from the camera to the front pane, metres, > 0.
    pub z_min_m: f64,
    /// Pixels per metre on the pane, > 0.
    pub pane_px_per_m: f64,
    /// Principal point: the image point on the optical axis, pixels.
    pub center_px: [f64; 2],
    /// Refractive index behind the pane: 1 for air (Nakajima et al.), 4/3 for water.
    pub medium_index: f64,
}

impl Camera {
    /// Returns the focal length, pixels: `pane_px_per_m * z_min_m`.
    pub fn focal_px(&self) -> f64 {
        self.pane_px_per_m * self.z_min_m
    }

    /// Returns the apparent depth, metres, of an object of height `height_m` that appears `height_px` tall.
    ///
    /// The formula is Nakajima et al., equation 7, corrected: `z = H z_min / len`, with `len` in metres on
    /// the pane. The printed equation has the quotient inverted, which places a more distant fish nearer.
    pub fn apparent_depth_m(&self, height_m: f64, height_px: f64) -> f64 {
        height_m * self.z_min_m / (height_px / self.pane_px_per_m)
    }

    /// Returns the position, metres, of an image point at an apparent depth.
    ///
    /// The apparent depth gives x and y by Nakajima et al., equation 1. Refraction changes only the depth
    /// (paraxial): `z = z_min + n (z_app - z_min)`.
    pub fn point_in_camera(&self, point_px: [f64; 2], z_apparent_m: f64) -> [f64; 3] {
        let scale = z_apparent_m / self.focal_px();
        [
            (point_px[0] - self.center_px[0]) * scale,
            (point_px[1] - self.center_px[1]) * scale,
            self.z_min_m + self.medium_index * (z_apparent_m - self.z_min_m),
        ]
    }

    /// Returns the image point, pixels, of a position in camera coordinates. Inverse of `point_in_camera`.
    pub fn image_from_camera(&self, point_m: [f64; 3]) -> [f64; 2] {
        let scale = self.focal_px() / self.apparent_from_true_depth_m(point_m[2]);
        [
            self.center_px[0] + point_m[0] * scale,
            self.center_px[1] + point_m[1] * scale,
        ]
    }

    /// Returns the apparent depth, metres, of a point at true depth `z_m`.
    pub fn apparent_from_true_depth_m(&self, z_m: f64) -> f64 {
        self.z_min_m + (z_m - self.z_min_m) / self.medium_index
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(medium_index: f64) -> Camera {
        Camera {
            z_min_m: 0.7,
            pane_px_per_m: 1000.0,
            center_px: [320.0, 240.0],
            medium_index,
        }
    }

    #[test]
    fn smaller_image_means_greater_depth() {
        let z = |px| camera(1.0).apparent_depth_m(0.057, px);
        assert!((z(57.0) - 0.7).abs() < 1e-12);
        assert!((z(28.5) - 1.4).abs() < 1e-12);
    }

    #[test]
    fn projection_and_back_projection_are_inverse() {
        for n in [1.0, 4.0 / 3.0] {
            let camera = camera(n);
            let z_app = camera.apparent_from_true_depth_m(0.9);
            let px = camera.image_from_camera([0.1, -0.05, 0.9]);
            let point = camera.point_in_camera(px, z_app);
            for (got, want) in point.iter().zip([0.1, -0.05, 0.9]) {
                assert!((got - want).abs() < 1e-12);
            }
        }
    }
}
