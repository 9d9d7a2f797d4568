//! Square cells that divide a picture, so that large pictures cost no more than small ones.

use crate::geometry::Rect;
use crate::raster::runs::Component;
use crate::raster::{Mask, RgbImage};

/// Longer side of a picture whose cells are its pixels; larger pictures have larger cells, pixels. Free choice.
const PICTURE_PX: f64 = 480.0;

/// The cells of a picture. Masks of cells have one bit per cell.
pub(super) struct Grid {
    /// Side of a cell, pixels: at least 1.
    pub(super) cell_px: f64,
    /// Number of columns and rows.
    size: [usize; 2],
    /// Width and height of the picture, pixels.
    picture_px: [u32; 2],
}

impl Grid {
    /// Returns the cells of a picture of the given width and height.
    pub(super) fn new(picture_px: [u32; 2]) -> Grid {
        let longest = picture_px.into_iter().fold(0, u32::max);
        let cell_px = (f64::from(longest) / PICTURE_PX).max(1.0);
        Grid {
            cell_px,
            size: picture_px.map(|px| (f64::from(px) / cell_px).ceil() as usize),
            picture_px,
        }
    }

    /// Returns an empty mask of all cells.
    pub(super) fn mask(&self) -> Mask {
        let [columns, rows] = self.size.map(|n| n as u32);
        Mask::new(Rect::of_size(columns, rows))
    }

    /// Returns the index of the cell at a place in the picture.
    pub(super) fn cell(&self, place_px: [f64; 2]) -> usize {
        let [column, row] =
            [0, 1].map(|axis| ((place_px[axis] / self.cell_px) as usize).min(self.size[axis] - 1));
        row * self.size[0] + column
    }

    /// Returns the column and the row of a cell.
    pub(super) fn place(&self, cell: usize) -> [u32; 2] {
        [cell % self.size[0], cell / self.size[0]].map(|at| at as u32)
    }

    /// Sets the cells of a component.
    pub(super) fn cover(&self, mask: &mut Mask, component: &Component) {
        for run in &component.runs {
            let [first, last] =
                [run.x0, run.x1 - 1].map(|x| self.cell([f64::from(x), f64::from(run.y)]));
            mask.bits[first..=last].fill(1);
        }
    }

    /// Returns for each cell the number of lists with a cell within two cells of it.
    pub(super) fn count_near<'a>(&self, lists: impl Iterator<Item = &'a Vec<usize>>) -> Vec<u16> {
        let mut counts = vec![0; self.size[0] * self.size[1]];
        for cells in lists {
            let mut mask = self.mask();
            cells.iter().for_each(|&cell| mask.bits[cell] = 1);
            for (count, bit) in counts.iter_mut().zip(mask.dilated_by(2).bits) {
                *count += u16::from(bit);
            }
        }
        counts
    }

    /// Returns a picture with one pixel per cell: the mean of the cell.
    pub(super) fn shrunk(&self, picture: &RgbImage) -> RgbImage {
        let [columns, rows] = self.size;
        let mut sums = vec![[0u32; 4]; columns * rows];
        for (at, pixel) in picture.pixels.chunks_exact(3).enumerate() {
            let width = picture.width as usize;
            let sum = &mut sums[self.cell([(at % width) as f64, (at / width) as f64])];
            sum[3] += 1;
            (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
        }
        let mut small = RgbImage::new(columns as u32, rows as u32);
        for (pixel, sum) in small.pixels.chunks_exact_mut(3).zip(sums) {
            (0..3).for_each(|c| pixel[c] = (sum[c] / sum[3].max(1)) as u8);
        }
        small
    }

    /// Returns the pixels of the picture in the cells of a mask and in the two cells around them, where its edge
    /// is blurred.
    pub(super) fn pixels(&self, cells: &Mask) -> Mask {
        let mut all = self.mask();
        all.add(cells);
        let all = all.dilated_by(2);
        let [width, height] = self.picture_px;
        let mut pixels = Mask::new(Rect::of_size(width, height));
        for (at, bit) in pixels.bits.iter_mut().enumerate() {
            let place = [at % width as usize, at / width as usize].map(|v| v as f64);
            *bit = all.bits[self.cell(place)];
        }
        pixels
    }
}
