//! The goldfish: our own geometry of a common goldfish, composed of trunk, eyes and fins.

use glam::DVec3;

use super::body::{self, TRUNK_END_S};
use super::colors::Colors;
use super::fins;
use super::mesh::{Mesh, MeshBuilder};
use super::params::Palette;
use super::spine::ORIGIN_S;
use crate::library::Animal;

impl Mesh {
    /// Returns a goldfish mesh of the given size and colors.
    pub fn goldfish(size: Animal, palette: Palette) -> Mesh {
        let colors = Colors::new(palette);
        let mut builder = MeshBuilder::default();
        body::add_trunk(&mut builder, &colors);
        body::add_eyes(&mut builder, &colors);
        fins::add_fins(&mut builder, &colors);
        builder.finish(size)
    }

    /// Returns the angle between the two lobes of the tail fin, seen from the end of the trunk, in radians.
    pub fn tail_spread_rad(&self) -> f64 {
        let root_m = (ORIGIN_S - TRUNK_END_S) * self.size.length_m;
        let tail = self.vertices.iter().map(|v| v.position_m);
        let tail = tail.filter(|at| at.x < root_m);
        let slope = |at: DVec3| libm::atan2(at.y, root_m - at.x);
        let [up, down] = tail.fold([DVec3::ZERO; 2], |[up, down], at| {
            [
                if at.y < up.y { at } else { up },
                if at.y > down.y { at } else { down },
            ]
        });
        slope(down) - slope(up)
    }
}
