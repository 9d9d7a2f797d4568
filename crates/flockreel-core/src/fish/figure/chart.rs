//! Charts: where a point of the body lies in the picture of one frame.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

use crate::fish::spine::lateral_parts_bl;
use crate::library::Pose;

/// Map from body coordinates to the picture of one frame.
#[derive(Clone)]
pub(super) enum Chart {
    /// Flat body seen from the side.
    Flat(Box<Flat>),
    /// Body bent along a midline seen from above.
    Curved {
        /// Midline of the frame.
        midline: Midline,
        /// Usual length of a midline, pixels.
        length_px: f64,
    },
}

impl Chart {
    /// Returns the image point of a point of the body.
    pub(super) fn image(&self, s: f64, t: f64) -> [f64; 2] {
        match self {
            Chart::Flat(flat) => flat.image(s, t),
            Chart::Curved { midline, length_px } => {
                let ([x, y], [ux, uy]) = midline.at(s * length_px);
                [x - t * length_px * uy, y + t * length_px * ux]
            }
        }
    }
}

/// Place of a flat body seen from the side, upright and without perspective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::fish) struct Fit {
    /// Image point of the centroid of the figure.
    pub(in crate::fish) center_px: [f64; 2],
    /// Yaw in -pi..=0: 0 = to the right, -pi/2 = toward the camera, -pi = to the left. Radians.
    pub(in crate::fish) yaw_rad: f64,
    /// Pitch, radians; positive = nose down.
    pub(in crate::fish) pitch_rad: f64,
    /// Length of the body seen broadside, pixels.
    pub(in crate::fish) length_px: f64,
    /// Bend to the animal's left, in body lengths, and the two parts of the wave (`Swimming::of_wave`).
    pub(in crate::fish) bend: [f64; 3],
}

impl Fit {
    /// Returns a body broadside at the centroid and heading of a pose; `None` without a heading.
    pub(super) fn start(pose: &Pose, length_px: f64) -> Option<Fit> {
        let heading_rad = pose.heading_rad?;
        Some(Fit {
            center_px: pose.centroid_px?,
            yaw_rad: if heading_rad.abs() < FRAC_PI_2 {
                0.0
            } else {
                -PI
            },
            pitch_rad: libm::asin(libm::sin(heading_rad)),
            length_px,
            bend: [0.0; 3],
        })
    }

    /// Returns whether the animal faces right.
    pub(super) fn faces_right(&self) -> bool {
        self.yaw_rad > -FRAC_PI_2
    }

    /// Returns the map between body and picture for a figure with its centroid at `center_s`.
    pub(super) fn flat(&self, center_s: f64) -> Flat {
        let (sin_yaw, cos_yaw) = (libm::sin(self.yaw_rad), libm::cos(self.yaw_rad));
        let (sin, cos) = (libm::sin(self.pitch_rad), libm::cos(self.pitch_rad));
        let along_px = [-cos_yaw * cos, -sin].map(|v| v * self.length_px);
        let across_px = [-cos_yaw * sin, cos].map(|v| v * self.length_px);
        let bent_px = SPINE.map(|parts| -sin_yaw * self.length_px * dot(&parts, &self.bend));
        let det = along_px[0] * across_px[1] - along_px[1] * across_px[0];
        let has_area = det.abs() > LEAST_AREA_PX;
        Flat {
            center_px: self.center_px,
            center_s,
            along_px,
            across_px,
            unbent: if has_area {
                unbent(&bent_px, across_px[1] / det)
            } else {
                [f64::NAN; N_SPINE]
            },
            bent_px,
            det,
        }
    }

    /// Moves the center by body coordinates, and makes the unit of length `scale` times as long.
    pub(super) fn rebase(&mut self, [ds, dt]: [f64; 2], scale: f64) {
        self.bend = [0.0; 3];
        self.center_px = self.flat(0.0).image(ds, dt);
        self.length_px *= scale;
    }
}

/// Map between a flat, bent body and the picture.
#[derive(Clone)]
pub(super) struct Flat {
    center_px: [f64; 2],
    center_s: f64,
    /// Image of one body length along the body (to the tail).
    along_px: [f64; 2],
    /// Image of one body length across the body (to the belly).
    across_px: [f64; 2],
    /// How far the bend moves points at even distances along the body to the right.
    bent_px: [f64; N_SPINE],
    /// Where even distances along a straight body lie on the bent one.
    unbent: [f64; N_SPINE],
    /// Area of a square body length in the picture, square pixels, negative if it is mirrored.
    det: f64,
}

impl Flat {
    /// Returns the image point of a point of the body.
    pub(super) fn image(&self, s: f64, t: f64) -> [f64; 2] {
        let ds = s - self.center_s;
        let at = |c: usize| self.center_px[c] + ds * self.along_px[c] + t * self.across_px[c];
        [at(0) + self.bent_px(s), at(1)]
    }

    /// Returns the body coordinates at an image point; `None` where the bent body folds, beyond its grids, and for a body
    /// without area.
    pub(super) fn body_at(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let ([ax, ay], [bx, by]) = (self.along_px, self.across_px);
        let (dx, dy) = (x - self.center_px[0], y - self.center_px[1]);
        // A straight body would have the point at `from`.
        let from = self.center_s + (dx * by - dy * bx) / self.det;
        let at = (from - SPINE_FROM) * SPINE_PER_BL;
        let k = at as usize;
        if !(at >= 0.0 && k + 1 < N_SPINE) {
            return None;
        }
        let share = at - k as f64;
        let s = self.unbent[k] + share * (self.unbent[k + 1] - self.unbent[k]);
        if s.is_nan() {
            return None;
        }
        Some([s, (ax * dy - ay * (dx - self.bent_px(s))) / self.det])
    }

    /// Returns how far the bend moves a point to the right, pixels.
    fn bent_px(&self, s: f64) -> f64 {
        let at = ((s - SPINE_FROM) * SPINE_PER_BL).clamp(0.0, N_SPINE as f64 - 1.001);
        let k = at as usize;
        self.bent_px[k] + (at - k as f64) * (self.bent_px[k + 1] - self.bent_px[k])
    }
}

/// Returns for even distances along a straight body which point of the bent body is seen there: the solution of
/// s + pull bent(s) = from. NaN where the body folds, and beyond its ends.
fn unbent(bent_px: &[f64; N_SPINE], pull: f64) -> [f64; N_SPINE] {
    let place = |k: usize| SPINE_FROM + k as f64 / SPINE_PER_BL;
    let seen = |k: usize| place(k) + pull * bent_px[k];
    let mut solved = [f64::NAN; N_SPINE];
    let mut k = 0;
    for (n, s) in solved.iter_mut().enumerate() {
        let from = place(n);
        while k + 2 < N_SPINE && seen(k + 1) < from {
            k += 1;
        }
        let share = (from - seen(k)) / (seen(k + 1) - seen(k));
        let steep = (seen(k + 1) - seen(k)) * SPINE_PER_BL;
        if steep >= LEAST_SLOPE && (0.0..=1.0).contains(&share) {
            *s = place(k) + share / SPINE_PER_BL;
        }
    }
    solved
}

/// Least change of the image along the body, relative to a straight one: where it is 0, the body folds. Free choice.
const LEAST_SLOPE: f64 = 0.1;

/// Least area of a square body length, square pixels: a body seen exactly from its end has none.
const LEAST_AREA_PX: f64 = 1e-6;

/// Displacements of the spine at even distances, for each part of the bend.
static SPINE: LazyLock<[[f64; 3]; N_SPINE]> = LazyLock::new(|| {
    std::array::from_fn(|k| lateral_parts_bl(SPINE_FROM + k as f64 / SPINE_PER_BL))
});
/// First of the even distances: the grids of the figure begin there, body lengths.
const SPINE_FROM: f64 = -0.5;
/// Even distances per body length. Free choice.
const SPINE_PER_BL: f64 = 50.0;
/// Number of even distances, up to the end of the grids.
const N_SPINE: usize = 101;

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Midline with the distance of each point from the head.
#[derive(Clone)]
pub(in crate::fish) struct Midline {
    points_px: Vec<[f64; 2]>,
    along_px: Vec<f64>,
}

impl Midline {
    /// Returns the midline; `None` if it has no length.
    pub(in crate::fish) fn new(points_px: &[[f64; 2]]) -> Option<Midline> {
        let mut along_px = vec![0.0];
        for pair in points_px.windows(2) {
            let step = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            along_px.push(along_px[along_px.len() - 1] + step);
        }
        let has_length = points_px.len() > 1 && *along_px.last()? > 0.0;
        has_length.then(|| Midline {
            points_px: points_px.to_vec(),
            along_px,
        })
    }

    /// Returns the length, pixels.
    pub(super) fn length_px(&self) -> f64 {
        self.along_px[self.along_px.len() - 1]
    }

    /// Returns the point at a distance from the head and the unit vector toward the tail there. Both ends go on
    /// straight.
    pub(in crate::fish) fn at(&self, distance_px: f64) -> ([f64; 2], [f64; 2]) {
        let after = self.along_px.partition_point(|&along| along < distance_px);
        let k = after.clamp(1, self.points_px.len() - 1);
        let span = (self.along_px[k] - self.along_px[k - 1]).max(1e-9);
        let share = (distance_px - self.along_px[k - 1]) / span;
        let (a, b) = (self.points_px[k - 1], self.points_px[k]);
        let point = [0, 1].map(|c| a[c] + share * (b[c] - a[c]));
        // The direction turns evenly from one middle of a segment to the next.
        let before = self.direction(k - 1, k.saturating_sub(2));
        let next = self.direction(k - 1, k);
        let here = self.direction(k - 1, k - 1);
        let away = (share - 0.5).clamp(-0.5, 0.5);
        let other = if away < 0.0 { before } else { next };
        let mixed = [0, 1].map(|c| here[c] + away.abs() * (other[c] - here[c]));
        let length = mixed[0].hypot(mixed[1]).max(1e-9);
        (point, mixed.map(|v| v / length))
    }

    /// Returns the direction of segment `k`, or of segment `fallback` if there is none.
    fn direction(&self, fallback: usize, k: usize) -> [f64; 2] {
        let k = if k + 1 < self.points_px.len() {
            k
        } else {
            fallback
        };
        let (a, b) = (self.points_px[k], self.points_px[k + 1]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
        [(b[0] - a[0]) / length, (b[1] - a[1]) / length]
    }
}
