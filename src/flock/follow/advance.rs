//! Headings and positions of individuals with `position: film`: the filmed steps of the frames shown, each
//! corrected a little toward the boid.

use rayon::prelude::*;

use super::company::{self, CLEAR_BL, Mover};
use super::perches::{self, Perches, Way};
use crate::flock::individual::BoidTrack;
use crate::flock::placement::{Before, Stage, is_jump};
use crate::geometry::{rounded, wrap_rad};
use crate::library::View;

/// Time constant with which an individual is drawn to its boid, seconds. Free choice.
const PULL_S: f64 = 0.5;
/// Largest correction of a step, as a share of its length. It stays below the quarter up to which
/// `bench/flocks.py` counts shown and filmed speeds as equal.
const WARP: f64 = 0.2;
/// A hovering animal has short steps although it moves. The mean speed around the frame then sets the limit
/// of the correction, up to this speed, body lengths per second. Free choice.
const HOVERING_BL_PER_S: f64 = 0.2;
/// Time before and after a frame over which that mean is taken, seconds. Free choice.
const AROUND_S: f64 = 0.25;
/// Distance beside the boid to which an animal that avoids others is drawn, body lengths. Free choice.
const ASIDE_BL: f64 = 1.0;
/// Top view: weight of the way to the boid in the wanted course, per body length. The direction of the boid
/// has weight 1. Free choice.
const PURSUED_PER_BL: f64 = 1.0;
/// Top view: weight of the avoidance of others in the wanted course. Free choice.
const EVADED: f64 = 2.0;
/// Top view: time constant with which headings follow the wanted course, seconds. Free choice.
const TURN_S: f64 = 0.25;
/// Top view: largest correction of the heading, as a share of the greatest turn rate of boids. It shrinks
/// with the speed below cruising speed, so that an animal at rest is not turned. Free choice.
const STEERED: f64 = 1.0;

/// Headings, radians, and positions, pixels, of an individual by frame.
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

/// Position and heading of a boid, and the size of its animal.
#[derive(Clone, Copy, Debug)]
struct Goal {
    centroid_px: [f64; 2],
    behind_px: f64,
    heading_rad: f64,
    size: f64,
}

impl Goal {
    fn of(boid: &BoidTrack, t: usize, size: f64) -> Goal {
        let [x, y, behind_px] = boid.position_px[t];
        Goal {
            centroid_px: [x, y],
            behind_px,
            heading_rad: boid.heading_rad[t],
            size,
        }
    }

    /// Returns the goal at a resting place, if there is one.
    fn or_at(self, seat: Option<[f64; 2]>) -> Goal {
        Goal {
            centroid_px: seat.unwrap_or(self.centroid_px),
            ..self
        }
    }
}

impl Stage<'_> {
    /// Returns headings and positions of all individuals over the frames `shown`, which follow `before`, by
    /// id. In side view, individuals that come to rest are led to `perches`.
    pub(super) fn advance(
        &self,
        shown: &[Vec<(u32, bool)>],
        boids: &[BoidTrack],
        before: &[Option<Before>],
        perches: &Perches,
    ) -> Vec<Advanced> {
        let is_flat = self.library.poses.view == View::Top;
        let headings = |id: usize| match is_flat {
            true => Vec::new(),
            false => self.headings(&shown[id], &boids[id], before[id]),
        };
        let mut advanced: Vec<Advanced> = (0..shown.len())
            .into_par_iter()
            .map(|id| Advanced {
                heading_rad: headings(id),
                centroid_px: Vec::new(),
            })
            .collect();
        let ways = |(id, one): (usize, &Advanced)| {
            let shown = (&shown[id][..], self.size(id));
            self.ways_to_rest(shown, &one.heading_rad, &boids[id], before[id])
        };
        let ways: Vec<Vec<Way>> = advanced.par_iter().enumerate().map(ways).collect();
        let seats = self.seats(shown, boids, before, perches);
        let mut last: Vec<Option<Before>> = before.to_vec();
        for t in 0..shown.first().map_or(0, Vec::len) {
            let others: Vec<[f64; 2]> = last.iter().flatten().map(|one| one.centroid_px).collect();
            let asides = match is_flat {
                true => self.asides(&last),
                false => vec![[0.0; 2]; last.len()],
            };
            let each = advanced
                .par_iter_mut()
                .zip(&mut last)
                .zip(asides)
                .enumerate();
            each.with_min_len(64)
                .for_each(|(id, ((one, last), aside))| {
                    let state = shown[id][t];
                    let seat = seats[id].filter(|_| t == 0);
                    let goal = Goal::of(&boids[id], t, self.size(id)).or_at(seat);
                    if is_flat {
                        one.heading_rad
                            .push(self.carried_heading(state, goal, *last, aside));
                    }
                    let heading_rad = one.heading_rad[t];
                    let landing =
                        last.zip(ways[id].get(t).copied().flatten())
                            .and_then(|(before, way)| {
                                let clear_px = CLEAR_BL * self.lens.length_px;
                                way.correction(before.centroid_px, perches, &others, clear_px)
                            });
                    let corrections = (aside, landing);
                    let centroid_px =
                        self.carried_centroid((state, heading_rad), goal, *last, corrections);
                    one.centroid_px.push(centroid_px);
                    *last = Some(Before {
                        state,
                        heading_rad,
                        centroid_px,
                    });
                });
        }
        advanced
    }

    /// Returns the avoidance vector of each individual.
    fn asides(&self, last: &[Option<Before>]) -> Vec<[f64; 2]> {
        let movers: Vec<Mover> = last
            .iter()
            .map(|before| {
                before.map_or(Mover::default(), |before| {
                    let turn = self.rotation(before.state, before.heading_rad);
                    let moved = &self.motion[before.state.0 as usize];
                    let [vx, vy] = moved.velocity_bl_per_s;
                    let side = if before.state.1 { -1.0 } else { 1.0 };
                    Mover {
                        position_bl: before.centroid_px.map(|px| px / self.lens.length_px),
                        velocity_bl_per_s: turned([side * vx, vy], turn, 1.0),
                        is_there: true,
                    }
                })
            })
            .collect();
        company::asides(&movers)
    }

    /// Returns the position after a filmed step and its correction, pixels.
    fn carried_centroid(
        &self,
        (state, heading_rad): ((u32, bool), f64),
        goal: Goal,
        last: Option<Before>,
        (aside, landing): ([f64; 2], Option<[f64; 2]>),
    ) -> [f64; 2] {
        let depth_bl = self.depth_bl(goal.behind_px);
        let Some(before) = last else {
            return self
                .kept_in(goal.centroid_px, goal.centroid_px, depth_bl)
                .map(|px| rounded(px, 2));
        };
        let fps = self.library.poses.fps;
        let scale = self.scale(state.0, depth_bl, goal.size);
        let step = self.shown_step_px(before.state, (state, heading_rad), (depth_bl, goal.size));
        let pull = 1.0 - libm::exp(-1.0 / (PULL_S * fps));
        let wanted = [0, 1].map(|axis| {
            goal.centroid_px[axis] - before.centroid_px[axis] - step[axis]
                + ASIDE_BL * self.lens.length_px * aside[axis]
        });
        let off = landing.unwrap_or(wanted.map(|px| pull * px));
        let hovering = self.speed_around(state.0).min(HOVERING_BL_PER_S);
        let hovering_px = scale * hovering * self.lens.length_px / fps;
        let most_px = WARP * step[0].hypot(step[1]).max(hovering_px);
        let share = (most_px / off[0].hypot(off[1]).max(1e-9)).min(1.0);
        let place = [0, 1].map(|axis| before.centroid_px[axis] + step[axis] + share * off[axis]);
        self.kept_in(place, goal.centroid_px, depth_bl)
            .map(|px| rounded(px, 2))
    }

    /// Returns the filmed step as shown, rotated and scaled, without a correction, pixels.
    fn shown_step_px(
        &self,
        before: (u32, bool),
        (state, heading_rad): ((u32, bool), f64),
        (depth_bl, size): (f64, f64),
    ) -> [f64; 2] {
        let turn = self.rotation(state, heading_rad);
        turned(
            self.filmed_step_px(before, state),
            turn,
            self.scale(state.0, depth_bl, size),
        )
    }

    /// Returns the remaining way to the next rest, by frame. Empty in top view.
    fn ways_to_rest(
        &self,
        (shown, size): (&[(u32, bool)], f64),
        heading_rad: &[f64],
        boid: &BoidTrack,
        before: Option<Before>,
    ) -> Vec<Way> {
        let mut last = before.map(|before| before.state);
        let steps = shown.iter().zip(heading_rad).zip(&boid.position_px);
        let steps: Vec<(bool, [f64; 2])> = steps
            .map(|((&state, &heading_rad), place)| {
                let depth_bl = self.depth_bl(place[2]);
                let step = last.map_or([0.0; 2], |before| {
                    self.shown_step_px(before, (state, heading_rad), (depth_bl, size))
                });
                last = Some(state);
                (perches::rests(&self.motion[state.0 as usize]), step)
            })
            .collect();
        perches::ways(
            &steps,
            (perches::REST_S * self.library.poses.fps).ceil() as usize,
        )
    }

    /// Returns the resting place of each individual that starts at rest, else `None`.
    fn seats(
        &self,
        shown: &[Vec<(u32, bool)>],
        boids: &[BoidTrack],
        before: &[Option<Before>],
        perches: &Perches,
    ) -> Vec<Option<[f64; 2]>> {
        let mut taken = Vec::new();
        (0..shown.len())
            .map(|id| {
                let &(frame, _) = shown[id].first().filter(|_| before[id].is_none())?;
                let goal = Goal::of(&boids[id], 0, self.size(id)).centroid_px;
                let seat = perches::rests(&self.motion[frame as usize])
                    .then(|| perches.nearest(goal, &taken, CLEAR_BL * self.lens.length_px))??;
                taken.push(seat);
                Some(seat)
            })
            .collect()
    }

    /// Returns a heading in top view, radians: the previous one, the filmed turn and a correction.
    fn carried_heading(
        &self,
        state: (u32, bool),
        goal: Goal,
        last: Option<Before>,
        aside: [f64; 2],
    ) -> f64 {
        let Some(before) = last else {
            return goal.heading_rad;
        };
        let fps = self.library.poses.fps;
        let heading = before.heading_rad + self.filmed_turn_rad(before.state, state);
        let course = [libm::cos(goal.heading_rad), libm::sin(goal.heading_rad)];
        let [x, y] = [0, 1].map(|axis| {
            let behind_bl =
                (goal.centroid_px[axis] - before.centroid_px[axis]) / self.lens.length_px;
            course[axis] + PURSUED_PER_BL * behind_bl + EVADED * aside[axis]
        });
        let speed = self.motion[state.0 as usize].speed_bl_per_s;
        let most_rad = STEERED * self.calibration.turn_rad_per_s / fps
            * (speed / self.calibration.cruise_bl_per_s).min(1.0);
        let pull = 1.0 - libm::exp(-1.0 / (TURN_S * fps));
        let wanted = wrap_rad(libm::atan2(y, x) - heading);
        rounded(
            wrap_rad(heading + (pull * wanted).clamp(-most_rad, most_rad)),
            5,
        )
    }

    /// Returns the filmed turn, radians. At a jump, the turn rate at the target over one frame.
    fn filmed_turn_rad(&self, before: (u32, bool), state: (u32, bool)) -> f64 {
        if !is_jump(before, state) {
            return wrap_rad(self.source_heading(state) - self.source_heading(before));
        }
        let rate = self.motion[state.0 as usize].turn_rad_per_s / self.library.poses.fps;
        if state.1 { -rate } else { rate }
    }

    /// Returns the filmed step, pixels. At a jump, the velocity at the target over one frame.
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

    /// Returns the mean speed in the frames around `frame`, body lengths per second.
    fn speed_around(&self, frame: u32) -> f64 {
        let reach = (AROUND_S * self.library.poses.fps).round() as usize;
        let frame = frame as usize;
        let around = frame.saturating_sub(reach)..(frame + reach + 1).min(self.motion.len());
        let speeds = self.motion[around].iter().map(|moved| moved.speed_bl_per_s);
        speeds.clone().sum::<f64>() / speeds.len() as f64
    }

    /// Returns `place`, or the point at which the line from the boid to it leaves the tank.
    fn kept_in(&self, place: [f64; 2], goal: [f64; 2], depth_bl: f64) -> [f64; 2] {
        let [from, to] = [goal, place].map(|px| self.lens.place_bl(px, depth_bl));
        match self.tank.contains(to) {
            true => place,
            false => self.lens.picture_px(self.tank.clip_segment(from, to)),
        }
    }
}

/// Returns a step, rotated and scaled.
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
            let tank = Tank::from_library(&library, &lens, &motion, &params);
            let calibration = Calibration::from_library(&library, &motion, lens.is_flat());
            let stage = Stage {
                library: &library,
                motion: &motion,
                params: &params,
                lens: &lens,
                tank: &tank,
                calibration: &calibration,
            };
            let [x, y] = lens.picture_px(tank.center);
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
            let advanced = &stage.advance(
                std::slice::from_ref(&shown),
                &[boid],
                &[Some(before)],
                &Perches::default(),
            )[0];
            for t in 1..shown.len() {
                let [from, to] = [t - 1, t].map(|t| advanced.centroid_px[t]);
                let [dx, dy] = stage.filmed_step_px(shown[t - 1], shown[t]);
                let filmed_px =
                    stage.scale(shown[t].0, stage.depth_bl(0.0), stage.size(0)) * dx.hypot(dy);
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
