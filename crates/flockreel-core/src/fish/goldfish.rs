//! The goldfish: our own geometry of a common goldfish, composed of trunk, eyes and fins.

use super::body;
use super::colors::Colors;
use super::fins;
use super::mesh::{Mesh, MeshBuilder};
use super::params::Palette;
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
}
