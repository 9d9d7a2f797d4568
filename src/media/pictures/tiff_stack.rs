//! Pages of a TIFF: gray or RGB of 8 or 16 bits, uncompressed or with lossless compression.

use std::io::{Read, Seek};
use std::time::Instant;

use image::ImageBuffer;
use tiff::decoder::{Decoder, DecodingResult, Limits as TiffLimits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

use super::picture::Picture;
use crate::media::error::Error;
use crate::media::limits::Limits;

/// Largest value of one tag, bytes. The strip offsets of the tallest allowed picture need half of it.
const MAX_TAG_BYTES: usize = 1 << 17;

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

/// Returns the number of pages. Fails beyond `limits.max_frames`, or if counting takes too long.
pub(super) fn n_pages<R: Read + Seek>(
    pages: &mut Decoder<R>,
    limits: &Limits,
) -> Result<usize, Error> {
    let start = Instant::now();
    let mut n_pages = 1;
    while pages.more_images() {
        pages.next_image().map_err(from_tiff)?;
        n_pages += 1;
        limits.check_n_frames(n_pages)?;
        if start.elapsed() > limits.base_time {
            return Err(Error::TimeLimit);
        }
    }
    Ok(n_pages)
}

/// Decodes a page, counted from 0. Fails for samples other than gray or RGB of 8 or 16 bits.
pub(super) fn page<R: Read + Seek>(
    pages: &mut Decoder<R>,
    idx: usize,
    limits: &Limits,
) -> Result<Picture, Error> {
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
    let samples = pages.read_image().map_err(from_tiff)?;
    let picture = match (color, samples) {
        (ColorType::Gray(8), DecodingResult::U8(gray)) => {
            ImageBuffer::from_raw(width, height, gray).map(Picture::Gray)
        }
        (ColorType::Gray(16), DecodingResult::U16(gray)) => {
            ImageBuffer::from_raw(width, height, gray).map(Picture::Gray16)
        }
        (ColorType::RGB(8), DecodingResult::U8(rgb)) => {
            ImageBuffer::from_raw(width, height, rgb).map(Picture::Rgb)
        }
        (ColorType::RGBA(8), DecodingResult::U8(rgba)) => {
            let rgb = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]);
            ImageBuffer::from_raw(width, height, rgb.collect()).map(Picture::Rgb)
        }
        (ColorType::RGB(16), DecodingResult::U16(rgb)) => {
            let rgb = rgb.iter().map(|&level| (level >> 8) as u8);
            ImageBuffer::from_raw(width, height, rgb.collect()).map(Picture::Rgb)
        }
        _ => return Err(unsupported()),
    };
    picture.ok_or_else(unsupported)
}

fn from_tiff(error: TiffError) -> Error {
    match error {
        TiffError::IoError(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io("reading the pictures")(error)
        }
        error => Error::NotAVideo(format!("the TIFF cannot be read: {error}")),
    }
}
