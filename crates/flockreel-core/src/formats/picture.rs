//! Conversion of pictures to PNG and back, and of posters to JPEG. PNG uses fast compression, because the
//! files are many and small.

use std::io::Cursor;

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use png::{BitDepth, ColorType, Compression};

use crate::raster::{RgbImage, RgbaImage};

/// Reasons why PNG bytes cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The bytes are not a PNG.
    #[error("not a PNG: {0}")]
    Decode(#[from] png::DecodingError),
    /// The pixels have an unexpected format.
    #[error("expected 8-bit {wanted}, found {found:?}")]
    Kind {
        /// The expected format.
        wanted: &'static str,
        /// The format of the file.
        found: (ColorType, BitDepth),
    },
    /// The picture is larger than allowed.
    #[error("the picture is larger than allowed: {width} x {height} pixels")]
    TooLarge {
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
}

/// Returns an RGB image as PNG.
pub fn write_rgb(image: &RgbImage) -> Vec<u8> {
    encode_8_bits(image.width, image.height, ColorType::Rgb, &image.pixels)
}

/// Returns straight-alpha RGBA pixels as PNG. Panics unless there are `width * height * 4` bytes.
pub fn write_rgba(width: u32, height: u32, pixels: &[u8]) -> Vec<u8> {
    encode_8_bits(width, height, ColorType::Rgba, pixels)
}

/// Returns gray levels as PNG. Panics unless there are `width * height` of them.
pub fn write_gray(width: u32, height: u32, pixels: &[u8]) -> Vec<u8> {
    encode_8_bits(width, height, ColorType::Grayscale, pixels)
}

/// Returns labels as a PNG of 16-bit gray. Panics unless there are `width * height` of them.
pub fn write_labels(width: u32, height: u32, labels: &[u16]) -> Vec<u8> {
    let bytes: Vec<u8> = labels
        .iter()
        .flat_map(|label| label.to_be_bytes())
        .collect();
    encode(
        width,
        height,
        ColorType::Grayscale,
        BitDepth::Sixteen,
        &bytes,
    )
}

/// Returns an RGB image as JPEG, for posters.
pub fn write_jpeg(image: &RgbImage) -> Vec<u8> {
    write_jpeg_of(image, 90)
}

/// Returns an RGB image as JPEG of a quality from 1 to 100.
pub fn write_jpeg_of(image: &RgbImage, quality: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    encoder
        .encode(
            &image.pixels,
            image.width,
            image.height,
            ExtendedColorType::Rgb8,
        )
        .expect("writing to memory fails only for a wrong number of pixels");
    bytes
}

/// Reads an 8-bit RGB PNG of at most `max_size_px` columns and rows.
pub fn read_rgb(bytes: &[u8], max_size_px: [u32; 2]) -> Result<RgbImage, Error> {
    let Decoded {
        width,
        height,
        pixels,
    } = decode(bytes, ColorType::Rgb, max_size_px)?;
    Ok(RgbImage {
        width,
        height,
        pixels,
    })
}

/// Reads an 8-bit RGBA PNG of at most `max_size_px` columns and rows.
pub fn read_rgba(bytes: &[u8], max_size_px: [u32; 2]) -> Result<RgbaImage, Error> {
    let Decoded {
        width,
        height,
        pixels,
    } = decode(bytes, ColorType::Rgba, max_size_px)?;
    Ok(RgbaImage {
        width,
        height,
        pixels,
    })
}

fn encode_8_bits(width: u32, height: u32, color: ColorType, pixels: &[u8]) -> Vec<u8> {
    encode(width, height, color, BitDepth::Eight, pixels)
}

fn encode(width: u32, height: u32, color: ColorType, depth: BitDepth, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(Compression::Fast);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(pixels))
        .expect("writing to memory fails only for a wrong number of pixels");
    bytes
}

struct Decoded {
    width: u32,
    height: u32,
    pixels: Vec<u8>,
}

fn decode(bytes: &[u8], color: ColorType, max_size_px: [u32; 2]) -> Result<Decoded, Error> {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info()?;
    let found = reader.output_color_type();
    if found != (color, BitDepth::Eight) {
        return Err(Error::Kind {
            wanted: if color == ColorType::Rgb {
                "RGB"
            } else {
                "RGBA"
            },
            found,
        });
    }
    let (width, height) = (reader.info().width, reader.info().height);
    if width > max_size_px[0] || height > max_size_px[1] {
        return Err(Error::TooLarge { width, height });
    }
    let mut pixels = vec![0; width as usize * height as usize * color.samples()];
    reader.next_frame(&mut pixels)?;
    Ok(Decoded {
        width,
        height,
        pixels,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_read_back_as_written() {
        let mut rgb = RgbImage::new(5, 3);
        rgb.pixels
            .iter_mut()
            .enumerate()
            .for_each(|(k, p)| *p = (k * 29) as u8);
        let bytes = write_rgb(&rgb);
        assert_eq!(read_rgb(&bytes, [5, 3]).expect("our own PNG"), rgb);
        let larger = read_rgb(&bytes, [4, 3]);
        assert!(matches!(larger, Err(Error::TooLarge { .. })));
        let mut rgba = RgbaImage::new(3, 4);
        rgba.pixels
            .iter_mut()
            .enumerate()
            .for_each(|(k, p)| *p = (k * 41) as u8);
        let bytes = write_rgba(3, 4, &rgba.pixels);
        assert_eq!(read_rgba(&bytes, [3, 4]).expect("our own PNG"), rgba);
        let larger = read_rgba(&bytes, [3, 3]);
        assert!(matches!(larger, Err(Error::TooLarge { .. })));
        assert!(matches!(
            read_rgb(&bytes, [3, 4]),
            Err(Error::Kind { wanted: "RGB", .. })
        ));
    }
}
