//! How an individual gets on: by the steps that the animal took in the frames shown, each steered toward the boid
//! within what nobody sees (ALGORITHMS.md 8).

use crate::flock::individual::{BoidTrack, rounded};
use crate::flock::placement::{Before, Stage, is_jump};
use crate::geometry::wrap_rad;
use crate::library::View;

/// Time constant with which an individual is drawn to its boid.
const PULL_S: f64 = 0.5;
/// A step leads elsewhere than filmed by this share of its length at most ...
const WARP: f64 = 0.2;
/// ... or of this speed, where that is more and the animal is as fast around the frame: what hovers to and fro is drawn
/// aside as well, what rests is not.
const HOVERING_BL_PER_S: f64 = 0.2;
/// So long either way is around a frame.
const AROUND_S: f64 = 0.25;
/// From above, an animal at its usual speed is turned toward its boid at most at this share of the greatest turn rate
/// that it was seen at, besides its own turns; a slower one less, and one that rests not at all.
const STEERED: f64 = 1.0;

/// Where an individual points and is, frame by frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::flock) struct Advanced {
    pub(in crate::flock) heading_rad: Vec<f64>,
    pub(in crate::flock) centroid_px: Vec<[f64; 2]>,
}

impl Advanced {
    pub(in crate::flock) fn append(&mut self, later: Advanced) {
        self.heading_rad.extend(later.heading_rad);
        self.centroid_px.extend(later.centroid_px);
    }
}

impl Stage<'_> {
    /// Where an individual gets to that shows some frames after `before`.
    pub(in crate::flock) fn advance(
        &self,
        shown: &[(u32, bool)],
        boid: &BoidTrack,
        before: Option<Before>,
    ) -> Advanced {
        let heading_rad = match self.library.poses.view {
            View::Side => self.headings(shown, boid, before),
            View::Top => self.carried_headings(shown, boid, before),
        };
        let mut centroid_px = Vec::with_capacity(shown.len());
        let mut last = before.map(|before| (before.state, before.centroid_px));
        for (t, &state) in shown.iter().enumerate() {
            let [x, y, behind_px] = boid.position_px[t];
            let (goal, depth_bl) = ([x, y], self.depth_bl(behind_px));
            let place = match last {
                None => goal,
                Some((before, place)) => {
                    let turn = self.rotation(state, heading_rad[t]);
                    let scale = self.scale(state.0, depth_bl);
                    let step = turned(self.filmed_step_px(before, state), turn, scale);
                    let pull = 1.0 - libm::exp(-1.0 / (PULL_S * self.library.poses.fps));
                    let off = [0, 1].map(|axis| pull * (goal[axis] - place[axis] - step[axis]));
                    let hovering = self.speed_around(state.0).min(HOVERING_BL_PER_S);
                    let hovering_px =
                        scale * hovering * self.lens.length_px / self.library.poses.fps;
                    let most_px = WARP * step[0].hypot(step[1]).max(hovering_px);
                    let share = (most_px / off[0].hypot(off[1]).max(1e-9)).min(1.0);
                    [0, 1].map(|axis| place[axis] + step[axis] + share * off[axis])
                }
            };
            let place = self.kept_in(place, goal, depth_bl).map(|px| rounded(px, 2));
            centroid_px.push(place);
            last = Some((state, place));
        }
        Advanced {
            heading_rad,
            centroid_px,
        }
    }

    /// The headings from above: each as much further as the animal turned, and steered.
    fn carried_headings(
        &self,
        shown: &[(u32, bool)],
        boid: &BoidTrack,
        before: Option<Before>,
    ) -> Vec<f64> {
        let fps = self.library.poses.fps;
        let most_rad = STEERED * self.calibration.turn_rad_per_s / fps;
        let pull = 1.0 - libm::exp(-1.0 / (PULL_S * fps));
        let mut last = before.map(|before| (before.state, before.heading_rad));
        let mut headings = Vec::with_capacity(shown.len());
        for (&state, &goal) in shown.iter().zip(&boid.heading_rad) {
            let heading = match last {
                None => goal,
                Some((before, heading)) => {
                    let heading = heading + self.filmed_turn_rad(before, state);
                    let speed = self.motion[state.0 as usize].speed_bl_per_s;
                    let most_rad = most_rad * (speed / self.calibration.cruise_bl_per_s).min(1.0);
                    heading + (pull * wrap_rad(goal - heading)).clamp(-most_rad, most_rad)
                }
            };
            let heading = rounded(wrap_rad(heading), 5);
            headings.push(heading);
            last = Some((state, heading));
        }
        headings
    }

    /// How far the animal turned before a frame: in the film, where the frame before is shown before; as fast as it turned
    /// there, where it is jumped to.
    fn filmed_turn_rad(&self, before: (u32, bool), state: (u32, bool)) -> f64 {
        if !is_jump(before, state) {
            return wrap_rad(self.source_heading(state) - self.source_heading(before));
        }
        let rate = self.motion[state.0 as usize].turn_rad_per_s / self.library.poses.fps;
        if state.1 { -rate } else { rate }
    }

    /// The same of its way in the picture, pixels.
    fn filmed_step_px(&self, before: (u32, bool), state: (u32, bool)) -> [f64; 2] {
        let poses = &self.library.poses.frames;
        let [from, to] = [before, state].map(|state| poses[state.0 as usize].centroid_px);
        let step = match (is_jump(before, state), from, to) {
            (false, Some(from), Some(to)) => [to[0] - from[0], to[1] - from[1]],
            _ => {
                let velocity = self.motion[state.0 as usize].velocity_bl_per_s;
                velocity.map(|v| v * self.lens.length_px / self.library.poses.fps)
            }
        };
        if state.1 { [-step[0], step[1]] } else { step }
    }

    /// The mean speed in the frames around one, body lengths a second.
    fn speed_around(&self, frame: u32) -> f64 {
        let reach = (AROUND_S * self.library.poses.fps).round() as usize;
        let frame = frame as usize;
        let around = frame.saturating_sub(reach)..(frame + reach + 1).min(self.motion.len());
        let n = around.len() as f64;
        let speeds = self.motion[around].iter().map(|moved| moved.speed_bl_per_s);
        speeds.sum::<f64>() / n
    }

    /// A place within the tank: that, or on the way to it from the boid.
    fn kept_in(&self, place: [f64; 2], goal: [f64; 2], depth_bl: f64) -> [f64; 2] {
        let [from, to] = [goal, place].map(|px| self.lens.place_bl(px, depth_bl));
        match self.tank.holds(to) {
            true => place,
            false => self.lens.picture_px(self.tank.on_the_way(from, to)),
        }
    }
}

fn turned(step: [f64; 2], turn_rad: f64, scale: f64) -> [f64; 2] {
    let (cos, sin) = (scale * libm::cos(turn_rad), scale * libm::sin(turn_rad));
    [cos * step[0] - sin * step[1], sin * step[0] + cos * step[1]]
}
