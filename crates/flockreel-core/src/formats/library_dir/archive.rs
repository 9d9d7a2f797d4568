//! Picture archives of a library folder: mattes, or the sprites of older libraries.

use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

use rayon::prelude::*;

use super::{Error, MATTES, SPRITES};
use crate::formats::library_json::Summary;
use crate::formats::picture;
use crate::formats::picture_archive::{self, Entry};
use crate::library::{Matte, Sprites};
use crate::raster::RgbaImage;
use crate::scratch::Scratch;

/// Writes a picture for every frame that has a sprite.
pub(super) fn write(
    dir: &Path,
    file: &'static str,
    sprites: &Sprites,
    encode: impl Fn(usize) -> Vec<u8> + Sync,
) -> Result<(), Error> {
    let io = |cause| Error::Io { file, cause };
    let present = (0..sprites.n_frames()).filter(|&idx| sprites.is_present(idx));
    let out = BufWriter::new(File::create(dir.join(file)).map_err(io)?);
    let mut out =
        picture_archive::write(out, present, encode).map_err(|cause| Error::Zip { file, cause })?;
    out.flush().map_err(io)
}

/// An archive of mattes.
pub(super) struct Archive<'a> {
    name: &'static str,
    file: File,
    /// Centroid in each matte; `None` for an archive of sprites, whose centroid is at the middle.
    pub(super) centers_px: Option<&'a [Option<[f64; 2]>]>,
}

impl Archive<'_> {
    pub(super) fn open<'a>(dir: &Path, summary: &'a Summary) -> Result<Archive<'a>, Error> {
        let centers_px = &summary.matte_center_px;
        if centers_px.is_empty() && summary.sprite_scale.is_some() {
            return Err(Error::Mismatch(
                "the library has an old format (sprites of one height): analyze the footage again",
            ));
        }
        let name = if centers_px.is_empty() {
            SPRITES
        } else {
            MATTES
        };
        let file = File::open(dir.join(name)).map_err(|cause| Error::Io { file: name, cause })?;
        Ok(Archive {
            name,
            file,
            centers_px: (!centers_px.is_empty()).then_some(centers_px),
        })
    }

    /// Stores the picture of every frame in `scratch`. Fails if one is larger than `max_size_px`.
    pub(super) fn mattes(
        &self,
        n_frames: usize,
        max_size_px: [u32; 2],
        scratch: &dyn Scratch,
    ) -> Result<Vec<Option<Matte>>, Error> {
        if self.centers_px.is_some_and(|all| all.len() != n_frames) {
            return Err(Error::Mismatch(
                "library.json must have one matte centroid per frame",
            ));
        }
        let entries = self.entries(n_frames)?;
        let matte = |(frame_idx, entry): (usize, &Option<Entry>)| {
            let Some(entry) = entry else { return Ok(None) };
            let image = self.picture(entry, max_size_px)?;
            let size = [image.width, image.height];
            let center_px = match self.centers_px {
                Some(centers_px) => centers_px[frame_idx],
                None => Some(size.map(|side| f64::from(side) / 2.0)),
            };
            let is_near = |center_px: &[f64; 2]| center_px.iter().all(|px| px.abs() < 1e5);
            let center_px = center_px.filter(is_near).ok_or(Error::Mismatch(
                "the centroid of a matte in library.json is missing or out of range",
            ))?;
            Ok(Some(Matte {
                size,
                center_px,
                at: scratch.put(&image.pixels)?,
            }))
        };
        entries.par_iter().enumerate().map(matte).collect()
    }

    fn entries(&self, n_frames: usize) -> Result<Vec<Option<Entry>>, Error> {
        let file = self.name;
        let metadata = self.file.metadata();
        let n_bytes = metadata.map_err(|cause| Error::Io { file, cause })?.len();
        picture_archive::entries(BufReader::new(&self.file), n_bytes, n_frames).map_err(|error| {
            match error {
                picture_archive::Error::Zip(cause) => Error::Zip { file, cause },
                picture_archive::Error::Mismatch(what) => Error::Mismatch(what),
            }
        })
    }

    /// Reads a picture of at most `max_size_px`.
    fn picture(&self, entry: &Entry, max_size_px: [u32; 2]) -> Result<RgbaImage, Error> {
        let file = self.name;
        let mut bytes = vec![0; entry.n_bytes];
        let read = self.file.read_exact_at(&mut bytes, entry.at);
        read.map_err(|cause| Error::Io { file, cause })?;
        picture::read_rgba(&bytes, max_size_px).map_err(|cause| Error::Picture { file, cause })
    }
}
