//! The course of a boid with three zones around it (Couzin et al. 2002, eqs 1 to 3): away from the too near, or
//! with those in the zone of orientation and toward those in the zone of attraction, half and half.

use super::nearest::Neighbor;
use super::params::Zones;
use super::vector::{Vec3, add_scaled, dot, norm, unit};

/// The direction wished for, a unit vector; `None` when nobody is in any zone, or all cancel out.
///
/// `cos_half_view`: who is behind is seen in the zone of repulsion alone.
pub fn course(
    zones: &Zones,
    velocity: Vec3,
    neighbors: &[Neighbor],
    cos_half_view: f64,
) -> Option<Vec3> {
    let [near, middle, far] = zones.radii_bl().map(|radius| radius * radius);
    let (mut away, mut along, mut toward) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let ahead = unit(velocity);
    for neighbor in neighbors {
        let to = unit(neighbor.offset);
        if neighbor.square_bl2 < near {
            away = add_scaled(away, -1.0, to);
        } else if dot(ahead, to) < cos_half_view {
        } else if neighbor.square_bl2 < middle {
            along = add_scaled(along, 1.0, unit(neighbor.velocity));
        } else if neighbor.square_bl2 < far {
            toward = add_scaled(toward, 1.0, to);
        }
    }
    if neighbors
        .first()
        .is_some_and(|nearest| nearest.square_bl2 < near)
    {
        return wished(away);
    }
    wished(add_scaled(unit(along), 1.0, unit(toward)))
}

fn wished(sum: Vec3) -> Option<Vec3> {
    (norm(sum) > 1e-9).then(|| unit(sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(id: u32, offset: Vec3) -> Neighbor {
        Neighbor {
            id,
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
            at(0, [0.5, 0.0, 0.0]),
            at(1, [0.0, 2.0, 0.0]),
            at(2, [6.0, 0.0, 0.0]),
        );
        assert_eq!(course(&[close, beside, far]), Some([-1.0, 0.0, 0.0]));
        assert_eq!(
            course(&[beside]),
            Some([0.0, 1.0, 0.0]),
            "its heading, not its place"
        );
        assert_eq!(course(&[far]), Some([1.0, 0.0, 0.0]));
        let both = course(&[beside, far]).unwrap();
        assert!(
            (both[0] - both[1]).abs() < 1e-12 && both[0] > 0.7,
            "half and half"
        );
        assert_eq!(course(&[at(2, [-6.0, 0.0, 0.0])]), None, "not seen");
        assert_eq!(
            course(&[at(2, [-0.5, 0.0, 0.0])]),
            Some([1.0, 0.0, 0.0]),
            "felt"
        );
    }
}
