//! In which samples each pixel shows the scene, and in which something before it.

use super::plate::Plate;
use super::samples::Samples;
use super::survey::{GHOST_SAMPLES, Survey};
use super::sway;
use crate::raster::runs::Component;
use crate::raster::{Frame, Mask};

/// Pixels around a component that may still show some of it.
const MARGIN_PX: u32 = 3;

/// What the samples show at each pixel; bit k is sample k.
pub(super) struct Occupancy {
    /// Something stands before the scene.
    pub(super) taken: Vec<u64>,
    /// The plate shows the animal, the sample does not.
    pub(super) ghost: Vec<u64>,
    /// Something of the scene sways here.
    pub(super) scenery: Vec<bool>,
}

impl Occupancy {
    /// The large components of every sample as the animal (or what is as large), its ghost, or swaying scenery.
    pub(super) fn of(
        samples: &Samples,
        plates: &[Plate],
        plate_of: &[Option<usize>],
        survey: &Survey,
    ) -> Occupancy {
        let n_px = samples.n_px();
        let mut seen = Occupancy {
            taken: vec![0; n_px],
            ghost: vec![0; n_px],
            scenery: vec![false; n_px],
        };
        let least_area = survey.least_area_px();
        for (k, components) in survey.found.iter().enumerate() {
            let Some(plate) = plate_of[k].map(|at| &plates[at].frame) else {
                continue;
            };
            for (at, component) in components.iter().enumerate() {
                // What is left of a ghost may be small.
                let is_small = component.area < least_area && !samples.are_masked();
                if is_small && !survey.looks[k][at].is_ghost {
                    continue;
                }
                let rect = component
                    .rect
                    .inflated(MARGIN_PX, plate.width, plate.height);
                let mut mask = component.mask(rect);
                if survey.is_scenery(k, at) {
                    let around = mask.dilated_by(MARGIN_PX);
                    pixels_of(&around, plate.width).for_each(|px| seen.scenery[px] = true);
                    // An animal that rests before a plant hangs together with it.
                    mask = without_displaced(&mask, &samples.frames[k], plate);
                }
                let mask = mask.dilated_by(MARGIN_PX);
                let bits = match survey.looks[k][at].is_ghost {
                    true => &mut seen.ghost,
                    false => &mut seen.taken,
                };
                pixels_of(&mask, plate.width).for_each(|px| bits[px] |= 1 << k);
            }
        }
        seen
    }

    /// Marks the pixels of a component as taken in some samples.
    pub(super) fn take(&mut self, component: &Component, [width, height]: [u32; 2], samples: u64) {
        let mask = component.mask(component.rect.inflated(MARGIN_PX, width, height));
        let mask = mask.dilated_by(MARGIN_PX);
        pixels_of(&mask, width).for_each(|px| self.taken[px] |= samples);
    }

    /// For each square cell of the picture the samples in which something stands before any of its pixels.
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

    /// The samples of `part` in which the pixel shows the scene.
    pub(super) fn free(&self, px: usize, part: u64) -> u64 {
        let ghost = self.ghost[px] & part;
        match ghost.count_ones() as usize >= GHOST_SAMPLES {
            true => ghost & !self.taken[px],
            false => part & !self.taken[px],
        }
    }
}

/// The indices in a picture `width` pixels wide of the set pixels of a mask.
fn pixels_of(mask: &Mask, width: u32) -> impl Iterator<Item = usize> {
    let set = mask.bits.iter().enumerate().filter(|&(_, &bit)| bit == 1);
    set.map(move |(at, _)| {
        let (x, y) = (at % mask.width(), at / mask.width());
        (mask.rect.y as usize + y) * width as usize + mask.rect.x as usize + x
    })
}

/// The mask less the pixels whose color the plate shows a little to the side.
fn without_displaced(mask: &Mask, frame: &Frame, plate: &Frame) -> Mask {
    let mut rest = mask.clone();
    let pixels: Vec<usize> = pixels_of(mask, plate.width).collect();
    let set = rest.bits.iter_mut().filter(|bit| **bit == 1);
    for (bit, px) in set.zip(pixels) {
        *bit = u8::from(!sway::is_displaced(frame, plate, px));
    }
    rest.majority()
}
