//! Headings and positions of individuals with `position: film`: the filmed steps of the frames shown, each
//! corrected a little toward the boid.

use rayon::prelude::*;

use super::avoidance::{CLEARANCE_BL, Mover, avoidance_vectors};
use super::resting_places::{self, RestingPlaces, WayToRest};
use crate::flock::individual::BoidTrack;
use crate::flock::placement::{Placer, PreviousFrame, is_jump};
use crate::geometry::{rounded, wrap_rad};
use crate::library::View;

/// Time constant with which an individual is drawn to its boid, seconds. Free choice.
const PULL_S: f64 = 0.5;
/// Largest correction of a step, as a share of its length. It stays below the quarter up to which
/// `bench/flocks.py` counts shown and filmed speeds as equal.
const MAX_CORRECTION_SHARE: f64 = 0.2;
/// A hovering animal has short steps although it moves. The mean speed around the frame then sets the limit
/// of the correction, up to this speed, body lengths per second. Free choice.
const HOVERING_BL_PER_S: f64 = 0.2;
/// Time before and after a frame over which that mean is taken, seconds. Free choice.
const SPEED_SPAN_S: f64 = 0.25;
/// Distance beside the boid to which an animal that avoids others is drawn, body lengths. Free choice.
const AVOIDANCE_BL: f64 = 1.0;
/// Top view: weight of the way to the boid in the wanted course, per body length. The direction of the boid
/// has weight 1. Free choice.
const PURSUIT_PER_BL: f64 = 1.0;
/// Top view: weight of the avoidance of others in the wanted course. Free choice.
const AVOIDANCE_WEIGHT: f64 = 2.0;
/// Top view: time constant with which headings follow the wanted course, seconds. Free choice.
const TURN_S: f64 = 0.25;

/// Headings, radians, and positions, pixels, of an individual by frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Trajectory {
    pub(super) heading_rad: Vec<f64>,
    pub(super) centroid_px: Vec<[f64; 2]>,
}

impl Trajectory {
    pub(super) fn append(&mut self, later: Trajectory) {
        self.heading_rad.extend(later.heading_rad);
        self.centroid_px.extend(later.centroid_px);
    }
}

/// Position and heading of a boid, and the size of its animal.
#[derive(Clone, Copy, Debug)]
struct BoidGoal {
    centroid_px: [f64; 2],
    behind_px: f64,
    heading_rad: f64,
    size: f64,
}

/// Corrections of a step.
#[derive(Clone, Copy, Debug)]
struct Corrections {
    /// Avoidance vector.
    avoidance: [f64; 2],
    /// Correction that leads to a resting place, pixels. It replaces all others.
    landing: Option<[f64; 2]>,
}

impl BoidGoal {
    fn new(boid: &BoidTrack, t: usize, size: f64) -> BoidGoal {
        let [x, y, behind_px] = boid.position_px[t];
        BoidGoal {
            centroid_px: [x, y],
            behind_px,
            heading_rad: boid.heading_rad[t],
            size,
        }
    }
}

impl Placer<'_> {
    /// Returns headings and positions of all individuals over the frames `shown`, by id. `before` holds the
    /// frames that precede them, if any. In side view, individuals that come to rest are led to
    /// `resting_places`.
    pub(super) fn advance(
        &self,
        shown: &[Vec<(u32, bool)>],
        boids: &[BoidTrack],
        before: Option<&[PreviousFrame]>,
        resting_places: &RestingPlaces,
    ) -> Vec<Trajectory> {
        let is_flat = self.library.poses.view == View::Top;
        let start = |id: usize| {
            let (shown, boid) = (&shown[id], &boids[id]);
            let before = before.map(|before| before[id]);
            let mut trajectory = Trajectory::default();
            if !is_flat {
                trajectory.heading_rad = self.headings(shown, boid, before);
            }
            let ways =
                self.ways_to_rest(shown, &trajectory.heading_rad, boid, before, self.size(id));
            (trajectory, ways)
        };
        let (mut trajectories, ways): (Vec<Trajectory>, Vec<Vec<Option<WayToRest>>>) =
            (0..shown.len()).into_par_iter().map(start).unzip();
        let mut last = match before {
            Some(before) => before.to_vec(),
            None => self.first_frames(shown, boids, &mut trajectories, resting_places),
        };
        let clearance_px = CLEARANCE_BL * self.lens.length_px;
        for t in usize::from(before.is_none())..shown.first().map_or(0, Vec::len) {
            let others: Vec<[f64; 2]> = last.iter().map(|one| one.centroid_px).collect();
            let avoidance = if is_flat {
                self.avoidance(&last)
            } else {
                vec![[0.0; 2]; last.len()]
            };
            let each = (trajectories.par_iter_mut().zip(&mut last).zip(avoidance)).enumerate();
            each.with_min_len(64)
                .for_each(|(id, ((one, last), avoidance))| {
                    let state = shown[id][t];
                    let goal = BoidGoal::new(&boids[id], t, self.size(id));
                    if is_flat {
                        let heading = self.next_heading(state, goal, *last, avoidance);
                        one.heading_rad.push(heading);
                    }
                    let heading_rad = one.heading_rad[t];
                    let landing = ways[id].get(t).copied().flatten().and_then(|way| {
                        way.correction(last.centroid_px, resting_places, &others, clearance_px)
                    });
                    let corrections = Corrections { avoidance, landing };
                    let centroid_px =
                        self.next_centroid(state, heading_rad, goal, *last, corrections);
                    one.centroid_px.push(centroid_px);
                    *last = PreviousFrame {
                        state,
                        heading_rad,
                        centroid_px,
                    };
                });
        }
        trajectories
    }

    /// Begins each trajectory at the position of its boid, or at a resting place if the animal starts at
    /// rest. Returns the first frames, by id.
    fn first_frames(
        &self,
        shown: &[Vec<(u32, bool)>],
        boids: &[BoidTrack],
        trajectories: &mut [Trajectory],
        resting_places: &RestingPlaces,
    ) -> Vec<PreviousFrame> {
        let clearance_px = CLEARANCE_BL * self.lens.length_px;
        let mut taken = Vec::new();
        let begin = |(id, one): (usize, &mut Trajectory)| {
            let state = shown[id][0];
            let goal = BoidGoal::new(&boids[id], 0, self.size(id));
            let rests = resting_places::rests(&self.motion[state.0 as usize]);
            let nearest = || resting_places.nearest(goal.centroid_px, &taken, clearance_px);
            let resting_place = rests.then(nearest).flatten();
            taken.extend(resting_place);
            let place = resting_place.unwrap_or(goal.centroid_px);
            let place = self.kept_in_tank(place, place, self.depth_bl(goal.behind_px));
            let centroid_px = place.map(|px| rounded(px, 2));
            if one.heading_rad.is_empty() {
                one.heading_rad.push(goal.heading_rad);
            }
            one.centroid_px.push(centroid_px);
            PreviousFrame {
                state,
                heading_rad: one.heading_rad[0],
                centroid_px,
            }
        };
        trajectories.iter_mut().enumerate().map(begin).collect()
    }

    /// Returns the avoidance vector of each individual.
    fn avoidance(&self, last: &[PreviousFrame]) -> Vec<[f64; 2]> {
        let mover = |before: &PreviousFrame| {
            let turn = self.rotation(before.state, before.heading_rad);
            let moved = &self.motion[before.state.0 as usize];
            let [vx, vy] = moved.velocity_bl_per_s;
            let side = if before.state.1 { -1.0 } else { 1.0 };
            Mover {
                position_bl: before.centroid_px.map(|px| px / self.lens.length_px),
                velocity_bl_per_s: turned([side * vx, vy], turn, 1.0),
            }
        };
        avoidance_vectors(&last.iter().map(mover).collect::<Vec<_>>())
    }

    /// Returns the position after a filmed step and its correction, pixels.
    fn next_centroid(
        &self,
        state: (u32, bool),
        heading_rad: f64,
        goal: BoidGoal,
        before: PreviousFrame,
        corrections: Corrections,
    ) -> [f64; 2] {
        let depth_bl = self.depth_bl(goal.behind_px);
        let fps = self.library.poses.fps;
        let scale = self.scale(state.0, depth_bl, goal.size);
        let step = self.shown_step_px(before.state, state, heading_rad, scale);
        let pull = 1.0 - libm::exp(-1.0 / (PULL_S * fps));
        let wanted = [0, 1].map(|axis| {
            goal.centroid_px[axis] - before.centroid_px[axis] - step[axis]
                + AVOIDANCE_BL * self.lens.length_px * corrections.avoidance[axis]
        });
        let off = corrections.landing.unwrap_or(wanted.map(|px| pull * px));
        let hovering = self.speed_around(state.0).min(HOVERING_BL_PER_S);
        let hovering_px = scale * hovering * self.lens.length_px / fps;
        let most_px = MAX_CORRECTION_SHARE * step[0].hypot(step[1]).max(hovering_px);
        let share = (most_px / off[0].hypot(off[1]).max(1e-9)).min(1.0);
        let place = [0, 1].map(|axis| before.centroid_px[axis] + step[axis] + share * off[axis]);
        self.kept_in_tank(place, goal.centroid_px, depth_bl)
            .map(|px| rounded(px, 2))
    }

    /// Returns the filmed step as shown, rotated and scaled, without a correction, pixels.
    fn shown_step_px(
        &self,
        before: (u32, bool),
        state: (u32, bool),
        heading_rad: f64,
        scale: f64,
    ) -> [f64; 2] {
        let turn = self.rotation(state, heading_rad);
        turned(self.filmed_step_px(before, state), turn, scale)
    }

    /// Returns the remaining way to the next rest, by frame. Empty in top view.
    fn ways_to_rest(
        &self,
        shown: &[(u32, bool)],
        heading_rad: &[f64],
        boid: &BoidTrack,
        before: Option<PreviousFrame>,
        size: f64,
    ) -> Vec<Option<WayToRest>> {
        let mut last = before.map(|before| before.state);
        let steps = shown.iter().zip(heading_rad).zip(&boid.position_px);
        let steps: Vec<(bool, [f64; 2])> = steps
            .map(|((&state, &heading_rad), place)| {
                let scale = self.scale(state.0, self.depth_bl(place[2]), size);
                let step = last.map_or([0.0; 2], |before| {
                    self.shown_step_px(before, state, heading_rad, scale)
                });
                last = Some(state);
                (resting_places::rests(&self.motion[state.0 as usize]), step)
            })
            .collect();
        let n_rest = (resting_places::REST_S * self.library.poses.fps).ceil() as usize;
        resting_places::ways_to_rest(&steps, n_rest)
    }

    /// Returns a heading in top view, radians: the previous one, the filmed turn and a correction.
    fn next_heading(
        &self,
        state: (u32, bool),
        goal: BoidGoal,
        before: PreviousFrame,
        avoidance: [f64; 2],
    ) -> f64 {
        let fps = self.library.poses.fps;
        let heading = before.heading_rad + self.filmed_turn_rad(before.state, state);
        let course = [libm::cos(goal.heading_rad), libm::sin(goal.heading_rad)];
        let [x, y] = [0, 1].map(|axis| {
            let behind_bl =
                (goal.centroid_px[axis] - before.centroid_px[axis]) / self.lens.length_px;
            course[axis] + PURSUIT_PER_BL * behind_bl + AVOIDANCE_WEIGHT * avoidance[axis]
        });
        let speed = self.motion[state.0 as usize].speed_bl_per_s;
        // An animal at rest is not turned.
        let most_rad = self.calibration.turn_rad_per_s / fps
            * (speed / self.calibration.cruise_bl_per_s).min(1.0);
        let pull = 1.0 - libm::exp(-1.0 / (TURN_S * fps));
        let wanted = wrap_rad(libm::atan2(y, x) - heading);
        let turn = (pull * wanted).clamp(-most_rad, most_rad);
        rounded(wrap_rad(heading + turn), 5)
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
        let reach = (SPEED_SPAN_S * self.library.poses.fps).round() as usize;
        let frame = frame as usize;
        let around = frame.saturating_sub(reach)..(frame + reach + 1).min(self.motion.len());
        let speeds = self.motion[around].iter().map(|moved| moved.speed_bl_per_s);
        speeds.clone().sum::<f64>() / speeds.len() as f64
    }

    /// Returns `place`, or the point at which the line from the boid to it leaves the tank.
    fn kept_in_tank(&self, place: [f64; 2], goal: [f64; 2], depth_bl: f64) -> [f64; 2] {
        let [from, to] = [goal, place].map(|px| self.lens.place_bl(px, depth_bl));
        if self.tank.contains(to) {
            return place;
        }
        self.lens.picture_px(self.tank.clip_segment(from, to))
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
    fn steps_stay_near_the_filmed_ones_far_from_the_boid() {
        for view in [View::Side, View::Top] {
            let (library, params) = (synthetic::library(view), Params::default());
            let lens = Lens::new(&library, &params);
            let motion = motion_of(&library, &lens);
            let tank = Tank::from_library(&library, &lens, &motion, &params);
            let calibration = Calibration::from_library(&library, &motion, lens.is_flat());
            let placer = Placer {
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
            let before = PreviousFrame {
                state: (99, false),
                heading_rad: motion[99].heading_rad,
                centroid_px: [x, y],
            };
            let advanced = &placer.advance(
                std::slice::from_ref(&shown),
                &[boid],
                Some(&[before]),
                &RestingPlaces::default(),
            )[0];
            for t in 1..shown.len() {
                let [from, to] = [t - 1, t].map(|t| advanced.centroid_px[t]);
                let [dx, dy] = placer.filmed_step_px(shown[t - 1], shown[t]);
                let filmed_px =
                    placer.scale(shown[t].0, placer.depth_bl(0.0), placer.size(0)) * dx.hypot(dy);
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
