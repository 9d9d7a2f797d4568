//! The first cut of a frame, and the second one with the cuts of the frames around it.
//!
//! Some pixels look alike in animal and scene, such as a snout in its shadow or a crumb of bedding. The frames around
//! decide them: each of their cuts, moved and turned onto this frame's, counts as one observation of each pixel.

use super::around::{Around, Shape};
use super::coat::Coat;
use super::cut::{Cut, mean_gap};
use super::{BAND_PX, MARGIN_PX, Matte, View, over_box, painted};
use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::{self, Difference};
use crate::geometry::Rect;
use crate::raster::{Frame, Mask, RgbImage};
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

impl Seen {
    /// Cuts the animal out the first time.
    pub(super) fn first(view: &View, silhouette: &Mask, length_px: f64) -> Seen {
        let frame = view.frame;
        let mut margin_px = MARGIN_PX;
        loop {
            let rect = (silhouette.rect).inflated(margin_px, frame.width, frame.height);
            let mut difference = silhouette::difference(frame, view.background, view.light, rect);
            (view.ignored.iter()).for_each(|ignored| difference.clear(*ignored));
            let silhouette = over_box(silhouette, rect);
            let cut = Cut {
                difference: &difference,
                background: view.background,
                coat: view.coat,
                silhouette: &silhouette,
                mean_gap: mean_gap(&difference),
                around: &[],
            };
            let solid = cut.animal(2 * BAND_PX);
            margin_px *= 2;
            if !reaches_edge(&solid, frame) || f64::from(margin_px) > length_px {
                break Seen {
                    difference,
                    silhouette,
                    solid,
                };
            }
        }
    }

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

    /// Returns the pixels that show the animal by the first cut.
    pub fn solid(&self) -> &Mask {
        &self.solid
    }

    /// Returns the animal by the first cut, with the centroid and the length axis of its body.
    pub fn shape(self, centroid_px: [f64; 2], axis_rad: Option<f64>) -> Shape {
        Shape {
            solid: self.solid,
            rgb: self.difference.rgb,
            centroid_px,
            axis_rad,
        }
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

/// Returns whether a mask reaches an edge of its box that is none of the frame.
fn reaches_edge(mask: &Mask, frame: &Frame) -> bool {
    let (rect, w, h) = (mask.rect, mask.width(), mask.height());
    let is_set = |x: usize, y: usize| mask.bits[y * w + x] == 1;
    let side = |x: usize| (0..h).any(|y| is_set(x, y));
    let row = |y: usize| (0..w).any(|x| is_set(x, y));
    rect.x > 0 && side(0)
        || rect.y > 0 && row(0)
        || rect.right() < frame.width && side(w - 1)
        || rect.bottom() < frame.height && row(h - 1)
}
