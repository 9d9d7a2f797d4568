//! A synthetic animal for tests: thick near the head, with one side dark.

use crate::analysis::track::Tracked;
use crate::analysis::track::sighting::Sighting;
use crate::geometry::Rect;
use crate::raster::RgbaImage;

/// Appearance of the animal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Appearance {
    /// Whether the head is at the left end.
    pub(super) is_left: bool,
    /// Whether the upper half is darker than the lower half.
    pub(super) is_upper_dark: bool,
}

const WIDTH: u32 = 60;
const HEIGHT: u32 = 30;

/// Returns the animal in one frame, with a little noise in its color.
pub(super) fn fish(frame_idx: usize, appearance: Appearance) -> Tracked {
    let mut matte = RgbaImage::new(WIDTH, HEIGHT);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let along = (f64::from(x) + 0.5) / f64::from(WIDTH);
            let to_head = if appearance.is_left {
                1.0 - along
            } else {
                along
            };
            let across = f64::from(y) + 0.5 - f64::from(HEIGHT) / 2.0;
            let half_width = 12.0 * (3.0 * to_head * to_head * (1.0 - to_head)).sqrt() / 0.667;
            if across.abs() < half_width {
                let noise = (x * 7 + y * 13 + frame_idx as u32 * 11) % 9;
                let is_dark = (across < 0.0) == appearance.is_upper_dark;
                let level = if is_dark { 70 } else { 150 } + noise as u8;
                matte.set_pixel(x, y, [level, level, level, 255]);
            }
        }
    }
    let rect = Rect {
        x: 100,
        y: 80,
        w: WIDTH,
        h: HEIGHT,
    };
    Tracked {
        time_s: frame_idx as f64 / 30.0,
        background_idx: Some(0),
        sighting: Sighting::measured(rect, &matte),
    }
}
