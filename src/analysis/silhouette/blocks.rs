//! Means of 4 x 4 blocks of luma (2 x 2 of chroma), compared with the plate's: a cheap look at the
//! whole frame that says where a closer one is worth it (ALGORITHMS.md 3).

use rayon::prelude::*;

use crate::analysis::light::Gain;
use crate::geometry::Rect;
use crate::raster::runs::{self, Component, Run};
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

    /// The boxes worth a closer look: around connected blocks that differ and lie in `region`, widened by
    /// `margin_px`, joined with what differs inside or as near to them again.
    ///
    /// `seen` is where to look first. It grows until nothing beyond it could belong to a box, so that the
    /// boxes do not depend on it: a small window says the same as the whole frame.
    pub fn proposals(
        &self,
        frame: &Frame,
        gain: &Gain,
        [region, seen]: [Rect; 2],
        margin_px: u32,
    ) -> Vec<Rect> {
        let [width, height] = [frame.width, frame.height];
        let mut seen = seen.union(&region);
        loop {
            let differing = self.differing(frame, gain, seen);
            let near = |rect: &Rect| rect.inflated(margin_px, width, height);
            let boxes = gathered(&differing, region, near);
            let needed = boxes.iter().fold(seen, |needed, found| {
                needed.union(&found.inflated(margin_px + SIDE as u32, width, height))
            });
            if needed == seen {
                return boxes;
            }
            seen = needed;
        }
    }

    /// The connected blocks that differ, of those that `region` touches.
    fn differing(&self, frame: &Frame, gain: &Gain, region: Rect) -> Vec<Component> {
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
        runs::components(&mask)
    }
}

/// Boxes of pixels around the components that have a block in `region`, as wide as `near` makes them, and
/// around those that have a block near such a box, and so on.
fn gathered(components: &[Component], region: Rect, near: impl Fn(&Rect) -> Rect) -> Vec<Rect> {
    let mut boxes: Vec<Rect> = Vec::new();
    let mut box_of: Vec<Option<usize>> = vec![None; components.len()];
    for (idx, component) in components.iter().enumerate() {
        if has_block_in(component, &region) {
            box_of[idx] = Some(boxes.len());
            boxes.push(near(&pixels_of(component.rect)));
        }
    }
    loop {
        let mut live = (0..boxes.len()).filter(|&slot| !boxes[slot].is_empty());
        let reached = live.find_map(|slot| {
            let reach = near(&boxes[slot]);
            let other =
                |idx: &usize| box_of[*idx] != Some(slot) && has_block_in(&components[*idx], &reach);
            let idx = (0..components.len()).find(other)?;
            Some((slot, idx))
        });
        let Some((slot, idx)) = reached else {
            break;
        };
        match box_of[idx] {
            None => boxes[slot] = boxes[slot].union(&near(&pixels_of(components[idx].rect))),
            Some(other) => {
                let taken = std::mem::take(&mut boxes[other]);
                boxes[slot] = boxes[slot].union(&taken);
            }
        }
        let joined = box_of[idx];
        box_of[idx] = Some(slot);
        if joined.is_some() {
            for of in box_of.iter_mut().filter(|of| **of == joined) {
                *of = Some(slot);
            }
        }
    }
    boxes.retain(|found| !found.is_empty());
    boxes.sort_by_key(|found| (found.y, found.x));
    boxes
}

/// Whether any of the component's blocks touches a box of pixels.
fn has_block_in(component: &Component, rect: &Rect) -> bool {
    let touches = |run: &Run| {
        let block = Rect {
            x: run.x0,
            y: run.y,
            w: run.x1 - run.x0,
            h: 1,
        };
        !pixels_of(block).intersection(rect).is_empty()
    };
    !pixels_of(component.rect).intersection(rect).is_empty() && component.runs.iter().any(touches)
}

/// The pixels of a box of blocks; those of the last ones may hang over the edge.
fn pixels_of(blocks: Rect) -> Rect {
    let side = SIDE as u32;
    Rect {
        x: blocks.x * side,
        y: blocks.y * side,
        w: blocks.w * side,
        h: blocks.h * side,
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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

    proptest! {
        #[test]
        fn the_boxes_do_not_depend_on_where_one_looks_first(
            spots in prop::collection::vec((0u32..150, 0u32..100, 1u32..30, 1u32..30), 1..14),
            (x, y, w, h) in (0u32..140, 0u32..90, 4u32..40, 4u32..40),
            margin_px in 0u32..9,
        ) {
            let (width, height) = (161, 117);
            let mut plate = Frame::new(width, height, ColorSpec::default());
            plate.planes.fill(100);
            let blocks = Blocks::of(&plate);
            let mut frame = plate.clone();
            for (x, y, w, h) in spots {
                let spot = Rect { x, y, w, h }.intersection(&Rect::of_size(width, height));
                for y in spot.y..spot.bottom() {
                    frame.planes[(y * width + spot.x) as usize..][..spot.w as usize].fill(140);
                }
            }
            let region = Rect { x, y, w, h }.intersection(&Rect::of_size(width, height));
            let from = |seen| blocks.proposals(&frame, &Gain::ONE, [region, seen], margin_px);
            prop_assert_eq!(from(region), from(Rect::of_size(width, height)));
        }
    }
}
