//! Points along the outline of a component, with the colors of frame and background on both sides.

use super::grid::Grid;
use crate::analysis::scene::background::Background;
use crate::raster::runs::Component;
use crate::raster::{Frame, RgbImage};

/// Distances of the two places from the outline, inside and outside, cells. The outline is blurred.
/// Free choice.
const AWAY: [f64; 2] = [-2.0, 2.5];

/// One point of an outline, and two places at it: inside and outside.
pub(super) struct Point {
    /// The cells of the two places.
    pub(super) cells: [usize; 2],
    /// Colors of the frame at the two places, levels of 255.
    pub(super) frame: [[f32; 3]; 2],
    /// Colors of the background at the two places, levels of 255.
    pub(super) background: [[f32; 3]; 2],
}

impl Point {
    /// Returns the contrast across the outline in the frame, levels of 255.
    pub(super) fn frame_contrast(&self) -> f32 {
        contrast(self.frame)
    }

    /// Returns the contrast across the outline in the background, levels of 255.
    pub(super) fn background_contrast(&self) -> f32 {
        contrast(self.background)
    }
}

/// Returns the largest channel difference of two colors.
pub(super) fn contrast([a, b]: [[f32; 3]; 2]) -> f32 {
    (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
}

/// Returns the points of a component's outline, about one per cell, without those at the border of the picture.
pub(super) fn points(
    component: &Component,
    frame: &Frame,
    background: &Background,
    grid: &Grid,
) -> Vec<Point> {
    let margin_px = (AWAY[1] * grid.cell_px).ceil() as u32 + 2;
    let rect = component
        .rect
        .inflated(margin_px, frame.width, frame.height);
    let mask = component.mask(rect);
    let rgb = frame.rgb(rect);
    let [w, h] = [mask.width() as i64, mask.height() as i64];
    let is_set = |x: i64, y: i64| {
        (0..w).contains(&x) && (0..h).contains(&y) && mask.bits[(y * w + x) as usize] == 1
    };
    let reach = (1.5 * grid.cell_px).ceil() as i64 + 1;
    // From the middle of the set pixels nearby to the middle of the clear ones.
    let outward = |x: i64, y: i64| {
        let around = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
        let clear = around.filter(|(dx, dy)| !is_set(x + dx, y + dy));
        let sum = clear.fold([0, 0], |sum, (dx, dy)| [sum[0] + dx, sum[1] + dy]);
        let [nx, ny] = sum.map(|v| v as f64);
        let length = libm::hypot(nx, ny);
        (length > 0.0).then(|| [nx / length, ny / length])
    };
    let is_outline = |&(x, y): &(i64, i64)| {
        is_set(x, y)
            && [(-1, 0), (1, 0), (0, -1), (0, 1)]
                .iter()
                .any(|(dx, dy)| !is_set(x + dx, y + dy))
    };
    let every = grid.cell_px.round() as i64;
    let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
    let (left, top) = (f64::from(rect.x), f64::from(rect.y));
    let (last_x, last_y) = (f64::from(frame.width) - 2.0, f64::from(frame.height) - 2.0);
    pixels
        .filter(|(x, y)| (x + y) % every == 0)
        .filter(is_outline)
        .filter_map(|(x, y)| {
            let [nx, ny] = outward(x, y)?;
            let places = AWAY.map(|away| {
                [(nx, left, x), (ny, top, y)]
                    .map(|(n, first, at)| first + at as f64 + away * grid.cell_px * n)
            });
            let is_inside =
                |[x, y]: &[f64; 2]| (1.0..=last_x).contains(x) && (1.0..=last_y).contains(y);
            places.iter().all(is_inside).then(|| Point {
                cells: places.map(|place| grid.cell(place)),
                frame: places.map(|[x, y]| mean_color(&rgb, [x - left, y - top])),
                background: places.map(|place| mean_color(&background.rgb, place)),
            })
        })
        .collect()
}

/// Returns the mean color of the 3 x 3 pixels around a place.
fn mean_color(picture: &RgbImage, [x, y]: [f64; 2]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
        let [x, y] = [(x, dx, picture.width), (y, dy, picture.height)]
            .map(|(v, d, n)| (v.round() as i64 + d).clamp(0, i64::from(n) - 1) as u32);
        for (sum, value) in sum.iter_mut().zip(picture.pixel(x, y)) {
            *sum += f32::from(value) / 9.0;
        }
    }
    sum
}
