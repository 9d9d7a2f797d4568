//! Marks that a still part of the animal leaves at the outlines of a sample.

use rayon::prelude::*;

use super::grid::Grid;
use super::outline::{self, Point};
use crate::analysis::palette::Palette;
use crate::analysis::scene::background::Background;
use crate::analysis::scene::samples::Samples;
use crate::analysis::scene::survey::Survey;
use crate::order;
use crate::raster::runs::Component;
use crate::raster::{Frame, Mask};

/// Least contrast that counts as an edge: levels of 255, and as a share of the animal's contrast. Free choice.
const MIN_EDGE: f32 = 8.0;
const EDGE_SHARE: f32 = 0.35;
/// An edge of the background is missing in the frame below this share of its contrast. Free choice.
const MISSING_SHARE: f32 = 0.5;

/// The marks of one sample. Cells are indices into a grid.
pub(super) struct Marks {
    /// Index of the sample.
    pub(super) sample: usize,
    /// Index of its background.
    pub(super) background: usize,
    /// Cells just inside of ghost outlines.
    pub(super) ghosts: Vec<usize>,
    /// Cells just outside of the animal's joints.
    pub(super) joints: Vec<usize>,
    /// Cells just outside of the animal's outline.
    pub(super) around: Vec<usize>,
    /// The cells that differ from the background.
    pub(super) differing: Mask,
    /// Those of the animal.
    pub(super) animal: Mask,
}

/// Colors that tell the animal from the scene, and the contrast of an edge.
pub(super) struct Colors {
    pub(super) animal: Palette,
    pub(super) scene: Palette,
    /// Least contrast across an edge, levels of 255.
    pub(super) edge: f32,
}

impl Colors {
    /// Returns whether a color is likelier in the animal than in the scene.
    fn is_animal(&self, color: [f32; 3]) -> bool {
        self.animal.log_ratio(&self.scene, color) > 0.0
    }

    /// Returns whether the background has an edge of the animal here, and the frame has none.
    fn is_ghost(&self, point: &Point) -> bool {
        let contrast = point.background_contrast();
        contrast > self.edge
            && point.frame_contrast() < MISSING_SHARE * contrast
            && self.is_animal(point.background[0])
    }

    /// Returns whether the animal goes on beyond its outline here.
    fn is_joint(&self, point: &Point) -> bool {
        point.frame_contrast() < self.edge
            && self.is_animal(point.frame[1])
            && self.is_animal(point.background[1])
    }
}

/// Returns the marks of the samples that show the animal, and the colors of animal and scene. `None` if no
/// sample does.
pub(super) fn find(
    samples: &Samples,
    backgrounds: &[Background],
    background_of: &[Option<usize>],
    survey: &Survey,
    grid: &Grid,
) -> Option<(Vec<Marks>, Colors)> {
    let found: Vec<(usize, &Component, usize)> = (0..samples.frames.len())
        .filter_map(|k| {
            Some((
                k,
                &survey.components[k][survey.animal[k]?],
                background_of[k]?,
            ))
        })
        .collect();
    let outlines: Vec<Vec<Point>> = found
        .par_iter()
        .map(|&(k, animal, at)| outline::points(animal, &samples.frames[k], &backgrounds[at], grid))
        .collect();
    let contrasts = outlines
        .iter()
        .flatten()
        .map(|point| f64::from(point.frame_contrast()));
    let scene = backgrounds[0].rgb.pixels.chunks_exact(3);
    let inside = found
        .iter()
        .flat_map(|(k, animal, _)| colors_inside(animal, &samples.frames[*k]));
    let colors = Colors {
        edge: (EDGE_SHARE * order::median(contrasts)? as f32).max(MIN_EDGE),
        animal: Palette::new(inside),
        scene: Palette::new(scene.map(color_of)),
    };
    let marks_of = |(&(k, animal, at), outline): (&(usize, &Component, usize), &Vec<Point>)| {
        let mut marks = Marks {
            sample: k,
            background: at,
            ghosts: Vec::new(),
            joints: outline
                .iter()
                .filter(|p| colors.is_joint(p))
                .map(|p| p.cells[1])
                .collect(),
            around: outline.iter().map(|point| point.cells[1]).collect(),
            differing: grid.mask(),
            animal: grid.mask(),
        };
        grid.cover(&mut marks.animal, animal);
        for component in &survey.components[k] {
            grid.cover(&mut marks.differing, component);
            if component.area >= survey.least_area_px() || component == animal {
                let points = outline::points(component, &samples.frames[k], &backgrounds[at], grid);
                let ghosts = points.iter().filter(|point| colors.is_ghost(point));
                marks.ghosts.extend(ghosts.map(|point| point.cells[0]));
            }
        }
        marks
    };
    let marks = found.par_iter().zip(&outlines).map(marks_of).collect();
    Some((marks, colors))
}

/// Returns the colors of a frame inside a component, without its outermost pixels.
fn colors_inside(component: &Component, frame: &Frame) -> Vec<[f32; 3]> {
    let mask = component.mask(component.rect);
    let inner = mask.eroded();
    let mask = if inner.area() > 0 { inner } else { mask };
    let rgb = frame.rgb(component.rect);
    let pixels = rgb.pixels.chunks_exact(3).zip(&mask.bits);
    pixels
        .filter(|(_, bit)| **bit == 1)
        .map(|(pixel, _)| color_of(pixel))
        .collect()
}

/// Returns an RGB pixel as a color, levels of 255.
pub(super) fn color_of(pixel: &[u8]) -> [f32; 3] {
    [0, 1, 2].map(|c| f32::from(pixel[c]))
}
