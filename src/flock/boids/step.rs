//! One step of all boids (docs/explanation/algorithms.md, "Boids"): neighbors, wanted velocities, and limits
//! of turn rate and speed. Boids are processed in the order of the grid's cells, where neighbors are adjacent
//! in memory, and written back by id.

use rayon::prelude::*;

use super::grid::{Boid, Grid};
use super::nearest::{Extent, Neighbor, Search};
use super::room::{Crowd, Inner, Room};
use super::rules::{Moment, Steering};
use super::vector::{Vec3, add_scaled, cross, dot, minus, norm, scaled, turned_at_most, unit};
use super::{Boids, CHUNK, draw, leadership};
use crate::random::{self, Row};

/// Time constant of the wandering turn rate, seconds. Free choice.
const WANDER_S: f64 = 1.0;
/// Greatest speed in flight, as a multiple of that of the animal (docs/explanation/algorithms.md, "Boids").
const FLIGHT_PACE: f64 = 1.6;
/// Factor on the distance of the farthest neighbor of the previous step, for the first search radius. It
/// affects the speed, not the result. Free choice.
const FARTHER: f64 = 1.03;

/// Values of one step that all boids share.
pub(super) struct Pace<'a> {
    steering: Steering<'a>,
    /// Greatest turn in one step, radians, and its cosine and sine.
    pub(super) turn_rad: f64,
    pub(super) cos_sin: (f64, f64),
    /// Share of the wander that is kept in one step, and standard deviation of what is added, relative to
    /// that of the wander.
    wander: [f64; 2],
    /// Random numbers added to turn rate and slope, by id.
    kicks: [Row; 2],
    reach_bl: f64,
}

impl Boids<'_> {
    pub(super) fn step(&mut self) {
        self.time_s += self.step_s;
        if let Some(hunter) = &mut self.hunter {
            let (time_s, step_s) = (self.time_s, self.step_s);
            self.habitat
                .advance(hunter, time_s, step_s, &self.positions, self.calibration);
        }
        let mut room = std::mem::take(&mut self.room);
        let Room {
            now, next, grid, ..
        } = &mut room;
        let pace = self.pace();
        grid.sort(&now.boids, pace.reach_bl);
        next.boids.resize(now.boids.len(), Boid::default());
        next.inners.resize(now.boids.len(), Inner::default());
        let farthest_bl2 = self.all_go_on(next, &now.inners, grid, &pace);
        self.push_apart(&mut room, farthest_bl2.sqrt());
        let (slots, boids) = (room.grid.slots(), &room.next.boids);
        (&mut self.positions, &mut self.velocities, &mut room.places)
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(position, velocity, place)| {
                *place = slots[*place as usize];
                let boid = &boids[*place as usize];
                (*position, *velocity) = (boid.position, boid.velocity);
            });
        std::mem::swap(&mut room.now, &mut room.next);
        self.room = room;
        self.step_idx += 1;
    }

    /// Copies `positions` and `velocities` to the working state of all boids.
    pub(super) fn swim_from_here(&mut self) {
        for boid in &mut self.room.now.boids {
            let id = boid.id as usize;
            (boid.position, boid.velocity) = (self.positions[id], self.velocities[id]);
        }
    }

    fn pace(&self) -> Pace<'_> {
        let rules = &self.params.rules;
        let half_view_rad = rules.view_deg.to_radians() / 2.0;
        let turn_rad = self.calibration.turn_rad_per_s * self.step_s;
        let keep = libm::exp(-self.step_s / WANDER_S);
        Pace {
            steering: Steering {
                params: &self.params,
                calibration: self.calibration,
                tank: self.tank,
                habitat: &self.habitat,
                time_s: self.time_s,
                hunter: self.hunter.as_ref(),
                cos_half_view: libm::cos(half_view_rad.min(std::f64::consts::PI)),
            },
            turn_rad,
            cos_sin: (libm::cos(turn_rad), libm::sin(turn_rad)),
            wander: [keep, (1.0 - keep * keep).sqrt()],
            kicks: [0, 1].map(|k| random::row(self.params.seed, &[draw::WANDER, self.step_idx, k])),
            reach_bl: rules.reach_bl(),
        }
    }

    /// Computes all boids after the step. Returns the squared length of the longest displacement.
    fn all_go_on(&self, next: &mut Crowd, now: &[Inner], grid: &Grid, pace: &Pace) -> f64 {
        (&mut next.boids, &mut next.inners)
            .into_par_iter()
            .with_min_len(CHUNK)
            .enumerate()
            .map_init(Search::default, |search, (slot, (boid, inner))| {
                let before = &now[grid.given()[slot] as usize];
                (*boid, *inner) = self.next(slot, before, grid, search, pace);
                let way = minus(boid.position, grid.at(slot).position);
                dot(way, way)
            })
            .reduce(|| 0.0, f64::max)
    }

    /// Returns the boid at `slot` and its inner state after the step.
    fn next(
        &self,
        slot: usize,
        before: &Inner,
        grid: &Grid,
        search: &mut Search,
        pace: &Pace,
    ) -> (Boid, Inner) {
        let extent = Extent {
            limit: self.params.rules.neighbors as usize,
            reach_bl: pace.reach_bl,
            guess_bl: FARTHER * before.sight_bl,
        };
        let neighbors = search.nearest(grid, slot, extent);
        let boid = grid.at(slot);
        let inner = self.next_inner(boid, before, neighbors, pace);
        let (id, position, velocity) = (boid.id as usize, boid.position, boid.velocity);
        let moment = Moment {
            position,
            velocity,
            neighbors,
            wander: inner.wander,
            leads: inner.leads_for_s > 0.0,
            noise: self.noise(id),
        };
        let wished = self.wished(id, before, &moment, pace);
        let sideways = cross(self.tank.up(), velocity);
        let ahead = self.turned_as_filmed(id, velocity);
        let turned = turned_at_most(ahead, wished, self.widest_turn(id, pace), sideways);
        let next = self.within_limits(turned, position, velocity);
        let way = self.at_filmed_speed(id, position, next);
        let place = add_scaled(position, self.step_s, way);
        let (place, next) = self.kept_in(place, velocity, next);
        // A slanted wall may reflect to a steeper slope than the animal swims.
        let next = self.within_limits(next, position, velocity);
        let boid = Boid {
            position: place,
            velocity: next,
            id: boid.id,
        };
        (boid, inner)
    }

    /// Returns the inner state of a boid after the step.
    fn next_inner(
        &self,
        boid: &Boid,
        before: &Inner,
        neighbors: &[Neighbor],
        pace: &Pace,
    ) -> Inner {
        let square_bl2 = |rank: usize| neighbors.get(rank).map_or(f64::INFINITY, |n| n.square_bl2);
        let last = self.params.rules.neighbors as usize - 1;
        Inner {
            wander: self.next_wander(boid.id, before, pace),
            leads_for_s: self.next_lead(boid, before, neighbors),
            sight_bl: square_bl2(last).sqrt(),
            nearest_bl2: square_bl2(0).min(pace.reach_bl * pace.reach_bl),
            is_blocked: false,
        }
    }

    /// Returns the velocity that a boid wants, body lengths per second.
    fn wished(&self, id: usize, before: &Inner, moment: &Moment, pace: &Pace) -> Vec3 {
        let velocity = moment.velocity;
        let wished = if before.is_blocked {
            let speed = norm(velocity).max(self.calibration.cruise_bl_per_s);
            let sideways = cross(self.tank.up(), velocity);
            scaled(speed.copysign(moment.wander[0]), unit(sideways))
        } else {
            let acceleration = pace.steering.acceleration(moment);
            add_scaled(velocity, self.step_s, acceleration)
        };
        match &self.meeting {
            Some(meeting) => meeting.wish(id, moment.position, wished),
            None => wished,
        }
    }

    /// Limits slope and speed to those of the animal. In flight the greatest speed is higher. A velocity near
    /// 0 gets the direction of `before`.
    pub(super) fn within_limits(&self, mut velocity: Vec3, position: Vec3, before: Vec3) -> Vec3 {
        if let Some(slopes) = &self.calibration.slopes {
            let [level, across] = self.habitat.lens.seen_level(position, velocity);
            let [up, down] = slopes.in_picture.map(|slope| slope * across);
            let seen = velocity[1].clamp(level - up, level + down);
            let pace = norm([velocity[0], 0.0, velocity[2]]);
            let [up, down] = slopes.limits.map(|slope| slope * pace);
            velocity[1] = seen.clamp(-up, down);
        }
        let [least, mut most] = self.calibration.speed_limits_bl_per_s;
        if self.habitat.flees(position, self.hunter.as_ref()) {
            most *= FLIGHT_PACE;
        }
        let speed = norm(velocity);
        let direction = if speed > 1e-9 { velocity } else { before };
        scaled(speed.clamp(least, most), unit(direction))
    }

    /// Returns the random error of a course in the zonal model, along each axis.
    fn noise(&self, id: usize) -> Vec3 {
        let Some(zones) = &self.params.rules.zones else {
            return [0.0; 3];
        };
        let n_axes = if self.tank.is_flat() { 2 } else { 3 };
        let mut noise = [0.0; 3];
        for axis in 0..n_axes {
            let key = [draw::NOISE, id as u64, self.step_idx, axis as u64];
            noise[axis] = zones.noise_rad * random::normal(self.params.seed, &key);
        }
        noise
    }

    /// Returns the next values of two Ornstein-Uhlenbeck processes. The first is a turn rate, at weight 1 as
    /// varied as that of the animal. The second is the wanted slope, in standard deviations from the usual
    /// one. A flat tank has no slope.
    fn next_wander(&self, id: u32, before: &Inner, pace: &Pace) -> [f64; 2] {
        let [keep, fresh] = pace.wander;
        let next = |k: usize, spread: f64| {
            keep * before.wander[k] + spread * fresh * pace.kicks[k].bell(u64::from(id))
        };
        let spread = self.params.rules.wander * self.calibration.wander_rad_per_s;
        let slope = if self.tank.is_flat() {
            0.0
        } else {
            next(1, 1.0)
        };
        [next(0, spread), slope]
    }

    /// Returns the remaining time of the lead of a boid, seconds; 0 if it does not lead.
    fn next_lead(&self, boid: &Boid, before: &Inner, neighbors: &[Neighbor]) -> f64 {
        let left = before.leads_for_s - self.step_s;
        if left > 0.0 || !self.params.leaders {
            return left.max(0.0);
        }
        let key = [draw::LEAD, u64::from(boid.id), self.step_idx];
        let offsets = neighbors.iter().map(|neighbor| neighbor.offset);
        let taken = leadership::taken(
            self.params.seed,
            key,
            boid.velocity,
            offsets,
            self.params.rules.cohesion_bl,
            self.step_s,
        );
        taken.unwrap_or(0.0)
    }
}
