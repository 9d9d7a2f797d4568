//! Estimates the backgrounds of a scene from its samples (docs/explanation/algorithms.md, "Background").
//!
//! [`super::estimate`] improves a [`BackgroundEstimate`] step by step. Each pixel comes from the samples that
//! show the scene there. Where no sample does, `fill` continues the surroundings.

use super::background::{Background, Threshold};
use super::occupancy::Occupancy;
use super::resting;
use super::samples::{MIN_AGREEING, Samples};
use super::states::thumbnail::Thumbnail;
use super::states::{self, SampleGroup};
use super::still_part::StillPart;
use super::survey::Survey;
use super::sway;
use super::windows;
use crate::analysis::silhouette::blocks;
use crate::analysis::{Error, Params};
use crate::geometry::Rect;
use crate::raster::fill;
use crate::raster::{Frame, RgbImage};

/// Random seed of the texture synthesis.
const FILL_SEED: u64 = 1;
/// Median share of the picture that differs, from which higher thresholds are tried. Free choice.
const BUSY_SHARE: f64 = 0.03;
/// Factor by which a higher threshold must raise the starkness to be kept. Free choice.
const MIN_STARKNESS_RATIO: f64 = 1.5;
/// Share of ghosts in all that differs, above which a state's background shows the animal. Free choice.
const MAX_GHOST_SHARE: f64 = 0.05;
/// Least core threshold, as a share of the animal's contrast. Free choice.
const CORE_CONTRAST: f64 = 0.25;

/// The backgrounds of a scene during their estimation.
pub(super) struct BackgroundEstimate {
    /// The samples of each background, in the same order.
    pub(super) groups: Vec<SampleGroup>,
    pub(super) backgrounds: Vec<Background>,
    /// Index of each sample's background; `None` for a sample without one.
    pub(super) background_of: Vec<Option<usize>>,
    /// The parameter `threshold`: least difference that counts, levels of 255.
    threshold: u8,
    /// Parts of the animal that never leave their place.
    pub(super) still_parts: Vec<StillPart>,
}

impl BackgroundEstimate {
    /// Returns one background for each state: the median of its samples, after their light is equalized.
    pub(super) fn from_states(
        samples: &mut Samples,
        params: &Params,
    ) -> Result<BackgroundEstimate, Error> {
        let groups = states::group_samples(samples)?;
        let mut backgrounds = Vec::with_capacity(groups.len());
        for group in &groups {
            let reference = samples.bright_reference(group.samples);
            let mut background =
                Background::without_noise(samples.frames[reference].clone(), params.threshold);
            samples.equalize_light(group.samples, &mut background);
            backgrounds.push(Background {
                uneven_light: background.uneven_light,
                light: group.light,
                ..Background::without_noise(samples.median_frame(group.samples), params.threshold)
            });
        }
        Ok(BackgroundEstimate::new(
            samples,
            groups,
            backgrounds,
            params.threshold,
        ))
    }

    /// Returns the median of all samples as the only background.
    pub(super) fn from_all_samples(samples: &Samples, params: &Params) -> BackgroundEstimate {
        let group = all_samples(samples);
        let median = samples.median_frame(group.samples);
        let background = Background::without_noise(median, params.threshold);
        BackgroundEstimate::new(samples, vec![group], vec![background], params.threshold)
    }

    /// Returns the given picture as the only background. Fails if it differs in size from the frames.
    pub(super) fn from_image(
        image: &RgbImage,
        samples: &mut Samples,
        params: &Params,
    ) -> Result<BackgroundEstimate, Error> {
        let first = &samples.frames[0];
        if (image.width, image.height) != (first.width, first.height) {
            return Err(Error::BackgroundSizeDiffers {
                found: [image.width, image.height],
                wanted: [first.width, first.height],
            });
        }
        let mut frame = Frame::new(first.width, first.height, first.color);
        frame.draw_rgb(image, Rect::of_size(first.width, first.height));
        let mut background = Background::without_noise(frame, params.threshold);
        let group = all_samples(samples);
        if !samples.are_masked() {
            samples.equalize_light(group.samples, &mut background);
        }
        Ok(BackgroundEstimate::new(
            samples,
            vec![group],
            vec![background],
            params.threshold,
        ))
    }

    fn new(
        samples: &Samples,
        groups: Vec<SampleGroup>,
        backgrounds: Vec<Background>,
        threshold: u8,
    ) -> BackgroundEstimate {
        BackgroundEstimate {
            background_of: background_of(&groups, samples.frames.len()),
            groups,
            backgrounds,
            threshold,
            still_parts: Vec::new(),
        }
    }

    /// Returns the background of each sample; `None` for a sample without one.
    pub(super) fn of_samples(&self) -> Vec<Option<&Background>> {
        let of_sample = |at: &Option<usize>| at.map(|at| &self.backgrounds[at]);
        self.background_of.iter().map(of_sample).collect()
    }

    /// Surveys the samples and sets the threshold of the backgrounds. Where much of the picture differs,
    /// thresholds twice and four times as high are tried. One is kept if the animal's contrast is at least
    /// twice the threshold and its starkness grows. At a low threshold, a black mouse forms one component
    /// with the bedding that it kicks about.
    pub(super) fn survey(&mut self, samples: &Samples) -> Survey {
        let usual = Threshold::usual(self.threshold);
        let mut best = (self.survey_at(usual, samples), usual);
        if best.0.differing_px() < BUSY_SHARE * samples.n_px() as f64 {
            return best.0;
        }
        for factor in [2, 4] {
            let raised = Threshold::raised(self.threshold.saturating_mul(factor));
            let survey = self.survey_at(raised, samples);
            let contrast = survey
                .subject
                .as_ref()
                .map_or(0.0, |subject| subject.contrast);
            let is_stark = contrast >= f64::from(raised.max);
            if is_stark && survey.starkness() > MIN_STARKNESS_RATIO * best.0.starkness() {
                best = (survey, raised);
            }
        }
        let (survey, threshold) = best;
        self.set_threshold(threshold);
        survey
    }

    fn survey_at(&mut self, threshold: Threshold, samples: &Samples) -> Survey {
        self.set_threshold(threshold);
        Survey::new(samples, &self.of_samples())
    }

    fn set_threshold(&mut self, threshold: Threshold) {
        let backgrounds = self.backgrounds.iter_mut();
        backgrounds.for_each(|background| background.set_threshold(threshold));
    }

    /// Returns the backgrounds for the first survey, and the survey: those of the states or those of short time
    /// windows, whichever explain the samples better. The states show an animal that lingers, unless it stays at one
    /// place for most of the film; short windows show one that moves, even where the scene changes over time.
    pub(super) fn for_first_survey(&self, samples: &Samples) -> (BackgroundEstimate, Survey) {
        let windows = self.groups.iter();
        let windows = windows.flat_map(|&group| windows::short_windows(group));
        let of_states = self.with_pictures(self.groups.clone(), samples, |at, _| {
            self.backgrounds[at].frame.clone()
        });
        let of_windows = self.with_pictures(windows.collect(), samples, |_, group| {
            samples.commonest_frame(group.samples)
        });
        let [of_states, of_windows] = [of_states, of_windows].map(|mut estimate| {
            let survey = estimate.survey(samples);
            (estimate, survey)
        });
        let n_found = of_states.1.animal.iter().flatten().count();
        let shows_animal =
            of_states.1.ghost_share() > MAX_GHOST_SHARE || 2 * n_found <= of_states.1.animal.len();
        if !shows_animal && of_states.1.explained() > of_windows.1.explained() {
            of_states
        } else {
            of_windows
        }
    }

    /// Returns an estimate with the given groups and their pictures.
    fn with_pictures(
        &self,
        groups: Vec<SampleGroup>,
        samples: &Samples,
        picture: impl Fn(usize, &SampleGroup) -> Frame,
    ) -> BackgroundEstimate {
        let background = |(at, group): (usize, &SampleGroup)| Background {
            light: group.light,
            ..Background::without_noise(picture(at, group), self.threshold)
        };
        let backgrounds = groups.iter().enumerate().map(background).collect();
        BackgroundEstimate::new(samples, groups, backgrounds, self.threshold)
    }

    /// Returns the samples in which each pixel shows the scene.
    pub(super) fn occupancy(&self, samples: &Samples, survey: &Survey) -> Occupancy {
        let mut occupancy = Occupancy::new(samples, &self.of_samples(), survey);
        for part in &self.still_parts {
            occupancy.mark_hidden(part);
        }
        occupancy
    }

    /// Returns the samples in which each pixel shows the scene. It combines the first survey with the
    /// places at which the subject rests for longer than one window.
    pub(super) fn occupancy_over_time(
        &self,
        first: &BackgroundEstimate,
        samples: &Samples,
        survey: &Survey,
    ) -> Occupancy {
        let mut occupancy = first.occupancy(samples, survey);
        if let Some(subject) = &survey.subject {
            for (group, background) in self.groups.iter().zip(&self.backgrounds) {
                let windows: Vec<(SampleGroup, &Background)> = first
                    .groups
                    .iter()
                    .zip(&first.backgrounds)
                    .filter(|(window, _)| window.samples & group.samples != 0)
                    .map(|(window, background)| (*window, background))
                    .collect();
                resting::mark_resting(&mut occupancy, background, &windows, subject);
            }
        }
        occupancy
    }

    /// Splits the groups whose scene changes for good.
    pub(super) fn split_in_time(&mut self, samples: &Samples, occupancy: &Occupancy) {
        let thumbnails = samples.thumbnails();
        let [width, height] = samples.size_px();
        let side = Thumbnail::cell_px(width, height);
        let taken = occupancy.taken_in_cells(side, [width, height]);
        let is_free = |k: usize, cell: usize| taken[cell] >> k & 1 == 0;
        let (mut groups, mut backgrounds) = (Vec::new(), Vec::new());
        for (group, background) in self.groups.iter().zip(&self.backgrounds) {
            for window in windows::split(*group, &thumbnails, &is_free) {
                groups.push(window);
                backgrounds.push(Background {
                    uneven_light: background.uneven_light,
                    light: background.light,
                    ..Background::without_noise(background.frame.clone(), self.threshold)
                });
            }
        }
        *self = BackgroundEstimate::new(samples, groups, backgrounds, self.threshold);
    }

    /// Repaints the backgrounds from the samples that show the scene, and measures their noise. A given
    /// background keeps its pixels.
    pub(super) fn repaint(&mut self, samples: &Samples, occupancy: &Occupancy, is_given: bool) {
        if !is_given {
            for (background, group) in self.backgrounds.iter_mut().zip(&self.groups) {
                background.set_picture(repainted(background, group, samples, occupancy));
            }
        }
        let frames: Vec<&Frame> = self
            .background_of
            .iter()
            .map(|at| &self.backgrounds[at.unwrap_or(0)].frame)
            .collect();
        let sigmas: Vec<Vec<f32>> = self
            .groups
            .iter()
            .map(|group| samples.noise(group.state_samples, &frames, occupancy))
            .collect();
        for (background, sigma) in self.backgrounds.iter_mut().zip(sigmas) {
            background.sigma = sigma;
            background.set_threshold(Threshold::usual(self.threshold));
            background.never_seen_px = 0;
        }
        if !is_given {
            self.fill_unknown(samples, occupancy, fill::smooth);
        }
    }

    /// Synthesizes texture where no sample shows the scene, and finds the second color of swaying scenery.
    /// Then measures the noise of blocks and raises the thresholds.
    pub(super) fn finish(
        &mut self,
        samples: &Samples,
        occupancy: &Occupancy,
        survey: &Survey,
        is_given: bool,
    ) {
        if !is_given {
            self.fill_unknown(samples, occupancy, |image, unknown| {
                fill::sample_texture(image, unknown, FILL_SEED)
            });
        }
        let taken = occupancy.taken_in_cells(blocks::SIDE, samples.size_px());
        for (background, group) in self.backgrounds.iter_mut().zip(&self.groups) {
            background.other = sway::other_color(&samples.frames, &background.frame, |px| {
                occupancy.free(px, group.samples)
            });
            let blocks = &mut background.blocks;
            blocks.measure_noise(&samples.frames, group.state_samples, &taken);
        }
        raise_thresholds(&mut self.backgrounds, survey);
    }

    /// Applies `fill` to the pixels of each background that are free in no sample.
    fn fill_unknown(
        &mut self,
        samples: &Samples,
        occupancy: &Occupancy,
        fill: impl Fn(&mut RgbImage, &[bool]),
    ) {
        for (background, group) in self.backgrounds.iter_mut().zip(&self.groups) {
            let unknown: Vec<bool> = (0..samples.n_px())
                .map(|px| occupancy.free(px, group.state_samples) == 0)
                .collect();
            let pixel = |px: usize| Rect {
                x: px as u32 % background.frame.width,
                y: px as u32 / background.frame.width,
                w: 1,
                h: 1,
            };
            let places = || (0..unknown.len()).filter(|&px| unknown[px]);
            let Some(hole) = places().map(pixel).reduce(|a, b| a.union(&b)) else {
                continue;
            };
            fill(&mut background.rgb, &unknown);
            let mut frame = background.frame.clone();
            frame.draw_rgb(&background.rgb, hole);
            background.never_seen_px = places().count() as u64;
            background.set_picture(frame);
        }
    }
}

/// Returns the commonest values of a group's free samples. A pixel that is rarely free in a time window takes
/// its value from all samples of the state.
fn repainted(
    background: &Background,
    group: &SampleGroup,
    samples: &Samples,
    occupancy: &Occupancy,
) -> Frame {
    if group.samples == group.state_samples {
        return samples.commonest_where_free(group.samples, &background.frame, occupancy, 1);
    }
    let of_state =
        samples.commonest_where_free(group.state_samples, &background.frame, occupancy, 1);
    samples.commonest_where_free(group.samples, &of_state, occupancy, MIN_AGREEING as u32)
}

/// Returns one group with all samples.
fn all_samples(samples: &Samples) -> SampleGroup {
    SampleGroup::of_state(u64::MAX >> (64 - samples.frames.len()), 0)
}

/// Returns the index of each sample's group; `None` for a sample in no group.
fn background_of(groups: &[SampleGroup], n_samples: usize) -> Vec<Option<usize>> {
    let group_of = |k: usize| groups.iter().position(|group| group.samples >> k & 1 == 1);
    (0..n_samples).map(group_of).collect()
}

/// Raises the core thresholds to at least a quarter of the animal's contrast. Beside a black mouse on white
/// paper, smaller differences are its shadow and its reflection.
fn raise_thresholds(backgrounds: &mut [Background], survey: &Survey) {
    let contrast = survey
        .subject
        .as_ref()
        .map_or(0.0, |subject| subject.contrast);
    let least = (CORE_CONTRAST * contrast) as u8;
    for threshold in backgrounds
        .iter_mut()
        .flat_map(|background| &mut background.core_threshold)
    {
        *threshold = (*threshold).max(least);
    }
}
