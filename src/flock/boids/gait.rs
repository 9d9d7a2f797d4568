//! Motion that is imposed on boids in addition to their rules: the speed and the turn rate of the filmed animal (the rules then
//! choose the direction alone), and in a loop the positions to return to.

use super::Boids;
use super::lanes::{self, Lanes};
use super::step::Pace;
use super::vector::{Vec3, add_scaled, minus, norm, scaled, unit};

/// Time constant with which a boid approaches the position that it must reach.
const MEETING_S: f64 = 0.6;

/// How a filmed animal gets on, whatever the rules wish.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gait {
    /// Its speed, body lengths a second. Who is slower than usual is turned less by its rules, and who rests not at all.
    pub speed_bl_per_s: f64,
    /// How fast it turns by itself, in the plane of the picture.
    pub turn_rad_per_s: f64,
}

impl Boids<'_> {
    /// Has everybody get on as filmed from now on, by id: their rules say where to, the film says how.
    pub fn go_as(&mut self, gaits: Vec<Gait>) {
        self.gaits = gaits;
    }

    /// The velocity at which one gets on, body lengths a second.
    pub fn motion(&self, id: usize) -> Vec3 {
        self.at_filmed_speed::<f64>(
            &[id as u32; lanes::MOST],
            self.positions[id],
            self.velocities[id],
        )
    }

    /// cos and sin of the widest turn of each: who is slower than usual turns less, and who rests does not turn.
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

    /// The velocity of each, turned as it was filmed to turn by itself.
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

    /// The velocity at which each gets on: in the direction that it swims in, as fast as it was filmed; in flight at
    /// least as fast as it would.
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

/// Where everybody is to be a frame later and how fast, by id: places in body lengths and velocities.
#[derive(Clone, Debug)]
pub struct Meeting {
    /// How much of each wish it is, 0..=1.
    pub share: f64,
    /// Place and velocity.
    pub places: Vec<(Vec3, Vec3)>,
}

impl Meeting {
    /// The velocity wished for instead of `wished`.
    pub(super) fn wish(&self, id: usize, position: Vec3, wished: Vec3) -> Vec3 {
        let (place, velocity) = self.places[id];
        let there = add_scaled(velocity, 1.0 / MEETING_S, minus(place, position));
        add_scaled(wished, self.share, minus(there, wished))
    }
}
