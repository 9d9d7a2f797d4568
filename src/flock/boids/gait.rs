//! Motion imposed on boids besides their rules. The speed and the turn rate of the filmed animal leave only
//! the direction to the rules. A loop adds the positions to return to.

use super::Boids;
use super::lanes::{self, Lanes};
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
        self.at_filmed_speed::<f64>(
            &[id as u32; lanes::MOST],
            self.positions[id],
            self.velocities[id],
        )
    }

    /// Returns cosine and sine of the greatest turn of each boid in one step. It shrinks with an imposed
    /// speed below cruising speed, to 0 at rest.
    #[inline(always)]
    pub(super) fn widest_turn<L: Lanes>(&self, ids: &[u32; lanes::MOST], pace: &Pace) -> (L, L) {
        if self.gaits.is_empty() {
            return (L::splat(pace.cos_sin.0), L::splat(pace.cos_sin.1));
        }
        let mut turns_rad = [0.0; lanes::MOST];
        for lane in 0..L::N {
            let speed = self.gaits[ids[lane] as usize].speed_bl_per_s;
            let share = (speed / self.calibration.cruise_bl_per_s).min(1.0);
            turns_rad[lane] = share * pace.turn_rad;
        }
        (
            L::from_fn(|lane| libm::cos(turns_rad[lane])),
            L::from_fn(|lane| libm::sin(turns_rad[lane])),
        )
    }

    /// Returns the velocities turned at the imposed turn rates.
    #[inline(always)]
    pub(super) fn turned_as_filmed<L: Lanes>(
        &self,
        ids: &[u32; lanes::MOST],
        velocity: [L; 3],
    ) -> [L; 3] {
        if self.gaits.is_empty() || !self.tank.is_flat() {
            return velocity;
        }
        let mut turns_rad = [0.0; lanes::MOST];
        for lane in 0..L::N {
            turns_rad[lane] = self.step_s * self.gaits[ids[lane] as usize].turn_rad_per_s;
        }
        let cos = L::from_fn(|lane| libm::cos(turns_rad[lane]));
        let sin = L::from_fn(|lane| libm::sin(turns_rad[lane]));
        let [x, y, z] = velocity;
        [cos * x - sin * y, sin * x + cos * y, z]
    }

    /// Returns the velocities at the imposed speeds. In flight the speed is at least that of the boid itself.
    #[inline(always)]
    pub(super) fn at_filmed_speed<L: Lanes>(
        &self,
        ids: &[u32; lanes::MOST],
        position: [L; 3],
        velocity: [L; 3],
    ) -> [L; 3] {
        if self.gaits.is_empty() {
            return velocity;
        }
        let filmed = L::from_fn(|lane| self.gaits[ids[lane] as usize].speed_bl_per_s);
        let flees = self.habitat.flees(position, self.hunter.as_ref());
        let speed = L::select(flees, filmed.max(norm(velocity)), filmed);
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
