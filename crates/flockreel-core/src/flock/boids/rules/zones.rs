//! Course of a boid in the zonal model (Couzin et al. 2002, equations 1 to 3). A boid heads away from
//! neighbors in the zone of repulsion. Otherwise it takes the heading of neighbors in the zone of orientation
//! and heads toward neighbors in the zone of attraction, in equal parts.

use super::Situation;
use crate::flock::boids::params::Zones;
use crate::flock::boids::vector::{Vec3, dot, minus, norm, plus, unit};

/// Returns the wanted direction, a unit vector. It is straight ahead if no neighbor is in a zone or all terms
/// cancel.
///
/// Neighbors outside the field of view count only in the zone of repulsion.
pub(super) fn course(zones: &Zones, situation: &Situation) -> Vec3 {
    let [near, middle, far] = zones.radii_bl().map(|radius| radius * radius);
    let (mut away, mut along, mut toward) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let ahead = unit(situation.velocity);
    for neighbor in situation.neighbors {
        let (square, to) = (neighbor.square_bl2, unit(neighbor.offset));
        if square < near {
            away = minus(away, to);
        } else if dot(ahead, to) >= situation.cos_half_view {
            if square < middle {
                along = plus(along, unit(neighbor.velocity));
            } else if square < far {
                toward = plus(toward, to);
            }
        }
    }
    let nearest = situation.neighbors.first();
    let sum = if nearest.is_some_and(|nearest| nearest.square_bl2 < near) {
        away
    } else {
        plus(unit(along), unit(toward))
    };
    if norm(sum) > 1e-9 { unit(sum) } else { ahead }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::boids::nearest::Neighbor;

    fn at(offset: [f64; 3]) -> Neighbor {
        Neighbor {
            offset,
            square_bl2: dot(offset, offset),
            velocity: [0.0, 1.0, 0.0],
        }
    }

    #[test]
    fn repulsion_takes_precedence_and_works_outside_the_field_of_view() {
        let zones = Zones::default();
        let course = |neighbors: &[Neighbor]| {
            let situation = Situation {
                velocity: [1.0, 0.0, 0.0],
                neighbors,
                cos_half_view: -0.5,
                ..Situation::default()
            };
            course(&zones, &situation)
        };
        let offsets = [[0.5, 0.0, 0.0], [0.0, 2.0, 0.0], [6.0, 0.0, 0.0]];
        let [close, beside, far] = offsets.map(at);
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
        let repelled = course(&[at([-0.4, -0.3, 0.0])]);
        assert!(
            norm(minus(repelled, [0.8, 0.6, 0.0])) < 1e-12,
            "{repelled:?}"
        );
    }
}
