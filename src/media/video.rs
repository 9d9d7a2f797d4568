//! Footage of any kind: a video file, decoded by a child process, or pictures, decoded in this process.

use std::path::{Path, PathBuf};

use super::decode::Film;
use super::error::Error;
use super::limits::Limits;
use super::notice::Notice;
use super::pictures::Pictures;
use super::read_options::ReadOptions;
use flockreel_core::footage::{FootageFormat, FrameSource, FrameStream, SourceError, Visit};

/// Footage that is within the limits and can be read any number of times.
#[derive(Clone, Debug)]
pub struct Video(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Film(Box<Film>),
    Pictures(Box<Pictures>),
}

impl Video {
    /// Opens footage like [`Video::open_with`], without options.
    pub fn open(path: &Path, limits: &Limits) -> Result<Video, Error> {
        Video::open_with(path, limits, &ReadOptions::default())
    }

    /// Opens a video file, an animated GIF, PNG or WebP, a zip of pictures, a TIFF of several pages or a folder of
    /// pictures. `options` override the file's own metadata.
    ///
    /// Fails with the reason of the first limit that the footage exceeds. `path` comes from the store or from
    /// the command line, never from the name of an uploaded file.
    pub fn open_with(path: &Path, limits: &Limits, options: &ReadOptions) -> Result<Video, Error> {
        let path = std::path::absolute(path).map_err(Error::io("finding the footage"))?;
        Ok(Video(match Pictures::open(&path, limits, options)? {
            Some(pictures) => Kind::Pictures(Box::new(pictures)),
            None => Kind::Film(Box::new(Film::open(path, limits, options)?)),
        }))
    }

    /// Reduces the frames of a film to a longest side of at most `longest_px`, and returns their size as a share of the
    /// film's. Pictures keep their size.
    pub fn reduce(&mut self, longest_px: u32) -> f64 {
        match &mut self.0 {
            Kind::Film(film) => film.reduce(longest_px),
            Kind::Pictures(_) => 1.0,
        }
    }

    /// Returns whether the footage has an alpha channel, even if it is opaque throughout.
    pub fn has_alpha(&self) -> bool {
        match &self.0 {
            Kind::Film(film) => film.has_alpha(),
            Kind::Pictures(pictures) => pictures.has_alpha(),
        }
    }

    /// Returns notices about the file: assumptions, and corrected faults.
    pub fn notices(&self) -> &[Notice] {
        match &self.0 {
            Kind::Film(film) => film.notices(),
            Kind::Pictures(pictures) => pictures.notices(),
        }
    }

    /// Returns the files that are read, in the order of their pictures. Only a folder has more than one.
    pub fn files(&self) -> &[PathBuf] {
        match &self.0 {
            Kind::Film(film) => film.files(),
            Kind::Pictures(pictures) => pictures.files(),
        }
    }

    fn source(&self) -> &dyn FrameSource {
        match &self.0 {
            Kind::Film(film) => &**film,
            Kind::Pictures(pictures) => &**pictures,
        }
    }
}

impl FrameSource for Video {
    fn format(&self) -> FootageFormat {
        self.source().format()
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        self.source().open()
    }

    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        self.source().spread(n, visit)
    }
}
