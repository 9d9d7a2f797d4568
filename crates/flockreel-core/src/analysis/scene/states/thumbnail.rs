//! Thumbnails of samples: the means of luma and chroma in square cells. Their comparison gives the share of
//! the picture that differs for reasons other than light.
//!
//! Before a comparison, one thumbnail is fitted to the other by gains for the whole picture, its rows and its
//! columns.

use crate::analysis::scene::probes::MAX_GAIN;
use crate::order;
use crate::raster::Frame;

/// Approximate number of cells along the longer side of the picture. Free choice.
const N_CELLS_ALONG: usize = 96;
/// Luma difference above which a cell differs, levels of 255, in addition to `LUMA_SHARE`. Free choice.
const LUMA_LEVELS: f32 = 6.0;
/// Further luma difference allowed, as a share of the cell's luma. Free choice.
const LUMA_SHARE: f32 = 0.1;
/// Chroma difference above which a cell differs, levels of 255. Free choice.
const CHROMA_LEVELS: f32 = 8.0;
/// Largest luma of a cell that is too dark to measure light, levels of 255. Free choice.
const MAX_DARK_LUMA: f32 = 12.0;
/// A picture is blank if its cells' luma varies by less than this, levels of 255. Free choice.
const MAX_BLANK_RANGE: f32 = 6.0;

/// Means of Y (minus black), U and V (both minus 128) in square cells, row by row.
#[derive(Clone, Debug)]
pub(in crate::analysis::scene) struct Thumbnail {
    columns: usize,
    cells: Vec<[f32; 3]>,
}

impl Thumbnail {
    /// Returns the side of a cell for a picture of this size, pixels; always even.
    pub(in crate::analysis::scene) fn cell_px(width: u32, height: u32) -> usize {
        let side = (width.max(height) as usize).div_ceil(N_CELLS_ALONG);
        (side + side % 2).max(4)
    }

    /// Returns the thumbnail of a frame.
    pub(in crate::analysis::scene) fn new(frame: &Frame) -> Thumbnail {
        let side = Thumbnail::cell_px(frame.width, frame.height);
        let (w, h) = (frame.width as usize, frame.height as usize);
        let (columns, rows) = (w.div_ceil(side), h.div_ceil(side));
        let black = frame.color.black();
        let (u, v) = frame.chroma();
        let y = cell_means(frame.luma(), [w, h], side);
        let chroma_size = [frame.chroma_width() as usize, h.div_ceil(2)];
        let [u, v] = [u, v].map(|plane| cell_means(plane, chroma_size, side / 2));
        let cell = |k: usize| [y[k] - black, u[k] - 128.0, v[k] - 128.0];
        Thumbnail {
            columns,
            cells: (0..columns * rows).map(cell).collect(),
        }
    }

    /// Returns the median of each cell over thumbnails of one size. Panics if there are none.
    pub(in crate::analysis::scene) fn median<'a>(
        all: impl Iterator<Item = &'a Thumbnail>,
    ) -> Thumbnail {
        let all: Vec<&Thumbnail> = all.collect();
        let cell = |k: usize| {
            [0, 1, 2].map(|c| {
                let values = all.iter().map(|t| f64::from(t.cells[k][c]));
                order::median(values).unwrap_or(0.0) as f32
            })
        };
        Thumbnail {
            columns: all[0].columns,
            cells: (0..all[0].cells.len()).map(cell).collect(),
        }
    }

    /// Returns the number of cells.
    pub(in crate::analysis::scene) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Returns whether the picture is blank: black, or without structure.
    pub(in crate::analysis::scene) fn is_blank(&self) -> bool {
        let luma = || self.cells.iter().map(|cell| cell[0]);
        let most = luma().fold(f32::MIN, f32::max);
        let least = luma().fold(f32::MAX, f32::min);
        most - least < MAX_BLANK_RANGE
    }

    /// Returns the share of cells that differ from another thumbnail after its light is fitted, 0..=1.
    pub(in crate::analysis::scene) fn mismatch(&self, other: &Thumbnail) -> f64 {
        let fitted = self.in_light_of(other);
        let differs = |(a, b): &(&[f32; 3], &[f32; 3])| cells_differ(a, b);
        let n = fitted
            .cells
            .iter()
            .zip(&other.cells)
            .filter(differs)
            .count();
        n as f64 / self.cells.len() as f64
    }

    /// Returns whether cell `k` differs from that of another thumbnail, without a fit of the light.
    pub(in crate::analysis::scene) fn differs_at(&self, other: &Thumbnail, k: usize) -> bool {
        cells_differ(&self.cells[k], &other.cells[k])
    }

    /// Returns the correlation of the luma of two thumbnails, -1..=1; 0 where one is flat.
    pub(in crate::analysis::scene) fn correlation(&self, other: &Thumbnail) -> f64 {
        let n = self.cells.len() as f64;
        let mean = |t: &Thumbnail| t.cells.iter().map(|c| f64::from(c[0])).sum::<f64>() / n;
        let (a, b) = (mean(self), mean(other));
        let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
        for (p, q) in self.cells.iter().zip(&other.cells) {
            let (p, q) = (f64::from(p[0]) - a, f64::from(q[0]) - b);
            ab += p * q;
            aa += p * p;
            bb += q * q;
        }
        if aa * bb > 0.0 {
            ab / (aa * bb).sqrt()
        } else {
            0.0
        }
    }

    /// Returns the thumbnail in the light of another: its luma divided by gains for picture, rows and
    /// columns, its chroma shifted by the median offset.
    fn in_light_of(&self, other: &Thumbnail) -> Thumbnail {
        let mut result = self.clone();
        let n_rows = self.cells.len() / self.columns;
        result.divide(0..self.cells.len(), other);
        for row in 0..n_rows {
            result.divide(row * self.columns..(row + 1) * self.columns, other);
        }
        for column in 0..self.columns {
            let along = (0..n_rows).map(|row| row * self.columns + column);
            result.divide(along, other);
        }
        for c in 1..3 {
            let off = |(a, b): (&[f32; 3], &[f32; 3])| f64::from(a[c] - b[c]);
            let off = order::median(result.cells.iter().zip(&other.cells).map(off));
            // Light of a clearly different color is another state, so the shift is limited.
            let off = (off.unwrap_or(0.0) as f32).clamp(-CHROMA_LEVELS, CHROMA_LEVELS);
            for cell in &mut result.cells {
                cell[c] -= off;
            }
        }
        result
    }

    /// Divides the luma of some cells by their median ratio to the other thumbnail. The median ignores an
    /// animal that covers less than half of them.
    fn divide(&mut self, cells: impl Iterator<Item = usize> + Clone, other: &Thumbnail) {
        let ratio = |k: usize| {
            let (a, b) = (self.cells[k][0], other.cells[k][0]);
            (a > MAX_DARK_LUMA && b > MAX_DARK_LUMA).then(|| f64::from(a / b))
        };
        let n_cells = cells.clone().count();
        let mut ratios: Vec<f64> = cells.clone().filter_map(ratio).collect();
        // Few bright cells on black are probably the animal.
        if 3 * ratios.len() < n_cells {
            return;
        }
        let gain = order::percentile(&mut ratios, 0.5).unwrap_or(1.0) as f32;
        let gain = gain.clamp(1.0 / MAX_GAIN as f32, MAX_GAIN as f32);
        for k in cells {
            self.cells[k][0] /= gain;
        }
    }
}

fn cells_differ(a: &[f32; 3], b: &[f32; 3]) -> bool {
    let luma = (a[0] - b[0]).abs() > LUMA_LEVELS + LUMA_SHARE * b[0].max(0.0);
    luma || (1..3).any(|c| (a[c] - b[c]).abs() > CHROMA_LEVELS)
}

/// Returns the means of square cells of a plane; cells at the right and lower edge may be smaller.
fn cell_means(plane: &[u8], [w, h]: [usize; 2], side: usize) -> Vec<f32> {
    let (columns, rows) = (w.div_ceil(side), h.div_ceil(side));
    let mut means = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        let lines = row * side..((row + 1) * side).min(h);
        let mut sums = vec![0u32; columns];
        for line in lines.clone() {
            let line = &plane[line * w..(line + 1) * w];
            for (sum, cell) in sums.iter_mut().zip(line.chunks(side)) {
                *sum += cell.iter().map(|&v| u32::from(v)).sum::<u32>();
            }
        }
        let n_px = |column: usize| (side.min(w - column * side) * lines.len()) as f32;
        let mean = |(column, sum): (usize, u32)| sum as f32 / n_px(column);
        means.extend(sums.into_iter().enumerate().map(mean));
    }
    means
}
