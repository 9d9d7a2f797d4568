//! Means of 4 x 4 blocks of luma (2 x 2 of chroma), compared with the plate's: a cheap look at the
//! whole frame that says where a closer one is worth it (ALGORITHMS.md 3).

use rayon::prelude::*;

use crate::analysis::light::Gain;
use crate::geometry::Rect;
use crate::raster::runs;
use crate::raster::{Frame, Mask, Range};

const SIDE: usize = 4;
/// A block is worth a look when the sum of its 16 luma differences exceeds 16 times this level ...
const LUMA_LEVELS: i32 = 3;
/// ... or the sum of its 4 differences of a chroma plane 4 times this one.
const CHROMA_LEVELS: i32 = 3;

/// Block sums of the plate, and how large a difference each block needs.
pub struct Blocks {
    columns: usize,
    rows: usize,
    black: f32,
    sums: Vec<[i16; 3]>,
    thresholds: Vec<[i16; 3]>,
}

impl Blocks {
    /// The block sums of a plate, with the least thresholds.
    pub fn of(plate: &Frame) -> Blocks {
        let (columns, rows) = grid(plate);
        let sums: Vec<[i16; 3]> = (0..rows).flat_map(|row| block_row(plate, row)).collect();
        let least = [LUMA_LEVELS * 16, CHROMA_LEVELS * 4, CHROMA_LEVELS * 4].map(|t| t as i16);
        let thresholds = vec![least; sums.len()];
        let black = if plate.color.range == Range::Limited {
            16.0 * 16.0
        } else {
            0.0
        };
        Blocks {
            columns,
            rows,
            black,
            sums,
            thresholds,
        }
    }

    /// Raises each block's thresholds to four times its noise over the samples (1.4826 times the
    /// median absolute deviation).
    pub fn measure_noise(&mut self, samples: &[Frame]) {
        let plate = self.sums.par_chunks_exact(self.columns);
        let rows = self
            .thresholds
            .par_chunks_exact_mut(self.columns)
            .zip(plate);
        rows.enumerate().for_each(|(row, (thresholds, plate))| {
            let sums: Vec<Vec<[i16; 3]>> = samples.iter().map(|s| block_row(s, row)).collect();
            let mut gaps = vec![0; samples.len()];
            for (column, (threshold, base)) in thresholds.iter_mut().zip(plate).enumerate() {
                for plane in 0..3 {
                    for (gap, sums) in gaps.iter_mut().zip(&sums) {
                        *gap = (sums[column][plane] - base[plane]).abs();
                    }
                    let middle = gaps.len() / 2;
                    let median = f32::from(*gaps.select_nth_unstable(middle).1);
                    let noise = (4.0 * 1.4826 * median).min(8000.0) as i16;
                    threshold[plane] = threshold[plane].max(noise);
                }
            }
        });
    }

    /// Boxes around connected blocks of `region` that differ, each widened by `margin_px`.
    pub fn proposals(&self, frame: &Frame, gain: &Gain, region: Rect, margin_px: u32) -> Vec<Rect> {
        let side = SIDE as u32;
        let blocks = Rect {
            x: region.x / side,
            y: region.y / side,
            w: (region.right().div_ceil(side)).min(self.columns as u32) - region.x / side,
            h: (region.bottom().div_ceil(side)).min(self.rows as u32) - region.y / side,
        };
        let mut mask = Mask::new(blocks);
        let to_plate = (1024.0 / gain.luma()).round() as i32;
        let black = self.black as i32;
        for (bits, row) in mask
            .bits
            .chunks_exact_mut(blocks.w.max(1) as usize)
            .zip(blocks.y as usize..)
        {
            let sums = block_row(frame, row);
            let from = blocks.x as usize;
            let plate = &self.sums[row * self.columns + from..];
            let thresholds = &self.thresholds[row * self.columns + from..];
            for (((bit, sum), base), threshold) in bits
                .iter_mut()
                .zip(&sums[from..])
                .zip(plate)
                .zip(thresholds)
            {
                let luma = (((i32::from(sum[0]) - black) * to_plate) >> 10) + black;
                let luma_gap = (luma - i32::from(base[0])).abs();
                let gap = |plane: usize| (sum[plane] - base[plane]).abs();
                let differs = luma_gap > i32::from(threshold[0])
                    || gap(1) > threshold[1]
                    || gap(2) > threshold[2];
                *bit = u8::from(differs);
            }
        }
        let to_pixels = |rect: Rect| Rect {
            x: rect.x * side,
            y: rect.y * side,
            w: (rect.right() * side).min(frame.width) - rect.x * side,
            h: (rect.bottom() * side).min(frame.height) - rect.y * side,
        };
        runs::components(&mask)
            .iter()
            .map(|c| to_pixels(c.rect).inflated(margin_px, frame.width, frame.height))
            .collect()
    }
}

/// (columns, rows) of blocks; the last ones may hang over the edge.
fn grid(frame: &Frame) -> (usize, usize) {
    (
        (frame.width as usize).div_ceil(SIDE),
        (frame.height as usize).div_ceil(SIDE),
    )
}

/// Sums of luma, U and V of the blocks of one row. At the edges the last pixels are repeated.
fn block_row(frame: &Frame, row: usize) -> Vec<[i16; 3]> {
    let (w, h) = (frame.width as usize, frame.height as usize);
    let (columns, _) = grid(frame);
    let mut sums = vec![[0i16; 3]; columns];
    for dy in 0..SIDE {
        let y = (row * SIDE + dy).min(h - 1);
        add_row(&mut sums, 0, &frame.luma()[y * w..][..w], SIDE);
    }
    let (u, v) = frame.chroma();
    let (cw, ch) = (frame.chroma_width() as usize, h.div_ceil(2));
    for dy in 0..SIDE / 2 {
        let y = (row * SIDE / 2 + dy).min(ch - 1);
        add_row(&mut sums, 1, &u[y * cw..][..cw], SIDE / 2);
        add_row(&mut sums, 2, &v[y * cw..][..cw], SIDE / 2);
    }
    sums
}

fn add_row(sums: &mut [[i16; 3]], plane: usize, values: &[u8], side: usize) {
    let mut whole = values.chunks_exact(side);
    let mut n = 0;
    for (sum, block) in sums.iter_mut().zip(&mut whole) {
        sum[plane] += block.iter().map(|&v| i16::from(v)).sum::<i16>();
        n += 1;
    }
    if let (Some(sum), Some(&last)) = (sums.get_mut(n), values.last()) {
        let rest = whole.remainder();
        let missing = (side - rest.len()) as i16 * i16::from(last);
        sum[plane] += rest.iter().map(|&v| i16::from(v)).sum::<i16>() + missing;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::ColorSpec;

    #[test]
    fn a_bright_spot_is_proposed_and_nothing_else() {
        let mut plate = Frame::new(61, 45, ColorSpec::default());
        plate.planes.fill(100);
        let blocks = Blocks::of(&plate);
        let mut frame = plate.clone();
        for y in 20..24 {
            for x in 41..46 {
                frame.planes[y * 61 + x] = 140;
            }
        }
        let whole = Rect::of_size(61, 45);
        let found = blocks.proposals(&frame, &Gain::ONE, whole, 0);
        assert_eq!(
            found,
            [Rect {
                x: 40,
                y: 20,
                w: 8,
                h: 4
            }]
        );
        assert_eq!(blocks.proposals(&plate, &Gain::ONE, whole, 0), []);
    }
}
