//! A decoded frame in planar YUV 4:2:0, the format of the decoder and the encoder. Only boxes of interest are
//! converted to RGB (docs/explanation/algorithms.md, "Tracking" and "Compositing").

use super::{ColorSpec, RgbImage};
use crate::geometry::Rect;

/// One frame: a luma plane of `width` by `height`, then two chroma planes of half the size, rounded up.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Frame {
    /// Number of luma columns.
    pub width: u32,
    /// Number of luma rows.
    pub height: u32,
    /// Conversion of the values to RGB.
    pub color: ColorSpec,
    /// The planes Y, U and V in this order, without padding.
    pub planes: Vec<u8>,
    /// Given alpha of the animal, if any.
    pub mask: Option<GivenMask>,
}

/// Alpha of the animal in a frame, from an alpha channel of the footage or from the user's masks.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct GivenMask {
    /// 0..=255 for each pixel, row by row.
    pub alpha: Vec<u8>,
    /// Whether the colors of partly covered pixels include the background, as filmed by a camera. Footage
    /// with an alpha channel holds the animal's colors only.
    pub is_mixed: bool,
}

impl Frame {
    /// Returns a frame of zeros.
    pub fn new(width: u32, height: u32, color: ColorSpec) -> Frame {
        Frame {
            width,
            height,
            color,
            planes: vec![0; Frame::n_bytes(width, height)],
            mask: None,
        }
    }

    /// Returns the size of a frame of `width` by `height`, bytes.
    pub fn n_bytes(width: u32, height: u32) -> usize {
        let chroma = width.div_ceil(2) as usize * height.div_ceil(2) as usize;
        width as usize * height as usize + 2 * chroma
    }

    /// Returns the luma plane, row by row.
    pub fn luma(&self) -> &[u8] {
        &self.planes[..self.width as usize * self.height as usize]
    }

    /// Returns the gray level, 0..=255, for each luma value.
    pub fn gray_levels(&self) -> [u8; 256] {
        let convert = self.color.to_rgb();
        std::array::from_fn(|luma| convert.convert(luma as u8, 128, 128)[1])
    }

    /// Returns the two chroma planes, with rows of `chroma_width`.
    pub fn chroma(&self) -> (&[u8], &[u8]) {
        let luma = self.width as usize * self.height as usize;
        self.planes[luma..].split_at((self.planes.len() - luma) / 2)
    }

    /// Returns the number of columns of a chroma plane.
    pub fn chroma_width(&self) -> u32 {
        self.width.div_ceil(2)
    }

    /// Returns the whole frame converted to RGB.
    pub fn to_rgb(&self) -> RgbImage {
        self.rgb(Rect::of_size(self.width, self.height))
    }

    /// Returns a box converted to RGB. Panics if it does not lie inside the frame.
    pub fn rgb(&self, rect: Rect) -> RgbImage {
        assert!(
            rect.right() <= self.width && rect.bottom() <= self.height,
            "box outside the frame"
        );
        let convert = self.color.to_rgb();
        let (u, v) = self.chroma();
        let (width, chroma_width) = (self.width as usize, self.chroma_width() as usize);
        let mut image = RgbImage::new(rect.w, rect.h);
        let rows = image.pixels.chunks_exact_mut(rect.w.max(1) as usize * 3);
        for (row, y) in rows.zip(rect.y as usize..) {
            let luma = &self.luma()[y * width + rect.x as usize..][..rect.w as usize];
            let chroma = y / 2 * chroma_width;
            let pixels = row.chunks_exact_mut(3).zip(luma);
            for ((pixel, &luma), x) in pixels.zip(rect.x as usize..) {
                let at = chroma + x / 2;
                pixel.copy_from_slice(&convert.convert(luma, u[at], v[at]));
            }
        }
        image
    }

    /// Writes a whole canvas into the planes. Panics if its size differs from the frame's.
    pub fn draw_all_rgb(&mut self, canvas: &RgbImage) {
        self.draw_rgb(canvas, Rect::of_size(self.width, self.height));
    }

    /// Writes a box of a canvas into the planes: the pixels and chroma of every 2 x 2 block that the box
    /// touches.
    ///
    /// Panics if the sizes of canvas and frame differ.
    pub fn draw_rgb(&mut self, canvas: &RgbImage, rect: Rect) {
        assert_eq!(canvas.size(), [self.width, self.height], "sizes differ");
        if rect.is_empty() {
            return;
        }
        let from = self.color.from_rgb();
        let (width, height) = (self.width as usize, self.height as usize);
        let chroma_width = self.chroma_width() as usize;
        let (luma, chroma) = self.planes.split_at_mut(width * height);
        let (u_plane, v_plane) = chroma.split_at_mut(chroma.len() / 2);
        let (x0, x1) = (rect.x as usize / 2, (rect.right() as usize).div_ceil(2));
        let (y0, y1) = (rect.y as usize / 2, (rect.bottom() as usize).div_ceil(2));
        for by in y0..y1 {
            for bx in x0..x1 {
                let mut sum = [0; 3];
                for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    // At an odd right or bottom edge the last pixel is used twice.
                    let (x, y) = ((2 * bx + dx).min(width - 1), (2 * by + dy).min(height - 1));
                    let at = y * width + x;
                    let rgb = canvas.pixel(x as u32, y as u32);
                    luma[at] = from.luma(rgb);
                    for (s, c) in sum.iter_mut().zip(rgb) {
                        *s += i32::from(c);
                    }
                }
                let [u, v] = from.chroma_of_block(sum);
                u_plane[by * chroma_width + bx] = u;
                v_plane[by * chroma_width + bx] = v;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rgb_round_trip_keeps_blocks_of_one_color() {
        let mut canvas = RgbImage::new(7, 5);
        for y in 0..5 {
            for x in 0..7 {
                canvas.set_pixel(x, y, [(x / 2 * 40) as u8, 120, (y / 2 * 60) as u8]);
            }
        }
        let mut frame = Frame::new(7, 5, ColorSpec::default());
        frame.draw_rgb(&canvas, Rect::of_size(7, 5));
        for (a, b) in frame.to_rgb().pixels.iter().zip(&canvas.pixels) {
            assert!(a.abs_diff(*b) <= 2);
        }
    }

    #[test]
    fn box_equals_the_same_part_of_the_whole_frame() {
        let mut frame = Frame::new(9, 6, ColorSpec::default());
        for (k, byte) in frame.planes.iter_mut().enumerate() {
            *byte = (k * 37 % 251) as u8;
        }
        let (whole, part) = (frame.to_rgb(), frame.rgb(Rect::new(3, 1, 5, 4)));
        for y in 0..4 {
            for x in 0..5 {
                assert_eq!(part.pixel(x, y), whole.pixel(x + 3, y + 1));
            }
        }
    }
}
