//! Sums over the visible neighbors of a boid, from which the rules are computed (Reynolds 1987;
//! docs/explanation/algorithms.md, "Boids").

use crate::flock::boids::nearest::Neighbor;
use crate::flock::boids::params::Rules;
use crate::flock::boids::vector::{Vec3, add_scaled, dot, plus, scaled};

/// Sums over the visible neighbors of a boid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// sum (p_i - p_j)/|.| (r_s/|.| - 1) over neighbors within r_s.
    pub(super) apart: Vec3,
    /// sum v_j over neighbors within r_a, and their number.
    pub(super) along: Vec3,
    pub(super) n_along: f64,
    /// sum p_j - p_i over neighbors within r_c, and their number.
    toward: Vec3,
    n_toward: f64,
}

impl Seen {
    /// Returns the sums for a boid that swims along the unit vector `ahead`.
    pub(super) fn of(
        neighbors: &[Neighbor],
        ahead: Vec3,
        cos_half_view: f64,
        rules: &Rules,
    ) -> Seen {
        let [apart_bl2, along_bl2, toward_bl2] =
            [rules.separation_bl, rules.alignment_bl, rules.cohesion_bl].map(|bl| bl * bl);
        let mut seen = Seen::default();
        for neighbor in neighbors {
            if !is_seen(neighbor, ahead, cos_half_view) {
                continue;
            }
            let square_bl2 = neighbor.square_bl2;
            if square_bl2 < along_bl2 {
                seen.n_along += 1.0;
                seen.along = plus(seen.along, neighbor.velocity);
            }
            if square_bl2 < toward_bl2 {
                seen.n_toward += 1.0;
                seen.toward = plus(seen.toward, neighbor.offset);
            }
            if square_bl2 < apart_bl2 {
                let distance = square_bl2.sqrt().max(0.05);
                let strength = (rules.separation_bl / distance - 1.0) / distance;
                seen.apart = add_scaled(seen.apart, -strength, neighbor.offset);
            }
        }
        if rules.picture_separation_bl > 0.0 {
            seen.part_in_picture(neighbors, rules.picture_separation_bl);
        }
        seen
    }

    /// Adds (p_i - p_j)/|.| (1 - |.|/r) in the image plane, over neighbors within r there, visible or not.
    fn part_in_picture(&mut self, neighbors: &[Neighbor], radius_bl: f64) {
        for neighbor in neighbors {
            let [x, y, _] = neighbor.offset;
            let distance = (x * x + y * y).sqrt();
            if distance < radius_bl {
                let strength = 1.0 / distance.max(0.05) - 1.0 / radius_bl;
                self.apart = add_scaled(self.apart, -strength, [x, y, 0.0]);
            }
        }
    }

    /// Returns mean p_j - p_i over neighbors within r_c, in units of r_c.
    pub(super) fn cohesion(&self, rules: &Rules) -> Vec3 {
        let n = self.n_toward.max(1.0) * rules.cohesion_bl;
        scaled(1.0 / n, self.toward)
    }
}

/// Returns whether a neighbor is in the field of view of a boid that swims along `ahead`.
pub(super) fn is_seen(neighbor: &Neighbor, ahead: Vec3, cos_half_view: f64) -> bool {
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
    fn a_near_neighbor_pushes_away_and_a_farther_one_attracts() {
        let (near, far) = (neighbor([0.5, 0.0, 0.0]), neighbor([3.0, 0.0, 0.0]));
        let rules = Rules::default();
        let seen = |neighbor| Seen::of(&[neighbor], [1.0, 0.0, 0.0], 0.0, &rules);
        assert_eq!(seen(near).apart, [-1.0, 0.0, 0.0]);
        assert_eq!(seen(far).apart, [0.0; 3]);
        assert_eq!(seen(far).cohesion(&rules), [0.5, 0.0, 0.0]);
        let nobody = Seen::of(&[], [1.0, 0.0, 0.0], 0.0, &rules);
        assert_eq!(seen(neighbor([-0.5, 0.0, 0.0])), nobody, "behind");
    }
}
