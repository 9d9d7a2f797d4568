//! Flocks with `position: film`: boids choose directions, while speeds and steps are filmed ones.
//!
//! A flock is made segment by segment. Each boid starts a segment at the position of its animal. It moves at
//! the speeds of the animal's natural continuation (`natural`). A search then chooses the frames of each
//! individual together with the places to which their filmed steps lead (`walk`, `places`, `support`).

mod natural;
pub(super) mod places;
mod steps;
pub(super) mod support;
mod walk;

use std::ops::Range;

use rayon::prelude::*;

use self::natural::NaturalPlayback;
use self::places::{HomeRange, World};
use self::steps::Trajectory;
use self::support::Support;
use self::walk::{Node, Other, Walk, Walker};
use super::boids::Boids;
use super::boids::vector::{norm, scaled};
use super::course::{Course, steps};
use super::placement::Placer;
use super::plan::segment::PlaybackStatus;
use super::plan::{Model, Plan};
use super::{Error, Played};
use crate::library::View;
use crate::progress::Progress;

/// Default length of a segment, seconds. In side view a turn takes about a second and pays off only after it,
/// so plans must look beyond it.
const SEGMENT_S: f64 = 3.0;

/// Greatest distance from the filmed places at which an individual that is carried stands, body lengths. Free
/// choice.
const ASIDE_BL: f64 = 0.45;
/// Number of individuals that are planned at the same time: at least two, and this share of a flock. Free
/// choices.
const MIN_ROUND: usize = 2;
const ROUND_SHARE: usize = 16;
/// Number of others, the nearest in the middle of a segment, to which an individual pays heed. Free choice.
const N_NEAREST: usize = 16;

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
    n_clipped: usize,
    home_range: HomeRange,
    support: Option<&'a Support>,
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
    support: Option<&Support>,
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
        n_clipped: 0,
        home_range: HomeRange::new(placer.library, placer.lens),
        support,
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
        follower.append(course, first)?;
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

    /// Appends the boids of a segment, and the frames and places of their animals. Individuals are planned in
    /// rounds. Each knows the walks of the rounds before, and of the others the boids.
    fn append(&mut self, course: Course, first: usize) -> Result<(), Error> {
        let n = self.plans.len();
        self.statuses.resize(n, PlaybackStatus::default());
        let goals: Vec<Vec<[f64; 2]>> = (course.tracks.iter())
            .map(|boid| boid.position_px.iter().map(|&[x, y, _]| [x, y]).collect())
            .collect();
        let mut walks: Vec<Walk> = Vec::with_capacity(n);
        while walks.len() < n {
            let ids = walks.len()..(walks.len() + MIN_ROUND.max(n / ROUND_SHARE)).min(n);
            let walk = |id: usize| {
                let walker = self.walker(id);
                let other = |&other: &usize| match walks.get(other) {
                    Some(walk) => Other {
                        places_px: &walk.trajectory.centroid_px,
                        states: Some(&walk.states),
                    },
                    None => Other {
                        places_px: &goals[other],
                        states: None,
                    },
                };
                let others: Vec<Other> = nearest(&goals, id).iter().map(other).collect();
                let moments = walker.moments(&course.tracks[id], &others);
                (walker.walk(self.last_node(id), &moments, first)).ok_or(Error::NoTransitions)
            };
            let round: Result<Vec<Walk>, Error> = ids.into_par_iter().map(walk).collect();
            walks.extend(round?);
        }
        for (id, walk) in walks.into_iter().enumerate() {
            let (wanted, before) = (
                self.model.wanted(&course.tracks[id]),
                self.statuses[id].state,
            );
            let cost = self.model.cost_of_walk(&wanted, before, &walk.states);
            self.statuses[id].update(&walk.states, self.model.dwell);
            self.trajectories[id].append(walk.trajectory);
            self.n_clipped += walk.n_clipped;
            self.plans[id].append(Plan {
                states: walk.states,
                cost,
            });
        }
        self.course.append(course);
        Ok(())
    }

    /// Returns the search for the walks of an individual.
    fn walker(&self, id: usize) -> Walker<'_> {
        let placer = self.placer;
        // Fractional parts of multiples of the golden ratio are spread evenly. The first stays in the middle.
        let aside = 2.0 * (std::f64::consts::GOLDEN_RATIO * id as f64 + 0.5).fract() - 1.0;
        let world = World {
            placer,
            home_range: &self.home_range,
            support: self.support,
            aside_px: ASIDE_BL * placer.lens.length_px * aside,
            radius_scale: placer.tank.radius_scale(self.plans.len()),
        };
        Walker::new(self.model, world, placer.size(id), self.plans.len())
    }

    /// Returns the frame and place that an individual showed last.
    fn last_node(&self, id: usize) -> Option<Node> {
        let status = self.statuses[id];
        let since = self.model.dwell - status.n_forced.min(self.model.dwell - 1);
        let trajectory = &self.trajectories[id];
        let (&heading, &place) = trajectory
            .heading_rad
            .last()
            .zip(trajectory.centroid_px.last())?;
        Some(Node::new(status.state?, since, heading, place))
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
            n_clipped: self.n_clipped,
        }
    }
}

/// Returns the ids of the individuals nearest to `id` in the middle of a segment.
fn nearest(goals: &[Vec<[f64; 2]>], id: usize) -> Vec<usize> {
    let middle = |id: usize| goals[id][goals[id].len() / 2];
    let [x, y] = middle(id);
    let square = |other: usize| {
        let [ox, oy] = middle(other);
        (ox - x) * (ox - x) + (oy - y) * (oy - y)
    };
    let others = (0..goals.len()).filter(|&other| other != id);
    let mut others: Vec<(f64, usize)> = others.map(|other| (square(other), other)).collect();
    let by_distance = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if others.len() > N_NEAREST {
        others.select_nth_unstable_by(N_NEAREST, by_distance);
        others.truncate(N_NEAREST);
    }
    others.sort_by(by_distance);
    others.into_iter().map(|(_, other)| other).collect()
}

#[cfg(test)]
mod tests;
