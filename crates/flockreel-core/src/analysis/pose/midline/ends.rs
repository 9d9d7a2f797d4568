//! Finds the two ends of an outline, head and tail, at its points of highest curvature
//! (docs/explanation/algorithms.md, "Midline and tail beat").

use super::distance;
use crate::raster::outline::N_POINTS;

/// Distance from a point to each of the two neighbors that its curvature is computed from, outline points.
const NEIGHBOR_DISTANCE: usize = 4;

/// Returns the indices of the two ends of an outline: the sharper one first, then the opposite one.
///
/// The sharper end is the curvature peak with the largest integral. The opposite end is the center of the
/// high curvature around the point farthest from it by index. The center is used instead of the highest peak,
/// because a head may have two eyes or two ears at its corners.
pub(super) fn ends(outline: &[[f64; 2]]) -> [usize; 2] {
    let sharpest = peaks(&excess_curvature(outline))
        .into_iter()
        .reduce(|best, peak| {
            if best.integral >= peak.integral {
                best
            } else {
                peak
            }
        });
    let sharp = sharpest.map_or(0, |peak| peak.at);
    [sharp, opposite_end(outline, sharp)]
}

/// Returns the index of the end opposite a given end.
pub(super) fn opposite_end(outline: &[[f64; 2]], end: usize) -> usize {
    curvature_center(&excess_curvature(outline), (end + N_POINTS / 2) % N_POINTS)
}

/// Returns the curvature at each point minus its mean, 1/pixels.
fn excess_curvature(outline: &[[f64; 2]]) -> Vec<f64> {
    let curvature = curvature(outline);
    let mean = curvature.iter().sum::<f64>() / N_POINTS as f64;
    curvature.iter().map(|c| c - mean).collect()
}

/// Returns the center of the excess curvature near an index, by four iterations of the weighted mean.
fn curvature_center(excess: &[f64], start: usize) -> usize {
    const NEAR: i64 = N_POINTS as i64 / 6;
    let at = |offset: i64| (start as i64 + offset).rem_euclid(N_POINTS as i64) as usize;
    let mut shift = 0;
    for _ in 0..4 {
        let (mut sum, mut total) = (0.0, 0.0);
        for offset in shift - NEAR..=shift + NEAR {
            let weight = excess[at(offset)].max(0.0);
            sum += weight * offset as f64;
            total += weight;
        }
        if total > 0.0 {
            shift = ((sum / total).round() as i64).clamp(-NEAR, NEAR);
        }
    }
    at(shift)
}

/// Returns the curvature at each point of a clockwise outline, 1/pixels, positive where it is convex.
///
/// The curvature is four times the area of the triangle with the two points at distance `NEIGHBOR_DISTANCE`,
/// divided by the product of its sides.
fn curvature(outline: &[[f64; 2]]) -> Vec<f64> {
    (0..N_POINTS)
        .map(|k| {
            let [a, b, c] = [k + N_POINTS - NEIGHBOR_DISTANCE, k, k + NEIGHBOR_DISTANCE]
                .map(|at| outline[at % N_POINTS]);
            let cross = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
            2.0 * cross / (distance(a, b) * distance(b, c) * distance(a, c)).max(1e-9)
        })
        .collect()
}

struct Peak {
    at: usize,
    integral: f64,
}

/// Returns the runs of positive values around the circle, each with the index of its maximum and its sum.
fn peaks(values: &[f64]) -> Vec<Peak> {
    let n = values.len();
    let Some(start) = (0..n).find(|&k| values[k] <= 0.0) else {
        return Vec::new();
    };
    let mut peaks: Vec<Peak> = Vec::new();
    let mut inside = false;
    for k in (start..start + n).map(|k| k % n) {
        if values[k] <= 0.0 {
            inside = false;
        } else if let Some(peak) = peaks.last_mut().filter(|_| inside) {
            peak.integral += values[k];
            if values[k] > values[peak.at] {
                peak.at = k;
            }
        } else {
            inside = true;
            peaks.push(Peak {
                at: k,
                integral: values[k],
            });
        }
    }
    peaks
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// Returns the outline of a drop: round at index 64, pointed at index 0.
    fn drop_outline() -> Vec<[f64; 2]> {
        (0..N_POINTS)
            .map(|k| {
                let t = TAU * k as f64 / N_POINTS as f64;
                [30.0 * t.cos(), 18.0 * t.sin() * (t / 2.0).sin().abs()]
            })
            .collect()
    }

    #[test]
    fn ends_of_a_drop_are_its_point_and_the_opposite_side() {
        let [point, round] = ends(&drop_outline());
        assert!(point <= 1 || point >= N_POINTS - 1, "{point}");
        assert!(round.abs_diff(64) <= 12, "{round}");
    }

    #[test]
    fn the_end_of_a_head_with_two_eyes_is_between_them() {
        let mut excess = vec![-1.0; N_POINTS];
        for eye in [58, 72] {
            excess[eye - 2..=eye + 2].fill(5.0);
        }
        assert_eq!(curvature_center(&excess, 64), 65);
        assert_eq!(curvature_center(&excess, 70), 65);
    }

    #[test]
    fn curvature_of_a_circle_is_one_over_its_radius() {
        let circle: Vec<[f64; 2]> = (0..N_POINTS)
            .map(|k| TAU * k as f64 / N_POINTS as f64)
            .map(|t| [10.0 * t.cos(), 10.0 * t.sin()])
            .collect();
        assert!(curvature(&circle).iter().all(|c| (c - 0.1).abs() < 1e-9));
    }

    #[test]
    fn a_peak_across_the_first_index_is_one_peak() {
        let found = peaks(&[2.0, -1.0, -1.0, 1.0, -1.0, 3.0]);
        let found: Vec<(usize, f64)> = found.iter().map(|p| (p.at, p.integral)).collect();
        assert_eq!(found, [(3, 1.0), (5, 5.0)]);
    }
}
