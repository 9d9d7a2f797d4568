//! Sums over the visible neighbors of boids, from which the rules are computed (Reynolds 1987;
//! docs/explanation/algorithms.md, "Boids").

use crate::flock::boids::lanes::Lanes;
use crate::flock::boids::nearest::Neighbor;
use crate::flock::boids::params::Rules;
use crate::flock::boids::vector::{add_scaled, dot, scaled};

/// Sums over the visible neighbors of boids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen<L> {
    /// sum (p_i - p_j)/|.| (r_s/|.| - 1) over neighbors within r_s.
    pub(super) apart: [L; 3],
    /// sum v_j over neighbors within r_a, and their number.
    pub(super) along: [L; 3],
    pub(super) n_along: L,
    /// sum p_j - p_i over neighbors within r_c, and their number.
    toward: [L; 3],
    n_toward: L,
}

impl<L: Lanes> Seen<L> {
    /// Returns the sums for boids that swim along the unit vectors `ahead`.
    #[inline(always)]
    pub(super) fn of(
        neighbors: &[Neighbor<L>],
        ahead: [L; 3],
        cos_half_view: f64,
        rules: &Rules,
    ) -> Seen<L> {
        let apart_bl2 = L::splat(rules.separation_bl * rules.separation_bl);
        let along_bl2 = L::splat(rules.alignment_bl * rules.alignment_bl);
        let toward_bl2 = L::splat(rules.cohesion_bl * rules.cohesion_bl);
        let (nothing, one) = (L::splat(0.0), L::splat(1.0));
        let mut seen = Seen {
            apart: [nothing; 3],
            along: [nothing; 3],
            n_along: nothing,
            toward: [nothing; 3],
            n_toward: nothing,
        };
        for neighbor in neighbors {
            // Invisible neighbors add 0. A branch on visibility would often be mispredicted.
            let square_bl2 = neighbor.square_bl2;
            let is_seen = is_seen(neighbor, ahead, cos_half_view);
            let along = L::one_where(L::and(is_seen, square_bl2.less(along_bl2)));
            let toward = L::one_where(L::and(is_seen, square_bl2.less(toward_bl2)));
            seen.n_along = seen.n_along + along;
            seen.n_toward = seen.n_toward + toward;
            seen.along = add_scaled(seen.along, along, neighbor.velocity);
            seen.toward = add_scaled(seen.toward, toward, neighbor.offset);
            let is_near = L::and(is_seen, square_bl2.less(apart_bl2));
            if L::any(is_near) {
                let distance = square_bl2.sqrt().max(L::splat(0.05));
                let strength = (L::splat(rules.separation_bl) / distance - one) / distance;
                let strength = L::select(is_near, strength, nothing);
                seen.apart = add_scaled(seen.apart, -strength, neighbor.offset);
            }
        }
        if rules.picture_separation_bl > 0.0 {
            seen.part_in_picture(neighbors, rules.picture_separation_bl);
        }
        seen
    }

    /// Adds (p_i - p_j)/|.| (1 - |.|/r) in the image plane, over neighbors within r there, visible or not.
    #[inline(always)]
    fn part_in_picture(&mut self, neighbors: &[Neighbor<L>], radius_bl: f64) {
        let nothing = L::splat(0.0);
        for neighbor in neighbors {
            let [x, y, _] = neighbor.offset;
            let distance = (x * x + y * y).sqrt();
            let is_near = L::and(neighbor.is_there(), distance.less(L::splat(radius_bl)));
            let strength = L::splat(1.0) / distance.max(L::splat(0.05)) - L::splat(1.0 / radius_bl);
            let strength = L::select(is_near, strength, nothing);
            self.apart = add_scaled(self.apart, -strength, [x, y, nothing]);
        }
    }

    /// Returns mean p_j - p_i over neighbors within r_c, in units of r_c.
    #[inline(always)]
    pub(super) fn cohesion(&self, rules: &Rules) -> [L; 3] {
        let n = at_least_one(self.n_toward) * L::splat(rules.cohesion_bl);
        scaled(L::splat(1.0) / n, self.toward)
    }
}

/// Returns the count, or 1 instead of 0, as a divisor.
#[inline(always)]
pub(super) fn at_least_one<L: Lanes>(count: L) -> L {
    count.max(L::splat(1.0))
}

/// Returns whether a neighbor exists and is in the field of view of a boid that swims along `ahead`.
#[inline(always)]
pub(super) fn is_seen<L: Lanes>(
    neighbor: &Neighbor<L>,
    ahead: [L; 3],
    cos_half_view: f64,
) -> L::Mask {
    let least = L::splat(cos_half_view) * neighbor.square_bl2.sqrt();
    L::and(
        neighbor.is_there(),
        dot(ahead, neighbor.offset).at_least(least),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn neighbor(offset: [f64; 3]) -> Neighbor<f64> {
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
