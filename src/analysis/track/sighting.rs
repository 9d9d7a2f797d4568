//! What is seen of the animal in one frame: cut out, put aside and measured (N 4; ALGORITHMS.md 2.7, 4).

use super::asymmetry::Asymmetry;
use super::body;
use crate::analysis::matte;
use crate::analysis::moments::{self, Moments};
use crate::analysis::scene::light::Light;
use crate::analysis::scene::plate::Plate;
use crate::analysis::{silhouette, subject};
use crate::geometry::Rect;
use crate::raster::runs::Component;
use crate::raster::{Frame, Mask, RgbaImage};
use crate::scratch::{Full, Scratch};

/// What was seen of the animal in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Where the animal cut out lies in the frame.
    pub rect: Rect,
    /// Where its pixels are put aside.
    pub at: u64,
    /// How far they reach from the centroid: horizontally, vertically, in any direction.
    pub reach_px: [f64; 3],
    /// Probability that the centroid lies within a tenth of the body length of the true one (`confidence`).
    pub confidence: f64,
    /// Its moments, weighed by alpha.
    pub moments: Moments,
    /// How its ends and its sides differ; `None` where it has no axis.
    pub asymmetry: Option<Asymmetry>,
    /// The axis of the body without its tail and other thin parts, in (-pi/2, pi/2]; `None` where that is round.
    pub body_rad: Option<f64>,
    /// Extents along the body's axis and across it, tail and all.
    pub body_extent_px: [f64; 2],
    /// Extents along the major axis and across it, of the pixels that are more animal than background.
    pub extent_px: [f64; 2],
    /// Extent of the same pixels from the topmost to the lowest.
    pub upright_px: f64,
    /// Bounding box of the silhouette.
    pub box_px: Rect,
    /// The silhouette touches the border of the frame or of a box that is not looked at.
    pub cut: bool,
    /// The frame around the animal, in some frames.
    pub around: Option<Around>,
}

/// A part of a frame that was put aside, in the light of the plate: RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Around {
    /// Where it lies in the frame.
    pub rect: Rect,
    /// Where its pixels are put aside.
    pub at: u64,
}

/// Room on every side of the animal, as a share of the diagonal of its box: a shadow is looked for there.
const ROOM: f64 = 0.3;

impl Sighting {
    /// What a matte that lies at `rect` tells by itself: neither where it is put aside, nor how sure it is, its
    /// silhouette's box and whether that is cut. `None` when nothing of it is opaque.
    pub(in crate::analysis) fn measured(rect: Rect, matte: &RgbaImage) -> Option<Sighting> {
        let pixels = matte.pixels.as_chunks::<4>().0;
        let weights: Vec<u8> = pixels.iter().map(|rgba| rgba[3]).collect();
        let moments = moments::moments(rect, &weights)?;
        let axis = moments.major_rad.unwrap_or(0.0);
        let solid = solid(rect, matte);
        let extent_px = |along_rad| moments::extent_px(&solid, along_rad);
        let quarter = std::f64::consts::FRAC_PI_2;
        let body = body::of(&solid);
        let opaque: Vec<u8> = body.bits.iter().map(|bit| 255 * bit).collect();
        let body_rad = moments::moments(body.rect, &opaque).and_then(|body| body.major_rad);
        let along_body = body_rad.unwrap_or(axis);
        Some(Sighting {
            asymmetry: Asymmetry::of(rect, matte, &moments),
            body_rad,
            body_extent_px: [extent_px(along_body), extent_px(along_body + quarter)],
            rect,
            at: 0,
            reach_px: reach_px(rect, matte, moments.centroid_px),
            confidence: 0.0,
            moments,
            extent_px: [extent_px(axis), extent_px(axis + quarter)],
            upright_px: extent_px(quarter),
            box_px: rect,
            cut: false,
            around: None,
        })
    }
}

/// The component taken for the animal in one frame, and its mended form.
pub struct Choice {
    /// As it was found.
    pub component: Component,
    /// Without holes and specks.
    pub silhouette: Mask,
}

/// A frame before its plate.
pub struct View<'a> {
    /// The picture.
    pub frame: &'a Frame,
    /// The scene without the animal.
    pub plate: &'a Plate,
    /// How much brighter than the plate the frame is.
    pub light: &'a Light,
    /// Boxes that are not looked at.
    pub ignored: &'a [Rect],
    /// Whether what is around the animal is put aside too.
    pub keeps_around: bool,
}

impl View<'_> {
    /// Cuts the animal out, puts it aside and measures it; `None` when nothing of it is opaque.
    pub fn look(&self, choice: &Choice, scratch: &dyn Scratch) -> Result<Option<Sighting>, Full> {
        let rect = choice.component.rect;
        let length_px = libm::hypot(f64::from(rect.w), f64::from(rect.h));
        let silhouette = &choice.silhouette;
        let matte = matte::pull(self.frame, self.plate, self.light, silhouette, length_px);
        let Some(measured) = Sighting::measured(matte.rect, &matte.image) else {
            return Ok(None);
        };
        let cut = self.cuts(rect);
        let room_px = (self.keeps_around && !cut).then_some((ROOM * length_px).ceil() as u32);
        Ok(Some(Sighting {
            at: scratch.put(&matte.image.pixels)?,
            box_px: rect,
            cut,
            around: room_px
                .map(|px| self.around(rect, px, scratch))
                .transpose()?,
            ..measured
        }))
    }

    fn around(&self, rect: Rect, room_px: u32, scratch: &dyn Scratch) -> Result<Around, Full> {
        let rect = rect.inflated(room_px, self.frame.width, self.frame.height);
        let seen = silhouette::difference(self.frame, self.plate, self.light, rect).rgb;
        let at = scratch.put(&seen.pixels)?;
        Ok(Around { rect, at })
    }

    /// Whether a box reaches the border of what is looked at.
    fn cuts(&self, rect: Rect) -> bool {
        let (width, height) = (self.frame.width, self.frame.height);
        let around = rect.inflated(1, width, height);
        let meets = |ignored: &Rect| !ignored.intersection(&around).is_empty();
        subject::touches_border(rect, [width, height]) || self.ignored.iter().any(meets)
    }
}

/// The pixels that are more animal than background. The silhouette itself is wider: its threshold is
/// low, so that no fin is lost.
fn solid(rect: Rect, matte: &RgbaImage) -> Mask {
    let bits = matte
        .pixels
        .chunks_exact(4)
        .map(|rgba| u8::from(rgba[3] >= 128))
        .collect();
    Mask { rect, bits }
}

/// How far the alpha reaches from the centroid: horizontally, vertically, in any direction.
fn reach_px(rect: Rect, matte: &RgbaImage, [cx, cy]: [f64; 2]) -> [f64; 3] {
    let mut most = [0.0f64; 3];
    let columns = rect.w.max(1) as usize;
    let rows = matte.pixels.as_chunks::<4>().0.chunks_exact(columns);
    let inside = |rgba: &[u8; 4]| rgba[3] > 0;
    for (row, y) in rows.zip(rect.y..) {
        // The ends of a row lie farthest from any centroid.
        let ends = row
            .iter()
            .position(inside)
            .into_iter()
            .chain(row.iter().rposition(inside));
        for column in ends {
            let dx = (f64::from(rect.x + column as u32) + 0.5 - cx).abs() + 0.5;
            let dy = (f64::from(y) + 0.5 - cy).abs() + 0.5;
            most = [
                most[0].max(dx),
                most[1].max(dy),
                most[2].max(libm::hypot(dx, dy)),
            ];
        }
    }
    most
}
