//! Drawing of one individual in one frame: its sprite, and around a jump a second sprite that fades in or
//! out (docs/explanation/algorithms.md, "Compositing").

use super::morph::bend;
use super::params::Cut;
use super::stock::Stock;
use super::truth::{Drawn, Whole};
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
pub(super) struct Stage<'a> {
    pub(super) sprites: &'a Sprites,
    pub(super) stock: &'a Stock,
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
    pub(super) fn paint(&mut self, stage: &Stage, who: &Appearance, nearer: Option<&Coverage>) {
        let is_bent = who.fade.is_some() && stage.cut == Cut::Morph;
        let room = Viewport {
            size: stage.view.size_px,
            // Morphing needs whole sprites.
            nearer: nearer.filter(|_| !is_bent),
        };
        self.paint_shifted(stage, who, room, [0.0; 2]);
        if let Some(veil) = stage.haze {
            let depth_px = who.individual.boid.position_px[who.frame_idx][2].max(0.0);
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
        stage: &Stage,
        who: &Appearance,
        canvas: &mut Canvas,
        cover: &mut Coverage,
    ) -> Rect {
        if who.fade.is_some() || stage.haze.is_some() {
            self.paint(stage, who, Some(cover));
            canvas.draw_layer_under(&self.layer, cover, stage.cpu);
            return self.layer.rect;
        }
        // Without fade and haze the sprite needs no intermediate layer.
        let (place, t) = (placement(stage, who), who.frame_idx);
        let frame = who.individual.source_frame[t];
        let sprite = (stage.stock).take(stage.sprites, frame, place.scale, &mut self.packed);
        canvas.draw_sprite_under(&sprite, &place, cover, stage.cpu)
    }

    /// Returns the alpha of the layer drawn last, for the ground truth. May overwrite `layer`.
    pub(super) fn drawn(&mut self, stage: &Stage, who: &Appearance) -> Drawn {
        let place = placement(stage, who);
        let mut drawn = Drawn {
            id: who.individual.id,
            centroid_px: place.center_px,
            scale: place.scale,
            rect: self.layer.rect,
            alpha: self.layer.alpha(),
            whole: None,
        };
        if self.is_clipped(stage) {
            drawn.whole = Some(self.whole(stage, who));
        }
        drawn
    }

    /// Draws the individual with margins on all sides and returns its extent without clipping.
    fn whole(&mut self, stage: &Stage, who: &Appearance) -> Whole {
        let place = placement(stage, who);
        let reach_px = |frame: u32, scale: f64| {
            let matte = stage.sprites.matte(frame as usize);
            matte.map_or(0.0, |matte| matte.reach_px()) * scale
        };
        let of_fade = who.fade.map_or(0.0, |fade| {
            let k = who.frame_idx - fade.start as usize;
            reach_px(fade.source_frame[k], fade.scale[k] * stage.view.scale)
        });
        let shown = who.individual.source_frame[who.frame_idx];
        let room = reach_px(shown, place.scale).max(of_fade).ceil() as u32 + 4;
        // Moves the sprite to the middle by whole pixels, so that its sub-pixel position stays the same.
        let size = [2 * room, 2 * room];
        let shift = place
            .center_px
            .map(|px| i64::from(room) - px.floor() as i64);
        let room = Viewport { size, nearer: None };
        self.paint_shifted(stage, who, room, shift.map(|px| px as f64));
        Whole::of(&self.layer.alpha(), self.layer.rect, shift)
    }

    /// Returns whether the layer may be clipped: its box is empty or touches the border of the picture.
    fn is_clipped(&self, stage: &Stage) -> bool {
        let (rect, [width, height]) = (self.layer.rect, stage.view.size_px);
        let clipped_before = rect.x == 0 || rect.y == 0;
        rect.is_empty() || clipped_before || rect.right() == width || rect.bottom() == height
    }

    fn paint_shifted(&mut self, stage: &Stage, who: &Appearance, room: Viewport, shift: [f64; 2]) {
        let (individual, t) = (who.individual, who.frame_idx);
        let mut place = placement(stage, who);
        place.center_px = std::array::from_fn(|k| place.center_px[k] + shift[k]);
        let frame = individual.source_frame[t];
        let sprite = (stage.stock).take(stage.sprites, frame, place.scale, &mut self.packed);
        self.layer.draw(&sprite, &place, room, stage.cpu);
        let Some(fade) = who.fade else {
            return;
        };
        let k = t - fade.start as usize;
        place.rotation_rad = fade.rotation_rad[k];
        place.scale = fade.scale[k] * stage.view.scale;
        place.mirrored = fade.mirrored;
        let frame = fade.source_frame[k];
        let sprite = (stage.stock).take(stage.sprites, frame, place.scale, &mut self.packed);
        self.second.draw(&sprite, &place, room, stage.cpu);
        if stage.cut == Cut::Morph {
            bend(&mut self.layer, &mut self.second, fade.weight[k]);
        }
        cross_fade(
            &mut self.layer,
            &self.second,
            fade.weight[k],
            &mut self.mixed,
            stage.cpu,
        );
    }
}

/// Returns the placement of the main sprite in the film.
fn placement(stage: &Stage, who: &Appearance) -> Placement {
    let (individual, t) = (who.individual, who.frame_idx);
    Placement {
        center_px: stage.view.point(individual.centroid_px[t]),
        rotation_rad: individual.rotation_rad[t],
        scale: individual.scale[t] * stage.view.scale,
        mirrored: individual.mirrored[t],
    }
}
