//! Where and how each frame of a plan is shown: rotation within the budget, position along the shown
//! heading on a leash to the boid, cross-fades at jumps (ALGORITHMS.md 8; O 5.2).

use super::individual::{BoidTrack, Fade, rounded};
use super::params::{Params, Position};
use super::plan::cost::FrameMotion;
use crate::geometry::angle::mirrored_rad;
use crate::geometry::wrap_rad;
use crate::library::{Library, View};

/// Time constant of the rotation.
const ROTATION_S: f64 = 0.1;
/// Time constant with which an individual is drawn to its boid.
const LEASH_S: f64 = 0.5;
/// The leash's length.
const LEASH_BL: f64 = 0.5;

/// Everything that placing depends on besides the individual.
pub struct Stage<'a> {
    /// The library shown.
    pub library: &'a Library,
    /// The motion of its frames.
    pub motion: &'a [FrameMotion],
    /// What was asked for.
    pub params: &'a Params,
    /// A body length.
    pub length_px: f64,
    /// Least and greatest place of a centroid.
    pub corners_px: [[f64; 2]; 2],
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
    /// Second sprites around jumps.
    pub fades: Vec<Fade>,
}

/// Whether something else than the next frame is shown after `before`.
pub fn is_jump(before: (u32, bool), after: (u32, bool)) -> bool {
    after != (before.0 + 1, before.1)
}

impl Stage<'_> {
    /// Places one individual.
    pub fn place(&self, shown: &[(u32, bool)], boid: &BoidTrack) -> Placed {
        let heading_rad = self.headings(shown, boid);
        let rotation_rad = shown
            .iter()
            .zip(&heading_rad)
            .map(|(&state, &heading)| rounded(self.rotation(state, heading), 5))
            .collect();
        Placed {
            rotation_rad,
            centroid_px: self.positions(&heading_rad, boid),
            fades: self.fades(shown, &heading_rad),
            heading_rad,
        }
    }

    /// The heading of a source frame on its mirror side.
    fn source_heading(&self, (frame, mirrored): (u32, bool)) -> f64 {
        let heading = self.motion[frame as usize].heading_rad;
        if mirrored {
            mirrored_rad(heading)
        } else {
            heading
        }
    }

    /// The rotation that shows a source frame with a heading, as far as the view allows.
    fn rotation(&self, state: (u32, bool), heading_rad: f64) -> f64 {
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
    fn headings(&self, shown: &[(u32, bool)], boid: &BoidTrack) -> Vec<f64> {
        if self.library.poses.view == View::Top {
            return boid.heading_rad.clone();
        }
        let keep = libm::exp(-1.0 / (ROTATION_S * self.library.poses.fps));
        let mut rotation = self.rotation(shown[0], boid.heading_rad[0]);
        let mut headings: Vec<f64> = Vec::with_capacity(shown.len());
        for (t, &state) in shown.iter().enumerate() {
            if t > 0 && is_jump(shown[t - 1], state) {
                rotation = self.rotation(state, headings[t - 1]);
            }
            let wanted = self.rotation(state, boid.heading_rad[t]);
            rotation = wanted + keep * (rotation - wanted);
            headings.push(rounded(wrap_rad(self.source_heading(state) + rotation), 5));
        }
        headings
    }

    fn positions(&self, heading_rad: &[f64], boid: &BoidTrack) -> Vec<[f64; 2]> {
        let fps = self.library.poses.fps;
        let pull = match self.params.position {
            Position::Leash => 1.0 - libm::exp(-1.0 / (LEASH_S * fps)),
            Position::Boid => 1.0,
            Position::Papers => 0.0,
        };
        let mut place = [boid.position_px[0][0], boid.position_px[0][1]];
        let mut places = Vec::with_capacity(heading_rad.len());
        for (t, &heading) in heading_rad.iter().enumerate() {
            let goal = [boid.position_px[t][0], boid.position_px[t][1]];
            if t > 0 {
                let step_px = boid.speed_bl_per_s[t] * self.length_px / fps;
                place[0] += step_px * libm::cos(heading);
                place[1] += step_px * libm::sin(heading);
            }
            for (place, goal) in place.iter_mut().zip(goal) {
                *place += pull * (goal - *place);
            }
            if self.params.position != Position::Papers {
                self.keep_near(&mut place, goal);
            }
            places.push(place.map(|px| rounded(px, 2)));
        }
        places
    }

    /// Within the leash of the boid, and inside the picture.
    fn keep_near(&self, place: &mut [f64; 2], goal: [f64; 2]) {
        let off = [place[0] - goal[0], place[1] - goal[1]];
        let distance = (off[0] * off[0] + off[1] * off[1]).sqrt();
        let most = LEASH_BL * self.length_px;
        if distance > most {
            *place = std::array::from_fn(|axis| goal[axis] + off[axis] * most / distance);
        }
        let [least, greatest] = self.corners_px;
        *place = std::array::from_fn(|axis| place[axis].clamp(least[axis], greatest[axis]));
    }

    fn fades(&self, shown: &[(u32, bool)], heading_rad: &[f64]) -> Vec<Fade> {
        let jumps: Vec<usize> = (1..shown.len())
            .filter(|&t| is_jump(shown[t - 1], shown[t]))
            .collect();
        let mut fades = Vec::new();
        for (k, &t) in jumps.iter().enumerate() {
            let before = if k > 0 { t - jumps[k - 1] } else { t };
            let after = jumps.get(k + 1).copied().unwrap_or(shown.len()) - t;
            let half = (self.params.fade_frames as usize / 2)
                .min(before / 2)
                .min(after / 2);
            if half > 0 {
                let halves = self.fade(shown, heading_rad, t, half);
                fades.extend(halves.into_iter().flatten());
            }
        }
        fades
    }

    /// The `half` frames before the jump at `t`, under which comes what follows, and the `half`
    /// after it, under which goes what was; `None` when the footage lacks one of them.
    fn fade(
        &self,
        shown: &[(u32, bool)],
        heading_rad: &[f64],
        t: usize,
        half: usize,
    ) -> Option<[Fade; 2]> {
        let (old, new) = (shown[t - 1], shown[t]);
        let mut sides: [Fade; 2] = [(t - half, new.1), (t, old.1)].map(|(start, mirrored)| Fade {
            start: start as u32,
            source_frame: Vec::new(),
            mirrored,
            rotation_rad: Vec::new(),
            weight: Vec::new(),
        });
        for (u, &heading) in heading_rad.iter().enumerate().take(t + half).skip(t - half) {
            let share = ((u + half - t) as f64 + 0.5) / (2 * half) as f64;
            let coming = share * share * (3.0 - 2.0 * share);
            let (side, frame, mirrored, weight) = match u < t {
                true => (0, new.0.checked_sub((t - u) as u32)?, new.1, coming),
                false => (1, old.0 + (u - t + 1) as u32, old.1, 1.0 - coming),
            };
            let sprites = &self.library.sprites;
            if frame as usize >= sprites.n_frames() || !sprites.is_present(frame as usize) {
                return None;
            }
            let rotation = self.rotation((frame, mirrored), heading);
            sides[side].source_frame.push(frame);
            sides[side].rotation_rad.push(rounded(rotation, 5));
            sides[side].weight.push(rounded(weight, 4));
        }
        Some(sides)
    }
}
