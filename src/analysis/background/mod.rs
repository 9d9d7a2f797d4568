//! The plate: what the scene looks like without the animal, and how much each pixel of it wavers
//! (ALGORITHMS.md 2.1, 2.2, 2.4).
//!
//! Median over frames spread through the footage, then again over those samples in which the
//! silhouettes found by the first plate leave a pixel free. An animal that slept in the first median
//! is seen as a ghost wherever it is gone, and its pixels are taken from just those frames.

use super::silhouette::{Blocks, shadow};
use super::{Error, Params, light, silhouette};
use crate::footage::FrameSource;
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::runs::Component;
use crate::raster::{Frame, Mask, RgbImage};

mod fill;
mod ranks;
mod refusal;
mod samples;
mod scenery;
mod shift;
mod sway;

use samples::Samples;

/// Least noise of a pixel, levels of 255: a lossy codec's plate looks steadier than it is.
const SIGMA_FLOOR: f32 = 1.5;
/// A pixel is known when it is free in at least this many samples.
const FREE_LEAST: u32 = 5;
/// Decides which of several like places a never-seen pixel is copied from.
const FILL_SEED: u64 = 1;

/// The scene without the animal.
pub struct Plate {
    /// The picture, as the decoder would give it.
    pub frame: Frame,
    /// The same in RGB.
    pub rgb: RgbImage,
    /// The other color of pixels that something sways across, the plate's color everywhere else; what
    /// lies between the two is no difference. `None` where nothing sways.
    pub other: Option<RgbImage>,
    /// Noise of each pixel (the largest over R, G, B), one standard deviation, levels of 255.
    pub sigma: Vec<f32>,
    /// Least difference that counts as the animal for certain: max(threshold, 4 sigma).
    pub core_threshold: Vec<u8>,
    /// The pixels whose light is compared.
    pub probes: Vec<light::Probe>,
    /// Means and noise of 4 x 4 blocks, to find places worth looking at.
    pub blocks: Blocks,
    /// Pixels that the animal never left free: continued from the texture around them, nearest the rim
    /// first; past 16384 of them the rest is filled smoothly.
    pub never_seen_px: u64,
    /// Several animals move, and the largest is to be followed.
    pub several_animals: bool,
}

impl Plate {
    /// Least difference of a pixel that counts as the animal beside one that does for certain.
    pub fn weak_threshold(&self, px: usize) -> u8 {
        self.core_threshold[px] / 2
    }
}

/// Estimates the plate, or takes the picture given and estimates its noise alone.
///
/// Fails when the given picture has another size than the footage, or when the footage is too
/// short to tell the animal from the scene.
pub fn estimate(
    source: &dyn FrameSource,
    given: Option<&RgbImage>,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Plate, Error> {
    let mut samples = Samples::spread(source, progress)?;
    let mut plate = match given {
        Some(image) => given_plate(image, &samples, params)?,
        None => plate_of(
            samples.median_frame(),
            vec![SIGMA_FLOOR; samples.n_px()],
            params,
        ),
    };
    samples.even_out_light(&plate);
    if shift::camera_moves(&samples.frames, &plate.frame, refusal::OFTEN) {
        return Err(Error::BackgroundNotStatic);
    }
    let mut unknown = Vec::new();
    let mut seen = occupancy(&samples, &plate);
    // Two rounds: what the first plate took for the animal may have been its ghost.
    for round in 0..2 {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if round > 0 {
            seen = occupancy(&samples, &plate);
        }
        let frame = match given {
            Some(_) => plate.frame.clone(),
            None => samples.median_where_free(&plate.frame, &seen),
        };
        let sigma = samples.noise(&frame, &seen);
        plate = plate_of(frame, sigma, params);
        if given.is_none() {
            unknown = never_seen(&samples, &seen);
            fill_with(&mut plate, &unknown, params, fill::smooth);
        }
    }
    let all = samples.all_bits();
    plate.other = sway::other_color(&samples.frames, &plate.frame, |px| seen.free(px, all));
    plate.blocks.measure_noise(&samples.frames);
    plate.several_animals = refuse(&samples, &plate, params)?;
    plate.never_seen_px = unknown.iter().filter(|&&u| u).count() as u64;
    if plate.never_seen_px > 0 {
        fill_with(&mut plate, &unknown, params, |image, unknown| {
            fill::sample_texture(image, unknown, FILL_SEED)
        });
        plate.blocks.measure_noise(&samples.frames);
    }
    raise_thresholds(&mut plate, &samples);
    Ok(plate)
}

/// Raises the core threshold of an animal that stands out starkly to a share of its contrast: what
/// differs by less than that beside a black mouse on white paper is its shadow and its reflection.
fn raise_thresholds(plate: &mut Plate, samples: &Samples) {
    const SHARE: f64 = 0.25;
    let largest = |found: Vec<Component>| found.into_iter().max_by_key(|c| c.area);
    let mut contrasts: Vec<u8> = samples
        .components(plate)
        .into_iter()
        .zip(&samples.frames)
        .filter_map(|(found, frame)| {
            let component = largest(found)?;
            let difference =
                silhouette::difference(frame, plate, &light::Gain::ONE, component.rect);
            let mask = component.mask(component.rect);
            let levels = difference.levels.iter().zip(&mask.bits);
            let mut levels: Vec<u8> = levels
                .filter(|(_, bit)| **bit == 1)
                .map(|(l, _)| *l)
                .collect();
            let middle = levels.len() / 2;
            Some(*levels.select_nth_unstable(middle).1)
        })
        .collect();
    if contrasts.is_empty() {
        return;
    }
    let middle = contrasts.len() / 2;
    let least = (SHARE * f64::from(*contrasts.select_nth_unstable(middle).1)) as u8;
    for threshold in &mut plate.core_threshold {
        *threshold = (*threshold).max(least);
    }
}

/// Refuses a footage that shows nothing, too much, or more than one animal; returns whether it shows
/// several of which the largest is to be followed.
fn refuse(samples: &Samples, plate: &Plate, params: &Params) -> Result<bool, Error> {
    let found: Vec<Vec<Component>> = samples.components(plate);
    refusal::judge(&found, samples.n_px(), params, |k, component| {
        shadow::is_shadow_alone(&samples.frames[k], plate, component)
    })
}

/// Which samples show the animal, and which its ghost, at each pixel: bit k for sample k.
pub(super) struct Occupancy {
    /// The animal (or anything as large) stands before the plate.
    pub(super) taken: Vec<u64>,
    /// The plate shows the animal, the sample does not.
    pub(super) ghost: Vec<u64>,
    /// Something of the scene sways here.
    pub(super) scenery: Vec<bool>,
}

impl Occupancy {
    /// The samples, as bits, in which the pixel shows the scene.
    pub(super) fn free(&self, px: usize, all: u64) -> u64 {
        if self.ghost[px] != 0 {
            self.ghost[px]
        } else {
            all & !self.taken[px]
        }
    }
}

fn given_plate(image: &RgbImage, samples: &Samples, params: &Params) -> Result<Plate, Error> {
    let first = &samples.frames[0];
    if (image.width, image.height) != (first.width, first.height) {
        return Err(Error::BackgroundSizeDiffers {
            found: [image.width, image.height],
            wanted: [first.width, first.height],
        });
    }
    let mut frame = Frame::new(first.width, first.height, first.color);
    frame.draw_rgb(image, Rect::of_size(first.width, first.height));
    Ok(plate_of(frame, vec![SIGMA_FLOOR; samples.n_px()], params))
}

/// A plate of a picture and the noise of its pixels.
pub(super) fn plate_of(frame: Frame, sigma: Vec<f32>, params: &Params) -> Plate {
    let threshold = f32::from(params.threshold);
    let rgb = frame.to_rgb();
    Plate {
        probes: light::probes(&rgb),
        rgb,
        core_threshold: sigma
            .iter()
            .map(|s| (4.0 * s).max(threshold).min(255.0) as u8)
            .collect(),
        blocks: Blocks::of(&frame),
        frame,
        other: None,
        sigma,
        never_seen_px: 0,
        several_animals: false,
    }
}

/// Marks the large components of every sample as the animal, its ghost, or swaying scenery.
fn occupancy(samples: &Samples, plate: &Plate) -> Occupancy {
    let found: Vec<Vec<Component>> = samples
        .components(plate)
        .into_iter()
        .map(|components| {
            let largest = components.iter().map(|c| c.area).max().unwrap_or(0);
            let large = |c: &Component| c.area >= 12 && 10 * c.area >= 3 * largest;
            components.into_iter().filter(large).collect()
        })
        .collect();
    let n_px = samples.n_px();
    let mut seen = Occupancy {
        taken: vec![0; n_px],
        ghost: vec![0; n_px],
        scenery: vec![false; n_px],
    };
    for (k, components) in found.iter().enumerate() {
        for component in components {
            let rect = component
                .rect
                .inflated(3, plate.frame.width, plate.frame.height);
            let mut mask = component.mask(rect);
            if scenery::is_scenery(&found, k, component) {
                let around = mask.dilated_by(3);
                pixels_of(&around, plate.frame.width).for_each(|px| seen.scenery[px] = true);
                // An animal that rests before a plant hangs together with it.
                mask = without_displaced(&mask, &samples.frames[k], &plate.frame);
            }
            let mask = mask.dilated_by(3);
            let set = pixels_of(&mask, plate.frame.width);
            if is_ghost(&samples.frames[k], plate, component) {
                set.for_each(|px| seen.ghost[px] |= 1 << k);
            } else {
                set.for_each(|px| seen.taken[px] |= 1 << k);
            }
        }
    }
    seen
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

/// Whether a component's outline lives in the plate rather than in the frame: the sum over the
/// outline of |grad I| - |grad B| is negative (ALGORITHMS.md 2.2).
fn is_ghost(frame: &Frame, plate: &Plate, component: &Component) -> bool {
    let (w, h) = (frame.width as usize, frame.height as usize);
    let rect = component.rect.inflated(1, frame.width, frame.height);
    let mask = component.mask(rect);
    let inner = mask.eroded();
    let gradient = |luma: &[u8], x: usize, y: usize| {
        let at = |x: usize, y: usize| i32::from(luma[y * w + x]);
        let dx = at((x + 1).min(w - 1), y) - at(x.saturating_sub(1), y);
        let dy = at(x, (y + 1).min(h - 1)) - at(x, y.saturating_sub(1));
        (dx.abs() + dy.abs()) as f32
    };
    let mut sum = 0.0;
    for (k, (&set, &inside)) in mask.bits.iter().zip(&inner.bits).enumerate() {
        if set == 1 && inside == 0 {
            let (x, y) = (
                rect.x as usize + k % mask.width(),
                rect.y as usize + k / mask.width(),
            );
            sum += gradient(frame.luma(), x, y) - gradient(plate.frame.luma(), x, y);
        }
    }
    sum < 0.0
}

/// The pixels that are free in too few samples.
fn never_seen(samples: &Samples, seen: &Occupancy) -> Vec<bool> {
    let all = samples.all_bits();
    let least = FREE_LEAST.min(samples.frames.len() as u32 / 3);
    (0..samples.n_px())
        .map(|px| seen.free(px, all).count_ones() < least)
        .collect()
}

/// Replaces the plate's unknown pixels as `fill` says, and nothing else.
fn fill_with(
    plate: &mut Plate,
    unknown: &[bool],
    params: &Params,
    fill: impl Fn(&mut RgbImage, &[bool]),
) {
    let width = plate.frame.width;
    let pixel = |px: usize| Rect {
        x: px as u32 % width,
        y: px as u32 / width,
        w: 1,
        h: 1,
    };
    let unknown_px = (0..unknown.len()).filter(|&px| unknown[px]);
    let Some(hole) = unknown_px.map(pixel).reduce(|a, b| a.union(&b)) else {
        return;
    };
    fill(&mut plate.rgb, unknown);
    let mut frame = plate.frame.clone();
    frame.draw_rgb(&plate.rgb, hole);
    *plate = Plate {
        never_seen_px: plate.never_seen_px,
        several_animals: plate.several_animals,
        other: plate.other.take(),
        ..plate_of(frame, std::mem::take(&mut plate.sigma), params)
    };
}

#[cfg(test)]
mod tests;
