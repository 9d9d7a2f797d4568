//! Placement of planned frames (Okabe et al., section 5.2; docs/explanation/algorithms.md, "Placement"):
//! rotations, positions near the boid, and cross-fades at jumps. `follow` is for `position: film`.

mod fades;

use rayon::prelude::*;

use self::fades::FadeInputs;
use super::boids::calibration::Calibration;
use super::boids::tank::Tank;
use super::individual::{BoidTrack, Fade};
use super::lens::Lens;
use super::motion::FrameMotion;
use super::params::{Params, Position};
use super::rotation;
use crate::geometry::angle::mirrored_rad;
use crate::geometry::{rounded, wrap_rad};
use crate::library::{Library, View};
use crate::random;

/// Time constant with which an individual is drawn to its boid, seconds. Free choice.
const LEASH_S: f64 = 0.5;
/// Largest distance of an individual from its boid, body lengths. Free choice.
const LEASH_BL: f64 = 0.5;

/// Rounds in which a loop is placed, so that its start follows from its end. Free choice.
const N_LOOP_ROUNDS: usize = 4;

/// Least and greatest scale of a sprite. Free choices.
const MIN_SCALE: f64 = 0.2;
const MAX_SCALE: f64 = 1.5;
/// First word of the random keys for body sizes. Boids use other words.
const SIZE_KEY: u64 = 0x517e;

/// Inputs of placement that all individuals share.
pub struct Placer<'a> {
    /// Library whose sprites are shown.
    pub library: &'a Library,
    /// Motion of the animal at each frame of the footage.
    pub motion: &'a [FrameMotion],
    /// Parameters of the flock.
    pub params: &'a Params,
    /// Projection of the tank.
    pub lens: &'a Lens,
    /// Tank that limits positions.
    pub tank: &'a Tank,
    /// Limits measured on the animal.
    pub calibration: &'a Calibration,
}

/// Placement of an individual. Lists have one entry per output frame, except `fades`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Placed {
    /// Rotation of the sprite, radians.
    pub rotation_rad: Vec<f64>,
    /// Heading as shown, radians.
    pub heading_rad: Vec<f64>,
    /// Position of the centroid, pixels.
    pub centroid_px: Vec<[f64; 2]>,
    /// Direction in space, a unit vector. `None` if the tank has no depth.
    pub forward: Option<Vec<[f64; 3]>>,
    /// Size relative to the footage.
    pub scale: Vec<f64>,
    /// Depth in the camera frame, metres. `None` if the scale in metres is unknown.
    pub depth_m: Option<Vec<f64>>,
    /// Second sprites around jumps.
    pub fades: Vec<Fade>,
    /// Size of the individual relative to the filmed animal.
    pub size: f64,
}

/// Frame shown before the first one: the end of the preceding segment, or in a loop the last frame.
#[derive(Clone, Copy)]
pub(super) struct PreviousFrame {
    pub(super) state: (u32, bool),
    pub(super) heading_rad: f64,
    pub(super) centroid_px: [f64; 2],
}

/// Returns whether `after` is not the next frame on the same mirror side.
pub fn is_jump(before: (u32, bool), after: (u32, bool)) -> bool {
    after != (before.0 + 1, before.1)
}

impl Placer<'_> {
    /// Places all individuals, by id. In a loop, individual `id` continues as `continuations[id]`.
    pub fn placed(
        &self,
        shown: &[Vec<(u32, bool)>],
        boids: &[BoidTrack],
        continuations: Option<&[u32]>,
    ) -> Vec<Placed> {
        let shown: Vec<&[(u32, bool)]> = shown.iter().map(Vec::as_slice).collect();
        match continuations {
            Some(continuations) => self.place_loop(&shown, boids, continuations),
            None => self.place(&shown, boids),
        }
    }

    fn place(&self, shown: &[&[(u32, bool)]], boids: &[BoidTrack]) -> Vec<Placed> {
        (shown.par_iter().zip(boids).enumerate())
            .map(|(id, (shown, boid))| self.place_one(shown, boid, None, self.size(id)))
            .collect()
    }

    /// Places a loop, by id. The last frame of each individual leads into the first of its continuation.
    fn place_loop(
        &self,
        shown: &[&[(u32, bool)]],
        boids: &[BoidTrack],
        continuations: &[u32],
    ) -> Vec<Placed> {
        let mut placed = self.place(shown, boids);
        for _ in 0..N_LOOP_ROUNDS {
            let mut before = vec![None; shown.len()];
            for (id, &continuation) in continuations.iter().enumerate() {
                let last = shown[id].len() - 1;
                before[continuation as usize] = Some(PreviousFrame {
                    state: shown[id][last],
                    heading_rad: placed[id].heading_rad[last],
                    centroid_px: placed[id].centroid_px[last],
                });
            }
            placed = (shown.par_iter().zip(boids).zip(before))
                .map(|((shown, boid), before)| self.place_one(shown, boid, before, 1.0))
                .collect();
        }
        let fades = self.fades_across(shown, boids, continuations, &placed);
        for (placed, fades) in placed.iter_mut().zip(fades) {
            placed.fades = fades;
        }
        placed
    }

    fn depths_bl(&self, boid: &BoidTrack) -> Vec<f64> {
        let places = boid.position_px.iter();
        places.map(|place| self.depth_bl(place[2])).collect()
    }

    fn place_one(
        &self,
        shown: &[(u32, bool)],
        boid: &BoidTrack,
        before: Option<PreviousFrame>,
        size: f64,
    ) -> Placed {
        let heading_rad = self.headings(shown, boid, before);
        let centroid_px = self.positions(&heading_rad, boid, before);
        self.with_fades(shown, size, boid, heading_rad, centroid_px)
    }

    /// Returns the placement of an individual with these headings and positions.
    pub(super) fn with_fades(
        &self,
        shown: &[(u32, bool)],
        size: f64,
        boid: &BoidTrack,
        heading_rad: Vec<f64>,
        centroid_px: Vec<[f64; 2]>,
    ) -> Placed {
        let depth_bl = self.depths_bl(boid);
        let rotation_rad: Vec<f64> = shown
            .iter()
            .zip(&heading_rad)
            .map(|(&state, &heading)| rounded(self.rotation(state, heading), 5))
            .collect();
        Placed {
            forward: (!self.lens.is_flat()).then(|| {
                let turned = shown.iter().zip(&rotation_rad);
                turned
                    .map(|(&state, &turn)| self.forward(state, turn))
                    .collect()
            }),
            rotation_rad,
            centroid_px,
            size,
            scale: (shown.iter().zip(&depth_bl))
                .map(|(state, &depth_bl)| self.scale(state.0, depth_bl, size))
                .collect(),
            depth_m: (depth_bl.iter())
                .map(|&bl| Some(rounded(self.lens.metres(bl)?, 5)))
                .collect(),
            fades: self.fades(
                &FadeInputs {
                    shown,
                    heading_rad: &heading_rad,
                    depth_bl: &depth_bl,
                    size,
                },
                shown.len(),
            ),
            heading_rad,
        }
    }

    /// Returns the distance from the camera, body lengths, for a distance behind the front of the tank.
    pub(super) fn depth_bl(&self, behind_px: f64) -> f64 {
        self.tank.corners[0][2] + behind_px / self.lens.length_px
    }

    /// Returns the random size of an individual relative to the filmed animal.
    pub(super) fn size(&self, id: usize) -> f64 {
        let spread = 2.0 * random::uniform(self.params.seed, &[SIZE_KEY, id as u64]) - 1.0;
        rounded(1.0 + self.params.variation * spread, 3)
    }

    /// Returns the scale at which an individual of this size shows a source frame at a given depth.
    pub(super) fn scale(&self, frame: u32, depth_bl: f64, size: f64) -> f64 {
        if self.lens.is_flat() {
            return size;
        }
        let filmed_px = self.lens.px_per_bl(self.motion[frame as usize].depth_bl);
        let scale = size * self.lens.px_per_bl(depth_bl) / filmed_px;
        rounded(scale.clamp(MIN_SCALE, MAX_SCALE), 4)
    }

    /// Returns the heading of a source frame on its mirror side, radians.
    pub(super) fn source_heading(&self, (frame, mirrored): (u32, bool)) -> f64 {
        let heading = self.motion[frame as usize].heading_rad;
        if mirrored {
            mirrored_rad(heading)
        } else {
            heading
        }
    }

    /// Returns the direction in space of a source frame on its mirror side, rotated in the image.
    fn forward(&self, (frame, mirrored): (u32, bool), turn_rad: f64) -> [f64; 3] {
        let [x, y, z] = self.motion[frame as usize].forward;
        let x = if mirrored { -x } else { x };
        let (cos, sin) = (libm::cos(turn_rad), libm::sin(turn_rad));
        [cos * x - sin * y, sin * x + cos * y, z].map(|part| rounded(part, 5))
    }

    /// Returns the rotation that shows a source frame at a heading, within `rho_deg` in side view.
    pub(super) fn rotation(&self, state: (u32, bool), heading_rad: f64) -> f64 {
        let gap = wrap_rad(heading_rad - self.source_heading(state));
        match self.library.poses.view {
            View::Top => gap,
            View::Side => {
                let rho = self.params.matching.rho_deg.to_radians();
                gap.clamp(-rho, rho)
            }
        }
    }

    /// Returns the headings shown: in top view those of the boid, in side view those of the frames, rotated
    /// smoothly toward the boid. A jump changes the heading as little as the limit allows.
    pub(super) fn headings(
        &self,
        shown: &[(u32, bool)],
        boid: &BoidTrack,
        before: Option<PreviousFrame>,
    ) -> Vec<f64> {
        if self.library.poses.view == View::Top {
            return boid.heading_rad.clone();
        }
        let stiffness = rotation::stiffness(self.library.poses.fps);
        let mut last = before.map(|before| (before.state, before.heading_rad));
        let mut headings: Vec<f64> = Vec::with_capacity(shown.len());
        for run in shown.chunk_by(|&before, &after| !is_jump(before, after)) {
            let anchor = last.map(|(before, heading)| {
                if is_jump(before, run[0]) {
                    self.rotation(run[0], heading)
                } else {
                    wrap_rad(heading - self.source_heading(before))
                }
            });
            let goals = &boid.heading_rad[headings.len()..];
            let wanted: Vec<f64> = run
                .iter()
                .zip(goals)
                .map(|(&state, &goal)| self.rotation(state, goal))
                .collect();
            let smoothed = rotation::smoothed(&wanted, anchor, stiffness);
            headings.extend(run.iter().zip(smoothed).map(|(&state, rotation)| {
                rounded(wrap_rad(self.source_heading(state) + rotation), 5)
            }));
            last = run.last().copied().zip(headings.last().copied());
        }
        headings
    }

    fn positions(
        &self,
        heading_rad: &[f64],
        boid: &BoidTrack,
        before: Option<PreviousFrame>,
    ) -> Vec<[f64; 2]> {
        let fps = self.library.poses.fps;
        let pull = match self.params.position {
            Position::Film | Position::Leash => 1.0 - libm::exp(-1.0 / (LEASH_S * fps)),
            Position::Boid => 1.0,
            Position::Papers => 0.0,
        };
        let start = [boid.position_px[0][0], boid.position_px[0][1]];
        let mut place = before.map_or(start, |before| before.centroid_px);
        let mut places = Vec::with_capacity(heading_rad.len());
        for (t, &heading) in heading_rad.iter().enumerate() {
            let goal = [boid.position_px[t][0], boid.position_px[t][1]];
            if t > 0 || before.is_some() {
                let step_px = boid.speed_bl_per_s[t] * self.lens.length_px / fps;
                place[0] += step_px * libm::cos(heading);
                place[1] += step_px * libm::sin(heading);
            }
            for (place, goal) in place.iter_mut().zip(goal) {
                *place += pull * (goal - *place);
            }
            if self.params.position != Position::Papers {
                place = self.near(place, goal, self.depth_bl(boid.position_px[t][2]));
            }
            places.push(place.map(|px| rounded(px, 2)));
        }
        places
    }

    /// Returns the point nearest to `place` on the leash to `goal`, cut at the walls of the tank.
    fn near(&self, place: [f64; 2], goal: [f64; 2], depth_bl: f64) -> [f64; 2] {
        let off = [place[0] - goal[0], place[1] - goal[1]];
        let distance = (off[0] * off[0] + off[1] * off[1]).sqrt();
        let share = (LEASH_BL * self.lens.px_per_bl(depth_bl) / distance.max(1e-9)).min(1.0);
        let leashed = [0, 1].map(|axis| goal[axis] + share * off[axis]);
        let [from, to] = [goal, leashed].map(|px| self.lens.place_bl(px, depth_bl));
        self.lens.picture_px(self.tank.clip_segment(from, to))
    }
}
