//! A sighting: the animal in one frame, cut out, stored and measured (Nakajima et al., sections 4 and 5.3).
//!
//! See docs/explanation/algorithms.md, "Pose". `matte` cuts the animal out.

use super::asymmetry::Asymmetry;
use super::body;
use super::evidence;
use crate::analysis::matte;
use crate::analysis::pose::moments::{self, Moments};
use crate::analysis::{silhouette, subject};
use crate::geometry::Rect;
use crate::raster::runs::Component;
use crate::raster::{Mask, RgbaImage};
use crate::scratch::{Full, Scratch};

/// The animal in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Box of the matte in the frame, pixels.
    pub rect: Rect,
    /// Offset of the matte's pixels in the scratch storage.
    pub at: u64,
    /// Greatest distance of the matte from the centroid: horizontal, vertical, in any direction, pixels.
    pub reach_px: [f64; 3],
    /// Probability that the centroid lies within a tenth of the body length of the true one (`confidence`).
    pub confidence: f64,
    /// Share of the outline that lies on edges of the frame which the background does not have (`evidence`), 0..=1.
    pub edge_share: Option<f64>,
    /// Moments of the matte, weighted by alpha.
    pub moments: Moments,
    /// Differences between the ends and between the sides; `None` without an axis.
    pub asymmetry: Option<Asymmetry>,
    /// Axis of the body without its tail and other thin parts, in (-pi/2, pi/2]; `None` when the body is
    /// round.
    pub body_rad: Option<f64>,
    /// Extents along the body's axis and across it, thin parts included, pixels.
    pub body_extent_px: [f64; 2],
    /// Extents along the major axis and across it, of pixels with alpha of at least one half, pixels.
    pub extent_px: [f64; 2],
    /// Vertical extent of the same pixels.
    pub upright_px: f64,
    /// Bounding box of the silhouette.
    pub box_px: Rect,
    /// Whether the silhouette touches the border of the frame or an ignored box.
    pub cut: bool,
    /// The first cut, for a second one; `None` where a mask is given.
    pub seen: Option<matte::Stored>,
    /// The frame around the animal; `None` in most frames.
    pub surroundings: Option<Surroundings>,
}

/// A stored part of a frame: RGB, in the light of the background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Box in the frame, pixels.
    pub rect: Rect,
    /// Offset of the pixels in the scratch storage.
    pub at: u64,
}

/// Margin of the surroundings on each side, as a share of the box's diagonal: the search range for a shadow.
/// Free choice.
const SURROUNDINGS_MARGIN: f64 = 0.3;

impl Sighting {
    /// Measures a matte at `rect`; returns `None` when all its pixels are transparent.
    ///
    /// `at`, `confidence`, `edge_share`, `box_px`, `cut`, `seen` and `surroundings` get placeholders.
    pub(in crate::analysis) fn measured(rect: Rect, matte: &RgbaImage) -> Option<Sighting> {
        let pixels = matte.pixels.as_chunks::<4>().0;
        let weights: Vec<u8> = pixels.iter().map(|rgba| rgba[3]).collect();
        let moments = moments::moments(rect, &weights)?;
        let axis = moments.major_rad.unwrap_or(0.0);
        let solid = solid(rect, matte);
        let extent_px = |along_rad| moments::extent_px(&solid, along_rad);
        let quarter = std::f64::consts::FRAC_PI_2;
        let body_rad = body::moments(&solid).and_then(|body| body.major_rad);
        let along_body = body_rad.unwrap_or(axis);
        Some(Sighting {
            asymmetry: Asymmetry::measure(rect, matte, &moments),
            body_rad,
            body_extent_px: [extent_px(along_body), extent_px(along_body + quarter)],
            rect,
            at: 0,
            reach_px: reach_px(rect, matte, moments.centroid_px),
            confidence: 0.0,
            edge_share: None,
            moments,
            extent_px: [extent_px(axis), extent_px(axis + quarter)],
            upright_px: extent_px(quarter),
            box_px: rect,
            cut: false,
            seen: None,
            surroundings: None,
        })
    }
}

/// The component of a candidate and its silhouette.
pub struct CandidateShape {
    /// The component as found.
    pub component: Component,
    /// The component without holes and specks.
    pub silhouette: Mask,
}

/// A frame in which animals are cut out.
pub struct FrameView<'a> {
    /// The frame and its scene.
    pub view: matte::View<'a>,
    /// Whether to store the animal's surroundings.
    pub keeps_surroundings: bool,
}

impl FrameView<'_> {
    /// Cuts the animal out, stores and measures it; returns `None` when all its pixels are transparent.
    pub fn cut_out(
        &self,
        shape: &CandidateShape,
        scratch: &dyn Scratch,
    ) -> Result<Option<Sighting>, Full> {
        let rect = shape.component.rect;
        let length_px = libm::hypot(f64::from(rect.w), f64::from(rect.h));
        let silhouette = &shape.silhouette;
        let matte::Pulled { matte, seen } = matte::pull(&self.view, silhouette, length_px);
        let Some(measured) = Sighting::measured(matte.rect, &matte.image) else {
            return Ok(None);
        };
        let cut = self.cuts(rect);
        let margin_px = (self.keeps_surroundings && !cut)
            .then_some((SURROUNDINGS_MARGIN * length_px).ceil() as u32);
        Ok(Some(Sighting {
            at: scratch.put(&matte.image.pixels)?,
            edge_share: evidence::edge_share(
                self.view.frame,
                self.view.background,
                self.view.light,
                &solid(matte.rect, &matte.image),
            ),
            box_px: rect,
            cut,
            seen: seen.map(|seen| seen.put(scratch)).transpose()?,
            surroundings: margin_px
                .map(|px| self.surroundings(rect, px, scratch))
                .transpose()?,
            ..measured
        }))
    }

    fn surroundings(
        &self,
        rect: Rect,
        margin_px: u32,
        scratch: &dyn Scratch,
    ) -> Result<Surroundings, Full> {
        let rect = rect.inflated(margin_px, self.view.frame.width, self.view.frame.height);
        let seen =
            silhouette::difference(self.view.frame, self.view.background, self.view.light, rect)
                .rgb;
        let at = scratch.put(&seen.pixels)?;
        Ok(Surroundings { rect, at })
    }

    /// Returns whether a box touches the border of the frame or an ignored box.
    fn cuts(&self, rect: Rect) -> bool {
        let (width, height) = (self.view.frame.width, self.view.frame.height);
        let around = rect.inflated(1, width, height);
        let meets = |ignored: &Rect| !ignored.intersection(&around).is_empty();
        subject::touches_border(rect, [width, height]) || self.view.ignored.iter().any(meets)
    }
}

/// Returns the pixels with alpha of at least one half. The silhouette is larger, as its low threshold keeps
/// fins.
fn solid(rect: Rect, matte: &RgbaImage) -> Mask {
    let bits = matte
        .pixels
        .chunks_exact(4)
        .map(|rgba| u8::from(rgba[3] >= 128))
        .collect();
    Mask { rect, bits }
}

/// Returns the greatest distance of pixels with alpha from the centroid: horizontal, vertical, in any
/// direction.
fn reach_px(rect: Rect, matte: &RgbaImage, [cx, cy]: [f64; 2]) -> [f64; 3] {
    let mut reach = [0.0f64; 3];
    let columns = rect.w.max(1) as usize;
    let rows = matte.pixels.as_chunks::<4>().0.chunks_exact(columns);
    let inside = |rgba: &[u8; 4]| rgba[3] > 0;
    for (row, y) in rows.zip(rect.y..) {
        // The ends of a row are its farthest pixels from any centroid.
        let ends = row
            .iter()
            .position(inside)
            .into_iter()
            .chain(row.iter().rposition(inside));
        for column in ends {
            let dx = (f64::from(rect.x + column as u32) + 0.5 - cx).abs() + 0.5;
            let dy = (f64::from(y) + 0.5 - cy).abs() + 0.5;
            reach = [
                reach[0].max(dx),
                reach[1].max(dy),
                reach[2].max(libm::hypot(dx, dy)),
            ];
        }
    }
    reach
}
