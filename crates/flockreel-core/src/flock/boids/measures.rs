//! Collective order of a flock: polarization, milling, distances and groups
//! (docs/explanation/algorithms.md, "Boids"; Tunstrom et al. 2013).

use super::vector::{Vec3, add_scaled, cross, dot, minus, norm, plus, scaled, unit};

/// Distance within which another boid is a neighbor, body lengths (docs/explanation/algorithms.md, "Boids").
const NEIGHBOR_BL: f64 = 3.0;
/// Distance within which two boids are in one group, body lengths (docs/explanation/algorithms.md, "Boids").
const GROUP_BL: f64 = 4.0;

/// Collective order at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Order {
    /// Polarization |sum of unit velocities| / N, 0..=1. It is 1 if all boids swim in one direction.
    pub polarization: f64,
    /// Milling |sum of u x r| / N, 0..=1. u are the unit velocities and r the unit vectors from the centroid.
    /// Both are projected along the axis about which boids turn. It is 1 if all boids circle in one sense.
    pub milling: f64,
    /// Mean distance to the nearest neighbor, body lengths; 0 for a single boid.
    pub nearest_bl: f64,
    /// Share of boids with a neighbor within 3 body lengths.
    pub neighbor_share: f64,
    /// Number of groups by single linkage: boids within 4 body lengths of each other are in one group.
    pub n_groups: u32,
    /// Number of boids beyond a wall or within an obstacle.
    pub n_outside: u32,
    /// Number of pairs nearer to each other than boids may be.
    pub n_overlaps: u32,
}

/// Returns the order of boids at `positions`, body lengths, that turn about `up`, a unit vector, and keep a
/// distance of `overlap_bl`. `n_outside` is 0.
pub fn order(positions: &[Vec3], velocities: &[Vec3], up: Vec3, overlap_bl: f64) -> Order {
    let n = positions.len() as f64;
    let level = |v: Vec3| add_scaled(v, -dot(v, up), up);
    let center = scaled(1.0 / n, sum(positions.iter().copied()));
    let spins = (positions.iter().zip(velocities))
        .map(|(&p, &v)| cross(unit(level(v)), unit(level(minus(p, center)))));
    let sorted = SortedByX::new(positions);
    let nearest_bl = sorted.nearest_bl();
    let n_with_neighbor = nearest_bl.iter().filter(|&&bl| bl <= NEIGHBOR_BL).count();
    Order {
        polarization: polarization(velocities),
        milling: norm(sum(spins)) / n,
        nearest_bl: mean_nearest_bl(&nearest_bl),
        neighbor_share: n_with_neighbor as f64 / n,
        n_groups: n_groups(positions, GROUP_BL),
        n_outside: 0,
        n_overlaps: sorted.pairs_within(overlap_bl).count() as u32,
    }
}

/// Returns the mean distance to the nearest neighbor, body lengths; 0 for a single boid.
pub fn nearest_bl(positions: &[Vec3]) -> f64 {
    mean_nearest_bl(&SortedByX::new(positions).nearest_bl())
}

fn mean_nearest_bl(nearest_bl: &[f64]) -> f64 {
    match nearest_bl.len() {
        0 | 1 => 0.0,
        n => nearest_bl.iter().sum::<f64>() / n as f64,
    }
}

/// Returns the polarization, 0..=1.
pub fn polarization(velocities: &[Vec3]) -> f64 {
    norm(sum(velocities.iter().map(|&v| unit(v)))) / velocities.len() as f64
}

fn sum(vectors: impl Iterator<Item = Vec3>) -> Vec3 {
    vectors.fold([0.0; 3], plus)
}

/// Returns the pairs of ids nearer to each other than `bl`, the smaller id first.
pub fn pairs_within(positions: &[Vec3], bl: f64) -> Vec<[usize; 2]> {
    SortedByX::new(positions).pairs_within(bl).collect()
}

/// Positions sorted along x. Boids that are far apart along x are not compared.
struct SortedByX<'a> {
    positions: &'a [Vec3],
    by_x: Vec<usize>,
}

impl SortedByX<'_> {
    fn new(positions: &[Vec3]) -> SortedByX<'_> {
        let mut by_x: Vec<usize> = (0..positions.len()).collect();
        by_x.sort_unstable_by(|&a, &b| positions[a][0].total_cmp(&positions[b][0]));
        SortedByX { positions, by_x }
    }

    /// Returns the distance of each boid to its nearest neighbor; infinite for a single boid.
    fn nearest_bl(&self) -> Vec<f64> {
        let (positions, by_x) = (self.positions, &self.by_x);
        let mut nearest_bl2 = vec![f64::INFINITY; positions.len()];
        for (rank, &id) in by_x.iter().enumerate() {
            let nearest = &mut nearest_bl2[id];
            let mut look_at = |&other: &usize| {
                let offset = minus(positions[other], positions[id]);
                let may_be_nearer = offset[0] * offset[0] < *nearest;
                may_be_nearer.then(|| *nearest = nearest.min(dot(offset, offset)))
            };
            (by_x[rank + 1..].iter()).try_for_each(&mut look_at);
            (by_x[..rank].iter().rev()).try_for_each(look_at);
        }
        nearest_bl2.into_iter().map(f64::sqrt).collect()
    }

    /// Returns the pairs nearer to each other than `bl`.
    fn pairs_within(&self, bl: f64) -> impl Iterator<Item = [usize; 2]> {
        let SortedByX { positions, by_x } = self;
        let offset = |one: usize, other: usize| minus(positions[other], positions[one]);
        (0..by_x.len()).flat_map(move |rank| {
            let one = by_x[rank];
            let after = by_x[rank + 1..].iter().copied();
            let near_along_x = after.take_while(move |&other| offset(one, other)[0] < bl);
            let square_bl2 = move |other| dot(offset(one, other), offset(one, other));
            let near = near_along_x.filter(move |&other| square_bl2(other) < bl * bl);
            near.map(move |other| [one.min(other), one.max(other)])
        })
    }
}

/// Returns the number of groups by single linkage: boids within `link_bl` of each other are in one group.
///
/// Space is cut into cells so small that all boids of a cell are in one group. Two cells are joined if any of
/// their boids are within `link_bl`.
fn n_groups(positions: &[Vec3], link_bl: f64) -> u32 {
    let side_bl = link_bl / 3f64.sqrt() * (1.0 - 1e-9);
    let cell = |position: Vec3| position.map(|x| (x / side_bl).floor() as i64);
    let mut placed: Vec<([i64; 3], Vec3)> = positions.iter().map(|&p| (cell(p), p)).collect();
    placed.sort_unstable_by_key(|&(cell, _)| cell);
    let cells: Vec<&[([i64; 3], Vec3)]> = placed.chunk_by(|a, b| a.0 == b.0).collect();
    let mut group: Vec<usize> = (0..cells.len()).collect();
    let mut n_groups = cells.len() as u32;
    for (one, here) in cells.iter().enumerate() {
        // Earlier cells were compared with this one already. Cells three or more apart are too far.
        let off = |k: usize, axis: usize| (cells[k][0].0[axis] - here[0].0[axis]).abs();
        let after = (one + 1..cells.len()).take_while(|&k| off(k, 0) <= 2);
        for other in after.filter(|&k| off(k, 1) <= 2 && off(k, 2) <= 2) {
            let [a, b] = [one, other].map(|k| first_of_group(&mut group, k));
            let is_near = |p: Vec3, q: Vec3| norm(minus(p, q)) <= link_bl;
            let any_near = |p: Vec3| cells[other].iter().any(|&(_, q)| is_near(p, q));
            if a != b && here.iter().any(|&(_, p)| any_near(p)) {
                group[a.max(b)] = a.min(b);
                n_groups -= 1;
            }
        }
    }
    n_groups
}

/// Returns the first cell of a group, and shortens the chain that leads to it (union-find).
fn first_of_group(group: &mut [usize], mut cell: usize) -> usize {
    while group[cell] != cell {
        group[cell] = group[group[cell]];
        cell = group[cell];
    }
    cell
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn distances_and_overlaps_equal_brute_force(
            positions in prop::collection::vec(prop::array::uniform3(-3i8..3).prop_map(|p| p.map(|c| 0.25 * f64::from(c))), 2..40),
        ) {
            let nearest = |id: usize| {
                let others = positions.iter().enumerate().filter(|other| other.0 != id);
                let distances = others.map(|(_, &other)| norm(minus(other, positions[id])));
                distances.fold(f64::INFINITY, f64::min)
            };
            let nearest: Vec<f64> = (0..positions.len()).map(nearest).collect();
            let n = positions.len() as f64;
            let order = order(&positions, &positions, [0.0, 0.0, 1.0], 0.6);
            prop_assert_eq!(order.nearest_bl, nearest.iter().sum::<f64>() / n);
            let pairs = (0..positions.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
            let near = pairs.filter(|&(a, b)| norm(minus(positions[a], positions[b])) < 0.6);
            prop_assert_eq!(order.n_overlaps, near.count() as u32);
        }

        #[test]
        fn groups_equal_single_linkage_by_search(
            positions in prop::collection::vec(prop::array::uniform3(-9.0..9.0f64), 1..60),
            flat in any::<bool>(),
        ) {
            let depth = if flat { 0.0 } else { 1.0 };
            let positions: Vec<Vec3> = positions.iter().map(|p| [p[0], p[1], depth * p[2]]).collect();
            let mut left: Vec<usize> = (0..positions.len()).collect();
            let mut n = 0;
            while let Some(first) = left.pop() {
                let mut front = vec![first];
                n += 1;
                while let Some(one) = front.pop() {
                    let is_near = |other: &usize| norm(minus(positions[one], positions[*other])) <= 2.0;
                    let (near, far) = left.iter().partition(|other| is_near(other));
                    front.extend::<Vec<usize>>(near);
                    left = far;
                }
            }
            prop_assert_eq!(n_groups(&positions, 2.0), n);
        }
    }

    #[test]
    fn column_is_polarized_and_ring_mills() {
        let ring: Vec<Vec3> = (0..8)
            .map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4)
            .map(|a| [libm::cos(a), libm::sin(a), 0.0])
            .collect();
        let same: Vec<Vec3> = vec![[0.3, 0.1, 0.0]; 8];
        let around: Vec<Vec3> = ring.iter().map(|p| [-p[1], p[0], 0.0]).collect();
        let order = |velocities| order(&ring, velocities, [0.0, 0.0, 1.0], 0.5);
        let (column, mill) = (order(&same), order(&around));
        assert!((column.polarization - 1.0).abs() < 1e-12 && column.milling < 1e-12);
        assert!((mill.milling - 1.0).abs() < 1e-12 && mill.polarization < 1e-12);
        let chord = 2.0 * libm::sin(std::f64::consts::FRAC_PI_8);
        assert!((mill.nearest_bl - chord).abs() < 1e-12);
    }
}
