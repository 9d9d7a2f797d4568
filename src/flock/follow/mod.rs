//! Flocks with `position: film`: boids choose directions, while speeds and steps are filmed ones.
//!
//! A flock is made segment by segment. Each boid starts a segment at the position of its animal. It moves at
//! the speeds of the animal's natural continuation (`natural`). The plan of the segment starts from the frame
//! shown last (`plan::segment`). The animal then moves by the filmed steps of the planned frames, corrected a
//! little toward the boid (`advance`).

mod advance;
pub(super) mod company;
mod natural;
pub(super) mod perches;

use rayon::prelude::*;

use self::advance::Advanced;
use self::natural::Natural;
use self::perches::Perches;
use super::Error;
use super::boids::Boids;
use super::boids::vector::{norm, scaled};
use super::course::{Course, steps};
use super::individual::BoidTrack;
use super::placement::{Before, Placed, Stage};
use super::plan::segment::Standing;
use super::plan::{Model, Plan, Planner};
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

/// All individuals up to the current segment, by id.
struct Flock {
    course: Course,
    plans: Vec<Plan>,
    advanced: Vec<Advanced>,
    standings: Vec<Standing>,
}

/// Makes a flock from boids that have not formed yet. Returns the simulation, plans and placements, by id.
/// Fails if the job is cancelled or playback cannot continue.
pub(super) fn play(
    mut boids: Boids,
    (model, stage): (&Model, &Stage),
    progress: &dyn Progress,
) -> Result<(Course, Vec<Plan>, Vec<Placed>), Error> {
    let (params, fps) = (stage.params, stage.library.poses.fps);
    let n_frames = params.frames as usize;
    let mut step = steps(boids.n_warm_up_frames() + n_frames, progress);
    boids.form(&mut step)?;
    let n = boids.positions().len();
    let natural = Natural::new(model, stage.motion, params.seed);
    let mut flock = Flock {
        course: Course::new(&boids, stage.lens),
        plans: vec![Plan::default(); n],
        advanced: vec![Advanced::default(); n],
        standings: Vec::new(),
    };
    let perches = Perches::of(stage.library, stage.motion, stage.lens);
    let ends = segments(n_frames, params.matching.segment_frames, fps);
    for segment in ends.windows(2) {
        let (first, end) = (segment[0], segment[1]);
        let states = flock.natural_states(&boids, (model, &natural, stage), segment)?;
        let mut course = Course::new(&boids, stage.lens);
        for t in first..end {
            step()?;
            let gait = |states: &Vec<u32>| natural.gait(states[t - first]);
            boids.impose_motion(states.iter().map(gait).collect());
            if t > 0 {
                boids.advance();
            }
            course.record(&boids, stage.lens);
        }
        let is_last = end == n_frames;
        let planner = Planner::of_segment(model, &course.tracks, &flock.standings, is_last);
        let plans = planner.plan(progress)?;
        flock.go_on((model, stage, &perches), &course.tracks, plans);
        flock.course.append(course);
        flock.draw_back(&mut boids, stage);
    }
    let placed = (flock.advanced.into_par_iter().zip(&flock.plans))
        .zip(&flock.course.tracks)
        .enumerate()
        .map(|(id, ((one, plan), boid))| {
            let shown = model.shown(&plan.states);
            stage.with_fades(
                (&shown, stage.size(id)),
                boid,
                (one.heading_rad, one.centroid_px),
            )
        })
        .collect();
    Ok((flock.course, flock.plans, placed))
}

impl Flock {
    /// Returns the states of the natural continuation of each individual over a segment.
    fn natural_states(
        &self,
        boids: &Boids,
        (model, natural, stage): (&Model, &Natural, &Stage),
        segment: &[usize],
    ) -> Result<Vec<Vec<u32>>, Error> {
        let n_frames = segment[1] - segment[0];
        let mut moment = Course::new(boids, stage.lens);
        moment.record(boids, stage.lens);
        let begun = |id: usize| {
            let cost = |state| model.heading_cost(&moment.tracks[id], state);
            let begun = natural.beginning(id, cost).ok_or(Error::NoTransitions)?;
            let key = [id as u64, 0];
            let mut states = natural.states((begun, 0), n_frames - 1, key);
            states.insert(0, begun);
            Ok(states)
        };
        let goes_on = |id: usize| {
            let standing = &self.standings[id];
            let state = standing.state.ok_or(Error::NoTransitions)?;
            let key = [id as u64, segment[0] as u64];
            Ok(natural.states((state, standing.held), n_frames, key))
        };
        let all = (0..self.plans.len()).into_par_iter();
        match self.standings.is_empty() {
            true => all.map(begun).collect(),
            false => all.map(goes_on).collect(),
        }
    }

    /// Appends the plans of a segment and places their frames.
    fn go_on(
        &mut self,
        (model, stage, perches): (&Model, &Stage, &Perches),
        boids: &[BoidTrack],
        plans: Vec<Plan>,
    ) {
        self.standings.resize(plans.len(), Standing::default());
        let shown: Vec<Vec<(u32, bool)>> =
            plans.iter().map(|plan| model.shown(&plan.states)).collect();
        let before: Vec<Option<Before>> = (self.plans.iter().zip(&self.advanced))
            .map(|(plan, one)| {
                let &state = plan.states.last()?;
                Some(Before {
                    state: model.trellis.shown(state as usize)?,
                    heading_rad: *one.heading_rad.last()?,
                    centroid_px: *one.centroid_px.last()?,
                })
            })
            .collect();
        let advanced = stage.advance(&shown, boids, &before, perches);
        for (id, (plan, advanced)) in plans.into_iter().zip(advanced).enumerate() {
            self.standings[id].go_on(&plan.states, model.dwell);
            self.advanced[id].append(advanced);
            self.plans[id].append(plan);
        }
    }

    /// Moves each boid to the position of its animal. In top view the boid also takes the heading of its
    /// animal. In side view it keeps its own, since the animal can show only filmed headings.
    fn draw_back(&self, boids: &mut Boids, stage: &Stage) {
        let mut positions = boids.positions().to_vec();
        let mut velocities = boids.velocities().to_vec();
        for (id, one) in self.advanced.iter().enumerate() {
            let ends = one.centroid_px.last().zip(one.heading_rad.last());
            let Some((&centroid_px, &heading_rad)) = ends else {
                continue;
            };
            let place = stage.lens.place_bl(centroid_px, positions[id][2]);
            positions[id] = boids.confined(place);
            if stage.library.poses.view == View::Top {
                let direction = [libm::cos(heading_rad), libm::sin(heading_rad), 0.0];
                velocities[id] = scaled(norm(velocities[id]), direction);
            }
        }
        boids.set_states(positions, velocities, boids.predator());
    }
}
