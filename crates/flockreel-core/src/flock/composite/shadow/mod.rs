//! Shadows of the animals on the floor, drawn below all sprites.
//!
//! In top view a shadow is the animal's outline, displaced away from the light, blurred, and as dark as it
//! was filmed. The displacement does not depend on the heading. In side view shadows are ellipses on a
//! floor (`floor`), and only if they are requested. Where shadows overlap, the darkest one counts
//! (docs/explanation/algorithms.md, "Shadows").

mod floor; // shadows in side view

use self::floor::Floor;
use super::layer::Appearance;
use super::view::View;
use crate::flock::Flock;
use crate::geometry::Rect;
use crate::library::{self, Library};
use crate::raster::resample::{ONE, Resampled};

/// Shadow for top view if shadows are requested but none was measured: an animal on a floor below a lamp.
/// Free choice.
const DEFAULT_SHADOW: library::Shadow = library::Shadow {
    darkness: 0.3,
    offset_bl: [0.06, 0.06],
    blur_bl: 0.09,
};
/// Number of successive box filters that approximate a Gaussian.
const N_MEANS: usize = 3;

/// Darkness and shape of a flock's shadows.
pub(super) struct Shadows {
    darkness: f64,
    cast: Cast,
}

enum Cast {
    /// Top view: displacement and blur of the outlines, in pixels of the footage.
    Outline { offset_px: [f64; 2], blur_px: f64 },
    /// Side view: ellipses on a floor.
    Floor(Floor),
}

impl Shadows {
    /// Returns the shadows of a flock; `None` if it has none.
    pub(super) fn new(library: &Library, flock: &Flock) -> Option<Shadows> {
        let asked = flock.params.render.shadow;
        let is_side = library.poses.view == library::View::Side;
        let measured = library.shadow.filter(|_| !is_side);
        let darkness = asked.or(measured.map(|shadow| shadow.darkness))?;
        let shape = measured.unwrap_or(DEFAULT_SHADOW);
        let cast = if is_side {
            Cast::Floor(Floor::new(library, flock))
        } else {
            Cast::Outline {
                offset_px: shape.offset_bl.map(|bl| bl * flock.length_px),
                blur_px: shape.blur_bl * flock.length_px,
            }
        };
        (darkness > 0.0).then_some(Shadows { darkness, cast })
    }

    /// Returns whether the shadows are made of the outlines of drawn sprites.
    pub(super) fn are_outlines(&self) -> bool {
        matches!(self.cast, Cast::Outline { .. })
    }

    /// Adds the shadow of an individual to `shade`. `layer` is the drawn sprite.
    pub(super) fn add(
        &self,
        appearance: &Appearance,
        layer: &Resampled,
        view: &View,
        shade: &mut Shade,
    ) {
        match &self.cast {
            Cast::Outline { offset_px, blur_px } => {
                let scale = appearance.individual.scale[appearance.frame_idx] * view.scale;
                let offset = offset_px.map(|px| (px * scale).round() as i64);
                shade.add_outline(layer, offset, blur_px * scale, self.darkness);
            }
            Cast::Floor(floor) => floor.shadow(appearance, view).draw(self.darkness, shade),
        }
    }
}

/// Shadows of one frame.
#[derive(Default)]
pub(super) struct Shade {
    size_px: [u32; 2],
    /// Share of the light that shadows remove from each pixel, in 16384ths, by rows.
    alpha: Vec<u16>,
    /// Box that contains all shadows.
    rect: Rect,
    /// Outline that is being blurred.
    outline: Vec<u32>,
    line: Vec<u32>,
}

impl Shade {
    /// Removes all shadows and sets the size of the picture.
    pub(super) fn begin(&mut self, size_px: [u32; 2]) {
        self.size_px = size_px;
        self.alpha.clear();
        self.alpha
            .resize(size_px[0] as usize * size_px[1] as usize, 0);
        self.rect = Rect::default();
    }

    /// Returns the share of the light that shadows remove from each pixel, in 16384ths, by rows.
    pub(super) fn alpha(&self) -> &[u16] {
        &self.alpha
    }

    /// Makes a pixel at least as dark as `alpha`.
    fn darken(&mut self, x: u32, y: u32, alpha: u16) {
        let before = &mut self.alpha[(y * self.size_px[0] + x) as usize];
        *before = (*before).max(alpha);
    }

    /// Extends the box of the shadows by `rect`.
    fn reach(&mut self, rect: Rect) {
        self.rect = if self.rect.is_empty() {
            rect
        } else {
            self.rect.union(&rect)
        };
    }

    /// Adds the outline of a layer as a shadow: displaced by (dx, dy) pixels, blurred with standard
    /// deviation `blur_px`, its alpha multiplied by `darkness`.
    fn add_outline(&mut self, layer: &Resampled, [dx, dy]: [i64; 2], blur_px: f64, darkness: f64) {
        let from = layer.rect;
        if from.is_empty() {
            return;
        }
        let radius = ((libm::sqrt(4.0 * blur_px * blur_px + 1.0) - 1.0) / 2.0).round() as usize;
        let room = N_MEANS * radius;
        let [width, height] = [from.w, from.h].map(|side| side as usize + 2 * room);
        self.outline.clear();
        self.outline.resize(width * height, 0);
        for ([x, y], pixels) in layer.shown() {
            let first = ((y - from.y) as usize + room) * width + (x - from.x) as usize + room;
            for (outline, pixel) in self.outline[first..].iter_mut().zip(pixels) {
                *outline = pixel[3] as u32;
            }
        }
        for _ in 0..N_MEANS {
            self.blur([width, 1], [height, width], radius);
            self.blur([height, width], [width, 1], radius);
        }
        let [left, top] =
            [(from.x, dx), (from.y, dy)].map(|(at, by)| i64::from(at) + by - room as i64);
        let rect = Rect::clipped(
            left,
            top,
            left + width as i64,
            top + height as i64,
            self.size_px[0],
            self.size_px[1],
        );
        self.reach(rect);
        for y in rect.y..rect.bottom() {
            let row = (i64::from(y) - top) as usize * width;
            for x in rect.x..rect.right() {
                let alpha = self.outline[row + (i64::from(x) - left) as usize];
                self.darken(x, y, (darkness * f64::from(alpha)) as u16);
            }
        }
    }

    /// Applies a box filter of 2 `radius` + 1 pixels to each line of the outline. A line has `n` pixels,
    /// `step` apart; the `n_lines` lines begin `apart` from each other. Pixels beyond the ends of a line
    /// are 0.
    fn blur(&mut self, [n, step]: [usize; 2], [n_lines, apart]: [usize; 2], radius: usize) {
        let span = 2 * radius as u32 + 1;
        for first in (0..n_lines).map(|line| line * apart) {
            self.line.clear();
            self.line
                .extend((0..n).map(|k| self.outline[first + k * step]));
            let mut sum: u32 = self.line.iter().take(radius).sum();
            for k in 0..n {
                sum += self.line.get(k + radius).copied().unwrap_or(0);
                self.outline[first + k * step] = sum / span;
                sum -= k.checked_sub(radius).map_or(0, |gone| self.line[gone]);
            }
        }
    }

    /// Writes the shadows to a layer: black pixels with the alpha of the shadows.
    pub(super) fn layer(&self, layer: &mut Resampled) {
        let rect = self.rect;
        layer.begin(rect);
        let mut pixels = layer.pixels.iter_mut();
        for y in rect.y..rect.bottom() {
            let first = (y * self.size_px[0] + rect.x) as usize;
            let row = &self.alpha[first..first + rect.w as usize];
            for (alpha, pixel) in row.iter().zip(&mut pixels) {
                *pixel = [0, 0, 0, (*alpha as i16).min(ONE)];
            }
            let mut from = rect.x;
            for run in row.chunk_by(|a, b| (*a > 0) == (*b > 0)) {
                let to = from + run.len() as u32;
                if run[0] > 0 {
                    layer.runs.push([y, from, to]);
                }
                from = to;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(rect: Rect) -> Resampled {
        let mut layer = Resampled::default();
        layer.begin(rect);
        layer.pixels.fill([0, 0, 0, ONE]);
        layer.show_whole();
        layer
    }

    #[test]
    fn outline_is_moved_blurred_and_as_dark_as_requested() {
        let rect = Rect {
            x: 20,
            y: 15,
            w: 21,
            h: 21,
        };
        let mut shade = Shade::default();
        shade.begin([80, 60]);
        // A shadow added twice is no darker.
        for _ in 0..2 {
            shade.add_outline(&square(rect), [6, -4], 2.0, 0.5);
        }
        let share = |x: usize, y: usize| f64::from(shade.alpha()[y * 80 + x]) / f64::from(ONE);
        assert!((share(36, 21) - 0.5).abs() < 0.01, "{}", share(36, 21));
        // The edge has half the darkness. Far outside there is no shadow.
        let edge = (share(25, 21) + share(26, 21)) / 2.0;
        assert!((edge - 0.25).abs() < 0.02, "{edge}");
        assert!(share(23, 21) > 0.0 && share(23, 21) < share(26, 21));
        assert_eq!(share(17, 21), 0.0);
        let mut layer = Resampled::default();
        shade.layer(&mut layer);
        let alpha = layer.alpha();
        let total = |alpha: &[u16]| alpha.iter().map(|&a| u64::from(a)).sum::<u64>();
        assert_eq!(total(&alpha), total(shade.alpha()));
    }

    #[test]
    fn shadow_outside_of_the_picture_is_clipped() {
        let mut shade = Shade::default();
        shade.begin([30, 30]);
        shade.add_outline(
            &square(Rect {
                x: 0,
                y: 0,
                w: 8,
                h: 8,
            }),
            [-5, -5],
            1.0,
            1.0,
        );
        assert!(shade.alpha()[0] > 0 && shade.alpha()[29] == 0);
        shade.begin([30, 30]);
        assert!(shade.alpha().iter().all(|&alpha| alpha == 0));
    }
}
