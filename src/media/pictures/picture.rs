//! One decoded still picture, and its conversion to RGB.

use image::imageops::{FilterType, resize};
use image::{DynamicImage, GrayImage, ImageBuffer, Luma, Rgb, RgbImage};

use crate::media::gray_range::GrayRange;

/// A decoded picture without alpha.
pub(super) enum Picture {
    /// Gray of 8 bits.
    Gray(GrayImage),
    /// Gray of 16 bits.
    Gray16(ImageBuffer<Luma<u16>, Vec<u16>>),
    /// Colors of 8 bits.
    Rgb(RgbImage),
}

impl Picture {
    /// Returns a picture without its alpha.
    pub(super) fn new(image: DynamicImage) -> Picture {
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

    /// Returns the alpha of a picture as gray, opaque if there is none.
    pub(super) fn of_alpha(image: DynamicImage) -> Picture {
        let rgba = image.into_rgba8();
        Picture::Gray(GrayImage::from_fn(rgba.width(), rgba.height(), |x, y| {
            Luma([rgba.get_pixel(x, y).0[3]])
        }))
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
    pub(super) fn into_rgb(self, gray_range: Option<&GrayRange>, size: [u32; 2]) -> Vec<u8> {
        let [width, height] = self.size();
        let to_8_bits = |level: u16| match gray_range {
            Some(range) => range.to_8_bits(level),
            None => (level >> 8) as u8,
        };
        let image = match self {
            Picture::Gray(gray) => {
                RgbImage::from_fn(width, height, |x, y| Rgb([gray.get_pixel(x, y).0[0]; 3]))
            }
            Picture::Gray16(gray) => RgbImage::from_fn(width, height, |x, y| {
                Rgb([to_8_bits(gray.get_pixel(x, y).0[0]); 3])
            }),
            Picture::Rgb(image) => image,
        };
        if [width, height] == size {
            image.into_raw()
        } else {
            resize(&image, size[0], size[1], FilterType::CatmullRom).into_raw()
        }
    }
}
