//! Library to flock: simulate boids, plan which real frames follow them best, place those frames in
//! the picture, and composite them (O 4 and 5; ALGORITHMS.md 6 to 8).

pub mod boids;
pub mod check;
pub mod composite;
pub mod error;
pub mod individual;
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
use self::boids::measures::{self, Order};
use self::boids::tank::Tank;
use self::individual::rounded;
use self::placement::Stage;
use self::plan::cost::motion_of;
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
    let motion = motion_of(library);
    let calibration = Calibration::of(library, &motion, params);
    let tank = Tank::of(library, calibration.length_px, params);
    let (tracks, orders) = simulate(library, params, &calibration, &tank, progress)?;
    let plans = Planner::new(library, &motion, &tracks, params).plan(progress)?;
    let stage = Stage {
        library,
        motion: &motion,
        params,
        length_px: calibration.length_px,
        corners_px: tank
            .corners
            .map(|corner| [corner[0], corner[1]].map(|bl| bl * calibration.length_px)),
    };
    let individuals = place(&stage, tracks, plans);
    Ok(Flock {
        fps: library.poses.fps,
        image_size_px: library.poses.image_size_px,
        length_px: calibration.length_px,
        stats: quality::measure(
            &individuals,
            &orders,
            library,
            params,
            calibration.length_px,
        ),
        params: params.clone(),
        individuals,
    })
}

/// The boids' tracks as files hold them, by id, and the order of every frame.
fn simulate(
    library: &Library,
    params: &Params,
    calibration: &Calibration,
    tank: &Tank,
    progress: &dyn Progress,
) -> Result<(Vec<BoidTrack>, Vec<Order>), Error> {
    progress.report("simulating", 0.0);
    let mut boids = Boids::new(params, calibration, tank, library.poses.fps);
    let mut tracks = vec![BoidTrack::default(); params.count as usize];
    let mut orders = Vec::with_capacity(params.frames as usize);
    for t in 0..params.frames {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        if t > 0 {
            boids.advance();
        }
        for (id, track) in tracks.iter_mut().enumerate() {
            let velocity = boids.velocities[id];
            let heading = Turns::from_rad(libm::atan2(velocity[1], velocity[0]));
            let place = boids.positions[id].map(|bl| rounded(bl * calibration.length_px, 2));
            track.position_px.push(place);
            track.heading_rad.push(rounded(heading.to_rad(), 5));
            let speed = velocity[0].hypot(velocity[1]);
            track.speed_bl_per_s.push(rounded(speed, 3));
        }
        orders.push(measures::order(&boids.positions, &boids.velocities));
        progress.report("simulating", f64::from(t + 1) / f64::from(params.frames));
    }
    Ok((tracks, orders))
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
                scale: vec![1.0; plan.shown.len()],
                depth_m: None,
                boid,
                cost: plan.cost,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests;
