//! Geometry of a flock as stored in flock.json: the projection and the walls of the tank. A reader of the
//! file can recompute distances, order and walls from it (docs/reference/formats.md, "flock.json").

use super::boids::tank::{Tank, Wall};
use super::boids::vector::Vec3;
use super::lens::Lens;
use crate::geometry::rounded;

/// Geometry of a flock, rounded as in files.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    /// Projection from positions in body lengths to the image.
    pub lens: Lens,
    /// Depth of the front of the tank, body lengths from the camera; 0 for a flat lens.
    pub front_bl: f64,
    /// Axis about which boids turn, a unit vector: the vertical, or in a flat tank the normal of the image
    /// plane.
    pub up: Vec3,
    /// Walls of the tank. A flat tank has a front and a back wall too, both at the depth of the boids.
    pub walls: Vec<Wall>,
}

impl Space {
    /// Returns the geometry of a tank that is seen through a lens.
    pub fn new(lens: &Lens, tank: &Tank) -> Space {
        let wall = |wall: &Wall| Wall {
            outward: wall.outward.map(|part| rounded(part, 6)),
            offset_bl: rounded(wall.offset_bl, 4),
        };
        Space {
            lens: lens.rounded(),
            front_bl: rounded(tank.corners[0][2], 4),
            up: tank.up(),
            walls: tank.walls().iter().map(wall).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::boids::measures;
    use crate::flock::lens::Pinhole;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;

    /// Returns the position of a boid, body lengths, by the formula of README.md.
    fn place_bl(space: &Space, [x, y, behind]: [f64; 3]) -> Vec3 {
        let length_px = space.lens.length_px;
        let z = space.front_bl + behind / length_px;
        let Some(camera) = space.lens.camera() else {
            return [x / length_px, y / length_px, z];
        };
        let apparent = camera.pane_bl + (z - camera.pane_bl) / camera.medium_index;
        let px = camera.focal_px / apparent;
        let [cx, cy] = camera.center_px;
        [(x - cx) / px, (y - cy) / px, z]
    }

    /// Returns how far a position is beyond the walls, body lengths; negative inside.
    fn beyond_bl(space: &Space, place: Vec3) -> f64 {
        let beyond = |wall: &Wall| {
            let along = (0..3).map(|axis| wall.outward[axis] * place[axis]);
            along.sum::<f64>() - wall.offset_bl
        };
        (space.walls.iter().map(beyond)).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn file_geometry_agrees_with_the_lens_behind_a_pane() {
        let camera = Pinhole {
            focal_px: 700.0,
            center_px: [310.0, 250.0],
            pane_bl: 7.0,
            medium_index: 1.33,
            metres: Some(0.1),
        };
        let lens = Lens::with(90.0, Some(camera));
        let tank = Tank::new([-3.0, -2.0, 7.5], [3.0, 2.0, 10.0]);
        let space = Space::new(&lens, &tank);
        for place in [[0.5, -1.0, 7.5], [-2.0, 1.5, 9.75]] {
            let [x, y] = lens.picture_px(place);
            let found = place_bl(&space, [x, y, (place[2] - 7.5) * 90.0]);
            assert!((0..3).all(|axis| (found[axis] - place[axis]).abs() < 1e-9));
            assert!(beyond_bl(&space, place) <= 1e-9);
        }
        assert!((beyond_bl(&space, [3.5, 0.0, 8.0]) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn order_distances_and_walls_can_be_recomputed_from_a_file() {
        for view in [View::Top, View::Side] {
            let params = Params {
                count: Some(9),
                frames: 40,
                ..Params::default()
            };
            let flock = plan_flock(&synthetic::library(view), &params, &Silent).unwrap();
            for (t, stored) in flock.orders.iter().enumerate() {
                let boids = || flock.individuals.iter().map(|one| &one.boid);
                let places: Vec<Vec3> = boids()
                    .map(|boid| place_bl(&flock.space, boid.position_px[t]))
                    .collect();
                let courses: Vec<Vec3> = boids()
                    .map(|boid| match &boid.forward {
                        Some(forward) => forward[t],
                        None => {
                            let heading = boid.heading_rad[t];
                            [libm::cos(heading), libm::sin(heading), 0.0]
                        }
                    })
                    .collect();
                let up = flock.space.up;
                let found = measures::order(&places, &courses, up, flock.stats.overlap_bl - 0.01);
                for (found, stored) in [
                    (found.polarization, stored.polarization),
                    (found.milling, stored.milling),
                    (found.nearest_bl, stored.nearest_bl),
                ] {
                    assert!(
                        (found - stored).abs() < 2e-3,
                        "{view:?} {t}: {found} {stored}"
                    );
                }
                assert_eq!((found.n_groups, found.n_overlaps), (stored.n_groups, 0));
                let beyond = places.iter().map(|&place| beyond_bl(&flock.space, place));
                assert!(beyond.fold(f64::NEG_INFINITY, f64::max) < 1e-3);
            }
        }
    }
}
