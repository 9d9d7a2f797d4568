//! Outline of a matte at half alpha: marching squares with interpolation, smoothed by elliptic
//! Fourier harmonics (Kuhl & Giardina 1982; docs/explanation/algorithms.md, "Midline and tail beat").

use std::f64::consts::TAU;

use crate::geometry::Rect;

/// Number of points in a smoothed outline.
pub const N_POINTS: usize = 128;
/// Number of harmonics kept.
const N_HARMONICS: usize = 16;
/// Alpha level of the outline, between 127 and 128 of 255.
const LEVEL: f64 = 127.5;

/// Returns the outline that encloses the largest area, as `N_POINTS` points, clockwise on the screen.
///
/// `alpha` holds one value per pixel of `rect`. The points are in pixels of the image that contains `rect`.
/// They are evenly spaced before smoothing. Returns `None` if no area above one pixel is at least half
/// opaque.
pub fn outline(rect: Rect, alpha: &[u8]) -> Option<Vec<[f64; 2]>> {
    let loops = Grid::new(rect, alpha).loops().into_iter();
    let largest = loops
        .map(|points| (enclosed_px2(&points), points))
        .reduce(|best, next| if best.0 >= next.0 { best } else { next });
    // The inside is on the right of the outline. Holes run the other way and have a negative area.
    let (area, points) = largest?;
    (area > 1.0).then(|| smoothed(&evenly_spaced(&points)))
}

/// Returns the area enclosed by a closed polygon, square pixels, positive when it runs clockwise on the
/// screen.
fn enclosed_px2(points: &[[f64; 2]]) -> f64 {
    let after = points.iter().cycle().skip(1);
    let twice: f64 = (points.iter().zip(after))
        .map(|(p, q)| p[0] * q[1] - q[0] * p[1])
        .sum();
    twice / 2.0
}

/// The alpha values with a transparent border of one pixel.
struct Grid {
    width: usize,
    height: usize,
    values: Vec<f64>,
    origin: [f64; 2],
}

impl Grid {
    fn new(rect: Rect, alpha: &[u8]) -> Grid {
        let (width, height) = (rect.w as usize + 2, rect.h as usize + 2);
        let mut values = vec![0.0; width * height];
        let rows = alpha.chunks_exact(rect.w.max(1) as usize);
        for (row, to) in rows.zip(values.chunks_exact_mut(width).skip(1)) {
            for (value, &a) in to[1..].iter_mut().zip(row) {
                *value = f64::from(a);
            }
        }
        // Pixel (1, 1) of the padded grid is the first of `rect`. Its center lies half a pixel inside.
        let origin = [f64::from(rect.x) - 0.5, f64::from(rect.y) - 0.5];
        Grid {
            width,
            height,
            values,
            origin,
        }
    }

    /// Returns every closed outline. Grid edge 2k connects pixel k with its right neighbor, edge 2k + 1 with
    /// the pixel below.
    fn loops(&self) -> Vec<Vec<[f64; 2]>> {
        let mut next = vec![None; 2 * self.values.len()];
        for y in 0..self.height - 1 {
            for x in 0..self.width - 1 {
                self.link_edges(y * self.width + x, &mut next);
            }
        }
        let mut loops = Vec::new();
        for first in 0..next.len() {
            let mut points = Vec::new();
            let mut edge = first;
            while let Some(to) = next[edge].take() {
                points.push(self.crossing(edge));
                edge = to;
            }
            if !points.is_empty() {
                loops.push(points);
            }
        }
        loops
    }

    /// Records which edges of a grid cell the outline connects. Pixel `k` is the upper left corner of the
    /// cell.
    ///
    /// In clockwise order of the corners, the outline enters the cell where they change from inside to
    /// outside.
    fn link_edges(&self, k: usize, next: &mut [Option<usize>]) {
        let corners = [k, k + 1, k + self.width + 1, k + self.width];
        let edges = [2 * k, 2 * (k + 1) + 1, 2 * (k + self.width), 2 * k + 1];
        let inside = corners.map(|at| self.values[at] > LEVEL);
        let middle = corners.iter().map(|&at| self.values[at]).sum::<f64>() / 4.0;
        for side in 0..4 {
            if !inside[side] || inside[(side + 1) % 4] {
                continue;
            }
            let leaves = |step: &usize| {
                let other = (side + step) % 4;
                !inside[other] && inside[(other + 1) % 4]
            };
            // If only two opposite corners are inside, the mean decides whether they are connected.
            let step = if middle > LEVEL {
                (1..4).find(leaves)
            } else {
                (1..4).rev().find(leaves)
            };
            next[edges[side]] = step.map(|step| edges[(side + step) % 4]);
        }
    }

    fn crossing(&self, edge: usize) -> [f64; 2] {
        let k = edge / 2;
        let beyond = k + if edge.is_multiple_of(2) {
            1
        } else {
            self.width
        };
        let share = (LEVEL - self.values[k]) / (self.values[beyond] - self.values[k]);
        let (x, y) = ((k % self.width) as f64, (k / self.width) as f64);
        match edge % 2 {
            0 => [self.origin[0] + x + share, self.origin[1] + y],
            _ => [self.origin[0] + x, self.origin[1] + y + share],
        }
    }
}

/// Returns `N_POINTS` points at equal distances along a closed polygon.
fn evenly_spaced(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let at = |k: usize| points[k % points.len()];
    let lengths: Vec<f64> = (0..points.len())
        .map(|k| (at(k), at(k + 1)))
        .map(|(p, q)| libm::hypot(p[0] - q[0], p[1] - q[1]))
        .collect();
    let step = lengths.iter().sum::<f64>() / N_POINTS as f64;
    let (mut k, mut passed) = (0, 0.0);
    (0..N_POINTS)
        .map(|n| {
            let target = n as f64 * step;
            while k + 1 < points.len() && passed + lengths[k] < target {
                passed += lengths[k];
                k += 1;
            }
            let share = ((target - passed) / lengths[k].max(1e-12)).clamp(0.0, 1.0);
            [0, 1].map(|c| at(k)[c] + share * (at(k + 1)[c] - at(k)[c]))
        })
        .collect()
}

/// Returns the curve of the first harmonics. Finer detail comes from the pixel grid, not from the animal.
fn smoothed(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = points.len();
    let wave: Vec<[f64; 2]> = (0..n)
        .map(|k| TAU * k as f64 / n as f64)
        .map(|angle| [libm::cos(angle), libm::sin(angle)])
        .collect();
    let mean = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / n as f64);
    let mut curve = vec![mean; n];
    for harmonic in 1..=N_HARMONICS {
        let mut coefficients = [[0.0; 2]; 2];
        for (k, point) in points.iter().enumerate() {
            let turn = wave[harmonic * k % n];
            for (row, value) in coefficients.iter_mut().zip(point) {
                row[0] += 2.0 / n as f64 * value * turn[0];
                row[1] += 2.0 / n as f64 * value * turn[1];
            }
        }
        for (k, point) in curve.iter_mut().enumerate() {
            let turn = wave[harmonic * k % n];
            for (value, row) in point.iter_mut().zip(&coefficients) {
                *value += row[0] * turn[0] + row[1] * turn[1];
            }
        }
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the alpha of a disc with antialiased edges.
    fn disc(center: [f64; 2], radius: f64) -> Vec<u8> {
        (0..64 * 64)
            .map(|k| {
                let (x, y) = ((k % 64) as f64 + 0.5, (k / 64) as f64 + 0.5);
                let inside = radius - libm::hypot(x - center[0], y - center[1]) + 0.5;
                (255.0 * inside.clamp(0.0, 1.0)) as u8
            })
            .collect()
    }

    #[test]
    fn the_outline_of_a_soft_disc_is_its_circle() {
        let rect = Rect {
            x: 100,
            y: 40,
            w: 64,
            h: 64,
        };
        let points = outline(rect, &disc([30.3, 33.8], 20.0)).expect("it is opaque");
        assert_eq!(points.len(), N_POINTS);
        for [x, y] in &points {
            let radius = libm::hypot(x - 130.3, y - 73.8);
            assert!((radius - 20.0).abs() < 0.15, "{radius}");
        }
        assert!(enclosed_px2(&points) > 0.0, "clockwise on the screen");
    }

    #[test]
    fn only_the_largest_part_is_outlined() {
        let (large, hole, small) = (
            disc([24.0, 24.0], 18.0),
            disc([24.0, 24.0], 8.0),
            disc([54.0, 54.0], 6.0),
        );
        let alpha: Vec<u8> = (0..64 * 64)
            .map(|k| (large[k] - hole[k]).max(small[k]))
            .collect();
        let points = outline(Rect::of_size(64, 64), &alpha).expect("it is opaque");
        assert!((enclosed_px2(&points) - 324.0 * TAU / 2.0).abs() < 12.0);
    }

    #[test]
    fn transparent_mattes_have_no_outline() {
        assert_eq!(outline(Rect::of_size(4, 4), &[100; 16]), None);
    }
}
