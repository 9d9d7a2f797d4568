//! Output of the frames of a flock: an encoder, a folder of pictures, or an archive of pictures. Also writes
//! single frames as posters (docs/explanation/algorithms.md, "Compositing").

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;

use super::target::{Output, Target};
use crate::jobs::Error;
use crate::media::{Encoding, VideoFormat, VideoWriter};
use flockreel_core::flock::composite::params::Format;
use flockreel_core::flock::{Flock, Shot};
use flockreel_core::formats::flock_overlay::FlockOverlay;
use flockreel_core::formats::ground_truth::{FilmShape, frame_name};
use flockreel_core::formats::picture;
use flockreel_core::raster::{ColorSpec, Frame, RgbImage};

/// Maximum length of a preview (GIF and WebP), seconds. Free choice.
const PREVIEW_S: f64 = 10.0;

/// Output that receives the frames of a video in order.
pub(super) struct Sink {
    size_px: [u32; 2],
    /// Whether the output has transparency.
    alpha: bool,
    /// Number of frames to write; later ones are ignored.
    n_wanted: usize,
    kind: Kind,
}

enum Kind {
    Video(VideoWriter),
    Overlay(VideoWriter, Box<FlockOverlay>, Frame),
    Folder(PathBuf),
    Archive(Box<zip::ZipWriter<BufWriter<File>>>),
}

impl Sink {
    /// Starts the output of a file. `alpha` is whether the video has a transparent background.
    pub(super) fn begin(
        target: &Target,
        film: FilmShape,
        flock: &Flock,
        alpha: bool,
    ) -> Result<Sink, Error> {
        let format = &VideoFormat {
            width: film.size_px[0],
            height: film.size_px[1],
            fps: film.fps,
            color: ColorSpec::default(),
        };
        let path = &target.path;
        let video = |encoding| VideoWriter::create_as(path, format, encoding).map(Kind::Video);
        let kind = match target.output {
            Output::Overlay => {
                let overlay = FlockOverlay::new(flock, film.size_px);
                let writer = VideoWriter::create(path, format)?;
                Kind::Overlay(writer, Box::new(overlay), Frame::default())
            }
            Output::Film(Format::Mp4) => video(Encoding::H264(Default::default()))?,
            Output::Film(Format::Webm) => video(Encoding::Vp9 { alpha })?,
            Output::Film(Format::Mov) => video(Encoding::ProRes { alpha })?,
            Output::Film(Format::Gif) => video(Encoding::Gif)?,
            Output::Film(Format::Webp) => video(Encoding::Webp)?,
            Output::Film(Format::Png | Format::Poster) => pictures(path)?,
        };
        Ok(Sink {
            size_px: film.size_px,
            alpha,
            n_wanted: n_wanted(target, film),
            kind,
        })
    }

    /// Writes the next frame.
    pub(super) fn take(
        &mut self,
        flock: &Flock,
        frame_idx: usize,
        shot: &Shot,
    ) -> Result<(), Error> {
        if frame_idx >= self.n_wanted {
            return Ok(());
        }
        let (size_px, alpha) = (self.size_px, self.alpha);
        match &mut self.kind {
            Kind::Video(writer) if shot.rgba.is_empty() => writer.write(&shot.frame)?,
            Kind::Video(writer) => writer.write_rgba(&shot.rgba)?,
            Kind::Overlay(writer, overlay, frame) => {
                frame.clone_from(&shot.frame);
                overlay.draw(flock, frame_idx, frame);
                writer.write(frame)?;
            }
            Kind::Folder(folder) => {
                let png = png(size_px, alpha, &shot.rgba);
                fs::write(folder.join(frame_name(frame_idx)), png)?;
            }
            Kind::Archive(archive) => {
                let stored =
                    SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
                archive
                    .start_file(frame_name(frame_idx), stored)
                    .map_err(io::Error::from)?;
                archive.write_all(&png(size_px, alpha, &shot.rgba))?;
            }
        }
        Ok(())
    }

    /// Completes the file.
    pub(super) fn finish(self) -> Result<(), Error> {
        match self.kind {
            Kind::Video(writer) | Kind::Overlay(writer, ..) => Ok(writer.finish()?),
            Kind::Archive(archive) => Ok(archive.finish().map_err(io::Error::from)?.flush()?),
            Kind::Folder(folder) => Ok(remove_frames(&folder, self.n_wanted)?),
        }
    }
}

/// Removes the frames from index `first` on that a longer earlier video has left in a folder.
pub(super) fn remove_frames(folder: &Path, first: usize) -> io::Result<()> {
    for frame_idx in first.. {
        match fs::remove_file(folder.join(frame_name(frame_idx))) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => break,
            removed => removed?,
        }
    }
    Ok(())
}

/// Returns the number of frames to write to a file.
pub(super) fn n_wanted(target: &Target, film: FilmShape) -> usize {
    match target.output {
        Output::Film(Format::Gif | Format::Webp) => {
            film.n_frames.min((PREVIEW_S * film.fps).ceil() as usize)
        }
        _ => film.n_frames,
    }
}

/// Creates a folder of pictures, or an archive if the path ends in `.zip`.
fn pictures(path: &Path) -> io::Result<Kind> {
    if path.extension().is_some_and(|extension| extension == "zip") {
        let file = BufWriter::new(File::create(path)?);
        return Ok(Kind::Archive(Box::new(zip::ZipWriter::new(file))));
    }
    fs::create_dir_all(path)?;
    Ok(Kind::Folder(path.to_owned()))
}

fn png([width, height]: [u32; 2], alpha: bool, rgba: &[u8]) -> Vec<u8> {
    if alpha {
        picture::write_rgba(width, height, rgba)
    } else {
        picture::write_rgb(&RgbImage::without_alpha(width, height, rgba))
    }
}

/// Writes one picture: a JPEG if the path ends in `.jpg` or `.jpeg`, otherwise a PNG.
pub(super) fn poster(path: &Path, size_px: [u32; 2], alpha: bool, rgba: &[u8]) -> io::Result<()> {
    let is_jpeg = path
        .extension()
        .is_some_and(|extension| extension == "jpg" || extension == "jpeg");
    let bytes = if is_jpeg {
        picture::write_jpeg(&RgbImage::without_alpha(size_px[0], size_px[1], rgba))
    } else {
        png(size_px, alpha, rgba)
    };
    fs::write(path, bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leftover_frames_are_removed_and_other_files_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let names = (0..5).map(frame_name).chain(["notes.txt".to_owned()]);
        for name in names {
            fs::write(folder.path().join(name), "x").expect("a file");
        }
        remove_frames(folder.path(), 2).expect("they can be removed");
        let left = fs::read_dir(folder.path()).expect("a folder");
        let mut left: Vec<_> = left
            .map(|entry| entry.expect("an entry").file_name())
            .collect();
        left.sort();
        assert_eq!(left, ["000000.png", "000001.png", "notes.txt"]);
    }
}
