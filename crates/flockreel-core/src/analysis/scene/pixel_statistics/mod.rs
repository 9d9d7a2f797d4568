//! Order statistics of each pixel over the samples: the median, the commonest value and the noise
//! (docs/explanation/algorithms.md, "Background" and "Light and noise").

pub(super) mod ranks;

use rayon::prelude::*;

use self::ranks::Wanted;
use super::background::MIN_SIGMA;
use super::occupancy::Occupancy;
use super::samples::{Samples, indices};
use crate::raster::Frame;

/// Kind of a plane: a luma value belongs to one pixel, a chroma value to four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plane {
    Luma,
    Chroma,
}

/// Kind and size of a plane.
#[derive(Clone, Copy)]
struct PlaneSize {
    plane: Plane,
    width: usize,
    n_rows: usize,
}

impl Samples {
    /// Returns the median of the samples of `group`, value by value in each plane.
    pub(super) fn median_frame(&self, group: u64) -> Frame {
        self.ranked_frame(group, None, false, |wanted, _, _| {
            wanted.fill(Wanted::median(group))
        })
    }

    /// Returns the commonest values of the samples of `group` (`ranks::narrow_to_commonest`).
    pub(super) fn commonest_frame(&self, group: u64) -> Frame {
        self.ranked_frame(group, None, true, |wanted, _, _| {
            wanted.fill(Wanted::median(group))
        })
    }

    /// Returns the commonest values over the samples of `group` in which each value is free. Where it is free
    /// in fewer than `least` samples, the value of `before` stays.
    pub(super) fn commonest_where_free(
        &self,
        group: u64,
        before: &Frame,
        occupancy: &Occupancy,
        least: u32,
    ) -> Frame {
        let mut result = self.ranked_frame(group, None, true, |wanted, plane, row| {
            for (x, wanted) in wanted.iter_mut().enumerate() {
                let free = self.free_at(plane, x, row, occupancy, group);
                let enough = free.count_ones() >= least;
                *wanted = Wanted::median(if enough { free } else { 0 });
            }
        });
        // Values without a wanted sample are 255.
        self.for_each_value(|at, plane, x, y| {
            if result.planes[at] == 255
                && self.free_at(plane, x, y, occupancy, group).count_ones() < least
            {
                result.planes[at] = before.planes[at];
            }
        });
        result
    }

    /// Returns the noise of each pixel over its free samples in `group`: one standard deviation, levels of
    /// 255, at least `MIN_SIGMA` (docs/explanation/algorithms.md, "Light and noise").
    ///
    /// Each sample is compared with its own background. The noise is 1.4826 times the median absolute
    /// deviation, with luma and chroma weighted by the conversion to RGB. Where scenery sways, the values
    /// cluster around two colors, and a median would miss one. There the 90th percentile replaces it, scaled
    /// by 0.41 as for a normal distribution.
    pub(super) fn noise(
        &self,
        group: u64,
        backgrounds: &[&Frame],
        occupancy: &Occupancy,
    ) -> Vec<f32> {
        let has_scenery = occupancy.scenery.contains(&true);
        let mut deviation =
            self.ranked_frame(group, Some(backgrounds), false, |wanted, plane, row| {
                for (x, wanted) in wanted.iter_mut().enumerate() {
                    let free = self.free_at(plane, x, row, occupancy, group);
                    *wanted = Wanted::median(free);
                    if has_scenery && free != 0 && self.is_scenery_at(plane, x, row, occupancy) {
                        wanted.rank = (free.count_ones() * 9 / 10) as u8;
                    }
                }
            });
        self.for_each_value(|at, plane, x, y| {
            let value = &mut deviation.planes[at];
            if *value == 255 && self.free_at(plane, x, y, occupancy, group) == 0 {
                *value = 0;
            }
            if has_scenery && self.is_scenery_at(plane, x, y, occupancy) {
                *value = (f32::from(*value) * 0.41).ceil() as u8;
            }
        });
        let (u, v) = deviation.chroma();
        let (width, chroma_width) = (deviation.width as usize, deviation.chroma_width() as usize);
        let mut sigma = vec![0.0; self.n_px()];
        let rows = sigma
            .par_chunks_mut(width)
            .zip(deviation.luma().par_chunks(width));
        rows.enumerate().for_each(|(y, (sigma, luma))| {
            let chroma = y / 2 * chroma_width;
            for (x, (sigma, &luma)) in sigma.iter_mut().zip(luma).enumerate() {
                let at = chroma + x / 2;
                let (y, c) = (f32::from(luma), f32::from(u[at].max(v[at])));
                *sigma = (1.4826 * (y * y * 1.36 + c * c * 4.0).sqrt()).max(MIN_SIGMA);
            }
        });
        sigma
    }

    /// Returns the samples of `all` in which a value is free. A chroma value is free where all its four
    /// pixels are.
    fn free_at(&self, plane: Plane, x: usize, y: usize, occupancy: &Occupancy, all: u64) -> u64 {
        match plane {
            Plane::Luma => occupancy.free(y * self.frames[0].width as usize + x, all),
            Plane::Chroma => self
                .pixels_of_chroma(x, y)
                .iter()
                .fold(all, |free, &px| free & occupancy.free(px, all)),
        }
    }

    /// Returns whether scenery sways at any pixel of a value.
    fn is_scenery_at(&self, plane: Plane, x: usize, y: usize, occupancy: &Occupancy) -> bool {
        match plane {
            Plane::Luma => occupancy.scenery[y * self.frames[0].width as usize + x],
            Plane::Chroma => self
                .pixels_of_chroma(x, y)
                .iter()
                .any(|&px| occupancy.scenery[px]),
        }
    }

    fn pixels_of_chroma(&self, x: usize, y: usize) -> [usize; 4] {
        let (w, h) = (
            self.frames[0].width as usize,
            self.frames[0].height as usize,
        );
        let (x0, y0) = (2 * x, 2 * y);
        let (x1, y1) = ((x0 + 1).min(w - 1), (y0 + 1).min(h - 1));
        [y0 * w + x0, y0 * w + x1, y1 * w + x0, y1 * w + x1]
    }

    /// Calls `visit` for every value of a frame with its index, plane, column and row.
    fn for_each_value(&self, mut visit: impl FnMut(usize, Plane, usize, usize)) {
        let mut at = 0;
        for size in self.planes() {
            for y in 0..size.n_rows {
                for x in 0..size.width {
                    visit(at, size.plane, x, y);
                    at += 1;
                }
            }
        }
    }

    /// Returns the planes in the order of the frame's bytes.
    fn planes(&self) -> [PlaneSize; 3] {
        let frame = &self.frames[0];
        let (w, h) = (frame.width as usize, frame.height as usize);
        let luma = PlaneSize {
            plane: Plane::Luma,
            width: w,
            n_rows: h,
        };
        let chroma = PlaneSize {
            plane: Plane::Chroma,
            width: frame.chroma_width() as usize,
            n_rows: h.div_ceil(2),
        };
        [luma, chroma, chroma]
    }

    /// Returns a frame of order statistics: each value has the wanted rank among the values of the samples of
    /// `group`. With `bases`, one frame for each sample, the absolute differences from them are ranked
    /// instead. `want` writes the wanted ranks of a row. `commonest` then narrows them by
    /// `ranks::narrow_to_commonest`.
    fn ranked_frame(
        &self,
        group: u64,
        bases: Option<&[&Frame]>,
        commonest: bool,
        want: impl Fn(&mut [Wanted], Plane, usize) + Sync,
    ) -> Frame {
        let mut result = self.frames[0].clone();
        let mut rest = result.planes.as_mut_slice();
        let mut first = 0;
        for PlaneSize {
            plane,
            width,
            n_rows,
        } in self.planes()
        {
            let (values, others) = rest.split_at_mut(width * n_rows);
            values
                .par_chunks_mut(width)
                .enumerate()
                .for_each(|(y, row)| {
                    let mut wanted = vec![Wanted::default(); width];
                    want(&mut wanted, plane, y);
                    let bytes = first + y * width..first + (y + 1) * width;
                    for wanted in &mut wanted {
                        wanted.free = packed(wanted.free, group);
                    }
                    let members = indices(group);
                    let samples: Vec<&[u8]> = members
                        .clone()
                        .map(|k| &self.frames[k].planes[bytes.clone()])
                        .collect();
                    let bases = bases.map(|bases| -> Vec<&[u8]> {
                        members.map(|k| &bases[k].planes[bytes.clone()]).collect()
                    });
                    if commonest {
                        ranks::narrow_to_commonest(&samples, &mut wanted);
                    }
                    ranks::write_ranked(&samples, bases.as_deref(), &wanted, row);
                });
            first += width * n_rows;
            rest = others;
        }
        result
    }
}

/// Returns the bits of `free` at the set bits of `group`, packed into the low bits.
fn packed(free: u64, group: u64) -> u64 {
    if free == group {
        return u64::MAX >> (64 - group.count_ones());
    }
    let bit = |(to, from): (usize, usize)| (free >> from & 1) << to;
    indices(group)
        .enumerate()
        .map(bit)
        .fold(0, |all, bit| all | bit)
}
