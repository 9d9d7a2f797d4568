//! Texels of the figure, and their means and medians over frames.

use rayon::prelude::*;

use super::chart::Chart;
use super::pixels::Pixels;
use crate::raster::fill::{sample_texture, smooth};
use crate::raster::{RgbImage, RgbaImage};

/// Box in body coordinates, divided into square texels.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    /// Body coordinates of the corner of the first texel.
    pub(super) first: [f64; 2],
    /// Number of texels along and across the body.
    pub(super) size: [usize; 2],
    /// Texels per body length.
    pub(super) texels_per_bl: f64,
}

/// Seed of the texture that continues the animal's. Free choice.
const SEED: u64 = 62;
/// Number of frames whose pixels make the picture. Free choice; more blur it.
const N_SHOWN: usize = 7;
/// Largest number of texels. Free choice; a goldfish with long fins has 120,000 at 320 a length.
const MOST_TEXELS: f64 = 200_000.0;
/// Alpha of a frame's texel from which its color counts, 0..=255: the animal covers most of it.
const COVERED: f32 = 192.0;
/// Alpha from which a texel without a color gets texture. Free choice: half of the frames cover it.
const SEEN: f32 = 0.5;

impl Grid {
    /// Returns the grid of a range along and a range across the body.
    pub(super) fn wide(s: [f64; 2], t: [f64; 2], texels_per_bl: f64) -> Grid {
        let n = |[lo, hi]: [f64; 2]| ((hi - lo) * texels_per_bl).ceil().max(1.0) as usize;
        Grid {
            first: [s[0], t[0]],
            size: [n(s), n(t)],
            texels_per_bl,
        }
    }

    /// Changes to coordinates with the origin at `origin` and a unit `scale` times as long.
    pub(super) fn rebase(&mut self, origin: [f64; 2], scale: f64, texels_per_bl: f64) {
        let end = [0, 1].map(|c| self.first[c] + self.size[c] as f64 / self.texels_per_bl);
        let range = |c: usize| [self.first[c], end[c]].map(|v| (v - origin[c]) / scale);
        let (s, t) = (range(0), range(1));
        let most = (MOST_TEXELS / ((s[1] - s[0]) * (t[1] - t[0]))).sqrt();
        *self = Grid::wide(s, t, texels_per_bl.min(most));
    }

    /// Returns the body coordinates of the middle of a texel.
    pub(super) fn at(&self, column: usize, row: usize) -> [f64; 2] {
        let middle = |c: usize, k: usize| self.first[c] + (k as f64 + 0.5) / self.texels_per_bl;
        [middle(0, column), middle(1, row)]
    }

    /// Returns where body coordinates lie in the box, 0..=1 along and across.
    pub(super) fn share(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| (at[c] - self.first[c]) * self.texels_per_bl / self.size[c] as f64)
    }

    /// Returns every texel of one frame, straight-alpha RGBA, 0..=255.
    fn gather(&self, chart: &Chart, pixels: &Pixels) -> Vec<[f32; 4]> {
        let [w, h] = self.size;
        let texel = |k: usize| {
            let [s, t] = self.at(k % w, k / w);
            pixels.sample(chart.image(s, t))
        };
        (0..w * h).map(texel).collect()
    }

    /// Returns the picture: the median color of the frames whose outline is the most usual, each made equally
    /// bright, and the alpha of the sheet. Texture fills what none of them shows.
    pub(super) fn picture(&self, sheet: &Sheet, charts: &[Chart], pixels: &[Pixels]) -> RgbaImage {
        let mut brightness: Vec<f32> = pixels.iter().map(Pixels::brightness).collect();
        let each = brightness.clone();
        brightness.sort_by(f32::total_cmp);
        let usual = brightness.get(each.len() / 2).copied().unwrap_or(1.0);
        let layers: Vec<Vec<[u8; 4]>> = (charts.par_iter().zip(pixels))
            .zip(&each)
            .map(|((chart, pixels), bright)| {
                let gain = usual / bright.max(1.0);
                let lit = |[r, g, b, a]: [f32; 4]| {
                    [r * gain, g * gain, b * gain, a].map(|v| (v + 0.5).min(255.0) as u8)
                };
                self.gather(chart, pixels).into_iter().map(lit).collect()
            })
            .collect();
        let layers = most_usual(layers, sheet);
        let [w, h] = self.size;
        let colors: Vec<Option<[u8; 3]>> = (0..w * h)
            .into_par_iter()
            .map(|k| median_color(layers.iter().map(|layer| layer[k])))
            .collect();
        let mut image = RgbImage::new(w as u32, h as u32);
        for (pixel, color) in image.pixels.chunks_exact_mut(3).zip(&colors) {
            pixel.copy_from_slice(&color.unwrap_or_default());
        }
        // Beyond the animal even colors suffice: they only keep its edge from fading into black.
        let unknown: Vec<bool> = colors.iter().map(Option::is_none).collect();
        smooth(&mut image, &unknown);
        let is_seen = |(unknown, alpha): (&bool, &f32)| *unknown && *alpha >= SEEN;
        let unseen: Vec<bool> = unknown.iter().zip(&sheet.alpha).map(is_seen).collect();
        sample_texture(&mut image, &unseen, SEED);
        let texels = image.pixels.chunks_exact(3).zip(&sheet.alpha);
        RgbaImage {
            width: w as u32,
            height: h as u32,
            pixels: texels
                .flat_map(|(rgb, alpha)| [rgb[0], rgb[1], rgb[2], (alpha * 255.0).round() as u8])
                .collect(),
        }
    }
}

/// Returns the layers whose alpha overlaps that of the sheet most: in all frames together, eyes and scales would
/// blur.
fn most_usual(layers: Vec<Vec<[u8; 4]>>, sheet: &Sheet) -> Vec<Vec<[u8; 4]>> {
    let overlap = |layer: &Vec<[u8; 4]>| {
        let (mut both, mut either) = (0.0, 1e-6);
        for (texel, &usual) in layer.iter().zip(&sheet.alpha) {
            let alpha = f32::from(texel[3]) / 255.0;
            both += alpha.min(usual);
            either += alpha.max(usual);
        }
        both / either
    };
    let mut ranked: Vec<(f32, Vec<[u8; 4]>)> = layers
        .into_iter()
        .map(|layer| (overlap(&layer), layer))
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(N_SHOWN);
    ranked.into_iter().map(|(_, layer)| layer).collect()
}

fn median_color(samples: impl Iterator<Item = [u8; 4]>) -> Option<[u8; 3]> {
    let covered: Vec<[u8; 4]> = samples.filter(|s| f32::from(s[3]) >= COVERED).collect();
    if covered.is_empty() {
        return None;
    }
    Some([0, 1, 2].map(|c| {
        let mut values: Vec<u8> = covered.iter().map(|s| s[c]).collect();
        let middle = values.len() / 2;
        *values.select_nth_unstable(middle).1
    }))
}

/// Alpha of the figure.
pub(super) struct Sheet {
    pub(super) grid: Grid,
    /// Alpha of each texel, row by row, 0..=1.
    pub(super) alpha: Vec<f32>,
}

impl Sheet {
    /// Returns the mean alpha over frames.
    pub(super) fn mean(grid: Grid, charts: &[Chart], pixels: &[Pixels]) -> Sheet {
        let layers: Vec<Vec<f32>> = (charts.par_iter().zip(pixels))
            .map(|(chart, pixels)| {
                let texels = grid.gather(chart, pixels).into_iter();
                texels.map(|rgba| rgba[3] / 255.0).collect()
            })
            .collect();
        let n = layers.len().max(1) as f32;
        let mean = |k: usize| layers.iter().map(|layer| layer[k]).sum::<f32>() / n;
        let n_texels = grid.size[0] * grid.size[1];
        Sheet {
            grid,
            alpha: (0..n_texels).map(mean).collect(),
        }
    }

    /// Returns the alpha at body coordinates, of the nearest texel; 0 outside.
    pub(super) fn alpha_at(&self, [s, t]: [f64; 2]) -> f32 {
        let Grid {
            first,
            size,
            texels_per_bl,
        } = self.grid;
        let (x, y) = (
            (s - first[0]) * texels_per_bl,
            (t - first[1]) * texels_per_bl,
        );
        if x < 0.0 || y < 0.0 || x >= size[0] as f64 || y >= size[1] as f64 {
            return 0.0;
        }
        self.alpha[y as usize * size[0] + x as usize]
    }

    /// Returns the centroid in body coordinates.
    pub(super) fn centroid(&self) -> [f64; 2] {
        let (mut sum, mut total) = ([0.0; 2], 1e-9);
        for (k, &alpha) in self.alpha.iter().enumerate() {
            let at = self.grid.at(k % self.grid.size[0], k / self.grid.size[0]);
            sum = [0, 1].map(|c| sum[c] + f64::from(alpha) * at[c]);
            total += f64::from(alpha);
        }
        sum.map(|v| v / total)
    }

    /// Returns the first and the last position along the body that most frames cover.
    pub(super) fn extent_s(&self) -> [f64; 2] {
        let [[first, last], _] = self.extent(0.5);
        [first, last]
    }

    /// Returns the extent across the body of the texels that most frames cover, in body lengths.
    pub(super) fn height(&self) -> f64 {
        let [_, [first, last]] = self.extent(0.5);
        last - first
    }

    /// Returns the box of the texels that some frames cover, with a margin.
    pub(super) fn visible(&self) -> Grid {
        let margin = 2.5 / self.grid.texels_per_bl;
        let [s, t] = self.extent(0.04).map(|[lo, hi]| [lo - margin, hi + margin]);
        Grid::wide(s, t, self.grid.texels_per_bl)
    }

    /// Returns the range along and across the body of the texels with at least this alpha.
    fn extent(&self, least: f32) -> [[f64; 2]; 2] {
        let mut range = [[f64::MAX, f64::MIN]; 2];
        let w = self.grid.size[0];
        for (k, _) in self.alpha.iter().enumerate().filter(|(_, a)| **a >= least) {
            let at = self.grid.at(k % w, k / w);
            for c in 0..2 {
                range[c] = [range[c][0].min(at[c]), range[c][1].max(at[c])];
            }
        }
        if range[0][0] > range[0][1] {
            return [[0.0, 1.0], [-0.5, 0.5]];
        }
        range
    }
}
