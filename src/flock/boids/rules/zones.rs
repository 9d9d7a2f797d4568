//! Course of a boid in the zonal model (Couzin et al. 2002, equations 1 to 3). A boid heads away from
//! neighbors in the zone of repulsion. Otherwise it takes the heading of neighbors in the zone of orientation
//! and heads toward neighbors in the zone of attraction, in equal parts.

use crate::flock::boids::lanes::{Lanes, select3};
use crate::flock::boids::nearest::Neighbor;
use crate::flock::boids::params::Zones;
use crate::flock::boids::vector::{add_scaled, dot, norm, plus, unit};

/// Returns the wanted direction, a unit vector. It is straight ahead if no neighbor is in a zone or all terms
/// cancel.
///
/// Neighbors outside the field of view, which `cos_half_view` gives, count only in the zone of repulsion.
#[inline(always)]
pub(super) fn course<L: Lanes>(
    zones: &Zones,
    velocity: [L; 3],
    neighbors: &[Neighbor<L>],
    cos_half_view: f64,
) -> [L; 3] {
    let [near, middle, far] = zones.radii_bl().map(|radius| radius * radius);
    let (near, middle, far) = (L::splat(near), L::splat(middle), L::splat(far));
    let nothing = [L::splat(0.0); 3];
    let (mut away, mut along, mut toward) = (nothing, nothing, nothing);
    let ahead = unit(velocity);
    for neighbor in neighbors {
        let (square, to) = (neighbor.square_bl2, unit(neighbor.offset));
        let is_seen = dot(ahead, to).at_least(L::splat(cos_half_view));
        let is_along = L::and(square.at_least(near), square.less(middle));
        let is_toward = L::and(square.at_least(middle), square.less(far));
        let [along_it, toward_it] = [
            L::one_where(L::and(is_seen, is_along)),
            L::one_where(L::and(is_seen, is_toward)),
        ];
        away = add_scaled(away, -L::one_where(square.less(near)), to);
        along = add_scaled(along, along_it, unit(neighbor.velocity));
        toward = add_scaled(toward, toward_it, to);
    }
    let nearest = (neighbors.first()).map_or(L::splat(f64::INFINITY), |first| first.square_bl2);
    let with_others = plus(unit(along), unit(toward));
    let sum = select3::<L>(nearest.less(near), away, with_others);
    let is_clear = L::splat(1e-9).less(norm(sum));
    select3::<L>(is_clear, unit(sum), ahead)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::boids::vector::minus;

    fn at(offset: [f64; 3]) -> Neighbor<f64> {
        Neighbor {
            offset,
            square_bl2: dot(offset, offset),
            velocity: [0.0, 1.0, 0.0],
        }
    }

    #[test]
    fn who_is_too_near_counts_alone_and_behind_one_only_that_is_felt() {
        let zones = Zones::default();
        let course = |neighbors: &[Neighbor<f64>]| course(&zones, [1.0, 0.0, 0.0], neighbors, -0.5);
        let (close, beside, far) = (
            at([0.5, 0.0, 0.0]),
            at([0.0, 2.0, 0.0]),
            at([6.0, 0.0, 0.0]),
        );
        assert_eq!(course(&[close, beside, far]), [-1.0, 0.0, 0.0]);
        assert_eq!(
            course(&[beside]),
            [0.0, 1.0, 0.0],
            "its heading, not its place"
        );
        assert_eq!(course(&[far]), [1.0, 0.0, 0.0]);
        let both = course(&[beside, far]);
        assert!(
            (both[0] - both[1]).abs() < 1e-12 && both[0] > 0.7,
            "half and half"
        );
        assert_eq!(course(&[at([-6.0, 1.0, 0.0])]), [1.0, 0.0, 0.0], "not seen");
        let felt = course(&[at([-0.4, -0.3, 0.0])]);
        assert!(norm(minus(felt, [0.8, 0.6, 0.0])) < 1e-12, "{felt:?}");
    }
}
