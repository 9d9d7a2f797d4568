//! Flocks with `position: film`: boids choose directions, while speeds and steps are filmed ones.
//!
//! A flock is made segment by segment. Each boid starts a segment at the position of its animal. It moves at
//! the speeds of the animal's natural continuation (`natural`). The plan of the segment starts from the frame
//! shown last (`plan::segment`). The animal then moves by the filmed steps of the planned frames, corrected a
//! little toward the boid (`advance`).

mod advance;
pub(super) mod avoidance;
mod natural;
pub(super) mod resting_places;

use std::ops::Range;

use rayon::prelude::*;

use self::advance::Trajectory;
use self::natural::NaturalPlayback;
use self::resting_places::RestingPlaces;
use super::boids::Boids;
use super::boids::vector::{norm, scaled};
use super::course::{Course, steps};
use super::placement::{Placer, PreviousFrame};
use super::plan::segment::PlaybackStatus;
use super::plan::{Model, Plan, Planner};
use super::{Error, Played};
use crate::library::View;
use crate::progress::Progress;

/// Default length of a segment, seconds. In side view a turn takes about a second and pays off only after it,
/// so plans must look beyond it.
const SEGMENT_S: f64 = 3.0;

/// Returns the first frame of each segment, and as the last entry the number of frames.
pub(super) fn segments(n_frames: usize, segment_frames: Option<u32>, fps: f64) -> Vec<usize> {
    let n = segment_frames.map_or((SEGMENT_S * fps).round() as usize, |n| n as usize);
    let mut ends: Vec<usize> = (0..n_frames).step_by(n.max(2)).collect();
    ends.push(n_frames);
    ends
}

/// Flock up to the current segment. Lists have one entry per individual, by id.
struct Follower<'a> {
    model: &'a Model,
    placer: &'a Placer<'a>,
    natural: NaturalPlayback<'a>,
    resting_places: RestingPlaces,
    course: Course,
    plans: Vec<Plan>,
    trajectories: Vec<Trajectory>,
    statuses: Vec<PlaybackStatus>,
}

/// Makes a flock from boids that have not formed yet. Fails if the job is cancelled or playback cannot
/// continue.
pub(super) fn play(
    mut boids: Boids,
    model: &Model,
    placer: &Placer,
    progress: &dyn Progress,
) -> Result<Played, Error> {
    let (params, fps) = (placer.params, placer.library.poses.fps);
    let n_frames = params.frames as usize;
    let mut step = steps(boids.n_warm_up_frames() + n_frames, progress);
    boids.form(&mut step)?;
    let n = boids.positions().len();
    let mut follower = Follower {
        model,
        placer,
        natural: NaturalPlayback::new(model, placer.motion, params.seed),
        resting_places: RestingPlaces::new(placer.library, placer.motion, placer.lens),
        course: Course::new(&boids, placer.lens),
        plans: vec![Plan::default(); n],
        trajectories: vec![Trajectory::default(); n],
        statuses: Vec::new(),
    };
    let ends = segments(n_frames, params.matching.segment_frames, fps);
    for segment in ends.windows(2) {
        let (first, end) = (segment[0], segment[1]);
        let states = follower.natural_states(&boids, first..end)?;
        let mut course = Course::new(&boids, placer.lens);
        for t in first..end {
            step()?;
            let motion = |states: &Vec<u32>| follower.natural.motion(states[t - first]);
            boids.impose_motion(states.iter().map(motion).collect());
            if t > 0 {
                boids.advance();
            }
            course.record(&boids, placer.lens);
        }
        let is_last = end == n_frames;
        let planner = Planner::for_segment(model, &course.tracks, &follower.statuses, is_last);
        let plans = planner.plan(progress)?;
        follower.append(course, plans);
        follower.move_to_animals(&mut boids);
    }
    Ok(follower.finish())
}

impl Follower<'_> {
    /// Returns the states of the natural continuation of each individual over a segment.
    fn natural_states(&self, boids: &Boids, frames: Range<usize>) -> Result<Vec<Vec<u32>>, Error> {
        let mut moment = Course::new(boids, self.placer.lens);
        moment.record(boids, self.placer.lens);
        let states = |id: usize| {
            let key = [id as u64, frames.start as u64];
            let Some(status) = self.statuses.get(id) else {
                let cost = |state| self.model.heading_cost(&moment.tracks[id], state);
                let first = self.natural.first_state(id, cost);
                let first = first.ok_or(Error::NoTransitions)?;
                let mut states = self.natural.states(first, 0, frames.len() - 1, key);
                states.insert(0, first);
                return Ok(states);
            };
            let state = status.state.ok_or(Error::NoTransitions)?;
            Ok((self.natural).states(state, status.n_forced, frames.len(), key))
        };
        let ids = (0..self.plans.len()).into_par_iter();
        ids.map(states).collect()
    }

    /// Appends the boids and plans of a segment, and places the frames of the plans.
    fn append(&mut self, course: Course, plans: Vec<Plan>) {
        let model = self.model;
        self.statuses.resize(plans.len(), PlaybackStatus::default());
        let shown: Vec<Vec<(u32, bool)>> =
            plans.iter().map(|plan| model.shown(&plan.states)).collect();
        let before: Option<Vec<PreviousFrame>> = (self.plans.iter().zip(&self.trajectories))
            .map(|(plan, trajectory)| {
                let &state = plan.states.last()?;
                Some(PreviousFrame {
                    state: model.trellis.shown(state as usize)?,
                    heading_rad: *trajectory.heading_rad.last()?,
                    centroid_px: *trajectory.centroid_px.last()?,
                })
            })
            .collect();
        let (tracks, resting_places) = (&course.tracks, &self.resting_places);
        let later = (self.placer).advance(&shown, tracks, before.as_deref(), resting_places);
        for (id, (plan, later)) in plans.into_iter().zip(later).enumerate() {
            self.statuses[id].update(&plan.states, model.dwell);
            self.trajectories[id].append(later);
            self.plans[id].append(plan);
        }
        self.course.append(course);
    }

    /// Moves each boid to the position of its animal. In top view the boid also takes the heading of its
    /// animal. In side view it keeps its own, since the animal can show only filmed headings.
    fn move_to_animals(&self, boids: &mut Boids) {
        let mut positions = boids.positions().to_vec();
        let mut velocities = boids.velocities().to_vec();
        for (id, trajectory) in self.trajectories.iter().enumerate() {
            let ends = (trajectory.centroid_px.last()).zip(trajectory.heading_rad.last());
            let Some((&centroid_px, &heading_rad)) = ends else {
                continue;
            };
            let place = self.placer.lens.place_bl(centroid_px, positions[id][2]);
            positions[id] = boids.confined(place);
            if self.placer.library.poses.view == View::Top {
                let direction = [libm::cos(heading_rad), libm::sin(heading_rad), 0.0];
                velocities[id] = scaled(norm(velocities[id]), direction);
            }
        }
        boids.set_states(positions, velocities, boids.predator());
    }

    /// Returns the whole flock with its placement.
    fn finish(self) -> Played {
        let (model, placer) = (self.model, self.placer);
        let placed = (self.trajectories.into_par_iter().zip(&self.plans))
            .zip(&self.course.tracks)
            .enumerate()
            .map(|(id, ((one, plan), boid))| {
                let shown = model.shown(&plan.states);
                let size = placer.size(id);
                placer.with_fades(&shown, size, boid, one.heading_rad, one.centroid_px)
            })
            .collect();
        Played {
            course: self.course,
            plans: self.plans,
            placed,
        }
    }
}
