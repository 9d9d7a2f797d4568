//! One step of all boids (docs/explanation/algorithms.md, "Boids"): neighbors, wanted velocities, and limits
//! of turn rate and speed. Boids are processed in the order of the grid's cells, where neighbors are adjacent
//! in memory, and written back by id.

use rayon::prelude::*;

use super::grid::{Boid, Grid};
use super::nearest::{Neighbor, Query, Search};
use super::rules::Situation;
use super::vector::{
    CosSin, Vec3, add_scaled, cross, dot, minus, norm, scaled, turned_at_most, unit,
};
use super::workspace::{InternalState, Population, Workspace};
use super::{Boids, CHUNK, leadership, random_key};
use crate::random::{self, Sequence};

/// Time constant of the wandering turn rate, seconds. Free choice.
const WANDER_S: f64 = 1.0;
/// Greatest speed while fleeing, as a multiple of that of the animal (docs/explanation/algorithms.md, "Boids").
const FLEEING_SPEED_FACTOR: f64 = 1.6;
/// Factor on the distance of the farthest neighbor of the previous step, for the first search radius. It
/// affects the speed, not the result. Free choice.
const GUESS_FACTOR: f64 = 1.03;

/// Values of one step that all boids share.
pub(super) struct StepContext {
    /// Cosine of half the field of view.
    cos_half_view: f64,
    /// Greatest turn in one step, radians, and its cosine and sine.
    pub(super) max_turn_rad: f64,
    pub(super) max_turn: CosSin,
    /// Share of the wander that is kept in one step, and standard deviation of what is added, relative to
    /// that of the wander.
    wander: [f64; 2],
    /// Random numbers added to turn rate and slope, by id.
    wander_noise: [Sequence; 2],
    reach_bl: f64,
}

impl Boids<'_> {
    pub(super) fn step(&mut self) {
        self.time_s += self.step_s;
        if let Some(predator) = &mut self.predator {
            let (time_s, step_s) = (self.time_s, self.step_s);
            self.habitat
                .advance(predator, time_s, step_s, &self.positions, self.calibration);
        }
        let mut workspace = std::mem::take(&mut self.workspace);
        let Workspace {
            current,
            next,
            grid,
            ..
        } = &mut workspace;
        let context = self.context();
        grid.sort(&current.boids, context.reach_bl);
        let n = current.boids.len();
        next.boids.resize(n, Boid::default());
        next.internals.resize(n, InternalState::default());
        let farthest_bl2 = self.advance_all(next, &current.internals, grid, &context);
        self.push_apart(&mut workspace, farthest_bl2.sqrt());
        let (slots, boids) = (&workspace.grid.slots, &workspace.next.boids);
        let index_by_id = &mut workspace.index_by_id;
        (&mut self.positions, &mut self.velocities, index_by_id)
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(position, velocity, index)| {
                *index = slots[*index as usize];
                let boid = &boids[*index as usize];
                (*position, *velocity) = (boid.position, boid.velocity);
            });
        std::mem::swap(&mut workspace.current, &mut workspace.next);
        self.workspace = workspace;
        self.step_idx += 1;
    }

    /// Copies `positions` and `velocities` to the working state of all boids.
    pub(super) fn load_states(&mut self) {
        for boid in &mut self.workspace.current.boids {
            let id = boid.id as usize;
            (boid.position, boid.velocity) = (self.positions[id], self.velocities[id]);
        }
    }

    fn context(&self) -> StepContext {
        let rules = &self.params.rules;
        let half_view_rad = rules.view_deg.to_radians() / 2.0;
        let max_turn_rad = self.calibration.turn_rad_per_s * self.step_s;
        let keep = libm::exp(-self.step_s / WANDER_S);
        let noise = |k| Sequence::new(self.params.seed, &[random_key::WANDER, self.step_idx, k]);
        StepContext {
            cos_half_view: libm::cos(half_view_rad.min(std::f64::consts::PI)),
            max_turn_rad,
            max_turn: CosSin::new(max_turn_rad),
            wander: [keep, (1.0 - keep * keep).sqrt()],
            wander_noise: [0, 1].map(noise),
            reach_bl: rules.reach_bl(),
        }
    }

    /// Computes all boids after the step. Returns the squared length of the longest displacement.
    fn advance_all(
        &self,
        next: &mut Population,
        internals: &[InternalState],
        grid: &Grid,
        context: &StepContext,
    ) -> f64 {
        (&mut next.boids, &mut next.internals)
            .into_par_iter()
            .with_min_len(CHUNK)
            .enumerate()
            .map_init(Search::default, |search, (slot, (boid, internal))| {
                let before = &internals[grid.input_indices[slot] as usize];
                (*boid, *internal) = self.next(slot, before, grid, search, context);
                let displacement = minus(boid.position, grid.at(slot).position);
                dot(displacement, displacement)
            })
            .reduce(|| 0.0, f64::max)
    }

    /// Returns the boid at `slot` and its internal state after the step.
    fn next(
        &self,
        slot: usize,
        before: &InternalState,
        grid: &Grid,
        search: &mut Search,
        context: &StepContext,
    ) -> (Boid, InternalState) {
        let query = Query {
            max_neighbors: self.params.rules.neighbors as usize,
            reach_bl: context.reach_bl,
            guess_bl: GUESS_FACTOR * before.sight_bl,
        };
        let neighbors = search.nearest(grid, slot, query);
        let boid = grid.at(slot);
        let internal = self.next_internal(boid, before, neighbors, context);
        let (id, position, velocity) = (boid.id as usize, boid.position, boid.velocity);
        let situation = Situation {
            position,
            velocity,
            neighbors,
            wander: internal.wander,
            leads: internal.leads_for_s > 0.0,
            noise: self.course_error(id),
            cos_half_view: context.cos_half_view,
        };
        let desired = self.desired_velocity(id, before, &situation);
        let sideways = cross(self.tank.up(), velocity);
        let ahead = self.turned_at_imposed_rate(id, velocity);
        let turned = turned_at_most(ahead, desired, self.max_turn(id, context), sideways);
        let next = self.within_limits(turned, position, velocity);
        let actual = self.at_imposed_speed(id, position, next);
        let next_position = add_scaled(position, self.step_s, actual);
        let (next_position, next) = self.within_habitat(next_position, velocity, next);
        // A slanted wall may reflect to a steeper slope than the animal swims.
        let next = self.within_limits(next, position, velocity);
        let boid = Boid {
            position: next_position,
            velocity: next,
            id: boid.id,
        };
        (boid, internal)
    }

    /// Returns the internal state of a boid after the step.
    fn next_internal(
        &self,
        boid: &Boid,
        before: &InternalState,
        neighbors: &[Neighbor],
        context: &StepContext,
    ) -> InternalState {
        let square_bl2 = |rank: usize| neighbors.get(rank).map_or(f64::INFINITY, |n| n.square_bl2);
        let last = self.params.rules.neighbors as usize - 1;
        InternalState {
            wander: self.next_wander(boid.id, before, context),
            leads_for_s: self.next_lead_s(boid, before, neighbors),
            sight_bl: square_bl2(last).sqrt(),
            nearest_bl2: square_bl2(0).min(context.reach_bl * context.reach_bl),
            is_blocked: false,
        }
    }

    /// Returns the velocity that a boid wants, body lengths per second.
    fn desired_velocity(&self, id: usize, before: &InternalState, situation: &Situation) -> Vec3 {
        let velocity = situation.velocity;
        let desired = if before.is_blocked {
            let speed = norm(velocity).max(self.calibration.cruise_bl_per_s);
            let sideways = cross(self.tank.up(), velocity);
            scaled(speed.copysign(situation.wander[0]), unit(sideways))
        } else {
            let acceleration = self.acceleration(situation);
            add_scaled(velocity, self.step_s, acceleration)
        };
        match &self.targets {
            Some(targets) => targets.desired_velocity(id, situation.position, desired),
            None => desired,
        }
    }

    /// Limits slope and speed to those of the animal. A fleeing boid may be faster. A velocity near 0 gets the
    /// direction of `before`.
    pub(super) fn within_limits(&self, mut velocity: Vec3, position: Vec3, before: Vec3) -> Vec3 {
        if let Some(slopes) = &self.calibration.slopes {
            let [level, across] = self.habitat.lens.seen_level(position, velocity);
            let [up, down] = slopes.in_picture.map(|slope| slope * across);
            let in_picture = velocity[1].clamp(level - up, level + down);
            let horizontal = norm([velocity[0], 0.0, velocity[2]]);
            let [up, down] = slopes.limits.map(|slope| slope * horizontal);
            velocity[1] = in_picture.clamp(-up, down);
        }
        let [min_speed, mut max_speed] = self.calibration.speed_limits_bl_per_s;
        if self.habitat.is_fleeing(position, self.predator.as_ref()) {
            max_speed *= FLEEING_SPEED_FACTOR;
        }
        let speed = norm(velocity);
        let direction = if speed > 1e-9 { velocity } else { before };
        scaled(speed.clamp(min_speed, max_speed), unit(direction))
    }

    /// Returns the random error of a course in the zonal model, along each axis.
    fn course_error(&self, id: usize) -> Vec3 {
        let Some(zones) = &self.params.rules.zones else {
            return [0.0; 3];
        };
        let n_axes = if self.tank.is_flat() { 2 } else { 3 };
        std::array::from_fn(|axis| {
            if axis >= n_axes {
                return 0.0;
            }
            let key = [random_key::NOISE, id as u64, self.step_idx, axis as u64];
            zones.noise_rad * random::normal(self.params.seed, &key)
        })
    }

    /// Returns the next values of two Ornstein-Uhlenbeck processes. The first is a turn rate, at weight 1 as
    /// varied as that of the animal. The second is the wanted slope, in standard deviations from the usual
    /// one. A flat tank has no slope.
    fn next_wander(&self, id: u32, before: &InternalState, context: &StepContext) -> [f64; 2] {
        let [keep, fresh] = context.wander;
        let next = |k: usize, spread: f64| {
            let noise = context.wander_noise[k].irwin_hall(u64::from(id));
            keep * before.wander[k] + spread * fresh * noise
        };
        let spread = self.params.rules.wander * self.calibration.wander_rad_per_s;
        let is_flat = self.tank.is_flat();
        [next(0, spread), if is_flat { 0.0 } else { next(1, 1.0) }]
    }

    /// Returns the remaining time of the lead of a boid, seconds; 0 if it does not lead.
    fn next_lead_s(&self, boid: &Boid, before: &InternalState, neighbors: &[Neighbor]) -> f64 {
        let left_s = before.leads_for_s - self.step_s;
        if left_s > 0.0 || !self.params.leaders {
            return left_s.max(0.0);
        }
        let candidate = leadership::Candidate {
            velocity: boid.velocity,
            neighbors,
            cohesion_bl: self.params.rules.cohesion_bl,
        };
        let key = [random_key::LEAD, u64::from(boid.id), self.step_idx];
        let lead_s = candidate.new_lead_s(self.params.seed, key, self.step_s);
        lead_s.unwrap_or(0.0)
    }
}
