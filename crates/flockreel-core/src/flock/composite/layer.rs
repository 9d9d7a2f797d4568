//! Drawing of one individual in one frame: its sprite, and around a jump a second sprite that fades in or
//! out (docs/explanation/algorithms.md, "Compositing").

use super::keypoints::SourceKeypoints;
use super::morph::warp_together;
use super::params::Cut;
use super::sprite_cache::SpriteCache;
use super::truth::{Drawn, FullExtent};
use super::view::View;
use crate::cpu::Level;
use crate::flock::individual::{Fade, Individual};
use crate::geometry::Rect;
use crate::library::Sprites;
use crate::raster::blend::{cross_fade, haze};
use crate::raster::canvas::{Canvas, Coverage};
use crate::raster::resample::{Placement, Quad, Resampled, Viewport};

/// Inputs of drawing that are the same for all individuals.
#[derive(Clone, Copy)]
pub(super) struct DrawContext<'a> {
    pub(super) sprites: &'a Sprites,
    pub(super) sprite_cache: &'a SpriteCache,
    pub(super) view: View,
    pub(super) cpu: Level,
    pub(super) cut: Cut,
    pub(super) haze: Option<Haze>,
}

/// Loss of color with depth.
#[derive(Clone, Copy)]
pub(super) struct Haze {
    /// Share of the color that remains after each pixel of depth.
    pub(super) left_per_px: f64,
    /// Color that replaces the lost share.
    pub(super) color: Quad,
}

/// One individual in one frame.
#[derive(Clone, Copy)]
pub(super) struct Appearance<'a> {
    pub(super) individual: &'a Individual,
    pub(super) frame_idx: usize,
    pub(super) fade: Option<&'a Fade>,
}

/// Draws individuals one after the other, in memory that it reuses.
#[derive(Default)]
pub(super) struct Painter {
    packed: Vec<u8>,
    /// Layer drawn last.
    pub(super) layer: Resampled,
    second: Resampled,
    mixed: Resampled,
}

impl Painter {
    /// Draws an individual into `layer`, in pixels of the film. Parts that `nearer` hides may be left out.
    pub(super) fn paint(
        &mut self,
        context: &DrawContext,
        appearance: &Appearance,
        nearer: Option<&Coverage>,
    ) {
        let is_morphed = appearance.fade.is_some() && context.cut == Cut::Morph;
        let viewport = Viewport {
            size: context.view.size_px,
            // Morphing needs whole sprites.
            nearer: nearer.filter(|_| !is_morphed),
        };
        self.paint_shifted(context, appearance, viewport, [0.0; 2]);
        if let Some(veil) = context.haze {
            let depth_px = appearance.individual.boid.position_px[appearance.frame_idx][2].max(0.0);
            haze(
                &mut self.layer,
                libm::pow(veil.left_per_px, depth_px),
                veil.color,
            );
        }
    }

    /// Draws an individual under the content of a canvas, which is nearer. Returns the box of the
    /// individual. The content of `layer` is unspecified afterwards.
    pub(super) fn paint_under(
        &mut self,
        context: &DrawContext,
        appearance: &Appearance,
        canvas: &mut Canvas,
        cover: &mut Coverage,
    ) -> Rect {
        if appearance.fade.is_some() || context.haze.is_some() {
            self.paint(context, appearance, Some(cover));
            canvas.draw_layer_under(&self.layer, cover, context.cpu);
            return self.layer.rect;
        }
        // Without fade and haze the sprite needs no intermediate layer.
        let (place, t) = (placement(context, appearance), appearance.frame_idx);
        let frame = appearance.individual.source_frame[t];
        let sprite =
            (context.sprite_cache).get(context.sprites, frame, place.scale, &mut self.packed);
        canvas.draw_sprite_under(&sprite, &place, cover, context.cpu)
    }

    /// Returns the alpha of the layer drawn last and the keypoints, for the ground truth. May overwrite `layer`.
    pub(super) fn drawn(
        &mut self,
        context: &DrawContext,
        appearance: &Appearance,
        keypoints: &SourceKeypoints,
    ) -> Drawn {
        let place = placement(context, appearance);
        let shown = appearance.individual.source_frame[appearance.frame_idx];
        let (keypoint_source, keypoints) = keypoints.placed(shown, &place);
        let mut drawn = Drawn {
            id: appearance.individual.id,
            centroid_px: place.center_px,
            scale: place.scale,
            rect: self.layer.rect,
            alpha: self.layer.alpha(),
            whole: None,
            keypoint_source,
            keypoints,
        };
        if self.is_clipped(context) {
            drawn.whole = Some(self.whole(context, appearance));
        }
        drawn
    }

    /// Draws the individual with margins on all sides and returns its extent without clipping.
    fn whole(&mut self, context: &DrawContext, appearance: &Appearance) -> FullExtent {
        let place = placement(context, appearance);
        let reach_px = |frame: u32, scale: f64| {
            let matte = context.sprites.matte(frame as usize);
            matte.map_or(0.0, |matte| matte.reach_px()) * scale
        };
        let of_fade = appearance.fade.map_or(0.0, |fade| {
            let k = appearance.frame_idx - fade.start as usize;
            reach_px(fade.source_frame[k], fade.scale[k] * context.view.scale)
        });
        let shown = appearance.individual.source_frame[appearance.frame_idx];
        let margin = reach_px(shown, place.scale).max(of_fade).ceil() as u32 + 4;
        // Moves the sprite to the middle by whole pixels, so that its sub-pixel position stays the same.
        let size = [2 * margin, 2 * margin];
        let shift = place
            .center_px
            .map(|px| i64::from(margin) - px.floor() as i64);
        let viewport = Viewport { size, nearer: None };
        self.paint_shifted(context, appearance, viewport, shift.map(|px| px as f64));
        FullExtent::new(&self.layer.alpha(), self.layer.rect, shift)
    }

    /// Returns whether the layer may be clipped: its box is empty or touches the border of the picture.
    fn is_clipped(&self, context: &DrawContext) -> bool {
        let (rect, [width, height]) = (self.layer.rect, context.view.size_px);
        let clipped_before = rect.x == 0 || rect.y == 0;
        rect.is_empty() || clipped_before || rect.right() == width || rect.bottom() == height
    }

    fn paint_shifted(
        &mut self,
        context: &DrawContext,
        appearance: &Appearance,
        viewport: Viewport,
        shift: [f64; 2],
    ) {
        let (individual, t) = (appearance.individual, appearance.frame_idx);
        let mut place = placement(context, appearance);
        place.center_px = std::array::from_fn(|k| place.center_px[k] + shift[k]);
        let frame = individual.source_frame[t];
        let sprite =
            (context.sprite_cache).get(context.sprites, frame, place.scale, &mut self.packed);
        self.layer.draw(&sprite, &place, viewport, context.cpu);
        let Some(fade) = appearance.fade else {
            return;
        };
        let k = t - fade.start as usize;
        place.rotation_rad = fade.rotation_rad[k];
        place.scale = fade.scale[k] * context.view.scale;
        place.mirrored = fade.mirrored;
        let frame = fade.source_frame[k];
        let sprite =
            (context.sprite_cache).get(context.sprites, frame, place.scale, &mut self.packed);
        self.second.draw(&sprite, &place, viewport, context.cpu);
        if context.cut == Cut::Morph {
            warp_together(&mut self.layer, &mut self.second, fade.weight[k]);
        }
        cross_fade(
            &mut self.layer,
            &self.second,
            fade.weight[k],
            &mut self.mixed,
            context.cpu,
        );
    }
}

/// Returns the placement of the main sprite in the film.
fn placement(context: &DrawContext, appearance: &Appearance) -> Placement {
    let (individual, t) = (appearance.individual, appearance.frame_idx);
    Placement {
        center_px: context.view.point(individual.centroid_px[t]),
        rotation_rad: individual.rotation_rad[t],
        scale: individual.scale[t] * context.view.scale,
        mirrored: individual.mirrored[t],
    }
}
