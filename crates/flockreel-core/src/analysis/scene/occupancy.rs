//! Records for each pixel the samples that show the scene, and those in which something covers it.
//!
//! The foreground components of the survey mark their pixels as taken, as a ghost or as swaying scenery. A
//! ghost is a place at which the background shows the resting animal and the sample does not.

use super::background::Background;
use super::samples::{MIN_AGREEING, Samples};
use super::still_part::StillPart;
use super::survey::Survey;
use super::sway;
use crate::raster::runs::Component;
use crate::raster::{Frame, Mask};

/// Width of the margin around a component that may still show some of it, pixels. Free choice.
const MARGIN_PX: u32 = 3;

/// Content of every pixel over the samples; in each word, bit k is sample k.
pub(super) struct Occupancy {
    /// Samples in which something covers the scene.
    pub(super) taken: Vec<u64>,
    /// Samples that show the scene where the background shows the animal.
    pub(super) ghost: Vec<u64>,
    /// Whether scenery sways at the pixel.
    pub(super) scenery: Vec<bool>,
}

impl Occupancy {
    /// Marks the pixels of all large components, and of ghosts of any size. With masks, components of any
    /// size count.
    pub(super) fn new(
        samples: &Samples,
        backgrounds: &[Option<&Background>],
        survey: &Survey,
    ) -> Occupancy {
        let n_px = samples.n_px();
        let mut occupancy = Occupancy {
            taken: vec![0; n_px],
            ghost: vec![0; n_px],
            scenery: vec![false; n_px],
        };
        let least_area = survey.least_area_px();
        for (k, components) in survey.components.iter().enumerate() {
            let Some(background) = backgrounds[k].map(|background| &background.frame) else {
                continue;
            };
            for (at, component) in components.iter().enumerate() {
                // The remainder of a ghost may be small.
                let is_small = component.area < least_area && !samples.are_masked();
                if is_small && !survey.looks[k][at].is_ghost {
                    continue;
                }
                let rect = component
                    .rect
                    .inflated(MARGIN_PX, background.width, background.height);
                let mut mask = component.mask(rect);
                if survey.is_scenery(k, at) {
                    let around = mask.dilated_by(MARGIN_PX);
                    pixels_of(&around, background.width)
                        .for_each(|px| occupancy.scenery[px] = true);
                    // An animal that rests in front of a plant forms one component with it.
                    mask = without_scenery(&mask, &samples.frames[k], background);
                }
                let mask = mask.dilated_by(MARGIN_PX);
                let bits = if survey.looks[k][at].is_ghost {
                    &mut occupancy.ghost
                } else {
                    &mut occupancy.taken
                };
                pixels_of(&mask, background.width).for_each(|px| bits[px] |= 1 << k);
            }
        }
        occupancy
    }

    /// Marks the pixels of a component and its margin as taken in `samples`.
    pub(super) fn mark_taken(
        &mut self,
        component: &Component,
        [width, height]: [u32; 2],
        samples: u64,
    ) {
        let mask = component.mask(component.rect.inflated(MARGIN_PX, width, height));
        let mask = mask.dilated_by(MARGIN_PX);
        pixels_of(&mask, width).for_each(|px| self.taken[px] |= samples);
    }

    /// Marks the pixels of a still part of the animal as taken in the samples that show it, and only in these.
    pub(super) fn mark_hidden(&mut self, part: &StillPart) {
        let pixels = self.taken.iter_mut().zip(&mut self.ghost);
        for ((taken, ghost), bit) in pixels.zip(&part.pixels.bits) {
            if *bit == 1 {
                *taken = part.samples;
                *ghost = 0;
            }
        }
    }

    /// Returns for each square cell of the picture the samples in which something covers any of its pixels.
    /// Cells have `side` pixels along each side and come row by row.
    pub(super) fn taken_in_cells(&self, side: usize, [width, height]: [u32; 2]) -> Vec<u64> {
        let (width, height) = (width as usize, height as usize);
        let columns = width.div_ceil(side);
        let mut cells = vec![0; columns * height.div_ceil(side)];
        for (y, row) in self.taken.chunks_exact(width).enumerate() {
            let cells = &mut cells[y / side * columns..][..columns];
            for (cell, values) in cells.iter_mut().zip(row.chunks(side)) {
                *cell |= values.iter().fold(0, |all, bits| all | bits);
            }
        }
        cells
    }

    /// Returns the samples of `group` in which a pixel shows the scene. If enough samples show a ghost there,
    /// only those count, because in the others the animal covers the pixel.
    pub(super) fn free(&self, px: usize, group: u64) -> u64 {
        let ghost = self.ghost[px] & group;
        if ghost.count_ones() as usize >= MIN_AGREEING {
            ghost & !self.taken[px]
        } else {
            group & !self.taken[px]
        }
    }
}

/// Returns the indices of the set pixels of a mask in a picture `width` pixels wide.
fn pixels_of(mask: &Mask, width: u32) -> impl Iterator<Item = usize> {
    let set = mask.bits.iter().enumerate().filter(|&(_, &bit)| bit == 1);
    set.map(move |(at, _)| {
        let (x, y) = (at % mask.width(), at / mask.width());
        (mask.rect.y as usize + y) * width as usize + mask.rect.x as usize + x
    })
}

/// Returns the mask without the pixels whose color the background shows nearby, smoothed by a 3 x 3 majority.
fn without_scenery(mask: &Mask, frame: &Frame, background: &Frame) -> Mask {
    let mut rest = mask.clone();
    let pixels: Vec<usize> = pixels_of(mask, background.width).collect();
    let set = rest.bits.iter_mut().filter(|bit| **bit == 1);
    for (bit, px) in set.zip(pixels) {
        *bit = u8::from(!sway::occurs_nearby(frame, background, px));
    }
    rest.majority()
}
