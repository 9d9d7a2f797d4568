//! Commands that read a library and write nothing but numbers and pictures of it.

pub mod matrix;
pub mod motion;
pub mod scale;
pub mod sprites;
pub mod summary;

use std::path::Path;

use super::{Error, unreadable};
use flockreel_core::formats::library_dir;
use flockreel_core::library::{Poses, Scale};

/// Reads the poses of a library.
fn read_poses(folder: &Path) -> Result<Poses, Error> {
    library_dir::read_poses(folder).map_err(unreadable(folder))
}

/// Reads the scale of a library.
fn read_scale(folder: &Path) -> Result<Option<Scale>, Error> {
    library_dir::read_scale(folder).map_err(unreadable(folder))
}
