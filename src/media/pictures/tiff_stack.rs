//! Pages of a TIFF: gray or RGB of 8 or 16 bits, uncompressed or with lossless compression.

use std::io::{ErrorKind, Read, Seek, SeekFrom};

use image::metadata::Orientation;
use image::{DynamicImage, ImageBuffer};
use tiff::decoder::{Decoder, DecodingResult, Limits as TiffLimits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

use crate::media::error::Error;
use crate::media::limits::Limits;

/// Largest value of one tag, bytes. The strip offsets of the tallest allowed picture need half of it.
const MAX_TAG_BYTES: usize = 1 << 17;
/// Largest number of tags of one page. TIFF 6.0 defines about 80, microscopes add a few dozen.
const MAX_TAGS: u64 = 1000;

/// Returns whether a file begins like a TIFF or a BigTIFF.
pub(super) fn is_tiff(head: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]
        .iter()
        .any(|magic| head.starts_with(*magic))
}

/// Opens a TIFF at its first page.
pub(super) fn open<R: Read + Seek>(from: R, limits: &Limits) -> Result<Decoder<R>, Error> {
    let max_bytes = usize::try_from(limits.max_pixels * 8).unwrap_or(usize::MAX);
    let mut bounds = TiffLimits::default();
    bounds.decoding_buffer_size = max_bytes;
    bounds.intermediate_buffer_size = max_bytes;
    bounds.ifd_value_size = MAX_TAG_BYTES;
    let decoder = Decoder::new(from).map_err(from_tiff)?;
    Ok(decoder.with_limits(bounds))
}

/// Returns the number of pages, at most `limits.max_frames`. Fails if directories share bytes or are in a circle, because
/// then a small file would have any number of tags.
///
/// Every page has a directory: its number of tags, the tags, and the place of the next directory. Only the first and
/// the last are read.
pub(super) fn n_pages(file: &mut (impl Read + Seek), limits: &Limits) -> Result<usize, Error> {
    let n_file_bytes = file.seek(SeekFrom::End(0)).map_err(from_io)?;
    let mut head = [0; 4];
    file.rewind()
        .and_then(|()| file.read_exact(&mut head))
        .map_err(from_io)?;
    let (is_big_endian, is_big_tiff) = (head[0] == b'M', head[2..].contains(&43));
    // Sizes of the number of tags, of a tag, and of a place in the file.
    let (count_bytes, tag_bytes, place_bytes) = if is_big_tiff { (8, 20, 8) } else { (2, 12, 4) };
    // The place of the first directory.
    let begin = SeekFrom::Start(if is_big_tiff { 8 } else { 4 });
    file.seek(begin).map_err(from_io)?;
    let (mut n_pages, mut n_directory_bytes) = (0, 0);
    loop {
        let place = number(file, place_bytes, is_big_endian)?;
        if place == 0 {
            return Ok(n_pages);
        }
        file.seek(SeekFrom::Start(place)).map_err(from_io)?;
        let n_tags = number(file, count_bytes, is_big_endian)?;
        n_directory_bytes +=
            count_bytes as u64 + n_tags.min(MAX_TAGS) * tag_bytes + place_bytes as u64;
        if n_tags > MAX_TAGS || n_directory_bytes > n_file_bytes {
            let why = "the TIFF has more tags than its pages need";
            return Err(Error::NotAVideo(why.to_owned()));
        }
        n_pages += 1;
        limits.check_n_frames(n_pages)?;
        let tags = SeekFrom::Current((n_tags * tag_bytes) as i64);
        file.seek(tags).map_err(from_io)?;
    }
}

/// Reads an unsigned number of at most eight bytes.
fn number(file: &mut impl Read, n_bytes: usize, is_big_endian: bool) -> Result<u64, Error> {
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes[..n_bytes]).map_err(from_io)?;
    if is_big_endian {
        bytes[..n_bytes].reverse();
    }
    Ok(u64::from_le_bytes(bytes))
}

/// Decodes a page, counted from 0, and turns it as its tag Orientation says. Fails for samples other than gray or RGB
/// of 8 or 16 bits.
pub(super) fn page<R: Read + Seek>(
    pages: &mut Decoder<R>,
    idx: usize,
    limits: &Limits,
) -> Result<DynamicImage, Error> {
    pages.seek_to_image(idx).map_err(from_tiff)?;
    let (width, height) = pages.dimensions().map_err(from_tiff)?;
    limits.check_size(width.into(), height.into())?;
    let color = pages.colortype().map_err(from_tiff)?;
    let is_planar = pages
        .find_tag_unsigned::<u16>(Tag::PlanarConfiguration)
        .map_err(from_tiff)?
        == Some(2);
    let unsupported =
        || Error::NotAVideo(format!("a TIFF of samples that are not read: {color:?}"));
    if is_planar && !matches!(color, ColorType::Gray(_)) {
        return Err(unsupported());
    }
    // A tag that cannot be read says no orientation.
    let orientation = pages.find_tag_unsigned::<u8>(Tag::Orientation);
    let orientation = orientation.ok().flatten().and_then(Orientation::from_exif);
    let samples = pages.read_image().map_err(from_tiff)?;
    let image = match (color, samples) {
        (ColorType::Gray(8), DecodingResult::U8(gray)) => {
            ImageBuffer::from_raw(width, height, gray).map(DynamicImage::ImageLuma8)
        }
        (ColorType::Gray(16), DecodingResult::U16(gray)) => {
            ImageBuffer::from_raw(width, height, gray).map(DynamicImage::ImageLuma16)
        }
        (ColorType::RGB(8), DecodingResult::U8(rgb)) => {
            ImageBuffer::from_raw(width, height, rgb).map(DynamicImage::ImageRgb8)
        }
        (ColorType::RGBA(8), DecodingResult::U8(rgba)) => {
            let rgb = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]);
            ImageBuffer::from_raw(width, height, rgb.collect()).map(DynamicImage::ImageRgb8)
        }
        (ColorType::RGB(16), DecodingResult::U16(rgb)) => {
            let rgb = rgb.iter().map(|&level| (level >> 8) as u8);
            ImageBuffer::from_raw(width, height, rgb.collect()).map(DynamicImage::ImageRgb8)
        }
        _ => return Err(unsupported()),
    };
    let mut image = image.ok_or_else(unsupported)?;
    image.apply_orientation(orientation.unwrap_or(Orientation::NoTransforms));
    Ok(image)
}

fn from_tiff(error: TiffError) -> Error {
    match error {
        TiffError::IoError(error) => from_io(error),
        error => Error::NotAVideo(format!("the TIFF cannot be read: {error}")),
    }
}

fn from_io(error: std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::UnexpectedEof | ErrorKind::InvalidInput => {
            Error::NotAVideo(format!("the TIFF cannot be read: {error}"))
        }
        _ => Error::io("reading the pictures")(error),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// Returns a file of `n` directories, each `step` bytes after the one before it and with `n_tags` tags.
    fn chain(n: u32, step: u32, n_tags: u16) -> Vec<u8> {
        let length = n * step + u32::from(n_tags) * 12 + 14;
        let mut bytes = vec![0; length as usize];
        bytes[..8].copy_from_slice(b"II*\0\x08\0\0\0");
        for k in 0..n {
            let (at, next) = ((8 + k * step) as usize, 8 + (k + 1) * step);
            let next = if k + 1 < n { next } else { 0 };
            bytes[at..at + 2].copy_from_slice(&n_tags.to_le_bytes());
            let link = at + 2 + usize::from(n_tags) * 12;
            bytes[link..link + 4].copy_from_slice(&next.to_le_bytes());
        }
        bytes
    }

    fn count(bytes: Vec<u8>) -> Result<usize, Error> {
        n_pages(&mut Cursor::new(bytes), &Limits::default())
    }

    #[test]
    fn pages_are_counted_by_their_links() {
        assert_eq!(count(chain(5, 200, 12)).ok(), Some(5));
        assert_eq!(count(chain(5, 200, 0)).ok(), Some(5));
    }

    #[test]
    fn overlapping_endless_and_huge_directories_are_refused() {
        // The tags of each directory are those of many others.
        assert!(matches!(count(chain(3, 14, 900)), Err(Error::NotAVideo(_))));
        let mut circle = chain(1, 14, 0);
        circle[10..14].copy_from_slice(&8_u32.to_le_bytes());
        assert!(matches!(count(circle), Err(Error::NotAVideo(_))));
        assert!(matches!(
            count(chain(1, 14, 1001)),
            Err(Error::NotAVideo(_))
        ));
    }
}
