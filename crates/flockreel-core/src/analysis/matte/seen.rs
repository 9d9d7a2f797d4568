//! The second cut of a frame, with the cuts of the frames around it.
//!
//! What one frame does not decide, the frames around it do: a snout as bright as the floor, a crumb of bedding.
//! Each of their cuts, moved and turned onto this frame's, counts as one observation of each pixel.

use super::coat::Coat;
use super::cut::{Cut, mean_gap};
use super::{BAND_PX, Matte, painted};
use crate::analysis::pose::moments;
use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::Difference;
use crate::analysis::track::body;
use crate::geometry::{Rect, wrap_rad};
use crate::raster::{Mask, RgbImage};
use crate::scratch::{Full, Scratch};

/// A frame around the animal, with its first cut.
pub struct Seen {
    pub(super) difference: Difference,
    /// The silhouette in the box of the difference.
    pub(super) silhouette: Mask,
    /// The pixels that show the animal.
    pub(super) solid: Mask,
}

/// A part of the temporary storage with a [`Seen`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored {
    rect: Rect,
    at: u64,
}

/// The animal by the first cut of a frame.
pub struct Shape {
    seen: Seen,
    /// Centroid of the body, pixels.
    centroid_px: [f64; 2],
    /// Length axis of the body; `None` when it is round.
    axis_rad: Option<f64>,
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
        let seen = &self.shape.seen;
        let own = seen.solid.rect;
        let x = to_x + cos * dx - sin * dy - f64::from(own.x);
        let y = to_y + sin * dx + cos * dy - f64::from(own.y);
        let is_inside = x >= 0.0 && y >= 0.0 && x < f64::from(own.w) && y < f64::from(own.h);
        let at = is_inside.then(|| y as usize * own.w as usize + x as usize)?;
        let color = [0, 1, 2].map(|c| seen.difference.rgb.pixels[3 * at + c]);
        Some((seen.solid.bits[at] == 1, color))
    }
}

impl Seen {
    /// Stores the frame around the animal.
    pub fn put(&self, scratch: &dyn Scratch) -> Result<Stored, Full> {
        let mut bytes = self.difference.rgb.pixels.clone();
        bytes.extend_from_slice(&self.difference.levels);
        let masks = self.silhouette.bits.iter().zip(&self.solid.bits);
        bytes.extend(masks.map(|(silhouette, solid)| silhouette | solid << 1));
        let at = scratch.put(&bytes)?;
        Ok(Stored {
            rect: self.difference.rect,
            at,
        })
    }

    /// Reads a frame around the animal.
    pub fn get(stored: Stored, scratch: &dyn Scratch) -> Seen {
        let rect = stored.rect;
        let n = rect.area() as usize;
        let mut bytes = vec![0; 5 * n];
        scratch.get(stored.at, &mut bytes);
        let masks = bytes.split_off(4 * n);
        let levels = bytes.split_off(3 * n);
        let mask = |bit: u8| Mask {
            rect,
            bits: masks.iter().map(|both| both >> bit & 1).collect(),
        };
        let mut rgb = RgbImage::new(rect.w, rect.h);
        rgb.pixels = bytes;
        Seen {
            difference: Difference { rect, rgb, levels },
            silhouette: mask(0),
            solid: mask(1),
        }
    }

    /// Returns the animal by the first cut; `None` if it has no pixels.
    pub fn shape(self) -> Option<Shape> {
        let body = body::without_thin_parts(&self.solid);
        let opaque: Vec<u8> = body.bits.iter().map(|bit| 255 * bit).collect();
        let moments = moments::moments(body.rect, &opaque)?;
        Some(Shape {
            seen: self,
            centroid_px: moments.centroid_px,
            axis_rad: moments.major_rad,
        })
    }

    /// Cuts the animal out again, with the animal in the frames around; `None` where that changes nothing.
    pub fn pull(&self, background: &Background, coat: &Coat, around: &[Around]) -> Option<Matte> {
        let cut = Cut {
            difference: &self.difference,
            background,
            coat,
            silhouette: &self.silhouette,
            mean_gap: mean_gap(&self.difference),
            around,
        };
        let solid = cut.animal(2 * BAND_PX);
        (solid != self.solid).then(|| painted(&self.difference, background, &solid))
    }
}
