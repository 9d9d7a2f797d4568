//! One picture of a footage: its bytes decoded, its pixels as red, green and blue.

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

/// The alpha of a picture.
fn alpha_of(image: DynamicImage) -> GrayImage {
    let rgba = image.into_rgba8();
    GrayImage::from_fn(rgba.width(), rgba.height(), |x, y| {
        image::Luma([rgba.get_pixel(x, y).0[3]])
    })
}

/// A decoded picture, without its alpha.
pub(super) enum Picture {
    /// Gray of 8 bits.
    Gray(GrayImage),
    /// Gray of more bits.
    Gray16(Gray16Image),
    /// Colors of 8 bits.
    Rgb(RgbImage),
}

impl Picture {
    /// Decodes a PNG, JPEG, BMP or the first page of a TIFF, or the alpha of one, opaque where it has none; and says
    /// whether it has an alpha channel. That of a TIFF is passed over.
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

    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        let (width, height) = match self {
            Picture::Gray(image) => image.dimensions(),
            Picture::Gray16(image) => image.dimensions(),
            Picture::Rgb(image) => image.dimensions(),
        };
        [width, height]
    }

    /// Returns rows of red, green, blue, scaled to `size`. Gray of 16 bits is stretched, or loses its lower 8 bits.
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
