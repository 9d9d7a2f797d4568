//! A pen for planar frames: anti-aliased lines, discs and digits. Strokes accumulate as coverage and are
//! drawn together in one color, so that crossing strokes do not darken each other.

use super::Frame;
use crate::geometry::Rect;

/// Coverage of the strokes since the last call of `draw`, for frames of one size.
#[derive(Clone, Debug)]
pub struct Pen {
    width: usize,
    height: usize,
    /// 0..=255 for each pixel.
    coverage: Vec<u8>,
    /// Bounding box of the pixels with coverage.
    touched: Rect,
}

impl Pen {
    /// Returns a pen for frames of `width` by `height` pixels.
    pub fn new(width: u32, height: u32) -> Pen {
        Pen {
            width: width as usize,
            height: height as usize,
            coverage: vec![0; width as usize * height as usize],
            touched: Rect::default(),
        }
    }

    /// Adds a line with round ends from `from` to `to`, pixels, with half-width `radius_px` and `alpha` in
    /// 0..=1. A line of length 0 is a disc.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], radius_px: f64, alpha: f64) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let squared = along[0] * along[0] + along[1] * along[1];
        let reach = radius_px + 1.0;
        let least = [0, 1].map(|c| from[c].min(to[c]) - reach);
        let most = [0, 1].map(|c| from[c].max(to[c]) + reach);
        self.cover(least, most, |p| {
            let (dx, dy) = (p[0] - from[0], p[1] - from[1]);
            let share = ((dx * along[0] + dy * along[1]) / squared.max(1e-12)).clamp(0.0, 1.0);
            let distance = libm::hypot(dx - share * along[0], dy - share * along[1]);
            alpha * (radius_px + 0.5 - distance).clamp(0.0, 1.0)
        });
    }

    /// Adds a line through all points.
    pub fn polyline(&mut self, points: &[[f64; 2]], radius_px: f64, alpha: f64) {
        for pair in points.windows(2) {
            self.line(pair[0], pair[1], radius_px, alpha);
        }
    }

    /// Adds text in a 5 x 7 dot font, with the upper left corner at `at` and dots `dot_px` wide. The font has
    /// the digits, the point and the letter s; other characters are blank. A font crate would need a font
    /// file.
    pub fn text(&mut self, text: &str, at: [f64; 2], dot_px: f64) {
        let half = dot_px / 2.0;
        for (n, character) in text.chars().enumerate() {
            for (row, dots) in glyph_of(character).split_whitespace().enumerate() {
                for (column, _) in dots.match_indices('1') {
                    let center = [
                        at[0] + (n as f64 * 6.0 + column as f64 + 0.5) * dot_px,
                        at[1] + (row as f64 + 0.5) * dot_px,
                    ];
                    let [least, most] = [-half, half].map(|d| center.map(|c| c + d));
                    self.cover(least, most, |p| {
                        let off = (p[0] - center[0]).abs().max((p[1] - center[1]).abs());
                        (half + 0.5 - off).clamp(0.0, 1.0)
                    });
                }
            }
        }
    }

    /// Draws the strokes onto the frame in one color and clears them. Panics if the frame has another size.
    pub fn draw(&mut self, frame: &mut Frame, rgb: [u8; 3]) {
        assert_eq!(
            (frame.width as usize, frame.height as usize),
            (self.width, self.height),
            "sizes differ"
        );
        let from = frame.color.from_rgb();
        let luma = from.luma(rgb);
        let chroma = from.chroma_of_block(rgb.map(|c| 4 * i32::from(c)));
        let chroma_width = frame.chroma_width() as usize;
        let (luma_plane, chroma_planes) = frame.planes.split_at_mut(self.width * self.height);
        let (u_plane, v_plane) = chroma_planes.split_at_mut(chroma_planes.len() / 2);
        let t = self.touched;
        for y in t.y as usize / 2..(t.bottom() as usize).div_ceil(2) {
            for x in t.x as usize / 2..(t.right() as usize).div_ceil(2) {
                let mut sum = 0;
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (px, py) = (2 * x + dx, 2 * y + dy);
                    if px >= self.width || py >= self.height {
                        continue;
                    }
                    let at = py * self.width + px;
                    let alpha = std::mem::take(&mut self.coverage[at]);
                    sum += u32::from(alpha);
                    luma_plane[at] = mixed(luma_plane[at], luma, u32::from(alpha));
                }
                for (plane, value) in [&mut *u_plane, &mut *v_plane].into_iter().zip(chroma) {
                    let old = &mut plane[y * chroma_width + x];
                    *old = mixed(*old, value, sum / 4);
                }
            }
        }
        self.touched = Rect::default();
    }

    /// Raises the coverage of each pixel between two corners to `coverage_at` its center.
    fn cover(&mut self, least: [f64; 2], most: [f64; 2], coverage_at: impl Fn([f64; 2]) -> f64) {
        if [least, most].concat().iter().any(|c| !c.is_finite()) {
            return;
        }
        let [left, top] = least.map(|c| c.floor() as i64);
        let [right, bottom] = most.map(|c| c.ceil() as i64 + 1);
        let (w, h) = (self.width as u32, self.height as u32);
        let rect = Rect::clipped(left, top, right, bottom, w, h);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let coverage = coverage_at([f64::from(x) + 0.5, f64::from(y) + 0.5]);
                let old = &mut self.coverage[y as usize * self.width + x as usize];
                *old = ((255.0 * coverage).round() as u8).max(*old);
            }
        }
        self.touched = self.touched.union(&rect);
    }
}

fn mixed(old: u8, new: u8, alpha: u32) -> u8 {
    ((u32::from(old) * (255 - alpha) + u32::from(new) * alpha + 127) / 255) as u8
}

/// Returns the seven rows of a character, from the top, with five dots each.
fn glyph_of(character: char) -> &'static str {
    match character {
        '0' => "01110 10001 10011 10101 11001 10001 01110",
        '1' => "00100 01100 00100 00100 00100 00100 01110",
        '2' => "01110 10001 00001 00110 01000 10000 11111",
        '3' => "11110 00001 00001 01110 00001 00001 11110",
        '4' => "00010 00110 01010 10010 11111 00010 00010",
        '5' => "11111 10000 11110 00001 00001 10001 01110",
        '6' => "00110 01000 10000 11110 10001 10001 01110",
        '7' => "11111 00001 00010 00100 01000 01000 01000",
        '8' => "01110 10001 10001 01110 10001 10001 01110",
        '9' => "01110 10001 10001 01111 00001 00010 01100",
        '.' => "00000 00000 00000 00000 00000 01100 01100",
        's' => "00000 00000 01111 10000 01110 00001 11110",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::ColorSpec;

    fn gray() -> Frame {
        let mut frame = Frame::new(33, 21, ColorSpec::default());
        frame.planes.fill(128);
        frame
    }

    #[test]
    fn line_changes_only_the_pixels_along_it() {
        let (mut frame, mut pen) = (gray(), Pen::new(33, 21));
        pen.line([4.0, 10.5], [20.0, 10.5], 1.0, 1.0);
        pen.draw(&mut frame, [255, 0, 0]);
        let [r, g, b] = frame.to_rgb().pixel(12, 10);
        assert!(r > 200 && g < 60 && b < 60, "{r} {g} {b}");
        let old = gray();
        for y in (0..8).chain(14..21) {
            let row = 33 * y..33 * (y + 1);
            assert_eq!(frame.luma()[row.clone()], old.luma()[row]);
        }
        // The first call cleared the pen.
        let drawn = frame.clone();
        pen.draw(&mut frame, [0, 255, 0]);
        assert_eq!(frame, drawn);
    }

    #[test]
    fn crossing_lines_do_not_darken_each_other_and_are_clipped() {
        let (mut once, mut twice, mut pen) = (gray(), gray(), Pen::new(33, 21));
        pen.line([-50.0, 5.0], [90.0, 5.0], 2.0, 0.5);
        pen.draw(&mut once, [0; 3]);
        for _ in 0..2 {
            pen.line([-50.0, 5.0], [90.0, 5.0], 2.0, 0.5);
        }
        pen.line([f64::NAN, 5.0], [90.0, 5.0], 2.0, 0.5);
        pen.draw(&mut twice, [0; 3]);
        assert_eq!(once, twice);
    }

    #[test]
    fn every_character_is_drawn_differently() {
        let drawn = |text: &str| {
            let (mut frame, mut pen) = (gray(), Pen::new(33, 21));
            pen.text(text, [2.0, 2.0], 2.0);
            pen.draw(&mut frame, [255; 3]);
            frame
        };
        let all: Vec<Frame> = "0123456789.s "
            .chars()
            .map(|c| drawn(&c.to_string()))
            .collect();
        for (k, one) in all.iter().enumerate() {
            assert!(all[k + 1..].iter().all(|other| other != one), "{k}");
        }
    }
}
