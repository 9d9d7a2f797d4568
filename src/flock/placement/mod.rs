//! Where and how each frame of a plan is shown: rotation within the budget, position along the shown
//! heading on a leash to the boid, cross-fades at jumps (ALGORITHMS.md 8; O 5.2).

mod fades;

use rayon::prelude::*;

use self::fades::Way;
use super::boids::calibration::Calibration;
use super::boids::tank::Tank;
use super::individual::{BoidTrack, Fade, rounded};
use super::lens::Lens;
use super::motion::FrameMotion;
use super::params::{Params, Position};
use super::rotation;
use crate::geometry::angle::mirrored_rad;
use crate::geometry::wrap_rad;
use crate::library::{Library, View};
use crate::random;

/// Time constant with which an individual is drawn to its boid.
const LEASH_S: f64 = 0.5;
/// The leash's length.
const LEASH_BL: f64 = 0.5;

/// A loop is gone round so many times before rotation and leash are as they were a round before.
const N_ROUNDS: usize = 4;

/// A sprite is drawn no smaller and no larger than this.
const LEAST_SCALE: f64 = 0.2;
const GREATEST_SCALE: f64 = 1.5;
/// First word of the keys of random sizes; boids use other words.
const SIZE: u64 = 0x517e;

/// Everything that placing depends on besides the individual.
pub struct Stage<'a> {
    /// The library shown.
    pub library: &'a Library,
    /// The motion of its frames.
    pub motion: &'a [FrameMotion],
    /// What was asked for.
    pub params: &'a Params,
    /// How the tank is seen.
    pub lens: &'a Lens,
    /// Where individuals may be.
    pub tank: &'a Tank,
    /// What the animal was seen to do.
    pub calibration: &'a Calibration,
}

/// How an individual is shown.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Placed {
    /// The sprite's rotation.
    pub rotation_rad: Vec<f64>,
    /// The direction of its head.
    pub heading_rad: Vec<f64>,
    /// Its centroid.
    pub centroid_px: Vec<[f64; 2]>,
    /// The direction in space, where the tank has depth.
    pub forward: Option<Vec<[f64; 3]>>,
    /// Its size relative to the footage.
    pub scale: Vec<f64>,
    /// Its depth in the camera's frame, where metres are known.
    pub depth_m: Option<Vec<f64>>,
    /// Second sprites around jumps.
    pub fades: Vec<Fade>,
}

/// How the frame before the first is shown, in a loop or by the segment before.
#[derive(Clone, Copy)]
pub(super) struct Before {
    pub(super) state: (u32, bool),
    pub(super) heading_rad: f64,
    pub(super) centroid_px: [f64; 2],
}

/// Whether something else than the next frame is shown after `before`.
pub fn is_jump(before: (u32, bool), after: (u32, bool)) -> bool {
    after != (before.0 + 1, before.1)
}

impl Stage<'_> {
    /// Places all individuals of a film, by id; of a loop with the heir of each.
    pub fn placed(
        &self,
        shown: &[Vec<(u32, bool)>],
        boids: &[BoidTrack],
        heirs: Option<&[u32]>,
    ) -> Vec<Placed> {
        let shown: Vec<&[(u32, bool)]> = shown.iter().map(Vec::as_slice).collect();
        match heirs {
            Some(heirs) => self.place_loop(&shown, boids, heirs),
            None => self.place(&shown, boids),
        }
    }

    fn place(&self, shown: &[&[(u32, bool)]], boids: &[BoidTrack]) -> Vec<Placed> {
        (shown.par_iter().zip(boids).enumerate())
            .map(|(id, (shown, boid))| self.place_one((shown, self.size(id)), boid, None))
            .collect()
    }

    /// Places all individuals, by id, so that the last frame of each plays into the first of its heir.
    fn place_loop(
        &self,
        shown: &[&[(u32, bool)]],
        boids: &[BoidTrack],
        heirs: &[u32],
    ) -> Vec<Placed> {
        let mut placed = self.place(shown, boids);
        for _ in 0..N_ROUNDS {
            let mut before = vec![None; shown.len()];
            for (id, &heir) in heirs.iter().enumerate() {
                let last = shown[id].len() - 1;
                before[heir as usize] = Some(Before {
                    state: shown[id][last],
                    heading_rad: placed[id].heading_rad[last],
                    centroid_px: placed[id].centroid_px[last],
                });
            }
            placed = (shown.par_iter().zip(boids).zip(before))
                .map(|((shown, boid), before)| self.place_one((shown, 1.0), boid, before))
                .collect();
        }
        let fades = self.fades_across(shown, boids, heirs, &placed);
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
        (shown, size): (&[(u32, bool)], f64),
        boid: &BoidTrack,
        before: Option<Before>,
    ) -> Placed {
        let heading_rad = self.headings(shown, boid, before);
        let centroid_px = self.positions(&heading_rad, boid, before);
        self.with_fades((shown, size), boid, (heading_rad, centroid_px))
    }

    /// An individual of that size with these headings and positions.
    pub(super) fn with_fades(
        &self,
        (shown, size): (&[(u32, bool)], f64),
        boid: &BoidTrack,
        (heading_rad, centroid_px): (Vec<f64>, Vec<[f64; 2]>),
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
            scale: (shown.iter().zip(&depth_bl))
                .map(|(state, &depth_bl)| self.scale(state.0, depth_bl, size))
                .collect(),
            depth_m: (depth_bl.iter())
                .map(|&bl| Some(rounded(self.lens.metres(bl)?, 5)))
                .collect(),
            fades: self.fades(
                &Way {
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

    /// How far from the camera is what lies so far behind the tank's front.
    pub(super) fn depth_bl(&self, behind_px: f64) -> f64 {
        self.tank.corners[0][2] + behind_px / self.lens.length_px
    }

    /// The size of an individual relative to the filmed animal.
    pub(super) fn size(&self, id: usize) -> f64 {
        let spread = 2.0 * random::unit(self.params.seed, &[SIZE, id as u64]) - 1.0;
        rounded(1.0 + self.params.variation * spread, 3)
    }

    /// The scale at which an individual of that size shows a frame at another depth (ALGORITHMS.md 8).
    pub(super) fn scale(&self, frame: u32, depth_bl: f64, size: f64) -> f64 {
        if self.lens.is_flat() {
            return size;
        }
        let filmed_px = self.lens.px_per_bl(self.motion[frame as usize].depth_bl);
        let scale = size * self.lens.px_per_bl(depth_bl) / filmed_px;
        rounded(scale.clamp(LEAST_SCALE, GREATEST_SCALE), 4)
    }

    /// The heading of a source frame on its mirror side.
    pub(super) fn source_heading(&self, (frame, mirrored): (u32, bool)) -> f64 {
        let heading = self.motion[frame as usize].heading_rad;
        if mirrored {
            mirrored_rad(heading)
        } else {
            heading
        }
    }

    /// The direction in space of a source frame on its mirror side, turned in the picture.
    fn forward(&self, (frame, mirrored): (u32, bool), turn_rad: f64) -> [f64; 3] {
        let [x, y, z] = self.motion[frame as usize].forward;
        let x = if mirrored { -x } else { x };
        let (cos, sin) = (libm::cos(turn_rad), libm::sin(turn_rad));
        [cos * x - sin * y, sin * x + cos * y, z].map(|part| rounded(part, 5))
    }

    /// The rotation that shows a source frame with a heading, as far as the view allows.
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

    /// The headings shown. In top view the boid's own. In side view the frame's, rotated toward the
    /// boid's; the rotation follows slowly, and at a jump takes up what it can of the step.
    pub(super) fn headings(
        &self,
        shown: &[(u32, bool)],
        boid: &BoidTrack,
        before: Option<Before>,
    ) -> Vec<f64> {
        if self.library.poses.view == View::Top {
            return boid.heading_rad.clone();
        }
        let stiffness = rotation::stiffness(self.library.poses.fps);
        let mut last = before.map(|before| (before.state, before.heading_rad));
        let mut headings: Vec<f64> = Vec::with_capacity(shown.len());
        for run in shown.chunk_by(|&before, &after| !is_jump(before, after)) {
            let anchor = last.map(|(before, heading)| match is_jump(before, run[0]) {
                true => self.rotation(run[0], heading),
                false => wrap_rad(heading - self.source_heading(before)),
            });
            let goals = &boid.heading_rad[headings.len()..];
            let wanted: Vec<f64> = run
                .iter()
                .zip(goals)
                .map(|(&state, &goal)| self.rotation(state, goal))
                .collect();
            let settled = rotation::settled(&wanted, anchor, stiffness);
            let of_run = run.iter().zip(settled);
            headings.extend(of_run.map(|(&state, rotation)| {
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
        before: Option<Before>,
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

    /// Within the leash of the boid at `goal`, and inside the tank.
    fn near(&self, place: [f64; 2], goal: [f64; 2], depth_bl: f64) -> [f64; 2] {
        let off = [place[0] - goal[0], place[1] - goal[1]];
        let distance = (off[0] * off[0] + off[1] * off[1]).sqrt();
        let share = (LEASH_BL * self.lens.px_per_bl(depth_bl) / distance.max(1e-9)).min(1.0);
        let leashed = [0, 1].map(|axis| goal[axis] + share * off[axis]);
        let [from, to] = [goal, leashed].map(|px| self.lens.place_bl(px, depth_bl));
        self.lens.picture_px(self.tank.on_the_way(from, to))
    }
}
