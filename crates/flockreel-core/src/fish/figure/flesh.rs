//! Mesh of the figure. From above it is a flat sheet on the spine. From the side a body with elliptical
//! sections stands in the sheet, which then shows tail and fins.

use std::f64::consts::PI;

use super::Figure;
use crate::fish::mesh::{Layer, Material, Mesh, MeshBuilder, SurfacePoint};
use crate::fish::spine::SPINE_DOWN_BL;
use crate::library::View;

/// Points of the sheet along and across the body. Free choice.
const SHEET: [usize; 2] = [64, 9];
/// Sections of the body, and points around half of a section. Free choice.
const BODY: [usize; 2] = [48, 13];
/// Width of the body of a fish as a share of its height. Free choice; goldfish have 0.55 to 0.7.
const WIDTH: f64 = 0.6;
/// Range along the body in which the root of the tail is looked for: the lowest section. Free choice.
const TAIL_ROOT: [f64; 2] = [0.35, 0.95];

impl Figure {
    /// Returns the mesh of the animal at the given length, as high as filmed or of the given height.
    pub fn mesh(&self, length_m: f64, height_m: Option<f64>) -> Mesh {
        let mut builder = MeshBuilder::default();
        if self.view == View::Side {
            self.add_body(&mut builder);
        }
        builder.add_grid(Layer::Fins, SHEET[0], SHEET[1], |i, j| {
            let share = [(i, SHEET[0]), (j, SHEET[1])].map(|(k, n)| k as f64 / (n - 1) as f64);
            let at = [0, 1].map(|c| {
                let side_bl = self.grid.size[c] as f64 / self.grid.texels_per_bl;
                self.grid.first[c] + share[c] * side_bl
            });
            match self.view {
                View::Side => self.point([at[0], at[1], 0.0], 0),
                View::Top => self.point([at[0], 0.0, at[1]], 0),
            }
        });
        let filmed_m = self.sheet.height() * length_m;
        let stretch = height_m.map_or(1.0, |height_m| height_m / filmed_m);
        let mut mesh = builder.scaled(length_m, stretch);
        mesh.picture = Some(self.picture.clone());
        mesh
    }

    /// Adds the right half and the left half of the body, each with its flank of the picture.
    fn add_body(&self, builder: &mut MeshBuilder) {
        let sections = self.sections();
        for (flank, side) in [(0, -1.0), (1, 1.0)] {
            builder.add_grid(Layer::Body, BODY[0], BODY[1], |i, j| {
                let [s, top, bottom, half_width] = sections[i];
                // The right half runs from the back to the belly, the left half back up.
                let turn = if side < 0.0 { j } else { BODY[1] - 1 - j };
                let angle = PI * turn as f64 / (BODY[1] - 1) as f64;
                let middle = 0.5 * (top + bottom);
                let t = middle - 0.5 * (bottom - top) * libm::cos(angle);
                self.point([s, t, side * half_width * libm::sin(angle)], flank)
            });
        }
    }

    /// Returns the sections of the body: position, upper and lower edge, half width; in body lengths.
    fn sections(&self) -> Vec<[f64; 4]> {
        let station = |k: usize, n: usize, end: f64| end * k as f64 / (n - 1) as f64;
        let height = |s: f64| self.edges(s).map_or(0.0, |[top, bottom]| bottom - top);
        let [from, to] = TAIL_ROOT;
        let places = (0..BODY[0]).map(|k| from + station(k, BODY[0], to - from));
        let root = places.min_by(|a, b| height(*a).total_cmp(&height(*b)));
        let end = root.unwrap_or(to);
        let section = |k: usize| {
            let s = station(k, BODY[0], end);
            let [top, bottom] = self.edges(s).unwrap_or([0.0; 2]);
            let thin = (1.0 - (s / end) * (s / end)).max(0.0).sqrt();
            [s, top, bottom, 0.5 * WIDTH * (bottom - top) * thin]
        };
        (0..BODY[0]).map(section).collect()
    }

    /// Returns the upper and lower edge of the largest part of a section that most frames cover.
    fn edges(&self, s: f64) -> Option<[f64; 2]> {
        let [_, rows] = self.grid.size;
        let at = |row: usize| self.grid.at(0, row)[1];
        let mut longest: Option<[f64; 2]> = None;
        let mut start = None;
        for row in 0..=rows {
            let is_inside = row < rows && self.sheet.alpha_at([s, at(row)]) >= 0.5;
            match (is_inside, start) {
                (true, None) => start = Some(at(row)),
                (false, Some(from)) => {
                    let run = [from, at(row - 1)];
                    if longest.is_none_or(|best| run[1] - run[0] > best[1] - best[0]) {
                        longest = Some(run);
                    }
                    start = None;
                }
                _ => {}
            }
        }
        longest
    }

    /// Returns a point of the surface with its place in the picture. `flank` is 0 for the right one.
    fn point(&self, [s, down, left]: [f64; 3], flank: usize) -> SurfacePoint {
        let across = match self.view {
            View::Side => down,
            View::Top => left,
        };
        let [u, v] = self.grid.share([s, across]);
        let n_flanks = self.picture.height as f64 / self.grid.size[1] as f64;
        SurfacePoint {
            // The spine lies in the middle of the figure.
            at: [s, down - SPINE_DOWN_BL, left],
            material: Material {
                color: [1.0; 4],
                shine: 0.0,
                grain: [u as f32, ((v + flank as f64) / n_flanks) as f32],
                grain_depth: 0.0,
            },
        }
    }
}
