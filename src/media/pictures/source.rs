//! Storage of still pictures: a folder, a zip, or the pages of a TIFF, with their order. A zip is never
//! unpacked to disk. Each picture is read from it directly, up to the size of the largest allowed picture.

use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use tiff::decoder::Decoder;
use zip::ZipArchive;
use zip::result::ZipError;

use super::order::by_number;
use super::picture::Picture;
use super::stack;
use crate::media::error::Error;
use crate::media::image::largest_file;
use crate::media::limits::Limits;

/// File name extensions of pictures.
const ENDINGS: [&str; 6] = ["png", "tif", "tiff", "jpg", "jpeg", "bmp"];

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
}

impl Source {
    /// Returns the pictures at `path`; `None` if it is neither a folder nor a zip nor a TIFF. Fails if there
    /// are no pictures, or more than the limit.
    pub(super) fn find(path: &Path, limits: &Limits) -> Result<Option<Source>, Error> {
        let failed = Error::io("opening the footage");
        let about = fs::metadata(path).map_err(&failed)?;
        if about.is_dir() {
            return files_of(path, limits).map(|files| Some(Source::Folder(files)));
        }
        let file = File::open(path).map_err(&failed)?;
        let mut head = Vec::with_capacity(4);
        (&file).take(4).read_to_end(&mut head).map_err(&failed)?;
        let (is_zip, is_tiff) = (head.starts_with(b"PK\x03\x04"), stack::is_tiff(&head));
        if !is_zip && !is_tiff {
            return Ok(None);
        }
        if about.len() > limits.max_bytes {
            return Err(Error::TooLong {
                found: about.len() as f64,
                unit: "bytes",
            });
        }
        let path = path.to_owned();
        let mut file = BufReader::new(file);
        file.rewind().map_err(&failed)?;
        Ok(Some(match is_zip {
            true => Source::Zip(path, entries_of(file, limits)?),
            false => {
                let n_pages = stack::n_pages(&mut stack::open(file, limits)?, limits)?;
                Source::Stack(path, n_pages)
            }
        }))
    }

    /// Returns the number of pictures.
    pub(super) fn n_pictures(&self) -> usize {
        match self {
            Source::Folder(files) => files.len(),
            Source::Zip(_, entries) => entries.len(),
            Source::Stack(_, n_pages) => *n_pages,
        }
    }

    /// Returns the files that hold the pictures.
    pub(super) fn files(&self) -> &[PathBuf] {
        match self {
            Source::Folder(files) => files,
            Source::Zip(path, _) | Source::Stack(path, _) => std::slice::from_ref(path),
        }
    }

    /// Starts reading the pictures, or their alpha.
    pub(super) fn read<'a>(
        &'a self,
        limits: &'a Limits,
        of_alpha: bool,
    ) -> Result<Reader<'a>, Error> {
        let open = |path| -> Result<BufReader<File>, Error> {
            let file = File::open(path).map_err(Error::io("opening the pictures"))?;
            Ok(BufReader::new(file))
        };
        let place = match self {
            Source::Folder(files) => Place::Folder(files),
            Source::Zip(path, entries) => {
                Place::Zip(ZipArchive::new(open(path)?).map_err(refused)?, entries)
            }
            Source::Stack(path, _) => Place::Stack(Box::new(stack::open(open(path)?, limits)?)),
        };
        Ok(Reader {
            place,
            limits,
            of_alpha,
        })
    }
}

/// Reads pictures by index.
pub(super) struct Reader<'a> {
    place: Place<'a>,
    limits: &'a Limits,
    of_alpha: bool,
}

enum Place<'a> {
    Folder(&'a [PathBuf]),
    Zip(ZipArchive<BufReader<File>>, &'a [usize]),
    Stack(Box<Decoder<BufReader<File>>>),
}

impl Reader<'_> {
    /// Decodes a picture and returns whether it has an alpha channel. If it cannot be decoded, the error
    /// names its number, counted from 1.
    pub(super) fn picture(&mut self, idx: usize) -> Result<(Picture, bool), Error> {
        let (limits, of_alpha) = (self.limits, self.of_alpha);
        let picture = match &mut self.place {
            Place::Folder(files) => File::open(&files[idx])
                .map_err(Error::io("opening a picture"))
                .and_then(|file| bytes_of(file, limits))
                .and_then(|bytes| Picture::decoded(&bytes, limits, of_alpha)),
            Place::Zip(archive, entries) => archive
                .by_index(entries[idx])
                .map_err(refused)
                .and_then(|entry| bytes_of(entry, limits))
                .and_then(|bytes| Picture::decoded(&bytes, limits, of_alpha)),
            Place::Stack(pages) => stack::page(pages, idx, limits).map(|page| (page, false)),
        };
        picture.map_err(|error| match error {
            Error::NotAVideo(why) => Error::NotAVideo(format!("picture {}: {why}", idx + 1)),
            error => error,
        })
    }
}

fn bytes_of(from: impl Read, limits: &Limits) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let read = from.take(largest_file(limits) + 1).read_to_end(&mut bytes);
    match read {
        Ok(_) => Ok(bytes),
        // Errors of the zip library for damaged data.
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::InvalidData
                    | io::ErrorKind::InvalidInput
                    | io::ErrorKind::UnexpectedEof
            ) =>
        {
            Err(Error::NotAVideo(format!("it is damaged: {error}")))
        }
        Err(error) => Err(Error::io("reading a picture")(error)),
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
    in_order(files, "the folder", limits)
}

/// Returns the pictures of a zip, ordered by path.
fn entries_of(file: BufReader<File>, limits: &Limits) -> Result<Vec<usize>, Error> {
    let n_most = limits.max_frames as u64 * DIRECTORY_BYTES;
    let bounded = Bounded {
        inner: file,
        n_left: n_most.max(1 << 20),
    };
    let archive = ZipArchive::new(bounded).map_err(refused)?;
    let mut entries = Vec::new();
    for idx in 0..archive.len() {
        let name = archive.name_for_index(idx).transpose().map_err(refused)?;
        if let Some(name) = name.filter(|name| is_picture(name)) {
            entries.push((name.into_owned(), idx));
        }
    }
    in_order(entries, "the zip", limits)
}

fn in_order<T>(mut named: Vec<(String, T)>, place: &str, limits: &Limits) -> Result<Vec<T>, Error> {
    if named.is_empty() {
        let endings = ENDINGS.join(", .");
        return Err(Error::NotAVideo(format!(
            "{place} contains no pictures (.{endings})"
        )));
    }
    if named.len() > limits.max_frames {
        return Err(Error::TooManyFrames {
            limit: limits.max_frames,
        });
    }
    named.sort_by(|(a, _), (b, _)| by_number(a, b));
    Ok(named.into_iter().map(|(_, picture)| picture).collect())
}

/// Returns whether a path has the name of a picture. Hidden files do not count, nor the `__MACOSX` entries
/// that macOS adds for each file.
fn is_picture(name: &str) -> bool {
    let is_hidden = |part: &str| part.starts_with('.') || part == "__MACOSX";
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    let ending = ending.unwrap_or_default().to_ascii_lowercase();
    ENDINGS.contains(&&*ending) && !name.split('/').any(is_hidden)
}

fn refused(error: ZipError) -> Error {
    match error {
        ZipError::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => {
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
            None => return Err(io::ErrorKind::UnexpectedEof.into()),
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
    fn pictures_are_known_by_their_names() {
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
    fn a_directory_longer_than_the_limit_is_not_read() {
        let mut bounded = Bounded {
            inner: io::repeat(1),
            n_left: 100,
        };
        let mut bytes = [0; 60];
        assert!(bounded.read(&mut bytes).is_ok());
        assert!(bounded.read(&mut bytes).is_err());
    }
}
