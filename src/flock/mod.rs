//! From library to flock (Okabe et al., sections 4 and 5). This module simulates boids, plans which source
//! frames follow each boid best, places these frames in the image, and draws the video.
//!
//! `plan_flock` does everything but the drawing, which `composite` does. The algorithms are described in
//! docs/explanation/algorithms.md, "Boids", "Planning", "Placement" and "Compositing".

pub mod advice;
pub mod boids;
pub mod check;
pub mod composite;
mod course;
mod density;
pub mod error;
mod follow;
pub mod individual;
pub mod lens;
pub mod motion;
pub mod params;
pub mod placement;
pub mod plan;
pub mod quality;
mod rotation;
pub mod space;
#[cfg(test)]
pub(crate) mod synthetic;

pub use boids::measures::Order;
pub use composite::{Compositor, Shot};
pub use error::Error;
pub use individual::{BoidTrack, Fade, Individual, PlanCost};
pub use params::Params;
pub use quality::Stats;
pub use space::Space;

use self::boids::Boids;
use self::boids::calibration::Calibration;
use self::boids::tank::Tank;
use self::course::Course;
use self::follow::company::CLEAR_BL;
use self::follow::perches::Perches;
use self::individual::MotionState;
use self::lens::Lens;
use self::motion::motion_of;
use self::params::{MOST_BY_DEFAULT, MatchBy, Position};
use self::placement::{Placed, Stage};
use self::plan::{Model, Plan, Planner};
use crate::geometry::rounded;
use crate::library::Library;
use crate::parameters::Parameters;
use crate::progress::{Progress, Quiet};

/// A simulated, planned and placed flock, without its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Flock {
    /// Frames per second, as in the footage.
    pub fps: f64,
    /// Width and height of the image, pixels, as in the footage.
    pub image_size_px: [u32; 2],
    /// Body length (BL) in the image, pixels.
    pub length_px: f64,
    /// Geometry of the tank and its projection to the image.
    pub space: Space,
    /// Parameters of the flock. `count` is filled in, and options that do not apply are replaced.
    pub params: Params,
    /// Individuals by id.
    pub individuals: Vec<Individual>,
    /// Position of the predator at each frame, in the units of `BoidTrack::position_px`. Empty without a
    /// predator.
    pub predator_px: Vec<[f64; 3]>,
    /// Measures of collective order at each frame.
    pub orders: Vec<Order>,
    /// Quality measures of the whole flock.
    pub stats: Stats,
}

impl Flock {
    /// Returns whether the flock can be drawn with `library`. Their image sizes must be equal, all source
    /// frames must exist in the library, and all tracks must be complete.
    pub fn fits(&self, library: &Library) -> bool {
        let n_frames = self.params.frames as usize;
        let sprites = &library.sprites;
        let exists = |&frame: &u32| (frame as usize) < sprites.n_frames();
        self.image_size_px == library.poses.image_size_px
            && (0..).zip(&self.individuals).all(|(id, individual)| {
                individual.id == id
                    && individual.is_complete(n_frames)
                    && individual.source_frame.iter().all(exists)
                    && (individual.fades.iter()).all(|fade| fade.source_frame.iter().all(exists))
            })
    }
}

/// Simulates, plans and places a flock of the library's animal.
///
/// Fails if a parameter is out of range or the job is cancelled. Also fails if the animal is too small for
/// sprites, the library has no jumps, or a loop does not close.
pub fn plan_flock(
    library: &Library,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Flock, Error> {
    params.check().map_err(Error::InvalidParams)?;
    if library.stats.animal_too_small {
        return Err(Error::AnimalTooSmall);
    }
    if library.playback.component.is_empty() || library.playback.jumps.is_empty() {
        return Err(Error::NoTransitions);
    }
    let lens = Lens::of(library, params);
    let mut params = told(params, &lens);
    let motion = motion_of(library, &lens);
    let tank = Tank::of(library, &lens, &motion, &params);
    let perches = Perches::of(library, &motion, &lens);
    let to_rest = perches.room_for(CLEAR_BL * lens.length_px);
    let room_for = tank.room_for().min(to_rest.unwrap_or(u32::MAX));
    params.count = params.count.or(Some(room_for.clamp(2, MOST_BY_DEFAULT)));
    let params = &params;
    let calibration = Calibration::of(library, &motion, lens.is_flat()).in_tank(&tank);
    let fps = library.poses.fps;
    let model = Model::new(library, &motion, params);
    let play = |params: &Params, progress: &dyn Progress| {
        let boids = Boids::at_random(params, &calibration, (&lens, &tank), fps);
        let stage = Stage {
            library,
            motion: &motion,
            params,
            lens: &lens,
            tank: &tank,
            calibration: &calibration,
        };
        match params.position {
            Position::Film => follow::play(boids, (&model, &stage), progress),
            Position::Leash | Position::Boid | Position::Papers => {
                whole(boids, (&model, &stage), progress)
            }
        }
    };
    let spaced = density::spaced(params, fps, |params| {
        let (.., placed) = play(params, &Quiet(progress))?;
        let places_px = placed.iter().map(|one| &one.centroid_px[..]);
        Ok(density::spacing_bl(places_px, lens.length_px))
    })?;
    let (course, plans, placed) = play(&spaced, progress)?;
    let states = motion::states(library, &motion);
    let individuals = individuals(&model, &course, (&plans, &states), placed);
    Ok(Flock {
        fps,
        image_size_px: library.poses.image_size_px,
        length_px: lens.length_px,
        space: Space::of(&lens, &tank),
        stats: Stats {
            room_for,
            ..measured(&individuals, &course.orders, (library, params), &tank)
        },
        orders: course.orders,
        params: params.clone(),
        predator_px: course.predator_px,
        individuals,
    })
}

/// Returns the quality measures of a flock, all but `room_for`.
fn measured(
    individuals: &[Individual],
    orders: &[Order],
    (library, params): (&Library, &Params),
    tank: &Tank,
) -> Stats {
    let length_px = Lens::of(library, params).length_px;
    let crowding = density::crowding(individuals, library, length_px);
    let places_px = individuals.iter().map(|one| &one.centroid_px[..]);
    Stats {
        spacing_bl: density::spacing_bl(places_px, length_px),
        crossings_per_min: crowding.crossings_per_min,
        visible_share: crowding.visible_share,
        overlap_bl: rounded(tank.overlap_bl(individuals.len()), 4),
        ..quality::measure(individuals, orders, library, params, length_px)
    }
}

/// Simulates the whole video, then plans and places it. Returns tracks, plans and placements by id.
fn whole(
    boids: Boids,
    (model, stage): (&Model, &Stage),
    progress: &dyn Progress,
) -> Result<(Course, Vec<Plan>, Vec<Placed>), Error> {
    let n_frames = stage.params.frames;
    let course = match stage.params.is_loop {
        true => {
            let length = (n_frames, stage.library.poses.fps);
            course::simulate_loop(boids, stage.lens, length, progress)?
        }
        false => course::simulate(boids, stage.lens, n_frames, progress)?,
    };
    progress.report("planning", 0.0);
    let planner = Planner::new(model, &course.tracks);
    let plans = match &course.heirs {
        Some(heirs) => planner.plan_loop(heirs, progress)?,
        None => planner.plan(progress)?,
    };
    let shown: Vec<_> = plans.iter().map(|plan| model.shown(&plan.states)).collect();
    let placed = stage.placed(&shown, &course.tracks, course.heirs.as_deref());
    Ok((course, plans, placed))
}

/// Returns the parameters with options replaced that do not apply. A loop has one body size and uses `leash`
/// instead of `film`. Without depth, headings are matched instead of directions.
fn told(params: &Params, lens: &Lens) -> Params {
    let mut params = params.clone();
    if params.is_loop && params.position == Position::Film {
        params.position = Position::Leash;
    }
    if params.is_loop {
        params.variation = 0.0; // each goes on as its heir
    }
    if lens.is_flat() && params.matching.by == MatchBy::Direction {
        params.matching.by = MatchBy::Heading;
    }
    params
}

fn individuals(
    model: &Model,
    course: &Course,
    (plans, states): (&[Plan], &[MotionState]),
    placed: Vec<Placed>,
) -> Vec<Individual> {
    (0u32..)
        .zip(placed)
        .zip(course.tracks.iter().zip(plans))
        .map(|((id, placed), (boid, plan))| {
            let shown = model.shown(&plan.states);
            Individual {
                id,
                source_frame: shown.iter().map(|shown| shown.0).collect(),
                mirrored: shown.iter().map(|shown| shown.1).collect(),
                rotation_rad: placed.rotation_rad,
                continues_as: course.heirs.as_ref().map(|heirs| heirs[id as usize]),
                fades: placed.fades,
                centroid_px: placed.centroid_px,
                heading_rad: placed.heading_rad,
                forward: placed.forward,
                scale: placed.scale,
                size: placed.size,
                state: (shown.iter().map(|shown| states[shown.0 as usize])).collect(),
                depth_m: placed.depth_m,
                boid: boid.clone(),
                cost: plan.cost.told(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests;
