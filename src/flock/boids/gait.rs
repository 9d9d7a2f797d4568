//! Motion imposed on boids besides their rules. The speed and the turn rate of the filmed animal leave only
//! the direction to the rules. A loop adds the positions to return to.

use super::Boids;
use super::step::Pace;
use super::vector::{Vec3, add_scaled, minus, norm, scaled, unit};

/// Time constant with which a boid approaches the position to reach, seconds. Free choice.
const MEETING_S: f64 = 0.6;

/// Speed and turn rate of the filmed animal, imposed on a boid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gait {
    /// Speed, body lengths per second. Below cruising speed the rules turn the boid less, and at rest not at
    /// all.
    pub speed_bl_per_s: f64,
    /// Turn rate in the image plane, radians per second. It adds to the turns by the rules, in a flat tank
    /// only.
    pub turn_rad_per_s: f64,
}

impl Boids<'_> {
    /// Imposes speeds and turn rates, by id, from the next step on.
    pub fn go_as(&mut self, gaits: Vec<Gait>) {
        self.gaits = gaits;
    }

    /// Returns the velocity at which a boid moves, body lengths per second.
    pub fn motion(&self, id: usize) -> Vec3 {
        self.at_filmed_speed(id, self.positions[id], self.velocities[id])
    }

    /// Returns cosine and sine of the greatest turn of a boid in one step. It shrinks with an imposed speed
    /// below cruising speed, to 0 at rest.
    pub(super) fn widest_turn(&self, id: usize, pace: &Pace) -> (f64, f64) {
        let Some(gait) = self.gaits.get(id) else {
            return pace.cos_sin;
        };
        let share = (gait.speed_bl_per_s / self.calibration.cruise_bl_per_s).min(1.0);
        let turn_rad = share * pace.turn_rad;
        (libm::cos(turn_rad), libm::sin(turn_rad))
    }

    /// Returns the velocity turned at the imposed turn rate.
    pub(super) fn turned_as_filmed(&self, id: usize, velocity: Vec3) -> Vec3 {
        let Some(gait) = self.gaits.get(id).filter(|_| self.tank.is_flat()) else {
            return velocity;
        };
        let turn_rad = self.step_s * gait.turn_rad_per_s;
        let (cos, sin) = (libm::cos(turn_rad), libm::sin(turn_rad));
        let [x, y, z] = velocity;
        [cos * x - sin * y, sin * x + cos * y, z]
    }

    /// Returns the velocity at the imposed speed. In flight the speed is at least that of the boid itself.
    pub(super) fn at_filmed_speed(&self, id: usize, position: Vec3, velocity: Vec3) -> Vec3 {
        let Some(gait) = self.gaits.get(id) else {
            return velocity;
        };
        let mut speed = gait.speed_bl_per_s;
        if self.habitat.flees(position, self.hunter.as_ref()) {
            speed = speed.max(norm(velocity));
        }
        scaled(speed, unit(velocity))
    }
}

/// Positions and velocities that boids are to reach one frame later.
#[derive(Clone, Debug)]
pub struct Meeting {
    /// Weight against the other wishes, 0..=1.
    pub share: f64,
    /// Position, body lengths, and velocity, body lengths per second, by id.
    pub places: Vec<(Vec3, Vec3)>,
}

impl Meeting {
    /// Returns the wanted velocity. `wished` is the one without the meeting.
    pub(super) fn wish(&self, id: usize, position: Vec3, wished: Vec3) -> Vec3 {
        let (place, velocity) = self.places[id];
        let there = add_scaled(velocity, 1.0 / MEETING_S, minus(place, position));
        add_scaled(wished, self.share, minus(there, wished))
    }
}
