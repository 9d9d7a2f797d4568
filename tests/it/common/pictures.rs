//! Pictures as footage, made on the spot: PNGs, zips of them, stacks of TIFF pages.

use std::io::{Cursor, Write};

use image::{GrayImage, ImageFormat, Luma, RgbaImage};
use tiff::encoder::{TiffEncoder, colortype};
use zip::CompressionMethod;
use zip::write::SimpleFileOptions;

/// Columns and rows of the pictures.
pub(crate) const SIZE: [u32; 2] = [64, 48];

/// A ramp of gray that moves on by 10 levels with each picture, modulo 256.
pub(crate) fn gray(k: usize) -> GrayImage {
    GrayImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        Luma([((2 * x + y) as usize + 10 * k) as u8])
    })
}

/// A picture as the bytes of a file.
pub(crate) fn encoded(image: &GrayImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("in memory");
    bytes.into_inner()
}

/// The same of a picture with alpha.
pub(crate) fn encoded_rgba(image: &RgbaImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("in memory");
    bytes.into_inner()
}

/// A zip of files, packed.
pub(crate) fn zip_of(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let packed = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in files {
        zip.start_file(name, packed).expect("in memory");
        zip.write_all(bytes).expect("in memory");
    }
    zip.finish().expect("in memory").into_inner()
}

/// A zip of `n` numbered PNGs.
pub(crate) fn zip_of_grays(n: usize) -> Vec<u8> {
    let file = |k: usize| {
        (
            format!("shots/{k}.png"),
            encoded(&gray(k), ImageFormat::Png),
        )
    };
    zip_of(&(0..n).map(file).collect::<Vec<_>>())
}

/// A TIFF of `n` pages of 8 bits.
pub(crate) fn stack_of_grays(n: usize) -> Vec<u8> {
    stack::<colortype::Gray8>(n, |k| gray(k).into_raw())
}

/// A TIFF of `n` pages of any samples.
pub(crate) fn stack<C: colortype::ColorType>(
    n: usize,
    page: impl Fn(usize) -> Vec<C::Inner>,
) -> Vec<u8>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    let mut tiff = TiffEncoder::new(&mut bytes).expect("in memory");
    for k in 0..n {
        tiff.write_image::<C>(SIZE[0], SIZE[1], &page(k))
            .expect("in memory");
    }
    bytes.into_inner()
}
