//! The plates of a scene while they are estimated, from its samples.

use super::fill;
use super::light;
use super::occupancy::Occupancy;
use super::plate::{Plate, Threshold};
use super::resting;
use super::samples::Samples;
use super::states::{self, Part};
use super::survey::Survey;
use super::sway;
use super::thumbnail::Thumbnail;
use super::windows;
use crate::analysis::silhouette::blocks;
use crate::analysis::{Error, Params};
use crate::geometry::Rect;
use crate::raster::{Frame, RgbImage};

/// A pixel is known when it is free in at least this many samples of a plate; the median of three ignores one.
const FREE_LEAST: u32 = 3;
/// Decides from which of several like places a never-seen pixel is copied.
const FILL_SEED: u64 = 1;
/// Frames examined for uneven light.
const N_LIGHT: usize = 16;
/// Where more than this share of the picture differs in most samples, higher thresholds are tried ...
const BUSY: f64 = 0.03;
/// ... and taken if the animal differs on average by as much as any of them asks for, and stands out more than at lower ones
/// by this factor: without scenery that hung together with it.
const MUCH_BETTER: f64 = 1.5;
/// Medians of short windows are taken that explain the samples better than the commonest values by this factor.
const FAR_BETTER: f64 = 3.0;

/// The plates while they are made.
pub(super) struct Draft {
    /// The samples of each plate.
    pub(super) parts: Vec<Part>,
    pub(super) plates: Vec<Plate>,
    /// The plate of each sample.
    pub(super) plate_of: Vec<Option<usize>>,
    /// All samples filmed from the same place and in the same light as each part's: where a window of time shows too
    /// little, these are asked.
    wider: Vec<u64>,
    /// Least difference that counts, levels of 255.
    threshold: u8,
}

impl Draft {
    /// One plate for each state of the scene, the median of its samples, whose light is made even.
    pub(super) fn of_states(samples: &mut Samples, params: &Params) -> Result<Draft, Error> {
        let parts = states::sort(samples)?;
        let mut plates = Vec::with_capacity(parts.len());
        for part in &parts {
            let reference = brightest(samples, part.samples);
            let mut plate =
                Plate::without_noise(samples.frames[reference].clone(), params.threshold);
            even_out_light(samples, part.samples, &mut plate);
            plates.push(Plate {
                uneven_light: plate.uneven_light,
                light: part.light,
                ..Plate::without_noise(samples.median_frame(part.samples), params.threshold)
            });
        }
        Ok(Draft::new(samples, parts, plates, params.threshold))
    }

    /// The median of all samples as the only plate.
    pub(super) fn of_all(samples: &Samples, params: &Params) -> Draft {
        let part = whole(samples);
        let median = samples.median_frame(part.samples);
        let plate = Plate::without_noise(median, params.threshold);
        Draft::new(samples, vec![part], vec![plate], params.threshold)
    }

    /// The given picture as the only plate.
    pub(super) fn given(
        image: &RgbImage,
        samples: &mut Samples,
        params: &Params,
    ) -> Result<Draft, Error> {
        let first = &samples.frames[0];
        if (image.width, image.height) != (first.width, first.height) {
            return Err(Error::BackgroundSizeDiffers {
                found: [image.width, image.height],
                wanted: [first.width, first.height],
            });
        }
        let mut frame = Frame::new(first.width, first.height, first.color);
        frame.draw_rgb(image, Rect::of_size(first.width, first.height));
        let mut plate = Plate::without_noise(frame, params.threshold);
        let part = whole(samples);
        if !samples.are_masked() {
            even_out_light(samples, part.samples, &mut plate);
        }
        Ok(Draft::new(
            samples,
            vec![part],
            vec![plate],
            params.threshold,
        ))
    }

    fn new(samples: &Samples, parts: Vec<Part>, plates: Vec<Plate>, threshold: u8) -> Draft {
        Draft {
            plate_of: plate_of(&parts, samples.frames.len()),
            wider: parts.iter().map(|part| part.samples).collect(),
            parts,
            plates,
            threshold,
        }
    }

    /// Surveys the samples. Where much of the picture differs, raised thresholds are tried too, and the one at which a
    /// subject that is stark even there stands out much more is kept: a black mouse among bedding that it kicks about, which at
    /// low thresholds hangs together with the bedding.
    pub(super) fn survey(&mut self, samples: &Samples) -> Survey {
        let usual = Threshold::usual(self.threshold);
        let mut best = (self.survey_at(usual, samples), usual);
        if best.0.differing_px() < BUSY * samples.n_px() as f64 {
            return best.0;
        }
        for factor in [2, 4] {
            let raised = Threshold::raised(self.threshold.saturating_mul(factor));
            let survey = self.survey_at(raised, samples);
            let contrast = survey
                .subject
                .as_ref()
                .map_or(0.0, |subject| subject.contrast);
            let is_stark = contrast >= f64::from(raised.most);
            if is_stark && survey.starkness() > MUCH_BETTER * best.0.starkness() {
                best = (survey, raised);
            }
        }
        let (survey, threshold) = best;
        self.set_threshold(threshold);
        survey
    }

    fn survey_at(&mut self, threshold: Threshold, samples: &Samples) -> Survey {
        self.set_threshold(threshold);
        Survey::of(samples, &self.plates, &self.plate_of)
    }

    fn set_threshold(&mut self, threshold: Threshold) {
        let plates = self.plates.iter_mut();
        plates.for_each(|plate| plate.set_threshold(threshold));
    }

    /// The same parts in short windows of time, each with the median of its samples as its plate: in them an animal that
    /// moves is seen, whatever changes over the film.
    pub(super) fn in_short_windows(&self, samples: &Samples) -> (Draft, Survey) {
        // A mouse that rests for a while among bedding that it kicks about is commoner than any one color of the bedding; a large
        // animal that hovers is in the median.
        let surveyed = |typical: fn(&Samples, u64) -> Frame| {
            let mut draft =
                self.in_short_windows_of(|part| typical(samples, part), samples.frames.len());
            let survey = draft.survey(samples);
            (draft, survey)
        };
        let of_medians = surveyed(Samples::median_frame);
        let of_commonest = surveyed(Samples::commonest_frame);
        match of_medians.1.worth < FAR_BETTER * of_commonest.1.worth {
            true => of_commonest,
            false => of_medians,
        }
    }

    fn in_short_windows_of(&self, typical: impl Fn(u64) -> Frame, n_samples: usize) -> Draft {
        let parts: Vec<Part> = self
            .parts
            .iter()
            .flat_map(|&part| windows::short(part))
            .collect();
        let plate = |part: &Part| Plate {
            light: part.light,
            ..Plate::without_noise(typical(part.samples), self.threshold)
        };
        Draft {
            plates: parts.iter().map(plate).collect(),
            plate_of: plate_of(&parts, n_samples),
            wider: parts.iter().map(|part| part.samples).collect(),
            threshold: self.threshold,
            parts,
        }
    }

    /// In which samples each pixel shows the scene, from the survey of short windows and the places at which the subject
    /// rests for longer than one.
    pub(super) fn occupancy_over_time(
        &self,
        short: &Draft,
        samples: &Samples,
        survey: &Survey,
    ) -> Occupancy {
        let mut seen = Occupancy::of(samples, &short.plates, &short.plate_of, survey);
        if let Some(subject) = &survey.subject {
            for (part, whole) in self.parts.iter().zip(&self.plates) {
                let windows: Vec<(Part, &Plate)> = short
                    .parts
                    .iter()
                    .zip(&short.plates)
                    .filter(|(window, _)| window.samples & part.samples != 0)
                    .map(|(window, plate)| (*window, plate))
                    .collect();
                resting::mark(&mut seen, whole, &windows, subject);
                resting::mark_settled(&mut seen, whole, part.samples, survey, subject);
            }
        }
        seen
    }

    /// Splits the parts of a scene that changes for good.
    pub(super) fn split_in_time(&mut self, samples: &Samples, seen: &Occupancy) {
        let thumbnails = samples.thumbnails();
        let first = &samples.frames[0];
        let side = Thumbnail::cell_px(first.width, first.height);
        let taken = seen.taken_in_cells(side, [first.width, first.height]);
        let is_free = |k: usize, cell: usize| taken[cell] >> k & 1 == 0;
        let (mut parts, mut wider, mut plates) = (Vec::new(), Vec::new(), Vec::new());
        for ((part, plate), &samples) in self.parts.iter().zip(&self.plates).zip(&self.wider) {
            for window in windows::split(*part, &thumbnails, &is_free) {
                parts.push(window);
                wider.push(samples);
                plates.push(Plate {
                    uneven_light: plate.uneven_light,
                    light: plate.light,
                    ..Plate::without_noise(plate.frame.clone(), self.threshold)
                });
            }
        }
        self.plate_of = plate_of(&parts, samples.frames.len());
        (self.parts, self.wider, self.plates) = (parts, wider, plates);
    }

    /// Paints the plates from the samples in which nothing stands before a pixel, and measures their noise.
    pub(super) fn paint(&mut self, samples: &Samples, seen: &Occupancy, is_given: bool) {
        if !is_given {
            let repaint = |(part, (plate, &wider)): (&Part, (&Plate, &u64))| {
                let before = match wider == part.samples {
                    true => plate.frame.clone(),
                    false => samples.median_where_free(wider, &plate.frame, seen, 1),
                };
                let least = if wider == part.samples { 1 } else { FREE_LEAST };
                samples.median_where_free(part.samples, &before, seen, least)
            };
            let painted = self.parts.iter().zip(self.plates.iter().zip(&self.wider));
            let frames: Vec<Frame> = painted.map(repaint).collect();
            for (plate, frame) in self.plates.iter_mut().zip(frames) {
                plate.frame = frame;
            }
        }
        let backgrounds: Vec<&Frame> = self
            .plate_of
            .iter()
            .map(|at| &self.plates[at.unwrap_or(0)].frame)
            .collect();
        let sigmas: Vec<Vec<f32>> = self
            .wider
            .iter()
            .map(|&wider| samples.noise(wider, &backgrounds, seen))
            .collect();
        for (plate, sigma) in self.plates.iter_mut().zip(sigmas) {
            *plate = Plate {
                uneven_light: plate.uneven_light,
                light: plate.light,
                ..Plate::of(plate.frame.clone(), sigma, self.threshold)
            };
        }
        if !is_given {
            self.fill_unknown(samples, seen, fill::smooth);
        }
    }

    /// Continues the texture where nothing was ever seen, finds the second color where something sways, and measures the
    /// noise of blocks.
    pub(super) fn finish(
        &mut self,
        samples: &Samples,
        seen: &Occupancy,
        survey: &Survey,
        is_given: bool,
    ) {
        if !is_given {
            self.fill_unknown(samples, seen, |image, unknown| {
                fill::sample_texture(image, unknown, FILL_SEED)
            });
        }
        let first = &samples.frames[0];
        let taken = seen.taken_in_cells(blocks::SIDE, [first.width, first.height]);
        for (plate, (part, &wider)) in self
            .plates
            .iter_mut()
            .zip(self.parts.iter().zip(&self.wider))
        {
            plate.other = sway::other_color(&samples.frames, &plate.frame, |px| {
                seen.free(px, part.samples)
            });
            plate.blocks.measure_noise(&samples.frames, wider, &taken);
        }
        raise_thresholds(&mut self.plates, survey);
    }

    /// Replaces the pixels of each plate that are free in no sample as `fill` says, and no others.
    fn fill_unknown(
        &mut self,
        samples: &Samples,
        seen: &Occupancy,
        fill: impl Fn(&mut RgbImage, &[bool]),
    ) {
        let threshold = self.threshold;
        for (plate, &wider) in self.plates.iter_mut().zip(&self.wider) {
            let unknown: Vec<bool> = (0..samples.n_px())
                .map(|px| seen.free(px, wider) == 0)
                .collect();
            let pixel = |px: usize| Rect {
                x: px as u32 % plate.frame.width,
                y: px as u32 / plate.frame.width,
                w: 1,
                h: 1,
            };
            let places = || (0..unknown.len()).filter(|&px| unknown[px]);
            let Some(hole) = places().map(pixel).reduce(|a, b| a.union(&b)) else {
                continue;
            };
            fill(&mut plate.rgb, &unknown);
            let mut frame = plate.frame.clone();
            frame.draw_rgb(&plate.rgb, hole);
            *plate = Plate {
                never_seen_px: places().count() as u64,
                uneven_light: plate.uneven_light,
                light: plate.light,
                core_threshold: std::mem::take(&mut plate.core_threshold),
                weak_share: plate.weak_share,
                ..Plate::of(frame, std::mem::take(&mut plate.sigma), threshold)
            };
        }
    }
}

/// All samples, in one light.
fn whole(samples: &Samples) -> Part {
    Part {
        samples: u64::MAX >> (64 - samples.frames.len()),
        light: 0,
    }
}

/// The plate of each sample.
fn plate_of(parts: &[Part], n_samples: usize) -> Vec<Option<usize>> {
    let of = |k: usize| parts.iter().position(|part| part.samples >> k & 1 == 1);
    (0..n_samples).map(of).collect()
}

/// The sample whose light is at the third quartile: dividing by more than one loses levels, and the brightest may be
/// a flash.
fn brightest(samples: &Samples, part: u64) -> usize {
    let mean = |k: usize| {
        let luma = samples.frames[k].luma();
        let sum: u64 = luma.iter().step_by(7).map(|&v| u64::from(v)).sum();
        sum / luma.len().div_ceil(7).max(1) as u64
    };
    let mut by_light: Vec<(u64, usize)> = states::bits(part).map(|k| (mean(k), k)).collect();
    by_light.sort_unstable();
    by_light[by_light.len() * 3 / 4].1
}

/// Divides the samples of a part by their light relative to a plate.
fn even_out_light(samples: &mut Samples, part: u64, plate: &mut Plate) {
    let members: Vec<usize> = states::bits(part).collect();
    let step = members.len().div_ceil(N_LIGHT).max(1);
    let some: Vec<&Frame> = members
        .iter()
        .step_by(step)
        .map(|&k| &samples.frames[k])
        .collect();
    plate.uneven_light = light::is_uneven(some.into_iter(), plate);
    let plate = &*plate;
    samples.change(part, |frame| light::of(frame, plate).undo(frame));
}

/// Raises the core threshold of an animal that stands out starkly to a share of its contrast: what
/// differs by less than that beside a black mouse on white paper is its shadow and its reflection.
fn raise_thresholds(plates: &mut [Plate], survey: &Survey) {
    const SHARE: f64 = 0.25;
    let contrast = survey
        .subject
        .as_ref()
        .map_or(0.0, |subject| subject.contrast);
    let least = (SHARE * contrast) as u8;
    for threshold in plates
        .iter_mut()
        .flat_map(|plate| &mut plate.core_threshold)
    {
        *threshold = (*threshold).max(least);
    }
}
