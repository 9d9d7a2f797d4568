//! Evidence from outside the subject that a sighting is the whole animal and nothing else.
//!
//! The misfit compares a sighting with a look that was learned from the same film, so a subject learned wrongly
//! fits itself. The test here uses no such knowledge, only frame and background on both sides of the outline.
//! See docs/explanation/algorithms.md, "Tracking".

use crate::analysis::scene::background::Background;
use crate::analysis::scene::light::Light;
use crate::analysis::silhouette;
use crate::order;
use crate::raster::{Frame, Mask, RgbImage};

/// Distance from the outline at which colors are taken, pixels: beyond the blur of the outline itself.
const AWAY_PX: f64 = 2.5;
/// Margin around the silhouette that holds all these colors, pixels.
const MARGIN_PX: u32 = 5;
/// Greatest number of points of an outline. Free choice: it bounds the time.
const MAX_POINTS: usize = 256;
/// Least difference across an edge, as a share of the animal's contrast. Free choice.
const EDGE_SHARE: f64 = 0.35;
/// Least difference across an edge, levels of 255. Free choice.
const MIN_EDGE: f64 = 8.0;

/// Returns the share of the outline of a silhouette that lies on edges of the frame which the background does not
/// have, 0..=1; `None` where no point has two sides in the picture, and where a mask is given.
pub(super) fn edge_share(
    frame: &Frame,
    background: &Background,
    light: &Light,
    solid: &Mask,
) -> Option<f64> {
    if frame.mask.is_some() {
        return None;
    }
    let rect = solid.rect.inflated(MARGIN_PX, frame.width, frame.height);
    let seen = silhouette::difference(frame, background, light, rect).rgb;
    let mut mask = Mask::new(rect);
    mask.add(solid);
    let sides = Sides {
        mask: &mask,
        seen: &seen,
        background,
    };
    let inner = mask.eroded();
    let outline: Vec<usize> = (0..mask.bits.len())
        .filter(|&k| mask.bits[k] == 1 && inner.bits[k] == 0)
        .collect();
    let step = outline.len().div_ceil(MAX_POINTS).max(1);
    let points: Vec<Point> = (outline.iter().step_by(step))
        .filter_map(|&k| sides.at(k))
        .collect();
    let contrast = order::median(points.iter().map(|point| point.contrast))?;
    let least = (EDGE_SHARE * contrast).max(MIN_EDGE);
    let is_edge = |p: &&Point| p.of_frame > least && 2.0 * p.of_background < p.of_frame;
    Some(points.iter().filter(is_edge).count() as f64 / points.len() as f64)
}

/// Color differences at a point of the outline, levels of 255.
struct Point {
    /// Across the outline in the frame.
    of_frame: f64,
    /// Across the outline in the background.
    of_background: f64,
    /// Between frame and background inside.
    contrast: f64,
}

struct Sides<'a> {
    mask: &'a Mask,
    seen: &'a RgbImage,
    background: &'a Background,
}

impl Sides<'_> {
    /// Returns the differences at a pixel of the outline; `None` where a side has no place in the box.
    fn at(&self, k: usize) -> Option<Point> {
        let width = self.mask.width();
        let at = [(k % width) as f64, (k / width) as f64];
        let inward = self.inward(at)?;
        let place = |px: f64| self.index([0, 1].map(|axis| at[axis] + px * inward[axis]));
        let inside = [AWAY_PX, 1.0, 0.0]
            .into_iter()
            .filter_map(place)
            .find(|&k| self.mask.bits[k] == 1)?;
        let outside = place(-AWAY_PX).filter(|&k| self.mask.bits[k] == 0)?;
        let [seen_in, seen_out] = [inside, outside].map(|k| self.color(k, false));
        let [back_in, back_out] = [inside, outside].map(|k| self.color(k, true));
        Some(Point {
            of_frame: apart(seen_in, seen_out),
            of_background: apart(back_in, back_out),
            contrast: apart(seen_in, back_in),
        })
    }

    /// Returns the unit vector toward the mean of the set pixels within 2 pixels.
    fn inward(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        let mut sum = [0.0; 2];
        for (dx, dy) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))) {
            let [dx, dy] = [dx, dy].map(f64::from);
            let is_set = self.index([at[0] + dx, at[1] + dy]);
            if is_set.is_some_and(|k| self.mask.bits[k] == 1) {
                sum = [sum[0] + dx, sum[1] + dy];
            }
        }
        let length = libm::hypot(sum[0], sum[1]);
        (length > 0.0).then(|| sum.map(|v| v / length))
    }

    /// Returns the index of the pixel at a place; `None` outside the box and on its border.
    fn index(&self, place: [f64; 2]) -> Option<usize> {
        let [x, y] = place.map(|v| v.round());
        let (w, h) = (self.mask.width() as f64, self.mask.height() as f64);
        let is_inside = x >= 1.0 && y >= 1.0 && x < w - 1.0 && y < h - 1.0;
        is_inside.then(|| y as usize * self.mask.width() + x as usize)
    }

    /// Returns the mean color in the 3 x 3 neighborhood of a pixel inside the box's border.
    fn color(&self, k: usize, of_background: bool) -> [f64; 3] {
        let width = self.mask.width();
        let mut sum = [0.0; 3];
        for at in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let k = k + at.0 * width + at.1 - width - 1;
            let color = if of_background {
                let px = self.background.px_in(self.mask.rect, k);
                &self.background.rgb.pixels[3 * px..3 * px + 3]
            } else {
                &self.seen.pixels[3 * k..3 * k + 3]
            };
            (0..3).for_each(|c| sum[c] += f64::from(color[c]) / 9.0);
        }
        sum
    }
}

/// Returns the largest channel difference of two colors.
fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).fold(0.0, |most, c| f64::max(most, (a[c] - b[c]).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rect;
    use crate::random;
    use crate::raster::{ColorSpec, GivenMask};

    const SIZE: u32 = 80;

    /// Returns noise of low contrast with a dark disc in the middle, which covers the share `cover`, 0..=1.
    fn scene(cover: f64) -> Frame {
        let mut picture = RgbImage::new(SIZE, SIZE);
        for (y, x) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (y, x))) {
            let floor = 150.0 + 20.0 * random::uniform(3, &[u64::from(x), u64::from(y)]);
            let covered = cover * f64::from(u8::from(in_disc(x, y)));
            let level = covered * 40.0 + (1.0 - covered) * floor;
            picture.set_pixel(x, y, [level as u8; 3]);
        }
        let mut frame = Frame::new(SIZE, SIZE, ColorSpec::default());
        frame.draw_rgb(&picture, Rect::of_size(SIZE, SIZE));
        frame
    }

    fn in_disc(x: u32, y: u32) -> bool {
        let [dx, dy] = [x, y].map(|at| f64::from(at) - 40.0);
        libm::hypot(dx, dy) < 20.0
    }

    fn share_of(frame: &Frame, background: &Frame, right: u32) -> f64 {
        examined(frame, background, right).expect("it has an outline")
    }

    /// Returns the edge share of the pixels of the disc left of `right`.
    fn examined(frame: &Frame, background: &Frame, right: u32) -> Option<f64> {
        let mut mask = Mask::new(Rect::of_size(SIZE, SIZE));
        for (at, bit) in (0..).zip(&mut mask.bits) {
            let (x, y) = (at % SIZE, at / SIZE);
            *bit = u8::from(in_disc(x, y) && x < right);
        }
        let n_px = (SIZE * SIZE) as usize;
        let background = Background::new(background.clone(), vec![1.5; n_px], 18);
        edge_share(frame, &background, &Light::NEUTRAL, &mask)
    }

    #[test]
    fn outline_of_a_part_has_no_edge_where_it_was_cut() {
        let (frame, empty) = (scene(1.0), scene(0.0));
        assert!(share_of(&frame, &empty, SIZE) > 0.95);
        assert!(share_of(&frame, &empty, 40) < 0.7);
    }

    #[test]
    fn given_mask_is_not_examined() {
        let mask = Some(GivenMask::default());
        let frame = Frame { mask, ..scene(1.0) };
        assert_eq!(examined(&frame, &scene(0.0), SIZE), None);
    }

    #[test]
    fn edges_that_only_the_background_has_do_not_count() {
        assert!(share_of(&scene(0.0), &scene(1.0), SIZE) < 0.05);
    }
}
