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
use self::follow::places::CLEAR_BL;
use self::follow::support::Support;
use self::individual::MotionState;
use self::lens::Lens;
use self::motion::motion_of;
use self::params::{MOST_BY_DEFAULT, MatchBy, Position};
use self::placement::{Placed, Placer};
use self::plan::{Model, Plan, Planner};
use crate::geometry::rounded;
use crate::library::{Library, View};
use crate::order::median;
use crate::parameters::Parameters;
use crate::progress::{CancelOnly, Progress};

/// Share of the frames, and distance from the middle of all places, body lengths, within which an animal stays at
/// one place. Free choices.
const STAYS_SHARE: f64 = 0.95;
const STAYS_BL: f64 = 0.25;

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
/// sprites or stays at one place, the library has no jumps, or a loop does not close.
pub fn plan_flock(
    library: &Library,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Flock, Error> {
    refuse(library, params)?;
    let (mut params, support) = resolved(params, library);
    let lens = Lens::new(library, &params);
    let motion = motion_of(library, &lens);
    let tank = Tank::from_library(library, &lens, &motion, &params);
    let stands = (support.iter()).map(|support| support.capacity(CLEAR_BL * lens.length_px));
    let room_for = stands.fold(tank.capacity(), u32::min);
    params.count = params.count.or(Some(room_for.clamp(2, MOST_BY_DEFAULT)));
    let params = &params;
    let calibration = Calibration::from_library(library, &motion, lens.is_flat()).in_tank(&tank);
    let fps = library.poses.fps;
    let model = Model::new(library, &motion, params);
    let play = |params: &Params, progress: &dyn Progress| {
        let boids = Boids::at_random(params, &calibration, &lens, &tank, fps);
        let placer = Placer {
            library,
            motion: &motion,
            params,
            lens: &lens,
            tank: &tank,
            calibration: &calibration,
        };
        match params.position {
            Position::Film => follow::play(boids, &model, &placer, support.as_ref(), progress),
            Position::Leash | Position::Boid | Position::Papers => {
                play_whole(boids, &model, &placer, progress)
            }
        }
    };
    let spaced = density::with_spacing(params, fps, |params| {
        let played = play(params, &CancelOnly(progress))?;
        let places_px = played.placed.iter().map(|one| &one.centroid_px[..]);
        Ok(density::spacing_bl(places_px, lens.length_px))
    })?;
    let mut played = play(&spaced, progress)?;
    let states = motion::states(library, &motion);
    let individuals = individuals(&model, &mut played, &states, support.as_ref());
    let n_steps = individuals.len() * params.frames as usize;
    let course = played.course;
    Ok(Flock {
        fps,
        image_size_px: library.poses.image_size_px,
        length_px: lens.length_px,
        space: Space::new(&lens, &tank),
        stats: Stats {
            room_for,
            clipped_share: rounded(played.n_clipped as f64 / n_steps as f64, 4),
            ..measured(&individuals, &course.orders, library, params, &tank)
        },
        orders: course.orders,
        params: params.clone(),
        predator_px: course.predator_px,
        individuals,
    })
}

/// Fails if no flock can be made of a library.
fn refuse(library: &Library, params: &Params) -> Result<(), Error> {
    params.check().map_err(Error::InvalidParams)?;
    if library.stats.animal_too_small {
        return Err(Error::AnimalTooSmall);
    }
    if library.playback.component.is_empty() || library.playback.jumps.is_empty() {
        return Err(Error::NoTransitions);
    }
    let shows_places = params.position == Position::Film && !params.is_loop;
    if shows_places && params.count != Some(1) && stays_in_place(library) {
        return Err(Error::StaysInPlace);
    }
    Ok(())
}

/// Returns whether the animal was nearly always at one place.
fn stays_in_place(library: &Library) -> bool {
    let length_px = library.stats.length_px.unwrap_or(0.0);
    let places: Vec<[f64; 2]> = library.places_px().collect();
    let middle = [0, 1].map(|k| median(places.iter().map(|place| place[k])).unwrap_or_default());
    let is_near = |[x, y]: &&[f64; 2]| (x - middle[0]).hypot(y - middle[1]) < STAYS_BL * length_px;
    places.iter().filter(is_near).count() as f64 >= STAYS_SHARE * places.len() as f64
}

/// Returns the quality measures of a flock, all but `room_for`.
fn measured(
    individuals: &[Individual],
    orders: &[Order],
    library: &Library,
    params: &Params,
    tank: &Tank,
) -> Stats {
    let length_px = Lens::new(library, params).length_px;
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

/// Simulation, plans and placements of a flock. Lists have one entry per individual, by id.
struct Played {
    course: Course,
    plans: Vec<Plan>,
    placed: Vec<Placed>,
    /// Number of steps that ended at a wall.
    n_clipped: usize,
}

/// Simulates the whole video, then plans and places it.
fn play_whole(
    boids: Boids,
    model: &Model,
    placer: &Placer,
    progress: &dyn Progress,
) -> Result<Played, Error> {
    let (n_frames, fps) = (placer.params.frames, placer.library.poses.fps);
    let course = if placer.params.is_loop {
        course::simulate_loop(boids, placer.lens, n_frames, fps, progress)?
    } else {
        course::simulate(boids, placer.lens, n_frames, progress)?
    };
    progress.report("planning", 0.0);
    let planner = Planner::new(model, &course.tracks);
    let plans = match &course.continuations {
        Some(continuations) => planner.plan_loop(continuations, progress)?,
        None => planner.plan(progress)?,
    };
    let shown: Vec<_> = plans.iter().map(|plan| model.shown(&plan.states)).collect();
    let placed = placer.placed(&shown, &course.tracks, course.continuations.as_deref());
    Ok(Played {
        course,
        plans,
        placed,
        n_clipped: 0,
    })
}

/// Returns the parameters with options replaced that are null or do not apply, and what carries the animal. A
/// loop has one body size and uses `leash` instead of `film`. Without depth, headings are matched instead of
/// directions. What carries an animal is not mirrored, and is in the image plane.
fn resolved(params: &Params, library: &Library) -> (Params, Option<Support>) {
    let mut params = params.clone();
    if params.is_loop && params.position == Position::Film {
        params.position = Position::Leash;
    }
    if params.is_loop {
        params.variation = 0.0; // each individual continues as another
    }
    let is_film = params.position == Position::Film;
    let support = Support::new(library, &Lens::new(library, &params)).filter(|_| is_film);
    if support.is_some() {
        params.mirror = false;
        params.depth_bl = params.depth_bl.or(Some(0.0));
    }
    if Lens::new(library, &params).is_flat() && params.matching.by == MatchBy::Direction {
        params.matching.by = MatchBy::Heading;
    }
    let lives_alone = support.is_some() || is_film && library.poses.view == View::Top;
    let sociality = if lives_alone { 0.0 } else { 1.0 };
    params.rules.sociality = params.rules.sociality.or(Some(sociality));
    (params, support)
}

/// Returns the individuals of a flock. Takes the placements out of `played`.
fn individuals(
    model: &Model,
    played: &mut Played,
    states: &[MotionState],
    support: Option<&Support>,
) -> Vec<Individual> {
    let is_carried = |support: &Support, frame: u32| support.foot_px(frame).is_some();
    let course = &played.course;
    let placed = std::mem::take(&mut played.placed);
    (0u32..)
        .zip(placed)
        .zip(course.tracks.iter().zip(&played.plans))
        .map(|((id, placed), (boid, plan))| {
            let shown = model.shown(&plan.states);
            let continuations = course.continuations.as_ref();
            Individual {
                id,
                source_frame: shown.iter().map(|shown| shown.0).collect(),
                mirrored: shown.iter().map(|shown| shown.1).collect(),
                rotation_rad: placed.rotation_rad,
                continues_as: continuations.map(|all| all[id as usize]),
                fades: placed.fades,
                centroid_px: placed.centroid_px,
                heading_rad: placed.heading_rad,
                forward: placed.forward,
                scale: placed.scale,
                size: placed.size,
                state: (shown.iter().map(|shown| states[shown.0 as usize])).collect(),
                carried: (support.iter())
                    .flat_map(|support| shown.iter().map(|shown| is_carried(support, shown.0)))
                    .collect(),
                depth_m: placed.depth_m,
                boid: boid.clone(),
                cost: plan.cost.in_radians(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests;
