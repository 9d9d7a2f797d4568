//! Course of a boid in the zonal model (Couzin et al. 2002, equations 1 to 3). A boid heads away from
//! neighbors in the zone of repulsion. Otherwise it takes the heading of neighbors in the zone of orientation
//! and heads toward neighbors in the zone of attraction, in equal parts.

use crate::flock::boids::nearest::Neighbor;
use crate::flock::boids::params::Zones;
use crate::flock::boids::vector::{Vec3, dot, minus, norm, plus, unit};

/// Returns the wanted direction, a unit vector. It is straight ahead if no neighbor is in a zone or all terms
/// cancel.
///
/// Neighbors outside the field of view, which `cos_half_view` gives, count only in the zone of repulsion.
pub(super) fn course(
    zones: &Zones,
    velocity: Vec3,
    neighbors: &[Neighbor],
    cos_half_view: f64,
) -> Vec3 {
    let [near, middle, far] = zones.radii_bl().map(|radius| radius * radius);
    let (mut away, mut along, mut toward) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let ahead = unit(velocity);
    for neighbor in neighbors {
        let (square, to) = (neighbor.square_bl2, unit(neighbor.offset));
        if square < near {
            away = minus(away, to);
        } else if dot(ahead, to) >= cos_half_view {
            if square < middle {
                along = plus(along, unit(neighbor.velocity));
            } else if square < far {
                toward = plus(toward, to);
            }
        }
    }
    let is_crowded = neighbors
        .first()
        .is_some_and(|first| first.square_bl2 < near);
    let sum = if is_crowded {
        away
    } else {
        plus(unit(along), unit(toward))
    };
    if norm(sum) > 1e-9 { unit(sum) } else { ahead }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(offset: [f64; 3]) -> Neighbor {
        Neighbor {
            offset,
            square_bl2: dot(offset, offset),
            velocity: [0.0, 1.0, 0.0],
        }
    }

    #[test]
    fn who_is_too_near_counts_alone_and_behind_one_only_that_is_felt() {
        let zones = Zones::default();
        let course = |neighbors: &[Neighbor]| course(&zones, [1.0, 0.0, 0.0], neighbors, -0.5);
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
