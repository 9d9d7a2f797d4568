//! Files that can be made of a flock: its video in each format, and the overlay.

use std::path::PathBuf;

use flockreel_core::flock::composite::params::Format;

/// A file to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// Content of the file.
    pub output: Output,
    /// Path of the file. PNG frames go to a folder, or to an archive if the path ends in `.zip`. A poster is
    /// a JPEG if the path ends in `.jpg` or `.jpeg`, otherwise a PNG.
    pub path: PathBuf,
}

/// Content of an output file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The flock, in this format.
    Film(Format),
    /// The flock with position and heading of every boid drawn over it, as MP4.
    Overlay,
}

impl Output {
    /// Returns whether the file is encoded from planes, without transparency.
    pub(super) fn is_planar(self) -> bool {
        match self {
            Output::Film(format) => !format.has_alpha(),
            Output::Overlay => true,
        }
    }
}
