//! Finds the boxes of a frame that may hold an animal, without a comparison of every pixel.
//!
//! Frame and background are summed over blocks of 4 x 4 luma and 2 x 2 chroma samples. Blocks whose sums
//! differ by more than their threshold are joined into boxes. Only these boxes are compared pixel by pixel
//! (`silhouette`). See docs/explanation/algorithms.md, "Tracking".

use rayon::prelude::*;

use crate::analysis::scene::light::Light;
use crate::geometry::Rect;
use crate::raster::runs::{self, Component};
use crate::raster::{Frame, Mask, Range};

/// Side of a block, luma pixels. Free choice; chroma blocks have half the side.
pub const SIDE: usize = 4;
/// Least mean luma difference of a block from the background, levels of 255. Free choice.
const LUMA_LEVELS: i32 = 3;
/// Least mean chroma difference of a block from the background, levels of 255. Free choice.
const CHROMA_LEVELS: i32 = 3;
/// Chroma sum of a gray block: 4 samples at level 128.
const GRAY: i32 = 4 * 128;

/// Block sums of the background (luma, U, V) and the least difference that counts, for each block.
pub struct Blocks {
    columns: usize,
    rows: usize,
    black: f32,
    sums: Vec<[i16; 3]>,
    thresholds: Vec<[i16; 3]>,
    /// Blocks with an upright edge, and with a level one: they would differ in a picture moved by one block.
    edges: [Vec<usize>; 2],
}

/// The parts of a frame that differ from the background.
#[derive(Debug, PartialEq)]
pub struct Proposals {
    /// The boxes that need a comparison pixel by pixel, by row, then by column.
    pub boxes: Vec<Rect>,
    /// Share of all blocks that differ, 0..=1.
    pub share: f64,
    /// Share of the background's edges that differ, 0..=1; 0 before `measure_noise`.
    pub edge_share: f64,
}

impl Blocks {
    /// Returns the block sums of a background image, with the least thresholds.
    pub fn new(background: &Frame) -> Blocks {
        let (columns, rows) = grid(background);
        let mut sums = vec![[0; 3]; columns * rows];
        for (row, sums) in sums.chunks_exact_mut(columns).enumerate() {
            block_row(background, row, sums);
        }
        let least = [LUMA_LEVELS * 16, CHROMA_LEVELS * 4, CHROMA_LEVELS * 4].map(|t| t as i16);
        let thresholds = vec![least; sums.len()];
        let black = if background.color.range == Range::Limited {
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
            edges: [Vec::new(), Vec::new()],
        }
    }

    /// Raises each block's thresholds to four times its noise, and finds the edges that stand out from it.
    ///
    /// The noise is 1.4826 times the median absolute deviation from the background, over the samples in which
    /// nothing covers the block. `group` selects the samples, one bit each. `taken` has one word per block:
    /// its bit k is set when something covers the block in sample k.
    pub fn measure_noise(&mut self, samples: &[Frame], group: u64, taken: &[u64]) {
        let background = self.sums.par_chunks_exact(self.columns);
        let rows = self
            .thresholds
            .par_chunks_exact_mut(self.columns)
            .zip(background)
            .zip(taken.par_chunks_exact(self.columns));
        rows.enumerate()
            .for_each(|(row, ((thresholds, background), taken))| {
                let members: Vec<usize> =
                    (0..samples.len()).filter(|k| group >> k & 1 == 1).collect();
                let sums_of = |&k: &usize| {
                    let mut sums = vec![[0; 3]; background.len()];
                    block_row(&samples[k], row, &mut sums);
                    sums
                };
                let sums: Vec<Vec<[i16; 3]>> = members.iter().map(sums_of).collect();
                let mut gaps = Vec::with_capacity(members.len());
                for (column, (threshold, base)) in thresholds.iter_mut().zip(background).enumerate()
                {
                    for plane in 0..3 {
                        let free = members.iter().zip(&sums);
                        let free = free.filter(|(k, _)| taken[column] >> **k & 1 == 0);
                        let gap = |sums: &Vec<[i16; 3]>| (sums[column][plane] - base[plane]).abs();
                        gaps.clear();
                        gaps.extend(free.map(|(_, sums)| gap(sums)));
                        if gaps.is_empty() {
                            continue;
                        }
                        let middle = gaps.len() / 2;
                        let median = f32::from(*gaps.select_nth_unstable(middle).1);
                        let noise = (4.0 * 1.4826 * median).min(8000.0) as i16;
                        threshold[plane] = threshold[plane].max(noise);
                    }
                }
            });
        let (columns, last_row) = (self.columns, self.sums.len() - self.columns);
        self.edges = [
            self.edges(1, |at| (at + 1) % columns > 0),
            self.edges(columns, |at| at < last_row),
        ];
    }

    /// Returns the parts of a frame that need a comparison pixel by pixel.
    ///
    /// The boxes surround connected differing blocks, widened by `margin_px`. Overlapping boxes are merged.
    pub fn proposals(&self, frame: &Frame, light: &Light, margin_px: u32) -> Proposals {
        let [width, height] = [frame.width, frame.height];
        let mask = self.differing(frame, light);
        let widened = |c: &Component| box_in_pixels(c.rect).inflated(margin_px, width, height);
        Proposals {
            boxes: merge_overlapping(runs::components(&mask).iter().map(widened).collect()),
            share: mask.area() as f64 / self.sums.len() as f64,
            edge_share: self.edge_share(&mask),
        }
    }

    /// Returns the share of the background's edges that differ, 0..=1: the larger one of upright and level edges.
    /// Edges that together are shorter than the picture do not count, because the animal alone could cover them.
    fn edge_share(&self, differing: &Mask) -> f64 {
        let share = |edges: &[usize], least: usize| {
            let n_differing = edges.iter().filter(|&&at| differing.bits[at] > 0).count();
            n_differing as f64 / edges.len().max(least) as f64
        };
        let [upright, level] = &self.edges;
        share(upright, self.rows).max(share(level, self.columns))
    }

    /// Returns the blocks whose luma differs from that of the block `step` blocks further, as far as `has_next` says
    /// that there is one.
    fn edges(&self, step: usize, has_next: impl Fn(usize) -> bool) -> Vec<usize> {
        let gap = |at: usize| (self.sums[at + step][0] - self.sums[at][0]).abs();
        let all = (0..self.sums.len()).filter(|&at| has_next(at));
        all.filter(|&at| gap(at) > self.thresholds[at][0]).collect()
    }

    /// Returns the mask of the differing blocks, in units of blocks.
    fn differing(&self, frame: &Frame, light: &Light) -> Mask {
        let mut mask = Mask::new(Rect::of_size(self.columns as u32, self.rows as u32));
        let mut sums = vec![[0; 3]; self.columns];
        let inverse_gain = 1024.0 / light.luma();
        let even = inverse_gain.round() as i32;
        let black = self.black as i32;
        let middle = |at: usize| at * SIDE + SIDE / 2;
        let (last_x, last_y) = (frame.width as usize - 1, frame.height as usize - 1);
        for (row, bits) in mask.bits.chunks_exact_mut(self.columns).enumerate() {
            block_row(frame, row, &mut sums);
            let first = row * self.columns;
            for (column, (bit, sum)) in bits.iter_mut().zip(&sums).enumerate() {
                let (base, threshold) =
                    (&self.sums[first + column], &self.thresholds[first + column]);
                let factor = if light.is_uneven() {
                    let (x, y) = (middle(column).min(last_x), middle(row).min(last_y));
                    (inverse_gain / light.factor(x, y)).round() as i32
                } else {
                    even
                };
                let luma = (((i32::from(sum[0]) - black) * factor) >> 10) + black;
                let luma_gap = (luma - i32::from(base[0])).abs();
                let gap = |plane: usize| {
                    let chroma = (((i32::from(sum[plane]) - GRAY) * even) >> 10) + GRAY;
                    (chroma - i32::from(base[plane])).abs()
                };
                let differs = luma_gap > i32::from(threshold[0])
                    || gap(1) > i32::from(threshold[1])
                    || gap(2) > i32::from(threshold[2]);
                *bit = u8::from(differs);
            }
        }
        mask
    }
}

/// Merges overlapping boxes until none overlap; returns them by row, then by column.
fn merge_overlapping(mut boxes: Vec<Rect>) -> Vec<Rect> {
    let mut merged: Vec<Rect> = Vec::new();
    while let Some(mut rect) = boxes.pop() {
        while let Some(at) = merged
            .iter()
            .position(|other| !other.intersection(&rect).is_empty())
        {
            rect = rect.union(&merged.swap_remove(at));
        }
        merged.push(rect);
    }
    merged.sort_by_key(|found| (found.y, found.x));
    merged
}

/// Returns the pixel box of a box of blocks; it may reach beyond the right and bottom edge of the frame.
fn box_in_pixels(blocks: Rect) -> Rect {
    let side = SIDE as u32;
    Rect {
        x: blocks.x * side,
        y: blocks.y * side,
        w: blocks.w * side,
        h: blocks.h * side,
    }
}

/// Returns the number of block columns and rows; the last ones may reach beyond the edge of the frame.
fn grid(frame: &Frame) -> (usize, usize) {
    (
        (frame.width as usize).div_ceil(SIDE),
        (frame.height as usize).div_ceil(SIDE),
    )
}

/// Writes the luma, U and V sums of one row of blocks. Beyond the edges the last pixel repeats.
fn block_row(frame: &Frame, row: usize, sums: &mut [[i16; 3]]) {
    let (w, h) = (frame.width as usize, frame.height as usize);
    sums.fill([0; 3]);
    for dy in 0..SIDE {
        let y = (row * SIDE + dy).min(h - 1);
        add_row::<SIDE>(sums, 0, &frame.luma()[y * w..][..w]);
    }
    let (u, v) = frame.chroma();
    let (cw, ch) = (frame.chroma_width() as usize, h.div_ceil(2));
    for dy in 0..SIDE / 2 {
        let y = (row * SIDE / 2 + dy).min(ch - 1);
        for (plane, values) in [(1, u), (2, v)] {
            add_row::<{ SIDE / 2 }>(sums, plane, &values[y * cw..][..cw]);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::ColorSpec;

    #[test]
    fn only_a_bright_spot_is_proposed() {
        let mut background = Frame::new(61, 45, ColorSpec::default());
        background.planes.fill(100);
        let blocks = Blocks::new(&background);
        let mut frame = background.clone();
        for y in 20..24 {
            for x in 41..46 {
                frame.planes[y * 61 + x] = 140;
            }
        }
        let found = blocks.proposals(&frame, &Light::NEUTRAL, 0);
        assert_eq!(
            found.boxes,
            [Rect {
                x: 40,
                y: 20,
                w: 8,
                h: 4
            }]
        );
        assert!((found.share - 2.0 / (16.0 * 12.0)).abs() < 1e-9);
        let nothing = blocks.proposals(&background, &Light::NEUTRAL, 0);
        assert_eq!((nothing.boxes, nothing.share), (vec![], 0.0));
    }

    #[test]
    fn edges_of_a_moved_picture_differ() {
        let [mut background, mut moved] = [0, 1].map(|_| Frame::new(64, 48, ColorSpec::default()));
        let tile = |x: usize, y: usize| {
            if (x / 16 + y / 12).is_multiple_of(2) {
                60
            } else {
                180
            }
        };
        for (at, (still, moved)) in background.planes[..64 * 48]
            .iter_mut()
            .zip(&mut moved.planes[..64 * 48])
            .enumerate()
        {
            (*still, *moved) = (tile(at % 64, at / 64), tile(at % 64 + 4, at / 64));
        }
        let mut blocks = Blocks::new(&background);
        blocks.measure_noise(&[background.clone()], 1, &[0; 16 * 12]);
        let share_of = |frame: &Frame| blocks.proposals(frame, &Light::NEUTRAL, 0).edge_share;
        assert_eq!(share_of(&moved), 1.0);
        let mut covered = background.clone();
        covered.planes[..64 * 12].fill(120); // a quarter of the picture, with a quarter of its edges
        assert!(
            (0.2..0.4).contains(&share_of(&covered)),
            "{}",
            share_of(&covered)
        );
    }

    #[test]
    fn overlapping_boxes_are_merged() {
        let rect = |x, w| Rect { x, y: 0, w, h: 4 };
        let found = merge_overlapping(vec![rect(0, 4), rect(10, 4), rect(3, 8), rect(20, 2)]);
        assert_eq!(found, [rect(0, 14), rect(20, 2)]);
    }
}
