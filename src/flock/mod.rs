//! Library to flock: simulate boids, plan which real frames follow them best, place those frames in
//! the picture, and composite them (O 4 and 5; ALGORITHMS.md 6 to 8).

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
use self::individual::rounded;
use self::lens::Lens;
use self::motion::motion_of;
use self::params::{MOST_BY_DEFAULT, MatchBy, Position};
use self::placement::{Placed, Stage};
use self::plan::{Model, Plan, Planner};
use crate::library::Library;
use crate::progress::{Progress, Quiet};

/// A simulated, planned and placed group: all but its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Flock {
    /// Frames a second, the footage's.
    pub fps: f64,
    /// Width and height of the film, the footage's.
    pub image_size_px: [u32; 2],
    /// A body length (BL) in the picture.
    pub length_px: f64,
    /// Where its boids may be, and how that is seen.
    pub space: Space,
    /// What was asked for.
    pub params: Params,
    /// By id.
    pub individuals: Vec<Individual>,
    /// Where the predator was at every frame, as boids' positions are; empty without one.
    pub predator_px: Vec<[f64; 3]>,
    /// How it moves as a whole, frame by frame.
    pub orders: Vec<Order>,
    /// How good it is.
    pub stats: Stats,
}

impl Flock {
    /// Whether it can be filmed with a library: every frame that it shows has its sprite there, and its
    /// tracks are of one length.
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
    let individuals = individuals(&model, &course, &plans, placed);
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

/// How good a flock is.
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

/// Simulates a whole film, then plans and places it: tracks, plans and places by id.
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

/// The parameters as they can be met: without depth, directions are headings.
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
    plans: &[Plan],
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
                depth_m: placed.depth_m,
                boid: boid.clone(),
                cost: plan.cost.told(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests;
