//! Still pictures: a background image or one picture of a footage. Limits are checked before decoding
//! (docs/explanation/promises.md, "Bad input").

use std::io::{Cursor, Read};
use std::path::Path;

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use super::error::Error;
use super::limits::Limits;
use flockreel_core::raster::RgbImage;

/// Reads an image file; see [`decode_image`].
pub fn read_image(path: &Path, limits: &Limits) -> Result<RgbImage, Error> {
    let failed = Error::io("reading the image");
    let file = std::fs::File::open(path).map_err(&failed)?;
    let mut bytes = Vec::new();
    file.take(limits.max_picture_bytes() + 1)
        .read_to_end(&mut bytes)
        .map_err(&failed)?;
    decode_image(&bytes, limits)
}

/// Decodes a PNG or JPEG. Alpha is ignored and deeper channels are reduced to 8 bits.
///
/// Fails with `not_a_video` for other formats and damaged files, with `too_long` for too many bytes, and with
/// `too_many_pixels` or `too_few_pixels`.
pub fn decode_image(bytes: &[u8], limits: &Limits) -> Result<RgbImage, Error> {
    let image = decode_any(bytes, &[ImageFormat::Png, ImageFormat::Jpeg], limits)?;
    let (width, height) = (image.width(), image.height());
    Ok(RgbImage {
        width,
        height,
        pixels: image.into_rgb8().into_raw(),
    })
}

/// Decodes a picture of one of the given formats, and turns it as its EXIF data say. Limits are checked before decoding.
pub(super) fn decode_any(
    bytes: &[u8],
    formats: &[ImageFormat],
    limits: &Limits,
) -> Result<DynamicImage, Error> {
    limits.check_picture_bytes(bytes.len() as u64)?;
    let format = image::guess_format(bytes).map_err(from_image)?;
    if !formats.contains(&format) {
        let accepted: Vec<&str> = formats
            .iter()
            .filter_map(|f| f.extensions_str().first().copied())
            .collect();
        let accepted = accepted.join(", ");
        return Err(Error::NotAVideo(format!(
            "the picture format must be one of: {accepted}"
        )));
    }
    let reader = || ImageReader::with_format(Cursor::new(bytes), format);
    let (width, height) = reader().into_dimensions().map_err(from_image)?;
    limits.check_size(width.into(), height.into())?;
    let mut reader = reader();
    let mut bounds = image::Limits::default();
    bounds.max_image_width = Some(limits.max_side_px);
    bounds.max_image_height = Some(limits.max_side_px);
    bounds.max_alloc = Some(limits.max_pixels * 16);
    reader.limits(bounds);
    let mut decoder = reader.into_decoder().map_err(from_image)?;
    // EXIF data that cannot be read hold no orientation.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut image = DynamicImage::from_decoder(decoder).map_err(from_image)?;
    image.apply_orientation(orientation);
    Ok(image)
}

fn from_image(error: ImageError) -> Error {
    Error::NotAVideo(format!("the picture cannot be read: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use flockreel_core::code::Code;

    fn png_of(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        let image =
            image::RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, 7]));
        image
            .write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png)
            .expect("an image in memory can be encoded");
        bytes
    }

    #[test]
    fn decoded_png_has_the_pixels_of_its_source() {
        let image = decode_image(&png_of(40, 20), &Limits::default()).expect("a good image");
        assert_eq!((image.width, image.height), (40, 20));
        assert_eq!(image.pixel(33, 12), [33, 12, 7]);
    }

    #[test]
    fn image_beyond_the_limits_or_cut_off_is_refused() {
        let code = |bytes: &[u8], limits: &Limits| {
            decode_image(bytes, limits).expect_err("a bad image").code()
        };
        let small = Limits {
            max_pixels: 500,
            ..Limits::default()
        };
        let png = png_of(40, 20);
        assert_eq!(code(&png, &small), Code::TooManyPixels);
        assert_eq!(
            code(&png[..png.len() / 2], &Limits::default()),
            Code::NotAVideo
        );
        assert_eq!(code(b"P6 40 20 255 ", &Limits::default()), Code::NotAVideo);
    }
}
