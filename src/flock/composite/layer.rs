//! One individual as it is drawn into one frame: its sprite placed, and around a jump the second one
//! faded in or out (ALGORITHMS.md 8).

use super::morph::bend;
use super::params::Cut;
use super::stock::Stock;
use super::truth::{Drawn, Whole};
use super::view::View;
use crate::cpu::Level;
use crate::flock::individual::{Fade, Individual};
use crate::geometry::Rect;
use crate::library::Sprites;
use crate::raster::blend::{haze, mix};
use crate::raster::canvas::{Canvas, Cover};
use crate::raster::resample::{Placement, Quad, Resampled, Room};

/// What drawing needs besides the individual.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a> {
    pub(super) sprites: &'a Sprites,
    pub(super) stock: &'a Stock,
    pub(super) view: View,
    pub(super) cpu: Level,
    pub(super) cut: Cut,
    pub(super) haze: Option<Haze>,
}

/// What is lost with distance.
#[derive(Clone, Copy)]
pub(super) struct Haze {
    /// The share that is left after each pixel of depth.
    pub(super) left_per_px: f64,
    /// What takes the place of the rest.
    pub(super) color: Quad,
}

/// One individual at one frame.
#[derive(Clone, Copy)]
pub(super) struct Appearance<'a> {
    pub(super) individual: &'a Individual,
    pub(super) frame_idx: usize,
    pub(super) fade: Option<&'a Fade>,
}

/// Draws individuals, one after the other, in memory that it keeps.
#[derive(Default)]
pub(super) struct Painter {
    packed: Vec<u8>,
    /// What was drawn last.
    pub(super) layer: Resampled,
    second: Resampled,
    mixed: Resampled,
}

impl Painter {
    /// Draws an individual's layer for a picture of the film.
    /// What is hidden by what is `nearer` may be left out.
    pub(super) fn paint(&mut self, stage: &Stage, who: &Appearance, nearer: Option<&Cover>) {
        let is_bent = who.fade.is_some() && stage.cut == Cut::Morph;
        let room = Room {
            size: stage.view.size_px,
            // Sprites are bent by all that they show.
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

    /// Draws an individual under what is on a canvas, which is nearer; returns its box. The layer is none then that
    /// anybody may ask for.
    pub(super) fn paint_under(
        &mut self,
        stage: &Stage,
        who: &Appearance,
        canvas: &mut Canvas,
        cover: &mut Cover,
    ) -> Rect {
        if who.fade.is_some() || stage.haze.is_some() {
            self.paint(stage, who, Some(cover));
            canvas.under(&self.layer, cover, stage.cpu);
            return self.layer.rect;
        }
        // Nothing more is done to it: it need not be a layer first.
        let (place, t) = (placement(stage, who), who.frame_idx);
        let frame = who.individual.source_frame[t];
        let sprite = (stage.stock).take(stage.sprites, frame, place.scale, &mut self.packed);
        canvas.draw_under(&sprite, &place, cover, stage.cpu)
    }

    /// What was painted last, as the ground truth needs it; the layer is used up.
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

    /// Draws once more with room on all sides, to see what the border cut off.
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
        // From the nearest whole pixel inside of the picture, however far outside it is drawn.
        let size = [2 * room, 2 * room];
        let shift = place
            .center_px
            .map(|px| i64::from(room) - px.floor() as i64);
        let room = Room { size, nearer: None };
        self.paint_shifted(stage, who, room, shift.map(|px| px as f64));
        Whole::of(&self.layer.alpha(), self.layer.rect, shift)
    }

    /// A box that ends inside of the picture on every side has not been clipped.
    fn is_clipped(&self, stage: &Stage) -> bool {
        let (rect, [width, height]) = (self.layer.rect, stage.view.size_px);
        let clipped_before = rect.x == 0 || rect.y == 0;
        rect.is_empty() || clipped_before || rect.right() == width || rect.bottom() == height
    }

    fn paint_shifted(&mut self, stage: &Stage, who: &Appearance, room: Room, shift: [f64; 2]) {
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
        mix(
            &mut self.layer,
            &self.second,
            fade.weight[k],
            &mut self.mixed,
            stage.cpu,
        );
    }
}

/// Where the main sprite goes in the film.
fn placement(stage: &Stage, who: &Appearance) -> Placement {
    let (individual, t) = (who.individual, who.frame_idx);
    Placement {
        center_px: stage.view.point(individual.centroid_px[t]),
        rotation_rad: individual.rotation_rad[t],
        scale: individual.scale[t] * stage.view.scale,
        mirrored: individual.mirrored[t],
    }
}
