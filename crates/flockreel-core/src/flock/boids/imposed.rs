//! Motion imposed on boids besides their rules. The speed and the turn rate of the filmed animal leave only
//! the direction to the rules. A loop adds the positions to return to.

use super::Boids;
use super::step::StepContext;
use super::vector::{CosSin, Vec3, add_scaled, minus, norm, scaled, unit};

/// Time constant with which a boid approaches its target position, seconds. Free choice.
const APPROACH_S: f64 = 0.6;

/// Speed and turn rate of the filmed animal, imposed on a boid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImposedMotion {
    /// Speed, body lengths per second. Below cruising speed the rules turn the boid less, and at rest not at
    /// all.
    pub speed_bl_per_s: f64,
    /// Turn rate in the image plane, radians per second. It adds to the turns by the rules, in a flat tank
    /// only.
    pub turn_rad_per_s: f64,
}

impl Boids<'_> {
    /// Imposes speeds and turn rates, by id, from the next step on.
    pub fn impose_motion(&mut self, imposed: Vec<ImposedMotion>) {
        self.imposed = imposed;
    }

    /// Returns the velocity at which a boid moves, body lengths per second.
    pub fn actual_velocity(&self, id: usize) -> Vec3 {
        self.at_imposed_speed(id, self.positions[id], self.velocities[id])
    }

    /// Returns cosine and sine of the greatest turn of a boid in one step. It shrinks with an imposed speed
    /// below cruising speed, to 0 at rest.
    pub(super) fn max_turn(&self, id: usize, context: &StepContext) -> CosSin {
        let Some(imposed) = self.imposed.get(id) else {
            return context.max_turn;
        };
        let share = (imposed.speed_bl_per_s / self.calibration.cruise_bl_per_s).min(1.0);
        CosSin::new(share * context.max_turn_rad)
    }

    /// Returns the velocity turned at the imposed turn rate.
    pub(super) fn turned_at_imposed_rate(&self, id: usize, velocity: Vec3) -> Vec3 {
        let Some(imposed) = self.imposed.get(id).filter(|_| self.tank.is_flat()) else {
            return velocity;
        };
        let CosSin { cos, sin } = CosSin::new(self.step_s * imposed.turn_rad_per_s);
        let [x, y, z] = velocity;
        [cos * x - sin * y, sin * x + cos * y, z]
    }

    /// Returns the velocity at the imposed speed. A fleeing boid keeps its own speed if that is higher.
    pub(super) fn at_imposed_speed(&self, id: usize, position: Vec3, velocity: Vec3) -> Vec3 {
        let Some(imposed) = self.imposed.get(id) else {
            return velocity;
        };
        let mut speed = imposed.speed_bl_per_s;
        if self.habitat.is_fleeing(position, self.predator.as_ref()) {
            speed = speed.max(norm(velocity));
        }
        scaled(speed, unit(velocity))
    }
}

/// Positions and velocities that boids are to reach one frame later.
#[derive(Clone, Debug)]
pub struct TargetStates {
    /// Weight against the rules, 0..=1.
    pub weight: f64,
    /// Position, body lengths, and velocity, body lengths per second, by id.
    pub states: Vec<(Vec3, Vec3)>,
}

impl TargetStates {
    /// Returns the desired velocity. `by_rules` is the one without the target.
    pub(super) fn desired_velocity(&self, id: usize, position: Vec3, by_rules: Vec3) -> Vec3 {
        let (target, velocity) = self.states[id];
        let approach = add_scaled(velocity, 1.0 / APPROACH_S, minus(target, position));
        add_scaled(by_rules, self.weight, minus(approach, by_rules))
    }
}
