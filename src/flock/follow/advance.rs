//! Headings and positions of an individual from the filmed steps of the frames that it shows, each corrected a little toward its
//! boid.

use crate::flock::individual::{BoidTrack, rounded};
use crate::flock::placement::{Before, Stage, is_jump};
use crate::geometry::wrap_rad;
use crate::library::View;

/// Time constant with which an individual is drawn to its boid.
const PULL_S: f64 = 0.5;
/// The correction of a step is at most this share of its length: below the quarter up to which shown and filmed speeds count as
/// the same (`bench/motion.py`).
const WARP: f64 = 0.2;
/// A step of an animal that hovers may be short although the animal moves. There the same share of the mean speed around the
/// frame is allowed, up to this speed. An animal at rest has no such speed, and is not moved.
const HOVERING_BL_PER_S: f64 = 0.2;
/// Half the time over which that mean is taken.
const AROUND_S: f64 = 0.25;
/// From above, headings are corrected toward the boid at up to this share of the greatest turn rate of the boids, in proportion
/// to the speed below cruising speed: an animal at rest is not turned.
const STEERED: f64 = 1.0;

/// Headings and positions of an individual, by frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Advanced {
    pub(super) heading_rad: Vec<f64>,
    pub(super) centroid_px: Vec<[f64; 2]>,
}

impl Advanced {
    pub(super) fn append(&mut self, later: Advanced) {
        self.heading_rad.extend(later.heading_rad);
        self.centroid_px.extend(later.centroid_px);
    }
}

impl Stage<'_> {
    /// Headings and positions of an individual over the frames `shown`, which follow `before`.
    pub(super) fn advance(
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

    /// Headings in top view: each is the one before, plus the filmed turn, plus the correction.
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

    /// The filmed turn from one state to the next. At a jump, where it was not filmed: the turn rate at the target, for a frame.
    fn filmed_turn_rad(&self, before: (u32, bool), state: (u32, bool)) -> f64 {
        if !is_jump(before, state) {
            return wrap_rad(self.source_heading(state) - self.source_heading(before));
        }
        let rate = self.motion[state.0 as usize].turn_rad_per_s / self.library.poses.fps;
        if state.1 { -rate } else { rate }
    }

    /// The filmed step from one state to the next, pixels. At a jump: the velocity at the target, for a frame.
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

    /// A position within the tank: `place` itself, or the point at which the way from the boid to it leaves the tank.
    fn kept_in(&self, place: [f64; 2], goal: [f64; 2], depth_bl: f64) -> [f64; 2] {
        let [from, to] = [goal, place].map(|px| self.lens.place_bl(px, depth_bl));
        match self.tank.holds(to) {
            true => place,
            false => self.lens.picture_px(self.tank.on_the_way(from, to)),
        }
    }
}

/// A step rotated and scaled.
fn turned(step: [f64; 2], turn_rad: f64, scale: f64) -> [f64; 2] {
    let (cos, sin) = (scale * libm::cos(turn_rad), scale * libm::sin(turn_rad));
    [cos * step[0] - sin * step[1], sin * step[0] + cos * step[1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::Params;
    use crate::flock::boids::calibration::Calibration;
    use crate::flock::boids::tank::Tank;
    use crate::flock::lens::Lens;
    use crate::flock::motion::motion_of;
    use crate::flock::synthetic;

    #[test]
    fn steps_stay_near_the_filmed_ones_however_far_away_the_boid_is() {
        for view in [View::Side, View::Top] {
            let (library, params) = (synthetic::library(view), Params::default());
            let lens = Lens::of(&library, &params);
            let motion = motion_of(&library, &lens);
            let tank = Tank::of(&library, &lens, &motion, &params);
            let calibration = Calibration::of(&library, &motion, lens.is_flat());
            let stage = Stage {
                library: &library,
                motion: &motion,
                params: &params,
                lens: &lens,
                tank: &tank,
                calibration: &calibration,
            };
            let [x, y] = lens.picture_px(tank.middle);
            let shown: Vec<(u32, bool)> = (100..130).map(|frame| (frame, false)).collect();
            let boid = BoidTrack {
                position_px: vec![[x + 60.0, y + 20.0, 0.0]; shown.len()],
                heading_rad: vec![2.0; shown.len()],
                ..BoidTrack::default()
            };
            let before = Before {
                state: (99, false),
                heading_rad: motion[99].heading_rad,
                centroid_px: [x, y],
            };
            let advanced = stage.advance(&shown, &boid, Some(before));
            for t in 1..shown.len() {
                let [from, to] = [t - 1, t].map(|t| advanced.centroid_px[t]);
                let [dx, dy] = stage.filmed_step_px(shown[t - 1], shown[t]);
                let filmed_px = stage.scale(shown[t].0, stage.depth_bl(0.0)) * dx.hypot(dy);
                let step_px = (to[0] - from[0]).hypot(to[1] - from[1]);
                let gap_px = (step_px - filmed_px).abs();
                assert!(
                    gap_px < 0.25 * filmed_px + 0.05,
                    "{view:?} {t}: {step_px} {filmed_px}"
                );
            }
        }
    }
}
