//! How a flock moves as a whole: polarization, milling, distances (ALGORITHMS.md 7; Tunstrom et al.
//! 2013).

use super::vector::{Vec3, add_scaled, cross, dot, minus, norm, scaled, unit};

/// The order of one moment.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Order {
    /// |sum of unit velocities| / N: 1 when all point one way.
    pub polarization: f64,
    /// |sum of u x r| / N, r the unit vectors from the centroid, both seen along the axis about which boids turn: 1
    /// when all circle one way.
    pub milling: f64,
    /// Mean distance to the nearest other, body lengths; 0 for one alone.
    pub nearest_bl: f64,
}

/// The order of boids at `positions` (body lengths) with `velocities`, who turn about `up`, a unit vector.
pub fn order(positions: &[Vec3], velocities: &[Vec3], up: Vec3) -> Order {
    let n = positions.len() as f64;
    let sum = |vectors: &mut dyn Iterator<Item = Vec3>| {
        vectors.fold([0.0; 3], |sum, v| add_scaled(sum, 1.0, v))
    };
    let level = |v: Vec3| add_scaled(v, -dot(v, up), up);
    let center = scaled(1.0 / n, sum(&mut positions.iter().copied()));
    let heading = sum(&mut velocities.iter().map(|&v| unit(v)));
    let spin = sum(&mut positions
        .iter()
        .zip(velocities)
        .map(|(&p, &v)| cross(unit(level(v)), unit(level(minus(p, center))))));
    Order {
        polarization: norm(heading) / n,
        milling: norm(spin) / n,
        nearest_bl: mean_nearest(positions),
    }
}

fn mean_nearest(positions: &[Vec3]) -> f64 {
    if positions.len() < 2 {
        return 0.0;
    }
    let mut by_x: Vec<usize> = (0..positions.len()).collect();
    by_x.sort_unstable_by(|&a, &b| positions[a][0].total_cmp(&positions[b][0]));
    let mut nearest_bl2 = vec![f64::INFINITY; positions.len()];
    for (rank, &id) in by_x.iter().enumerate() {
        let here = positions[id];
        let nearest = &mut nearest_bl2[id];
        let mut look_at = |&other: &usize| {
            let offset = minus(positions[other], here);
            // Who is too far along x is too far, and so is who comes after.
            let may_be_nearer = offset[0] * offset[0] < *nearest;
            may_be_nearer.then(|| *nearest = nearest.min(dot(offset, offset)))
        };
        (by_x[rank + 1..].iter()).try_for_each(&mut look_at);
        (by_x[..rank].iter().rev()).try_for_each(look_at);
    }
    let sum: f64 = nearest_bl2.into_iter().map(f64::sqrt).sum();
    sum / positions.len() as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_nearest_is_the_nearest_of_all(
            positions in prop::collection::vec(prop::array::uniform3(-3i8..3).prop_map(|p| p.map(|c| 0.25 * f64::from(c))), 2..40),
        ) {
            let nearest = |id: usize| {
                let others = positions.iter().enumerate().filter(|other| other.0 != id);
                let distances = others.map(|(_, &other)| norm(minus(other, positions[id])));
                distances.fold(f64::INFINITY, f64::min)
            };
            let mean = (0..positions.len()).map(nearest).sum::<f64>() / positions.len() as f64;
            prop_assert_eq!(mean_nearest(&positions), mean);
        }
    }

    #[test]
    fn a_column_is_polarized_and_a_ring_mills() {
        let ring: Vec<Vec3> = (0..8)
            .map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4)
            .map(|a| [libm::cos(a), libm::sin(a), 0.0])
            .collect();
        let same: Vec<Vec3> = vec![[0.3, 0.1, 0.0]; 8];
        let around: Vec<Vec3> = ring.iter().map(|p| [-p[1], p[0], 0.0]).collect();
        let (column, mill) = (
            order(&ring, &same, [0.0, 0.0, 1.0]),
            order(&ring, &around, [0.0, 0.0, 1.0]),
        );
        assert!((column.polarization - 1.0).abs() < 1e-12 && column.milling < 1e-12);
        assert!((mill.milling - 1.0).abs() < 1e-12 && mill.polarization < 1e-12);
        let chord = 2.0 * libm::sin(std::f64::consts::FRAC_PI_8);
        assert!((mill.nearest_bl - chord).abs() < 1e-12);
    }
}
