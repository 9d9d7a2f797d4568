//! Ghosts: places at which the background shows an object, such as the resting animal, and the frame does not
//! (docs/explanation/algorithms.md, "Background").

use super::background::Background;
use crate::analysis::subject::Color;
use crate::geometry::Rect;
use crate::raster::runs::Component;
use crate::raster::{Frame, Mask};

/// Gap between a component and its surroundings, pixels, because its rim is blurred. Free choice.
const MARGIN_PX: u32 = 2;
/// Least width of the surroundings, pixels. Large components use a quarter of the root of their area. Free
/// choice.
const RING_PX: u32 = 6;

/// Returns whether the background shows an object that the frame does not. The sum of two measures decides,
/// each from -1 to 1 and positive for an object in the frame. One compares gradients along the outline
/// (docs/explanation/algorithms.md, "Background"), the other colors. The outline counts less where the
/// texture around it is stronger, as for a smooth mouse on rough bedding.
pub(super) fn is_ghost(frame: &Frame, background: &Background, component: &Component) -> bool {
    let surroundings = Surroundings::new(frame, component);
    let [texture, of_frame, of_background] = surroundings.gradients(frame, &background.frame);
    let outline = (of_frame.max(of_background) - texture).max(0.0);
    let share = outline / (outline + texture).max(1e-9);
    let behind = Color::in_component(&background.rgb, component);
    let [inside, around] = surroundings.colors(frame);
    let by_color = contrast(inside.distance(&around), behind.distance(&around));
    share * contrast(of_frame, of_background) + (1.0 - share) * by_color < 0.0
}

/// A component and a ring around it, as pixel indices into one box.
struct Surroundings {
    rect: Rect,
    /// The pixels of the component.
    inside: Mask,
    /// The outermost pixels of the component.
    outline: Vec<usize>,
    /// The pixels of the ring, which begins `MARGIN_PX` outside the component.
    around: Vec<usize>,
}

impl Surroundings {
    fn new(frame: &Frame, component: &Component) -> Surroundings {
        let away_px = MARGIN_PX + RING_PX.max((component.area as f64).sqrt() as u32 / 4);
        let rect = component.rect.inflated(away_px, frame.width, frame.height);
        let inside = component.mask(rect);
        let inner = inside.eroded();
        let (near, far) = (inside.dilated_by(MARGIN_PX), inside.dilated_by(away_px));
        let chosen = |is_chosen: &dyn Fn(usize) -> bool| {
            (0..inside.bits.len()).filter(|&k| is_chosen(k)).collect()
        };
        Surroundings {
            rect,
            outline: chosen(&|k| inside.bits[k] == 1 && inner.bits[k] == 0),
            around: chosen(&|k| far.bits[k] == 1 && near.bits[k] == 0),
            inside,
        }
    }

    /// Returns mean gradients of the background in the ring, and of frame and background on the outline.
    fn gradients(&self, frame: &Frame, background: &Frame) -> [f64; 3] {
        let (w, h) = (frame.width as usize, frame.height as usize);
        let gradient = |luma: &[u8], k: usize| {
            let x = self.rect.x as usize + k % self.inside.width();
            let y = self.rect.y as usize + k / self.inside.width();
            let at = |x: usize, y: usize| f64::from(luma[y * w + x]);
            let dx = at((x + 1).min(w - 1), y) - at(x.saturating_sub(1), y);
            let dy = at(x, (y + 1).min(h - 1)) - at(x, y.saturating_sub(1));
            dx.abs() + dy.abs()
        };
        let mean = |luma: &[u8], pixels: &[usize]| {
            let sum: f64 = pixels.iter().map(|&k| gradient(luma, k)).sum();
            sum / pixels.len().max(1) as f64
        };
        [
            mean(background.luma(), &self.around),
            mean(frame.luma(), &self.outline),
            mean(background.luma(), &self.outline),
        ]
    }

    /// Returns the colors of the frame inside the component and in the ring.
    fn colors(&self, frame: &Frame) -> [Color; 2] {
        let rgb = frame.rgb(self.rect);
        let inside = (0..self.inside.bits.len()).filter(|&k| self.inside.bits[k] == 1);
        let pixel = |k: usize| &rgb.pixels[3 * k..3 * k + 3];
        [
            Color::from_pixels(inside.map(pixel)),
            Color::from_pixels(self.around.iter().map(|&k| pixel(k))),
        ]
    }
}

/// Returns (a - b) / (a + b), -1..=1, for two quantities that are not negative.
fn contrast(a: f64, b: f64) -> f64 {
    (a - b) / (a + b).max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random;
    use crate::raster::runs::components;
    use crate::raster::{ColorSpec, RgbImage};

    const SIZE: u32 = 80;

    /// Returns the share of a pixel that a disc with a soft edge covers, 0..=1.
    fn in_disc(x: u32, y: u32) -> f64 {
        let distance_px = libm::hypot(f64::from(x) - 40.0, f64::from(y) - 40.0);
        ((20.0 - distance_px) / 6.0).clamp(0.0, 1.0)
    }

    /// Returns a scene of two-pixel chips with levels in the given range, with or without a smooth dark disc
    /// on top.
    fn frame([darkest, brightest]: [f64; 2], has_disc: bool) -> Frame {
        let mut picture = RgbImage::new(SIZE, SIZE);
        for (y, x) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (y, x))) {
            let chip = random::uniform(3, &[u64::from(x / 2), u64::from(y / 2)]);
            let level = darkest + (brightest - darkest) * chip;
            let covered = if has_disc { in_disc(x, y) } else { 0.0 };
            let level = covered * 40.0 + (1.0 - covered) * level;
            picture.set_pixel(x, y, [level as u8; 3]);
        }
        let mut frame = Frame::new(SIZE, SIZE, ColorSpec::default());
        frame.draw_rgb(&picture, Rect::of_size(SIZE, SIZE));
        frame
    }

    #[test]
    fn a_smooth_animal_is_no_ghost_however_rough_the_scene_behind_it() {
        let mut mask = Mask::new(Rect::of_size(SIZE, SIZE));
        for (at, bit) in (0..).zip(&mut mask.bits) {
            *bit = u8::from(in_disc(at % SIZE, at / SIZE) > 0.3);
        }
        let disc = &components(&mask)[0];
        for levels in [[180.0, 190.0], [60.0, 250.0]] {
            let [empty, with_disc] = [false, true].map(|has_disc| frame(levels, has_disc));
            let background = |frame: &Frame| Background::without_noise(frame.clone(), 12);
            assert!(
                !is_ghost(&with_disc, &background(&empty), disc),
                "{levels:?}"
            );
            assert!(
                is_ghost(&empty, &background(&with_disc), disc),
                "{levels:?}"
            );
        }
    }
}
