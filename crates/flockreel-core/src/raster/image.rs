//! Packed 8-bit images in encoded sRGB values: RGB without alpha, RGBA with straight alpha.

/// An image with `N` bytes per pixel, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Image<const N: usize> {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height * N` bytes.
    pub pixels: Vec<u8>,
}

/// An RGB image.
pub type RgbImage = Image<3>;

/// An RGBA image with straight (not premultiplied) alpha.
pub type RgbaImage = Image<4>;

impl RgbImage {
    /// Returns the colors of RGBA pixels. Alpha is ignored. Panics unless there are `width * height * 4` bytes.
    pub fn without_alpha(width: u32, height: u32, rgba: &[u8]) -> RgbImage {
        let mut image = RgbImage::new(width, height);
        assert_eq!(
            rgba.len() / 4 * 3,
            image.pixels.len(),
            "4 bytes for each pixel"
        );
        for (rgb, rgba) in image.pixels.chunks_exact_mut(3).zip(rgba.chunks_exact(4)) {
            rgb.copy_from_slice(&rgba[..3]);
        }
        image
    }
}

impl<const N: usize> Image<N> {
    /// Returns an image of zeros: black, and transparent if it has alpha.
    pub fn new(width: u32, height: u32) -> Self {
        Image {
            width,
            height,
            pixels: vec![0; width as usize * height as usize * N],
        }
    }

    /// Returns the number of columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Returns the pixel in column `x` and row `y`. Panics outside the image.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; N] {
        let at = self.offset(x, y);
        std::array::from_fn(|channel| self.pixels[at + channel])
    }

    /// Sets one pixel. Panics outside the image.
    pub fn set_pixel(&mut self, x: u32, y: u32, pixel: [u8; N]) {
        let at = self.offset(x, y);
        self.pixels[at..at + N].copy_from_slice(&pixel);
    }

    fn offset(&self, x: u32, y: u32) -> usize {
        (y as usize * self.width as usize + x as usize) * N
    }
}
