//! The figure: one flat picture of the filmed animal, learned from the mattes of its best frames
//! (docs/explanation/algorithms.md, "Virtual fish").
//!
//! The picture lies in body coordinates: `s` runs along the body from the nose (0) to the tip of the tail (1),
//! and `t` across it, both in body lengths. From the side `t` points to the belly, from above to the animal's
//! left. Its alpha is the mean alpha of the frames, so fins that move are translucent at their edges.

mod chart;
pub(super) mod course;
mod evidence;
mod fit;
mod flesh;
mod grid;
mod pixels;

use glam::DVec3;
use rayon::prelude::*;

use self::chart::Chart;
pub(super) use self::chart::{Fit, Midline};
use self::course::{Bend, Evidence};
use self::fit::Outline;
use self::grid::{Grid, Sheet};
pub(super) use self::pixels::Pixels;
use super::error::Error;
use super::motion::toward_sight;
use crate::geometry::Camera;
use crate::library::{Library, Pose, View};
use crate::order::{median, percentile};
use crate::raster::RgbaImage;

/// Flat picture of an animal, and its place in every frame.
pub struct Figure {
    view: View,
    grid: Grid,
    /// From the side the right flank and the left one, below each other; from above the back.
    picture: RgbaImage,
    /// Alpha of the figure.
    sheet: Sheet,
    /// Position of the centroid along the body.
    pub(super) center_s: f64,
    /// Length of the animal seen broadside, in pixels.
    pub(super) length_px: f64,
    /// Place of the figure in every frame; empty if the poses say it better: from above, or with a camera.
    pub(super) fits: Vec<Option<Fit>>,
    /// Rate of the tail beat, hertz, and bend in every frame; empty from above, where the midline has it.
    pub(super) beat_hz: f64,
    pub(super) bends: Vec<Bend>,
}

/// Largest number of frames from which the figure is learned. Free choice.
const N_FRAMES: usize = 60;
/// Texels of the figure per body length: least and most. Free choice.
const TEXELS: [f64; 2] = [48.0, 320.0];

impl Figure {
    /// Returns the figure of the animal of a library. Fails if no frame shows the whole animal.
    pub fn learn(library: &Library) -> Result<Figure, Error> {
        let frames = good_frames(library);
        if frames.is_empty() {
            return Err(Error::NoPictures);
        }
        match library.poses.view {
            View::Side => Figure::from_the_side(library, &frames),
            View::Top => Figure::from_above(library, &frames),
        }
    }

    fn from_above(library: &Library, frames: &[usize]) -> Result<Figure, Error> {
        let read = |k: &usize| {
            let midline = Midline::new(library.poses.frames[*k].midline_px.as_ref()?)?;
            Some((midline, Pixels::read(library, *k)?))
        };
        let (midlines, pixels): (Vec<Midline>, Vec<Pixels>) =
            frames.iter().filter_map(read).unzip();
        let length_px = median(midlines.iter().map(Midline::length_px)).ok_or(Error::NoPictures)?;
        let charts: Vec<Chart> = midlines
            .into_iter()
            .map(|midline| Chart::Curved { midline, length_px })
            .collect();
        let texels = length_px.clamp(TEXELS[0], TEXELS[1]);
        let wide = Grid::wide([-0.2, 1.2], [-0.6, 0.6], texels);
        let wide_sheet = Sheet::mean(wide, &charts, &pixels);
        let sheet = Sheet::mean(wide_sheet.visible(), &charts, &pixels);
        let grid = sheet.grid;
        Ok(Figure {
            view: View::Top,
            picture: grid.picture(&sheet, &charts, &pixels),
            center_s: sheet.centroid()[0],
            grid,
            sheet,
            length_px,
            fits: Vec::new(),
            beat_hz: 0.0,
            bends: Vec::new(),
        })
    }

    fn from_the_side(library: &Library, frames: &[usize]) -> Result<Figure, Error> {
        let poses = &library.poses.frames;
        let read = |k: &usize| {
            let start = Fit::start(&poses[*k], poses[*k].length_px?)?;
            Some((start, Pixels::read(library, *k)?))
        };
        let (mut fits, pixels): (Vec<Fit>, Vec<Pixels>) = frames.iter().filter_map(read).unzip();
        let wide = Grid::wide([-0.5, 1.5], [-0.8, 0.8], TEXELS[0]);
        let mut sheet = Sheet::mean(wide, &charts(&fits, 0.5), &pixels);
        let mut center_s = 0.5;
        for round in 0..N_ROUNDS {
            let [nose, tail] = sheet.extent_s();
            if tail - nose < LEAST_LENGTH {
                return Err(Error::NoPictures);
            }
            let middle = sheet.centroid();
            for fit in &mut fits {
                fit.rebase([middle[0] - center_s, middle[1]], tail - nose);
            }
            center_s = (middle[0] - nose) / (tail - nose);
            let length_px = usual_length_px(&fits)?;
            let last = round + 1 == N_ROUNDS;
            let texels = if last {
                length_px
            } else {
                length_px.min(128.0)
            };
            let texels = texels.clamp(TEXELS[0], TEXELS[1]);
            let mut box_of = sheet.visible();
            box_of.rebase([nose, middle[1]], tail - nose, texels);
            sheet = Sheet::mean(box_of, &charts(&fits, center_s), &pixels);
            if !last {
                let outlines = pixels.par_iter().map(Outline::new);
                fits = outlines
                    .zip(&fits)
                    .map(|(outline, start)| outline.fit(&sheet, center_s, start))
                    .collect();
                sheet = Sheet::mean(sheet.grid, &charts(&fits, center_s), &pixels);
            }
        }
        Figure::of_both_flanks(library, sheet, center_s, &fits, &pixels)
    }

    fn of_both_flanks(
        library: &Library,
        sheet: Sheet,
        center_s: f64,
        fits: &[Fit],
        pixels: &[Pixels],
    ) -> Result<Figure, Error> {
        let grid = sheet.grid;
        let all = charts(fits, center_s);
        let mut picture = RgbaImage::new(grid.size[0] as u32, 0);
        let n_right = fits.iter().filter(|fit| fit.faces_right()).count();
        let fewest = n_right.min(fits.len() - n_right);
        for is_right in [true, false] {
            // A flank that few frames show is the other one mirrored.
            let seen = |fit: &Fit| fewest < LEAST_OF_A_FLANK || fit.faces_right() == is_right;
            let chosen: Vec<usize> = (0..fits.len()).filter(|&k| seen(&fits[k])).collect();
            let charts: Vec<Chart> = chosen.iter().map(|&k| all[k].clone()).collect();
            let pixels: Vec<Pixels> = chosen.iter().map(|&k| pixels[k].clone()).collect();
            let flank = grid.picture(&sheet, &charts, &pixels);
            picture.pixels.extend(flank.pixels);
            picture.height += flank.height;
        }
        let mut figure = Figure {
            view: View::Side,
            grid,
            picture,
            sheet,
            center_s,
            length_px: usual_length_px(fits)?,
            fits: Vec::new(),
            beat_hz: 0.0,
            bends: Vec::new(),
        };
        figure.fit_all(library);
        Ok(figure)
    }

    /// Finds the figure in every frame in which it can be found, bent as all frames together say.
    fn fit_all(&mut self, library: &Library) {
        let poses = &library.poses;
        let frames = poses.frames.par_iter().enumerate();
        let outlines: Vec<Option<Outline>> = frames
            .map(|(k, _)| Some(Outline::new(&Pixels::read(library, k)?)))
            .collect();
        let (sheet, center_s) = (&self.sheet, self.center_s);
        let search = |(outline, pose): (&Option<Outline>, &Pose)| {
            let start = Fit::start(pose, self.length_px)?;
            Some(outline.as_ref()?.search(sheet, center_s, &start))
        };
        let frames = outlines.par_iter().zip(&poses.frames);
        let mut fits: Vec<Option<Fit>> = frames.map(search).collect();
        let sides: Vec<f64> = poses
            .frames
            .iter()
            .map(|pose| side(pose, poses.camera))
            .collect();
        let mut bends = Vec::new();
        for _ in 0..N_BENDS {
            let frames = fits.par_iter().zip(&outlines).zip(&sides);
            let evidence: Vec<Evidence> = frames
                .map(|((fit, outline), side)| match (fit, outline) {
                    (Some(fit), Some(outline)) => {
                        let mut one = evidence::evidence(fit, outline, sheet, center_s);
                        one.pull *= *side;
                        one
                    }
                    _ => Evidence::NONE,
                })
                .collect();
            (self.beat_hz, bends) = course::bends(&evidence, poses.fps);
            let again = |k: usize| {
                let bent = Fit {
                    bend: (bends[k].mean * sides[k]).to_array(),
                    ..fits[k]?
                };
                Some(outlines[k].as_ref()?.place(sheet, center_s, &bent))
            };
            fits = (0..fits.len()).into_par_iter().map(again).collect();
        }
        self.bends = bends;
        // Poses in space are better than fits without perspective.
        if poses.camera.is_none() || poses.animal.is_none() {
            self.fits = fits;
        }
    }
}

/// Returns 1, or -1 where the animal is known to point away from the camera. A fit always points toward it, and its bend is
/// then that to the other side.
fn side(pose: &Pose, camera: Option<Camera>) -> f64 {
    let known = pose.forward.zip(pose.position_m).zip(camera);
    let points_away = known.is_some_and(|((forward, position_m), camera)| {
        let sight = toward_sight(&camera, position_m.into()) * DVec3::Z;
        sight.dot(forward.into()) > 0.0
    });
    if points_away { -1.0 } else { 1.0 }
}

/// Rounds of bending and placing. Free choice.
const N_BENDS: usize = 2;
/// Least length of the mean silhouette, as a share of the measured length. Free choice.
const LEAST_LENGTH: f64 = 0.25;
/// Rounds of averaging and fitting. Free choice; more change the figure little.
const N_ROUNDS: usize = 3;
/// Least number of frames that show a flank. Free choice.
const LEAST_OF_A_FLANK: usize = 5;

fn usual_length_px(fits: &[Fit]) -> Result<f64, Error> {
    median(fits.iter().map(|fit| fit.length_px)).ok_or(Error::NoPictures)
}

fn charts(fits: &[Fit], center_s: f64) -> Vec<Chart> {
    fits.iter()
        .map(|fit| Chart::Flat(Box::new(fit.flat(center_s))))
        .collect()
}

/// Returns up to [`N_FRAMES`] frames, spread over the film, that surely show the whole animal. From the side
/// it is nearly broadside: at least 0.9 times as long as in one frame of ten.
fn good_frames(library: &Library) -> Vec<usize> {
    let poses = &library.poses;
    let is_whole = |k: &usize| {
        let pose = &poses.frames[*k];
        let is_sure = [pose.confidence, pose.head_confidence]
            .iter()
            .all(|p| p.is_some_and(|p| p > SURE));
        let has_axis = match poses.view {
            View::Side => pose.heading_rad.is_some() && pose.length_px.is_some(),
            View::Top => pose.midline_px.is_some(),
        };
        is_sure && !pose.cut && has_axis && library.sprites.is_present(*k)
    };
    let mut frames: Vec<usize> = (0..poses.frames.len()).filter(is_whole).collect();
    if poses.view == View::Side {
        let length = |k: &usize| poses.frames[*k].length_px.unwrap_or(0.0);
        let mut lengths: Vec<f64> = frames.iter().map(length).collect();
        let long = percentile(&mut lengths, 0.9).unwrap_or(0.0);
        frames.retain(|k| length(k) >= 0.9 * long);
    }
    let n = frames.len();
    let n_chosen = n.min(N_FRAMES);
    (0..n_chosen).map(|k| frames[k * n / n_chosen]).collect()
}

/// Confidence of position and head above which a frame counts. Free choice.
const SURE: f64 = 0.75;

#[cfg(test)]
mod tests;
