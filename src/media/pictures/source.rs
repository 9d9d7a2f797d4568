//! Storage of pictures: a folder, a zip, the pages of a TIFF, or an animated WebP, with their order. A zip is never
//! unpacked to disk. Each picture is read from it directly, up to the size of the largest allowed picture.

use std::fs::{self, File};
use std::io::{self, BufReader, Cursor, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageFormat};
use tiff::decoder::Decoder;
use zip::ZipArchive;
use zip::result::ZipError;

use super::animation::{self, Animation};
use super::natural_order::compare_natural;
use super::picture::Picture;
use super::tiff_stack;
use crate::media::error::Error;
use crate::media::image::decode_any;
use crate::media::limits::Limits;

/// File name extensions of pictures.
const EXTENSIONS: [&str; 7] = ["png", "tif", "tiff", "jpg", "jpeg", "bmp", "webp"];

/// Allowed size of a zip directory per picture of the limit, bytes: an entry of 46, its name, and its date in
/// extra fields. The directory is kept in memory.
const DIRECTORY_BYTES: u64 = 128;

/// Pictures in order.
#[derive(Clone, Debug)]
pub(super) enum Source {
    /// Files of a folder.
    Folder(Vec<PathBuf>),
    /// Entries of a zip, by their index in its directory.
    Zip(PathBuf, Vec<usize>),
    /// A TIFF and its number of pages.
    Stack(PathBuf, usize),
    /// An animated WebP and the times of its pictures, seconds from the first.
    Animation(PathBuf, Vec<f64>),
}

impl Source {
    /// Returns the pictures at `path`; `None` if it is neither a folder nor a zip nor a TIFF nor an
    /// animated WebP. Fails if there are no pictures, or more than the limit.
    pub(super) fn find(path: &Path, limits: &Limits) -> Result<Option<Source>, Error> {
        let failed = Error::io("opening the footage");
        let about = fs::metadata(path).map_err(&failed)?;
        if about.is_dir() {
            return files_of(path, limits).map(|files| Some(Source::Folder(files)));
        }
        let file = File::open(path).map_err(&failed)?;
        let mut head = Vec::with_capacity(animation::HEAD_BYTES);
        (&file)
            .take(animation::HEAD_BYTES as u64)
            .read_to_end(&mut head)
            .map_err(&failed)?;
        let (is_zip, is_tiff) = (head.starts_with(b"PK\x03\x04"), tiff_stack::is_tiff(&head));
        if !is_zip && !is_tiff && !animation::is_animated_webp(&head) {
            return Ok(None);
        }
        limits.check_n_bytes(about.len())?;
        let path = path.to_owned();
        let mut file = BufReader::new(file);
        file.rewind().map_err(&failed)?;
        Ok(Some(if is_zip {
            Source::Zip(path, entries_of(file, limits)?)
        } else if !is_tiff {
            Source::Animation(path, animation::times_s(&mut file, limits)?)
        } else {
            Source::Stack(path, tiff_stack::n_pages(&mut file, limits)?)
        }))
    }

    /// Returns the number of pictures.
    pub(super) fn n_pictures(&self) -> usize {
        match self {
            Source::Folder(files) => files.len(),
            Source::Zip(_, entries) => entries.len(),
            Source::Stack(_, n_pages) => *n_pages,
            Source::Animation(_, times_s) => times_s.len(),
        }
    }

    /// Returns the time of each picture, seconds from the first; `None` if it is unknown.
    pub(super) fn times_s(&self) -> Vec<Option<f64>> {
        match self {
            Source::Animation(_, times_s) => times_s.iter().copied().map(Some).collect(),
            _ => vec![None; self.n_pictures()],
        }
    }

    /// Returns the files that hold the pictures.
    pub(super) fn files(&self) -> &[PathBuf] {
        match self {
            Source::Folder(files) => files,
            Source::Zip(path, _) | Source::Stack(path, _) | Source::Animation(path, _) => {
                std::slice::from_ref(path)
            }
        }
    }

    /// Starts reading the pictures, or their alpha.
    pub(super) fn read<'a>(
        &'a self,
        limits: &'a Limits,
        alpha_as_gray: bool,
    ) -> Result<Reader<'a>, Error> {
        let open = |path| -> Result<BufReader<File>, Error> {
            let file = File::open(path).map_err(Error::io("opening the pictures"))?;
            Ok(BufReader::new(file))
        };
        let source = match self {
            Source::Folder(files) => OpenSource::Folder(files),
            Source::Zip(path, entries) => {
                OpenSource::Zip(ZipArchive::new(open(path)?).map_err(from_zip)?, entries)
            }
            Source::Stack(path, _) => {
                OpenSource::Stack(Box::new(tiff_stack::open(open(path)?, limits)?))
            }
            Source::Animation(path, _) => {
                OpenSource::Animation(Box::new(Animation::open(path, limits)?))
            }
        };
        Ok(Reader {
            source,
            limits,
            alpha_as_gray,
        })
    }
}

/// Reads pictures by index.
pub(super) struct Reader<'a> {
    source: OpenSource<'a>,
    limits: &'a Limits,
    alpha_as_gray: bool,
}

enum OpenSource<'a> {
    Folder(&'a [PathBuf]),
    Zip(ZipArchive<BufReader<File>>, &'a [usize]),
    Stack(Box<Decoder<BufReader<File>>>),
    Animation(Box<Animation<'a>>),
}

impl Reader<'_> {
    /// Decodes a picture, or its alpha, and returns whether it has an alpha channel. If it cannot be decoded, the
    /// error names its number, counted from 1.
    pub(super) fn picture(&mut self, idx: usize) -> Result<(Picture, bool), Error> {
        let image = self.decode(idx).map_err(|error| match error {
            Error::NotAVideo(why) => Error::NotAVideo(format!("picture {}: {why}", idx + 1)),
            error => error,
        })?;
        let has_alpha = image.color().has_alpha();
        let convert = if self.alpha_as_gray {
            Picture::of_alpha
        } else {
            Picture::new
        };
        Ok((convert(image), has_alpha))
    }

    fn decode(&mut self, idx: usize) -> Result<DynamicImage, Error> {
        let limits = self.limits;
        let bytes = match &mut self.source {
            OpenSource::Folder(files) => {
                let file = File::open(&files[idx]).map_err(Error::io("opening a picture"))?;
                bytes_of(file, limits)?
            }
            OpenSource::Zip(archive, entries) => {
                bytes_of(archive.by_index(entries[idx]).map_err(from_zip)?, limits)?
            }
            OpenSource::Stack(pages) => return tiff_stack::page(pages, idx, limits),
            OpenSource::Animation(animation) => return animation.picture(idx, limits),
        };
        decode(&bytes, limits)
    }
}

/// Decodes a PNG, JPEG, BMP, WebP or the first page of a TIFF. The alpha of a TIFF is ignored.
fn decode(bytes: &[u8], limits: &Limits) -> Result<DynamicImage, Error> {
    if tiff_stack::is_tiff(bytes) {
        let mut pages = tiff_stack::open(Cursor::new(bytes), limits)?;
        return tiff_stack::page(&mut pages, 0, limits);
    }
    let formats = [
        ImageFormat::Png,
        ImageFormat::Jpeg,
        ImageFormat::Bmp,
        ImageFormat::WebP,
    ];
    decode_any(bytes, &formats, limits)
}

fn bytes_of(from: impl Read, limits: &Limits) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let read = from
        .take(limits.max_picture_bytes() + 1)
        .read_to_end(&mut bytes);
    match read {
        Ok(_) => Ok(bytes),
        // Errors of the zip library for damaged data.
        Err(error) => match error.kind() {
            ErrorKind::InvalidData | ErrorKind::InvalidInput | ErrorKind::UnexpectedEof => {
                Err(Error::NotAVideo(format!("it is damaged: {error}")))
            }
            _ => Err(Error::io("reading a picture")(error)),
        },
    }
}

/// Returns the pictures of a folder, ordered by name. Subfolders are skipped.
fn files_of(folder: &Path, limits: &Limits) -> Result<Vec<PathBuf>, Error> {
    let failed = Error::io("reading the folder");
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(&failed)? {
        let path = entry.map_err(&failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if is_picture(&name) && path.is_file() {
            files.push((name.into_owned(), path));
        }
    }
    sorted(files, "the folder", limits)
}

/// Returns the pictures of a zip, ordered by path.
fn entries_of(file: BufReader<File>, limits: &Limits) -> Result<Vec<usize>, Error> {
    let max_bytes = limits.max_frames as u64 * DIRECTORY_BYTES;
    let bounded = Bounded {
        inner: file,
        n_left: max_bytes.max(1 << 20),
    };
    let archive = ZipArchive::new(bounded).map_err(from_zip)?;
    let mut entries = Vec::new();
    for idx in 0..archive.len() {
        let name = archive.name_for_index(idx).transpose().map_err(from_zip)?;
        if let Some(name) = name.filter(|name| is_picture(name)) {
            entries.push((name.into_owned(), idx));
        }
    }
    sorted(entries, "the zip", limits)
}

fn sorted<T>(
    mut named: Vec<(String, T)>,
    container: &str,
    limits: &Limits,
) -> Result<Vec<T>, Error> {
    if named.is_empty() {
        let endings = EXTENSIONS.join(", .");
        return Err(Error::NotAVideo(format!(
            "{container} contains no pictures (.{endings})"
        )));
    }
    limits.check_n_frames(named.len())?;
    named.sort_by(|(a, _), (b, _)| compare_natural(a, b));
    Ok(named.into_iter().map(|(_, picture)| picture).collect())
}

/// Returns whether a path has the name of a picture. Hidden files do not count, nor the `__MACOSX` entries
/// that macOS adds for each file.
fn is_picture(name: &str) -> bool {
    let is_hidden = |part: &str| part.starts_with('.') || part == "__MACOSX";
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    let ending = ending.unwrap_or_default().to_ascii_lowercase();
    EXTENSIONS.contains(&&*ending) && !name.split('/').any(is_hidden)
}

fn from_zip(error: ZipError) -> Error {
    match error {
        ZipError::Io(error) if error.kind() != ErrorKind::UnexpectedEof => {
            Error::io("reading the zip")(error)
        }
        error => Error::NotAVideo(format!("the zip cannot be read: {error}")),
    }
}

/// A reader that allows a limited total number of bytes, at any offsets.
struct Bounded<R> {
    inner: R,
    n_left: u64,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n_read = self.inner.read(buffer)?;
        match self.n_left.checked_sub(n_read as u64) {
            Some(n_left) => self.n_left = n_left,
            None => return Err(ErrorKind::UnexpectedEof.into()),
        }
        Ok(n_read)
    }
}

impl<R: Seek> Seek for Bounded<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.inner.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_recognized_by_their_names() {
        for name in ["1.png", "a/b/2.TIFF", "x.y.jpg"] {
            assert!(is_picture(name), "{name}");
        }
        for name in [
            "notes.txt",
            "png",
            ".1.png",
            "__MACOSX/1.png",
            "a/.b/1.png",
            "1.png/",
        ] {
            assert!(!is_picture(name), "{name}");
        }
    }

    #[test]
    fn directory_above_the_limit_is_not_read() {
        let mut bounded = Bounded {
            inner: io::repeat(1),
            n_left: 100,
        };
        let mut bytes = [0; 60];
        assert!(bounded.read(&mut bytes).is_ok());
        assert!(bounded.read(&mut bytes).is_err());
    }
}
