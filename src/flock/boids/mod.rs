//! Boids: simulated individuals that move as a flock and never ask for what the animal was not seen
//! to do (O 4; Reynolds 1987; ALGORITHMS.md 7).
//!
//! In top view they swim in the plane of the picture. In side view they swim in a shallow tank behind
//! it, so that they turn round as the animal does: through the depth, not through the vertical.
//! One step an output frame, less where a step would be long; every number is the same for any
//! number of threads.

pub mod calibration;
pub mod grid;
pub mod habitat;
pub mod leadership;
pub mod measures;
mod meeting;
mod overlap;
pub mod params;
pub mod rules;
pub mod tank;
pub mod vector;
pub mod zones;

use rayon::prelude::*;

use self::calibration::Calibration;
use self::grid::{Grid, Neighbor};
use self::habitat::{Habitat, Hunter};
pub use self::meeting::Meeting;
use self::rules::{Moment, Steering};
use self::tank::Tank;
use self::vector::{Vec3, add_scaled, norm, scaled, turned_at_most, unit};
use super::lens::Lens;
use super::params::Params;
use crate::random;

/// The longest way in one step, body lengths.
const LONGEST_STEP_BL: f64 = 0.2;
/// Boids nearer than this are pushed apart after each step, where the tank has room.
const OVERLAP_BL: f64 = 0.5;
/// How long they swim before the first frame, so that the flock has formed.
const WARM_UP_S: f64 = 10.0;
/// Time constant of the wandering turn rate.
const WANDER_S: f64 = 1.0;
/// In flight the greatest speed is so many times the animal's.
const FLIGHT_PACE: f64 = 1.6;
/// Boids of one unit of parallel work.
const CHUNK: usize = 64;

/// What a random number is for.
mod draw {
    pub(super) const START: u64 = 1;
    pub(super) const WANDER: u64 = 2;
    pub(super) const LEAD: u64 = 3;
    pub(super) const COURSE: u64 = 4;
    pub(super) const NOISE: u64 = 5;
}

/// Boids in their tank.
pub struct Boids<'a> {
    /// With radii that fit the tank.
    params: Params,
    overlap_bl: f64,
    calibration: &'a Calibration,
    tank: &'a Tank,
    habitat: Habitat<'a>,
    step_s: f64,
    n_substeps: u32,
    step_idx: u64,
    /// Of the film; negative before it.
    time_s: f64,
    /// Positions, body lengths.
    pub positions: Vec<Vec3>,
    /// Velocities, body lengths a second.
    pub velocities: Vec<Vec3>,
    wander: Vec<[f64; 2]>,
    leads_for_s: Vec<f64>,
    hunter: Option<Hunter>,
    meeting: Option<Meeting>,
}

impl<'a> Boids<'a> {
    /// Boids that have swum until they have formed.
    pub fn new(
        params: &'a Params,
        calibration: &'a Calibration,
        place: (&'a Lens, &'a Tank),
        fps: f64,
    ) -> Self {
        let mut boids = Boids::at_random(params, calibration, place, fps);
        for _ in 0..(WARM_UP_S * fps).ceil() as u64 {
            boids.advance();
        }
        boids.hunter = boids.habitat.hunter();
        boids
    }

    /// Boids at random places, all of one course as far as they align, `WARM_UP_S` before the film.
    pub fn at_random(
        params: &'a Params,
        calibration: &'a Calibration,
        (lens, tank): (&'a Lens, &'a Tank),
        fps: f64,
    ) -> Self {
        let longest_s = LONGEST_STEP_BL / calibration.speed_limits_bl_per_s[1];
        let n_substeps = (1.0 / (fps * longest_s)).ceil().clamp(1.0, 1000.0) as u32;
        let n = params.count as usize;
        let closeness = tank.closeness(n);
        let n_steps = (WARM_UP_S * fps).ceil() * f64::from(n_substeps);
        let step_s = 1.0 / (fps * f64::from(n_substeps));
        let mut boids = Boids {
            params: Params {
                rules: params.rules.closer(closeness),
                ..params.clone()
            },
            habitat: Habitat::new(params, lens, tank),
            overlap_bl: OVERLAP_BL * closeness,
            calibration,
            tank,
            step_s,
            n_substeps,
            step_idx: 0,
            time_s: -n_steps * step_s,
            positions: vec![[0.0; 3]; n],
            velocities: vec![[0.0; 3]; n],
            wander: vec![[0.0; 2]; n],
            leads_for_s: vec![0.0; n],
            hunter: None,
            meeting: None,
        };
        boids.start();
        boids
    }

    /// Where the predator is, if there is one.
    pub fn predator(&self) -> Option<Vec3> {
        Some(self.hunter?.position)
    }

    /// Lets the film begin so many frames later.
    pub fn set_back(&mut self, n_frames: usize) {
        self.time_s -= n_frames as f64 * f64::from(self.n_substeps) * self.step_s;
    }

    /// What they wish for from now on, besides their rules.
    pub fn meet(&mut self, meeting: Meeting) {
        self.meeting = Some(meeting);
    }

    /// Puts everybody into a moment.
    pub fn show(&mut self, positions: Vec<Vec3>, velocities: Vec<Vec3>, hunter: Option<Vec3>) {
        (self.positions, self.velocities) = (positions, velocities);
        if let (Some(hunter), Some(position)) = (&mut self.hunter, hunter) {
            hunter.position = position;
        }
    }

    /// How they move as a whole at this moment.
    pub fn order(&self) -> measures::Order {
        measures::order(&self.positions, &self.velocities, self.tank.up())
    }

    /// The depth of the tank's front, body lengths from the camera.
    pub fn front_bl(&self) -> f64 {
        self.tank.corners[0][2]
    }

    /// One output frame.
    pub fn advance(&mut self) {
        for _ in 0..self.n_substeps {
            self.step();
        }
    }

    fn start(&mut self) {
        let [least, greatest] = self.tank.corners;
        // Who aligns starts aligned: a school takes long to form, and is wanted from the first frame.
        let course =
            std::f64::consts::PI * (2.0 * random::unit(self.params.seed, &[draw::COURSE])).floor();
        let spread = std::f64::consts::PI / (1.0 + 4.0 * self.params.rules.alignment);
        for id in 0..self.positions.len() {
            let key = |word| [draw::START, id as u64, word];
            let at = |word| random::unit(self.params.seed, &key(word));
            let angle = course + spread * (2.0 * at(3) - 1.0);
            let (cos, sin) = (libm::cos(angle), libm::sin(angle));
            let direction = match self.tank.is_flat() {
                true => [cos, sin, 0.0],
                false => [cos, 0.0, sin],
            };
            self.positions[id] = std::array::from_fn(|axis| {
                least[axis] + at(axis as u64) * (greatest[axis] - least[axis])
            });
            self.velocities[id] = scaled(self.calibration.cruise_bl_per_s, direction);
            self.habitat
                .keep_out(&mut self.positions[id], &mut self.velocities[id]);
        }
    }

    fn step(&mut self) {
        self.time_s += self.step_s;
        if let Some(hunter) = &mut self.hunter {
            let (time_s, step_s) = (self.time_s, self.step_s);
            self.habitat
                .advance(hunter, time_s, step_s, &self.positions, self.calibration);
        }
        let rules = &self.params.rules;
        let reach = rules.reach_bl();
        let grid = Grid::new(&self.positions, reach);
        let half_view_rad = rules.view_deg.to_radians() / 2.0;
        let steering = Steering {
            params: &self.params,
            calibration: self.calibration,
            tank: self.tank,
            habitat: &self.habitat,
            time_s: self.time_s,
            hunter: self.hunter.as_ref(),
            cos_half_view: libm::cos(half_view_rad.min(std::f64::consts::PI)),
            velocities: &self.velocities,
        };
        let cos_sin = {
            let turn_rad = self.calibration.turn_rad_per_s * self.step_s;
            (libm::cos(turn_rad), libm::sin(turn_rad))
        };
        // In the order of cells: whoever is looked at next has nearly the same neighbors.
        let next: Vec<Next> = grid
            .by_cell()
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let mut neighbors = Vec::new();
                let mut next = Vec::with_capacity(chunk.len());
                for &id in chunk {
                    let position = self.positions[id as usize];
                    let limit = rules.neighbors as usize;
                    grid.nearest(id, position, reach, limit, &mut neighbors);
                    next.push(self.next(id as usize, &neighbors, &steering, cos_sin));
                }
                next
            })
            .collect();
        for (&id, next) in grid.by_cell().iter().zip(next) {
            let id = id as usize;
            self.positions[id] = next.position;
            self.velocities[id] = next.velocity;
            self.wander[id] = next.wander;
            self.leads_for_s[id] = next.leads_for_s;
        }
        self.push_apart();
        self.step_idx += 1;
    }

    fn next(
        &self,
        id: usize,
        neighbors: &[Neighbor],
        steering: &Steering,
        cos_sin: (f64, f64),
    ) -> Next {
        let (position, velocity) = (self.positions[id], self.velocities[id]);
        let wander = self.next_wander(id);
        let leads_for_s = self.next_lead(id, neighbors);
        let acceleration = steering.acceleration(&Moment {
            position,
            velocity,
            neighbors,
            wander,
            leads: leads_for_s > 0.0,
            noise: self.noise(id),
        });
        let wished = add_scaled(velocity, self.step_s, acceleration);
        let wished = match &self.meeting {
            Some(meeting) => meeting.wish(id, position, wished),
            None => wished,
        };
        let aside = match self.tank.is_flat() {
            true => [-velocity[1], velocity[0], 0.0],
            false => [-velocity[2], 0.0, velocity[0]],
        };
        let turned = turned_at_most(velocity, wished, cos_sin, aside);
        let mut next = Next {
            position,
            velocity: self.within_limits(turned, position, velocity),
            wander,
            leads_for_s,
        };
        next.position = add_scaled(position, self.step_s, next.velocity);
        let along = next.velocity;
        self.habitat
            .keep_out(&mut next.position, &mut next.velocity);
        // A slanting wall reflects more steeply than the animal swims.
        next.velocity = self.within_limits(next.velocity, position, along);
        next
    }

    /// Speed and slope as the animal was seen to have them, in flight faster; the direction of `before` when it
    /// stands.
    fn within_limits(&self, mut velocity: Vec3, position: Vec3, before: Vec3) -> Vec3 {
        if let Some([up, down]) = self.calibration.slopes.map(|slopes| slopes.limits) {
            let level = velocity[0].hypot(velocity[2]);
            velocity[1] = velocity[1].clamp(-up * level, down * level);
        }
        let [least, most] = self.calibration.speed_limits_bl_per_s;
        let flees = self.habitat.flee(position, self.hunter.as_ref()).is_some();
        let most = if flees { FLIGHT_PACE * most } else { most };
        let speed = norm(velocity);
        let direction = if speed > 1e-9 {
            unit(velocity)
        } else {
            unit(before)
        };
        scaled(speed.clamp(least, most), direction)
    }

    /// The error of a course with zones, in each direction.
    fn noise(&self, id: usize) -> Vec3 {
        let Some(zones) = &self.params.rules.zones else {
            return [0.0; 3];
        };
        let n_axes = if self.tank.is_flat() { 2 } else { 3 };
        std::array::from_fn(|axis| {
            let key = [draw::NOISE, id as u64, self.step_idx, axis as u64];
            let is_free = axis < n_axes;
            f64::from(u8::from(is_free)) * zones.noise_rad * random::normal(self.params.seed, &key)
        })
    }

    /// Ornstein-Uhlenbeck: a level turn rate, at weight 1 as varied as the animal's own, and a standard normal
    /// number, which is how far its slope is to be off the usual one.
    fn next_wander(&self, id: usize) -> [f64; 2] {
        let keep = libm::exp(-self.step_s / WANDER_S);
        let spread = self.params.rules.wander * self.calibration.wander_rad_per_s;
        let fresh = (1.0 - keep * keep).sqrt();
        std::array::from_fn(|k| {
            let key = [draw::WANDER, id as u64, self.step_idx, k as u64];
            let fresh = [spread, 1.0][k] * fresh * random::normal(self.params.seed, &key);
            keep * self.wander[id][k] + fresh
        })
    }

    fn next_lead(&self, id: usize, neighbors: &[Neighbor]) -> f64 {
        let left = self.leads_for_s[id] - self.step_s;
        if left > 0.0 || !self.params.leaders {
            return left.max(0.0);
        }
        let key = [draw::LEAD, id as u64, self.step_idx];
        let scale = (self.params.rules.cohesion_bl, self.step_s);
        leadership::taken(self.params.seed, key, self.velocities[id], neighbors, scale)
            .unwrap_or(0.0)
    }
}

/// What a boid is after a step.
struct Next {
    position: Vec3,
    velocity: Vec3,
    wander: [f64; 2],
    leads_for_s: f64,
}

#[cfg(test)]
mod tests;
