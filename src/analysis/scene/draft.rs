//! Estimates the backgrounds of a scene from its samples (docs/explanation/algorithms.md, "Background").
//!
//! A [`Draft`] holds the backgrounds while [`super::estimate`] improves them. Each pixel comes from the
//! samples that show the scene there. Where no sample does, `fill` continues the surroundings.

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

/// Least number of free samples that repaint a part's pixel; a median of three ignores one outlier.
const FREE_LEAST: u32 = 3;
/// Random seed of the texture synthesis.
const FILL_SEED: u64 = 1;
/// Number of frames compared to detect uneven light. Free choice.
const N_LIGHT: usize = 16;
/// Median share of the picture that differs, from which higher thresholds are tried. Free choice.
const BUSY: f64 = 0.03;
/// Factor by which a higher threshold must raise the starkness to be kept. Free choice.
const MUCH_BETTER: f64 = 1.5;
/// Factor by which medians must explain the samples better than commonest values do. Free choice.
const FAR_BETTER: f64 = 3.0;

/// The backgrounds of a scene during their estimation.
pub(super) struct Draft {
    /// The samples of each background.
    pub(super) parts: Vec<Part>,
    pub(super) plates: Vec<Plate>,
    /// Index of each sample's background; `None` for a sample without one.
    pub(super) plate_of: Vec<Option<usize>>,
    /// All samples of each part's state, one bit each; used where a time window shows a pixel too rarely.
    wider: Vec<u64>,
    /// The parameter `threshold`: least difference that counts, levels of 255.
    threshold: u8,
}

impl Draft {
    /// Returns one background for each state: the median of its samples, after their light is equalized.
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

    /// Returns the median of all samples as the only background.
    pub(super) fn of_all(samples: &Samples, params: &Params) -> Draft {
        let part = whole(samples);
        let median = samples.median_frame(part.samples);
        let plate = Plate::without_noise(median, params.threshold);
        Draft::new(samples, vec![part], vec![plate], params.threshold)
    }

    /// Returns the given picture as the only background. Fails if it differs in size from the frames.
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

    /// Surveys the samples and sets the threshold of the backgrounds. Where much of the picture differs,
    /// thresholds twice and four times as high are tried. One is kept if the animal's contrast is at least
    /// twice the threshold and its starkness grows. At a low threshold, a black mouse forms one component
    /// with the bedding that it kicks about.
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

    /// Returns the parts as short time windows with backgrounds of their own, and their survey. Short windows
    /// show a moving animal even where the scene changes over time.
    pub(super) fn in_short_windows(&self, samples: &Samples) -> (Draft, Survey) {
        // The commonest values show a mouse that rests among bedding it kicks about. Medians show a large
        // animal that hovers.
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

    /// Returns the samples in which each pixel shows the scene. It combines the survey of short windows with
    /// the places at which the subject rests for longer than one window.
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
            }
        }
        seen
    }

    /// Splits the parts whose scene changes for good.
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

    /// Repaints the backgrounds from the samples that show the scene, and measures their noise. A given
    /// background keeps its pixels.
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

    /// Synthesizes texture where no sample shows the scene, and finds the second color of swaying scenery.
    /// Then measures the noise of blocks and raises the thresholds.
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

    /// Applies `fill` to the pixels of each background that are free in no sample.
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

/// Returns one part with all samples.
fn whole(samples: &Samples) -> Part {
    Part {
        samples: u64::MAX >> (64 - samples.frames.len()),
        light: 0,
    }
}

/// Returns the index of each sample's part; `None` for a sample in no part.
fn plate_of(parts: &[Part], n_samples: usize) -> Vec<Option<usize>> {
    let of = |k: usize| parts.iter().position(|part| part.samples >> k & 1 == 1);
    (0..n_samples).map(of).collect()
}

/// Returns the sample whose mean luma is the third quartile. A bright reference keeps gains low, because a
/// gain above 1 loses levels. The brightest sample may be a flash.
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

/// Divides the samples of a part by their light relative to a background. Sets `uneven_light` of the
/// background.
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

/// Raises the core thresholds to at least a quarter of the animal's contrast. Beside a black mouse on white
/// paper, smaller differences are its shadow and its reflection.
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
