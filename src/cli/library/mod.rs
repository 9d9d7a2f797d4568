//! Commands that read a library and write nothing but numbers and pictures of it.

pub mod matrix;
pub mod motion;
pub mod scale;
pub mod sprites;
pub mod summary;

use std::path::Path;

use super::{Error, unreadable};
use flockreel_core::analysis::stats;
use flockreel_core::formats::csv::motion::Film;
use flockreel_core::formats::library_dir;
use flockreel_core::library::{Poses, Scale};

/// Poses and scale of a library.
struct Measured {
    poses: Poses,
    scale: Option<Scale>,
}

impl Measured {
    fn read(folder: &Path) -> Result<Measured, Error> {
        let poses = library_dir::read_poses(folder).map_err(unreadable(folder))?;
        let scale = library_dir::read_scale(folder).map_err(unreadable(folder))?;
        Ok(Measured { poses, scale })
    }

    fn film(&self) -> Film<'_> {
        Film {
            poses: &self.poses,
            length_px: stats::length_px(&self.poses),
            scale: self.scale,
        }
    }
}
