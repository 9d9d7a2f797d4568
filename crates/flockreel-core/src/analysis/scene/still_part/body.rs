//! Cuts a body out of the background around marks.

use super::cut;
use super::marks::{Colors, color_of};
use super::outline::contrast;
use crate::analysis::palette::Palette;
use crate::geometry::Rect;
use crate::raster::runs::{self, Component};
use crate::raster::{Mask, RgbImage};

/// Number of cuts; each learns the colors from the one before. Free choice.
const N_CUTS: usize = 3;
/// Largest share of the outline at the border of the window or the picture, 0..=1. Free choice.
const MAX_BORDER_SHARE: f64 = 0.15;
/// Least share of the outline that is an edge of the background, 0..=1. Free choice.
const MIN_EDGE_SHARE: f64 = 0.5;
/// Distance across the outline over which an edge is looked for, cells. The outline is blurred. Free choice.
const EDGE_REACH: i64 = 3;
/// Cost of a cell that must, or must not, be part of the body, in units of the log-likelihood.
const CERTAIN: f32 = 20.0;
/// Largest cost of a cell by its color. Free choice: one rare color does not decide.
const MAX_COLOR_COST: f32 = 8.0;

/// Returns the body around a cluster of marks, or `None` if its outline is not one of the background. `picture`
/// and masks have one pixel per cell.
pub(super) fn cut_out(
    picture: &RgbImage,
    cluster: &Component,
    seeds: &Mask,
    colors: &Colors,
) -> Option<Mask> {
    let diagonal = libm::hypot(f64::from(cluster.rect.w), f64::from(cluster.rect.h));
    let window = cluster
        .rect
        .inflated(diagonal.ceil() as u32, picture.width, picture.height);
    let view = cropped(picture, window);
    let color = |at: usize| color_of(&view.pixels[3 * at..3 * at + 3]);
    let mut own_seeds = Mask::new(window);
    own_seeds.add(seeds);
    for (seed, near) in own_seeds.bits.iter_mut().zip(cluster.mask(window).bits) {
        *seed &= near;
    }
    let on_border = |at: usize| {
        let (x, y) = (at % window.w as usize, at / window.w as usize);
        x == 0 || y == 0 || x + 1 == window.w as usize || y + 1 == window.h as usize
    };
    let all = || 0..own_seeds.bits.len();
    let mut learned: Option<[Palette; 2]> = None;
    let mut body = Mask::new(window);
    for _ in 0..N_CUTS {
        let [inside, outside] = match &learned {
            Some([inside, outside]) => [inside, outside],
            None => [&colors.animal, &colors.scene],
        };
        let cost = |at: usize| match own_seeds.bits[at] {
            1 => -CERTAIN,
            _ if on_border(at) => CERTAIN,
            _ => -inside
                .log_ratio(outside, color(at))
                .clamp(-MAX_COLOR_COST, MAX_COLOR_COST),
        };
        let part = cut::cheapest_part(&view, &all().map(cost).collect::<Vec<f32>>());
        body = with_seeds(&part, &own_seeds);
        learned = Some(
            [1, 0].map(|bit| Palette::new(all().filter(|&at| body.bits[at] == bit).map(color))),
        );
    }
    body.fill_holes();
    let inner = body.eroded();
    let outline: Vec<usize> = all()
        .filter(|&at| body.bits[at] == 1 && inner.bits[at] == 0)
        .collect();
    let share = |holds: &dyn Fn(usize) -> bool| {
        outline.iter().filter(|&&at| holds(at)).count() as f64 / outline.len().max(1) as f64
    };
    let is_edge = |at: usize| {
        let outside = cells_within(at, window).filter(|&other| body.bits[other] == 0);
        outside
            .map(|other| contrast([color(at), color(other)]))
            .fold(0.0, f32::max)
            > colors.edge
    };
    (share(&on_border) < MAX_BORDER_SHARE && share(&is_edge) > MIN_EDGE_SHARE).then_some(body)
}

/// Returns the connected components of a part that hold seeds.
fn with_seeds(part: &[bool], seeds: &Mask) -> Mask {
    let window = seeds.rect;
    let bits = part.iter().map(|&part| u8::from(part)).collect();
    let mut body = Mask::new(window);
    for component in runs::components(&Mask { rect: window, bits }) {
        let mask = component.mask(window);
        if mask
            .bits
            .iter()
            .zip(&seeds.bits)
            .any(|(bit, seed)| bit & seed == 1)
        {
            body.add(&mask);
        }
    }
    body
}

/// Returns the cells of a window within `EDGE_REACH` columns and rows of a cell.
fn cells_within(at: usize, window: Rect) -> impl Iterator<Item = usize> {
    let [w, h] = [i64::from(window.w), i64::from(window.h)];
    let (x, y) = (at as i64 % w, at as i64 / w);
    let near = |at: i64, n: i64| (at - EDGE_REACH).max(0)..(at + EDGE_REACH + 1).min(n);
    near(y, h).flat_map(move |y| near(x, w).map(move |x| (y * w + x) as usize))
}

fn cropped(picture: &RgbImage, rect: Rect) -> RgbImage {
    let mut view = RgbImage::new(rect.w, rect.h);
    for (y, row) in (rect.y..).zip(view.pixels.chunks_exact_mut(3 * rect.w as usize)) {
        let first = 3 * (y * picture.width + rect.x) as usize;
        row.copy_from_slice(&picture.pixels[first..first + row.len()]);
    }
    view
}
