//! One still picture: decoding of its bytes and conversion to RGB.

use std::io::Cursor;

use image::imageops::{FilterType, resize};
use image::{DynamicImage, GrayImage, ImageFormat, RgbImage};

use super::stack;
use crate::media::error::Error;
use crate::media::image::decode;
use crate::media::limits::Limits;
use crate::media::stretch::Stretch;

/// Gray of 16 bits.
pub(super) type Gray16Image = image::ImageBuffer<image::Luma<u16>, Vec<u16>>;

/// Returns the alpha of a picture as gray.
fn alpha_of(image: DynamicImage) -> GrayImage {
    let rgba = image.into_rgba8();
    GrayImage::from_fn(rgba.width(), rgba.height(), |x, y| {
        image::Luma([rgba.get_pixel(x, y).0[3]])
    })
}

/// A decoded picture without alpha.
pub(super) enum Picture {
    /// Gray of 8 bits.
    Gray(GrayImage),
    /// Gray of 16 bits.
    Gray16(Gray16Image),
    /// Colors of 8 bits.
    Rgb(RgbImage),
}

impl Picture {
    /// Decodes a PNG, JPEG, BMP or the first page of a TIFF. Returns the picture and whether it has an alpha
    /// channel.
    ///
    /// With `of_alpha` the picture is the alpha instead, opaque if there is none. The alpha of a TIFF is
    /// ignored.
    pub(super) fn decoded(
        bytes: &[u8],
        limits: &Limits,
        of_alpha: bool,
    ) -> Result<(Picture, bool), Error> {
        if stack::is_tiff(bytes) {
            let mut pages = stack::open(Cursor::new(bytes), limits)?;
            return Ok((stack::page(&mut pages, 0, limits)?, false));
        }
        let formats = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp];
        let image = decode(bytes, &formats, limits)?;
        let has_alpha = image.color().has_alpha();
        let picture = match of_alpha {
            true => Picture::Gray(alpha_of(image)),
            false => Picture::of(image),
        };
        Ok((picture, has_alpha))
    }

    fn of(image: DynamicImage) -> Picture {
        match image {
            DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) => {
                Picture::Gray(image.into_luma8())
            }
            DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => {
                Picture::Gray16(image.into_luma16())
            }
            _ => Picture::Rgb(image.into_rgb8()),
        }
    }

    /// Returns width and height, pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        let (width, height) = match self {
            Picture::Gray(image) => image.dimensions(),
            Picture::Gray16(image) => image.dimensions(),
            Picture::Rgb(image) => image.dimensions(),
        };
        [width, height]
    }

    /// Returns RGB pixels, scaled to `size`. Gray of 16 bits is stretched, or reduced to its upper 8 bits.
    pub(super) fn into_rgb(self, stretch: Option<&Stretch>, size: [u32; 2]) -> Vec<u8> {
        let is_scaled = self.size() != size;
        let gray_of = |level: u16| match stretch {
            Some(stretch) => stretch.gray(level),
            None => (level >> 8) as u8,
        };
        let pixels = match &self {
            Picture::Gray(image) => image.iter().flat_map(|&gray| [gray; 3]).collect(),
            Picture::Gray16(image) => image.iter().flat_map(|&l| [gray_of(l); 3]).collect(),
            Picture::Rgb(_) => Vec::new(),
        };
        let [width, height] = self.size();
        let image = match self {
            Picture::Rgb(image) => Some(image),
            _ => RgbImage::from_raw(width, height, pixels),
        };
        let image = image.unwrap_or_default();
        match is_scaled {
            true => resize(&image, size[0], size[1], FilterType::CatmullRom).into_raw(),
            false => image.into_raw(),
        }
    }
}
