//! The animal in a frame as other frames see it: moved and turned onto them.

use crate::geometry::{Rect, wrap_rad};
use crate::raster::{Mask, RgbImage};

/// The animal by the first cut of a frame.
pub struct Shape {
    /// The pixels that show the animal.
    pub(super) solid: Mask,
    /// The frame in the same box.
    pub(super) rgb: RgbImage,
    /// Centroid of the body, pixels.
    pub(super) centroid_px: [f64; 2],
    /// Length axis of the body; `None` when it is round.
    pub(super) axis_rad: Option<f64>,
}

/// The animal in a frame, seen from another frame.
pub struct Around<'a> {
    shape: &'a Shape,
    /// Centroid of the body in the other frame, pixels.
    from_px: [f64; 2],
    /// Cosine and sine of the turn from the other frame to this one.
    turn: [f64; 2],
}

impl Shape {
    /// Returns this shape, seen from another frame. An axis has no ends, so it turns by a quarter at most.
    pub fn from_frame_of(&self, other: &Shape) -> Around<'_> {
        let turn = other.axis_rad.zip(self.axis_rad);
        let turn = turn.map_or(0.0, |(from, to)| 0.5 * wrap_rad(2.0 * (to - from)));
        Around {
            shape: self,
            from_px: other.centroid_px,
            turn: [libm::cos(turn), libm::sin(turn)],
        }
    }
}

impl Around<'_> {
    /// Returns whether a pixel of a box of the other frame shows the animal here, and its color; `None` outside.
    pub(super) fn at(&self, rect: Rect, k: usize) -> Option<(bool, [u8; 3])> {
        let width = rect.w as usize;
        let dx = f64::from(rect.x) + (k % width) as f64 + 0.5 - self.from_px[0];
        let dy = f64::from(rect.y) + (k / width) as f64 + 0.5 - self.from_px[1];
        let ([cos, sin], [to_x, to_y]) = (self.turn, self.shape.centroid_px);
        let Shape { solid, rgb, .. } = self.shape;
        let own = solid.rect;
        let x = to_x + cos * dx - sin * dy - f64::from(own.x);
        let y = to_y + sin * dx + cos * dy - f64::from(own.y);
        let is_inside = x >= 0.0 && y >= 0.0 && x < f64::from(own.w) && y < f64::from(own.h);
        let at = is_inside.then(|| y as usize * own.w as usize + x as usize)?;
        let color = [0, 1, 2].map(|c| rgb.pixels[3 * at + c]);
        Some((solid.bits[at] == 1, color))
    }
}
