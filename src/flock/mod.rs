//! Library to flock: simulate boids, plan which real frames follow them best, place those frames in
//! the picture, and composite them (O 4 and 5; ALGORITHMS.md 6 to 8).

pub mod boids;
pub mod check;
pub mod composite;
pub mod error;
pub mod individual;
pub mod lens;
pub mod motion;
pub mod params;
pub mod placement;
pub mod plan;
pub mod quality;
#[cfg(test)]
pub(crate) mod synthetic;

pub use composite::{Compositor, Shot};
pub use error::Error;
pub use individual::{BoidTrack, Fade, Individual, PlanCost};
pub use params::Params;
pub use quality::Stats;

use rayon::prelude::*;

use self::boids::Boids;
use self::boids::calibration::Calibration;
use self::boids::measures::Order;
use self::boids::tank::Tank;
use self::boids::vector::{Vec3, unit};
use self::individual::rounded;
use self::lens::Lens;
use self::motion::motion_of;
use self::params::MatchBy;
use self::placement::Stage;
use self::plan::{Plan, Planner};
use crate::geometry::Turns;
use crate::library::Library;
use crate::progress::Progress;

/// A simulated, planned and placed group: all but its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Flock {
    /// Frames a second, the footage's.
    pub fps: f64,
    /// Width and height of the film, the footage's.
    pub image_size_px: [u32; 2],
    /// A body length (BL) in the picture.
    pub length_px: f64,
    /// What was asked for.
    pub params: Params,
    /// By id.
    pub individuals: Vec<Individual>,
    /// Where the predator was at every frame, as boids' positions are; empty without one.
    pub predator_px: Vec<[f64; 3]>,
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
    let params = &told(params, library, &lens);
    let motion = motion_of(library, &lens);
    let tank = Tank::of(library, &lens, &motion, params);
    let calibration = Calibration::of(library, &motion, lens.is_flat());
    let boids = Boids::new(params, &calibration, (&lens, &tank), library.poses.fps);
    let course = simulate(boids, &lens, params.frames, progress)?;
    let plans = Planner::new(library, &motion, &course.tracks, params).plan(progress)?;
    let stage = Stage {
        library,
        motion: &motion,
        params,
        lens: &lens,
        tank: &tank,
    };
    let individuals = place(&stage, course.tracks, plans);
    Ok(Flock {
        fps: library.poses.fps,
        image_size_px: library.poses.image_size_px,
        length_px: lens.length_px,
        stats: quality::measure(
            &individuals,
            &course.orders,
            library,
            params,
            lens.length_px,
        ),
        params: params.clone(),
        predator_px: course.predator_px,
        individuals,
    })
}

/// The parameters with what they leave open.
fn told(params: &Params, library: &Library, lens: &Lens) -> Params {
    let mut params = params.clone();
    let is_known = library
        .poses
        .frames
        .iter()
        .any(|pose| pose.forward.is_some());
    params.matching.by = Some(match params.matching.by {
        None if is_known && !lens.is_flat() => MatchBy::Direction,
        Some(MatchBy::Direction) if lens.is_flat() => MatchBy::Heading,
        by => by.unwrap_or(MatchBy::Heading),
    });
    params
}

/// How a simulation went, as files hold it.
struct Course {
    /// By id.
    tracks: Vec<BoidTrack>,
    /// By frame.
    orders: Vec<Order>,
    /// By frame; empty without one.
    predator_px: Vec<[f64; 3]>,
}

fn simulate(
    mut boids: Boids,
    lens: &Lens,
    n_frames: u32,
    progress: &dyn Progress,
) -> Result<Course, Error> {
    progress.report("simulating", 0.0);
    let track = BoidTrack {
        forward: (!lens.is_flat()).then(Vec::new),
        ..BoidTrack::default()
    };
    let mut course = Course {
        tracks: vec![track; boids.positions.len()],
        orders: Vec::with_capacity(n_frames as usize),
        predator_px: Vec::new(),
    };
    for t in 0..n_frames {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if t > 0 {
            boids.advance();
        }
        for (id, track) in course.tracks.iter_mut().enumerate() {
            record(track, lens, &boids, id);
        }
        let predator = boids.predator().map(|place| seen(place, lens, &boids));
        course.predator_px.extend(predator);
        course.orders.push(boids.order());
        progress.report("simulating", f64::from(t + 1) / f64::from(n_frames));
    }
    Ok(course)
}

/// A place in the picture, and how far behind the front of the tank: pixels.
fn seen(place: Vec3, lens: &Lens, boids: &Boids) -> [f64; 3] {
    let [x, y] = lens.picture_px(place);
    let behind_px = (place[2] - boids.front_bl()) * lens.length_px;
    [x, y, behind_px].map(|px| rounded(px, 2))
}

/// A boid's moment, as it is seen.
fn record(track: &mut BoidTrack, lens: &Lens, boids: &Boids, id: usize) {
    let (place, velocity) = (boids.positions[id], boids.velocities[id]);
    track.position_px.push(seen(place, lens, boids));
    if let Some(forward) = &mut track.forward {
        forward.push(unit(velocity).map(|part| rounded(part, 5)));
    }
    let [vx, vy] = lens.picture_velocity(place, velocity);
    let heading = Turns::from_rad(libm::atan2(vy, vx));
    track.heading_rad.push(rounded(heading.to_rad(), 5));
    track.speed_bl_per_s.push(rounded(vx.hypot(vy), 3));
}

fn place(stage: &Stage, tracks: Vec<BoidTrack>, plans: Vec<Plan>) -> Vec<Individual> {
    (0u32..)
        .zip(tracks)
        .zip(plans)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|((id, boid), plan)| {
            let placed = stage.place(&plan.shown, &boid);
            Individual {
                id,
                source_frame: plan.shown.iter().map(|shown| shown.0).collect(),
                mirrored: plan.shown.iter().map(|shown| shown.1).collect(),
                rotation_rad: placed.rotation_rad,
                fades: placed.fades,
                centroid_px: placed.centroid_px,
                heading_rad: placed.heading_rad,
                forward: placed.forward,
                scale: placed.scale,
                depth_m: placed.depth_m,
                boid,
                cost: plan.cost,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests;
