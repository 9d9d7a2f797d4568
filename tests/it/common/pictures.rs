//! Footage made of pictures, generated at run time: PNG files, zips of them, and multi-page TIFF files.

use std::io::{Cursor, Write};

use image::{GrayImage, ImageFormat, Luma, RgbaImage};
use tiff::encoder::{TiffEncoder, colortype};
use zip::CompressionMethod;
use zip::write::SimpleFileOptions;

/// Width and height of the pictures, pixels.
pub(crate) const SIZE: [u32; 2] = [64, 48];

/// Returns a gray ramp. Each step of `k` adds 10 levels, modulo 256.
pub(crate) fn gray(k: usize) -> GrayImage {
    GrayImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        Luma([((2 * x + y) as usize + 10 * k) as u8])
    })
}

/// Returns the bytes of an encoded picture.
pub(crate) fn encoded(image: &GrayImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("in memory");
    bytes.into_inner()
}

/// Returns the bytes of an encoded picture with alpha.
pub(crate) fn encoded_rgba(image: &RgbaImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("in memory");
    bytes.into_inner()
}

/// Returns the bytes of a compressed zip of files.
pub(crate) fn zip_of(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let packed = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in files {
        zip.start_file(name, packed).expect("in memory");
        zip.write_all(bytes).expect("in memory");
    }
    zip.finish().expect("in memory").into_inner()
}

/// Returns the bytes of a zip with `n` numbered PNG files.
pub(crate) fn zip_of_grays(n: usize) -> Vec<u8> {
    let file = |k: usize| {
        (
            format!("shots/{k}.png"),
            encoded(&gray(k), ImageFormat::Png),
        )
    };
    zip_of(&(0..n).map(file).collect::<Vec<_>>())
}

/// Returns the bytes of a TIFF with `n` pages of 8 bits.
pub(crate) fn stack_of_grays(n: usize) -> Vec<u8> {
    stack::<colortype::Gray8>(n, |k| gray(k).into_raw())
}

/// Returns the bytes of a TIFF with `n` pages of any sample type.
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
