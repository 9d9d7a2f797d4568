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
        let mut sums = vec![[0; 3]; columns * rows];
        for (row, sums) in sums.chunks_exact_mut(columns).enumerate() {
            block_row(plate, row, 0, sums);
        }
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
            let of = |sample: &Frame| {
                let mut sums = vec![[0; 3]; plate.len()];
                block_row(sample, row, 0, &mut sums);
                sums
            };
            let sums: Vec<Vec<[i16; 3]>> = samples.iter().map(of).collect();
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

    /// The boxes worth a closer look that meet `region`: around connected blocks that differ, each widened
    /// by `margin_px`, joined until no two of them meet.
    ///
    /// `seen` is where to look first. It grows until every box in it is whole and nothing beyond can
    /// join one, so that the boxes do not depend on it: a small window says the same as the whole frame.
    pub fn proposals(
        &self,
        frame: &Frame,
        gain: &Gain,
        [region, seen]: [Rect; 2],
        margin_px: u32,
    ) -> Vec<Rect> {
        let mut seen = seen.union(&region);
        loop {
            let boxes = disjoint(self.differing(frame, gain, seen, margin_px));
            let reach = margin_px + SIDE as u32;
            let needed = boxes.iter().fold(seen, |needed, found| {
                needed.union(&found.inflated(reach, frame.width, frame.height))
            });
            if needed == seen {
                let meets = |found: &Rect| !found.intersection(&region).is_empty();
                return boxes.into_iter().filter(meets).collect();
            }
            seen = needed;
        }
    }

    /// Boxes around connected blocks of `region` that differ, each widened by `margin_px`.
    fn differing(&self, frame: &Frame, gain: &Gain, region: Rect, margin_px: u32) -> Vec<Rect> {
        let side = SIDE as u32;
        let blocks = Rect {
            x: region.x / side,
            y: region.y / side,
            w: (region.right().div_ceil(side)).min(self.columns as u32) - region.x / side,
            h: (region.bottom().div_ceil(side)).min(self.rows as u32) - region.y / side,
        };
        let mut mask = Mask::new(blocks);
        let mut sums = vec![[0; 3]; blocks.w as usize];
        let to_plate = (1024.0 / gain.luma()).round() as i32;
        let black = self.black as i32;
        for (bits, row) in mask
            .bits
            .chunks_exact_mut(blocks.w.max(1) as usize)
            .zip(blocks.y as usize..)
        {
            let from = blocks.x as usize;
            block_row(frame, row, from, &mut sums);
            let plate = &self.sums[row * self.columns + from..];
            let thresholds = &self.thresholds[row * self.columns + from..];
            for (((bit, sum), base), threshold) in
                bits.iter_mut().zip(&sums).zip(plate).zip(thresholds)
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

/// Sums of luma, U and V of blocks of one row, from column `from` on, as many as `sums` holds. At the
/// edges the last pixels are repeated.
fn block_row(frame: &Frame, row: usize, from: usize, sums: &mut [[i16; 3]]) {
    let (w, h) = (frame.width as usize, frame.height as usize);
    sums.fill([0; 3]);
    for dy in 0..SIDE {
        let y = (row * SIDE + dy).min(h - 1);
        add_row::<SIDE>(sums, 0, &frame.luma()[y * w..][from * SIDE..w]);
    }
    let (u, v) = frame.chroma();
    let (cw, ch) = (frame.chroma_width() as usize, h.div_ceil(2));
    for dy in 0..SIDE / 2 {
        let y = (row * SIDE / 2 + dy).min(ch - 1);
        for (plane, values) in [(1, u), (2, v)] {
            add_row::<{ SIDE / 2 }>(sums, plane, &values[y * cw..][from * SIDE / 2..cw]);
        }
    }
}

fn add_row<const N: usize>(sums: &mut [[i16; 3]], plane: usize, values: &[u8]) {
    let (whole, rest) = values.as_chunks::<N>();
    for (sum, block) in sums.iter_mut().zip(whole) {
        sum[plane] += block.iter().map(|&v| i16::from(v)).sum::<i16>();
    }
    if let (Some(sum), Some(&last)) = (sums.get_mut(whole.len()), values.last()) {
        let missing = (N - rest.len()) as i16 * i16::from(last);
        sum[plane] += rest.iter().map(|&v| i16::from(v)).sum::<i16>() + missing;
    }
}

/// Boxes joined until no two of them meet.
fn disjoint(mut boxes: Vec<Rect>) -> Vec<Rect> {
    let mut idx = 0;
    while idx < boxes.len() {
        let meets = |other: &Rect| !boxes[idx].intersection(other).is_empty();
        match (idx + 1..boxes.len()).find(|&other| meets(&boxes[other])) {
            Some(other) => {
                boxes[idx] = boxes[idx].union(&boxes[other]);
                boxes.remove(other);
                idx = 0;
            }
            None => idx += 1,
        }
    }
    boxes
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
        let found = blocks.proposals(&frame, &Gain::ONE, [whole; 2], 0);
        assert_eq!(
            found,
            [Rect {
                x: 40,
                y: 20,
                w: 8,
                h: 4
            }]
        );
        assert_eq!(blocks.proposals(&plate, &Gain::ONE, [whole; 2], 0), []);
    }
}
