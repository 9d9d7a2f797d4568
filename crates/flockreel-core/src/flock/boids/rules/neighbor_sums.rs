//! Sums over the visible neighbors of a boid, from which the rules are computed (Reynolds 1987;
//! docs/explanation/algorithms.md, "Boids").

use super::Situation;
use crate::flock::boids::nearest::Neighbor;
use crate::flock::boids::params::Rules;
use crate::flock::boids::vector::{Vec3, add_scaled, dot, plus, scaled};

/// Sums over the visible neighbors of a boid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct NeighborSums {
    /// sum (p_i - p_j)/|.| (r_s/|.| - 1) over neighbors within r_s.
    pub(super) separation: Vec3,
    /// sum v_j over neighbors within r_a, and their number.
    pub(super) velocity: Vec3,
    pub(super) n_aligned: f64,
    /// sum p_j - p_i over neighbors within r_c, and their number.
    offset: Vec3,
    n_cohering: f64,
}

impl NeighborSums {
    /// Returns the sums for a boid that swims along the unit vector `ahead`.
    pub(super) fn new(situation: &Situation, ahead: Vec3, rules: &Rules) -> NeighborSums {
        let neighbors = situation.neighbors;
        let [separation_bl2, alignment_bl2, cohesion_bl2] =
            [rules.separation_bl, rules.alignment_bl, rules.cohesion_bl].map(|bl| bl * bl);
        let mut sums = NeighborSums::default();
        for neighbor in neighbors {
            if !is_visible(neighbor, ahead, situation.cos_half_view) {
                continue;
            }
            let square_bl2 = neighbor.square_bl2;
            if square_bl2 < alignment_bl2 {
                sums.n_aligned += 1.0;
                sums.velocity = plus(sums.velocity, neighbor.velocity);
            }
            if square_bl2 < cohesion_bl2 {
                sums.n_cohering += 1.0;
                sums.offset = plus(sums.offset, neighbor.offset);
            }
            if square_bl2 < separation_bl2 {
                let distance = square_bl2.sqrt().max(0.05);
                let strength = (rules.separation_bl / distance - 1.0) / distance;
                sums.separation = add_scaled(sums.separation, -strength, neighbor.offset);
            }
        }
        if rules.picture_separation_bl > 0.0 {
            sums.add_separation_in_picture(neighbors, rules.picture_separation_bl);
        }
        sums
    }

    /// Adds (p_i - p_j)/|.| (1 - |.|/r) in the image plane, over neighbors within r there, visible or not.
    fn add_separation_in_picture(&mut self, neighbors: &[Neighbor], radius_bl: f64) {
        for neighbor in neighbors {
            let [x, y, _] = neighbor.offset;
            let distance = (x * x + y * y).sqrt();
            if distance < radius_bl {
                let strength = 1.0 / distance.max(0.05) - 1.0 / radius_bl;
                self.separation = add_scaled(self.separation, -strength, [x, y, 0.0]);
            }
        }
    }

    /// Returns mean p_j - p_i over neighbors within r_c, in units of r_c.
    pub(super) fn cohesion(&self, rules: &Rules) -> Vec3 {
        let n = self.n_cohering.max(1.0) * rules.cohesion_bl;
        scaled(1.0 / n, self.offset)
    }
}

/// Returns whether a neighbor is in the field of view of a boid that swims along `ahead`.
pub(super) fn is_visible(neighbor: &Neighbor, ahead: Vec3, cos_half_view: f64) -> bool {
    dot(ahead, neighbor.offset) >= cos_half_view * neighbor.square_bl2.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn neighbor(offset: [f64; 3]) -> Neighbor {
        Neighbor {
            offset,
            square_bl2: dot(offset, offset),
            velocity: [0.0; 3],
        }
    }

    #[test]
    fn near_neighbors_repel_and_farther_ones_attract() {
        let (near, far) = (neighbor([0.5, 0.0, 0.0]), neighbor([3.0, 0.0, 0.0]));
        let rules = Rules::default();
        let sums = |neighbors: &[Neighbor]| {
            let situation = Situation {
                neighbors,
                ..Situation::default()
            };
            NeighborSums::new(&situation, [1.0, 0.0, 0.0], &rules)
        };
        assert_eq!(sums(&[near]).separation, [-1.0, 0.0, 0.0]);
        assert_eq!(sums(&[far]).separation, [0.0; 3]);
        assert_eq!(sums(&[far]).cohesion(&rules), [0.5, 0.0, 0.0]);
        assert_eq!(sums(&[neighbor([-0.5, 0.0, 0.0])]), sums(&[]), "behind");
    }
}
