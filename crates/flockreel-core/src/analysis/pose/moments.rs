//! Moments of a silhouette: centroid, axes, elongation and skew.
//!
//! Formulas: Nakajima et al., section 5.3, equations 2 to 6, corrected. The weight f(X, Y) is alpha. It is 0
//! outside the silhouette, where the box contains noise. Pixel centers lie at +0.5. See
//! docs/explanation/algorithms.md, "Pose".

use crate::geometry::Rect;
use crate::raster::Mask;

/// Least ratio of the eigenvalues for an axis; rounder silhouettes have none. Free choice.
const MIN_EIGENVALUE_RATIO: f64 = 1.05;

/// Moments of one silhouette.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Sum of the weights M00, pixels.
    pub area_px: f64,
    /// Centroid (Nakajima et al., equation 2), pixels of the frame.
    pub centroid_px: [f64; 2],
    /// Second central moments over the area: xx, xy, yy, square pixels. A pixel's own moment of 1 / 12 is
    /// included.
    pub covariance_px2: [f64; 3],
    /// Major axis, in (-pi/2, pi/2]; `None` when the silhouette is round.
    ///
    /// It is 0.5 atan2(2 mu11, mu20 - mu02): Nakajima et al., equation 4, corrected.
    pub major_rad: Option<f64>,
    /// Ratio of the larger to the smaller eigenvalue of the second moments, at least 1.
    pub eigenvalue_ratio: f64,
    /// Third standardized moment along the major axis, and along the axis a quarter turn further.
    pub skew: [f64; 2],
}

/// Returns the moments of weights 0..=255 over a box; `None` when all are zero.
///
/// ```
/// use flockreel_core::analysis::pose::moments::moments;
/// use flockreel_core::geometry::Rect;
/// let bar = moments(Rect { x: 10, y: 20, w: 4, h: 1 }, &[255; 4]).unwrap();
/// assert_eq!((bar.centroid_px, bar.major_rad), ([12.0, 20.5], Some(0.0)));
/// ```
pub fn moments(rect: Rect, weights: &[u8]) -> Option<Moments> {
    let weighed = || {
        weights
            .iter()
            .enumerate()
            .filter(|&(_, &weight)| weight > 0)
            .map(move |(k, &weight)| {
                let (x, y) = (k % rect.w as usize, k / rect.w as usize);
                (x as f64 + 0.5, y as f64 + 0.5, f64::from(weight) / 255.0)
            })
    };
    let [mut m00, mut m10, mut m01] = [0.0; 3];
    for (x, y, f) in weighed() {
        m00 += f;
        m10 += f * x;
        m01 += f * y;
    }
    if m00 <= 0.0 {
        return None;
    }
    let (cx, cy) = (m10 / m00, m01 / m00);
    let [mut mu20, mut mu11, mut mu02] = [0.0; 3];
    for (x, y, f) in weighed() {
        mu20 += f * (x - cx) * (x - cx);
        mu11 += f * (x - cx) * (y - cy);
        mu02 += f * (y - cy) * (y - cy);
    }
    // A pixel is a square, not a point: its own second moment is 1 / 12 of its weight.
    let (mu20, mu11, mu02) = (mu20 / m00 + 1.0 / 12.0, mu11 / m00, mu02 / m00 + 1.0 / 12.0);
    let root = (4.0 * mu11 * mu11 + (mu20 - mu02) * (mu20 - mu02)).sqrt();
    let (large, small) = ((mu20 + mu02 + root) / 2.0, (mu20 + mu02 - root) / 2.0);
    let eigenvalue_ratio = large / small.max(1e-9);
    let angle = 0.5 * libm::atan2(2.0 * mu11, mu20 - mu02);
    let major_rad = (eigenvalue_ratio >= MIN_EIGENVALUE_RATIO).then_some(angle);
    let (c, s) = (libm::cos(angle), libm::sin(angle));
    let mut third = [0.0; 2];
    for (x, y, f) in weighed() {
        let (dx, dy) = (x - cx, y - cy);
        let (u, v) = (dx * c + dy * s, dy * c - dx * s);
        third[0] += f * u * u * u;
        third[1] += f * v * v * v;
    }
    let skew = [
        third[0] / m00 / (large * large.sqrt()),
        third[1] / m00 / (small * small.sqrt()).max(1e-9),
    ];
    Some(Moments {
        area_px: m00,
        centroid_px: [f64::from(rect.x) + cx, f64::from(rect.y) + cy],
        covariance_px2: [mu20, mu11, mu02],
        major_rad,
        eigenvalue_ratio,
        skew,
    })
}

/// Returns the extent of the mask along a direction, pixels; 0 for an empty mask.
pub fn extent_px(mask: &Mask, direction_rad: f64) -> f64 {
    let (c, s) = (libm::cos(direction_rad), libm::sin(direction_rad));
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    for (k, _) in mask.bits.iter().enumerate().filter(|&(_, &bit)| bit == 1) {
        let (x, y) = (k % mask.width(), k / mask.width());
        let along = x as f64 * c + y as f64 * s;
        min = min.min(along);
        max = max.max(along);
    }
    // Adds one pixel, because pixel centers were compared. On a diagonal, a pixel is up to 1.41 wide.
    if max >= min { max - min + 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// An ellipse with half axes 20 and 8, turned by `angle`, heavier toward +axis.
    fn ellipse(angle: f64) -> (Rect, Vec<u8>) {
        let rect = Rect {
            x: 100,
            y: 50,
            w: 64,
            h: 64,
        };
        let inside = |x: f64, y: f64| {
            let (u, v) = (
                x * angle.cos() + y * angle.sin(),
                y * angle.cos() - x * angle.sin(),
            );
            let half_width = 8.0 + u * 0.2;
            (u / 20.0).powi(2) + (v / half_width).powi(2) < 1.0
        };
        let weight = |k: usize| {
            let (x, y) = ((k % 64) as f64 - 31.5, (k / 64) as f64 - 31.5);
            if inside(x, y) { 255 } else { 0 }
        };
        (rect, (0..64 * 64).map(weight).collect())
    }

    #[test]
    fn the_major_axis_is_found_at_every_angle() {
        for k in -8..=8 {
            let angle = f64::from(k) * PI / 17.0;
            let (rect, weights) = ellipse(angle);
            let found = moments(rect, &weights)
                .expect("not empty")
                .major_rad
                .expect("not round");
            assert!(
                crate::geometry::wrap_rad(2.0 * (found - angle)).abs() < 0.03,
                "{angle} {found}"
            );
        }
    }

    #[test]
    fn skew_is_negative_with_the_thick_end_ahead() {
        // The thick end contains the mass, so the long tail of the distribution points backward.
        let (rect, weights) = ellipse(0.0);
        assert!(moments(rect, &weights).expect("not empty").skew[0] < -0.05);
    }

    #[test]
    fn a_disc_has_no_axis() {
        let weight = |k: usize| {
            let (x, y) = ((k % 32) as f64 - 15.5, (k / 32) as f64 - 15.5);
            if x * x + y * y < 100.0 { 255 } else { 0 }
        };
        let weights: Vec<u8> = (0..32 * 32).map(weight).collect();
        assert_eq!(
            moments(Rect::of_size(32, 32), &weights)
                .expect("not empty")
                .major_rad,
            None
        );
        assert_eq!(moments(Rect::of_size(4, 4), &[0; 16]), None);
    }

    #[test]
    fn extents_are_measured_along_any_direction() {
        let mask = Mask {
            rect: Rect::of_size(6, 3),
            bits: vec![0, 1, 1, 1, 1, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0],
        };
        assert_eq!(extent_px(&mask, 0.0), 4.0);
        assert!((extent_px(&mask, PI / 2.0) - 2.0).abs() < 1e-12);
    }
}
