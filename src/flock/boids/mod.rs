//! Boids: simulated individuals that move as a flock, within the limits measured on the animal. Sources:
//! Okabe et al., section 4; Reynolds 1987; docs/explanation/algorithms.md, "Boids".
//!
//! In top view boids swim in the image plane. In side view they swim in a tank behind it. There they turn
//! through the depth, as the animal does, and not through the vertical. An output frame takes one step, or
//! several if a step would be long. All numbers are the same for any number of threads.

pub mod calibration;
mod gait;
pub mod grid;
pub mod habitat;
pub mod leadership;
pub mod measures;
pub mod nearest;
mod overlap;
pub mod params;
mod room;
pub mod rules;
mod step;
pub mod tank;
pub mod vector;
mod walls;

use std::convert::Infallible;

use self::calibration::Calibration;
pub use self::gait::{Gait, Meeting};
use self::habitat::{Habitat, Hunter};
use self::room::Room;
use self::tank::Tank;
use self::vector::{Vec3, scaled};
use super::lens::Lens;
use super::params::Params;
use crate::random;

/// Greatest distance covered in one step, body lengths (docs/explanation/algorithms.md, "Boids").
const LONGEST_STEP_BL: f64 = 0.2;
/// Distance below which boids are pushed apart after each step, body lengths, if the tank has room.
const OVERLAP_BL: f64 = 0.5;
/// Distance that boids swim before the first frame while the flock forms, body lengths. Free choice.
const WARM_UP_BL: f64 = 10.0;
/// Least and greatest time in which the flock forms, seconds. Free choice.
const WARM_UP_S: [f64; 2] = [10.0, 60.0];
/// Polarization at which a school has formed. A slow school in front of a wall may take a whole short video
/// to turn, and swims in two directions until then. Free choice.
const FORMED: f64 = 0.9;
/// Boids per unit of parallel work. Free choice.
const CHUNK: usize = 64;

/// Purposes of random numbers, as words of their keys.
mod draw {
    pub(super) const START: u64 = 1;
    pub(super) const WANDER: u64 = 2;
    pub(super) const LEAD: u64 = 3;
    pub(super) const COURSE: u64 = 4;
    pub(super) const NOISE: u64 = 5;
}

/// Boids in their tank.
pub struct Boids<'a> {
    /// Parameters with radii that fit the tank.
    params: Params,
    overlap_bl: f64,
    calibration: &'a Calibration,
    tank: &'a Tank,
    habitat: Habitat<'a>,
    step_s: f64,
    n_substeps: u32,
    n_frames_before: usize,
    step_idx: u64,
    /// Time of the video, seconds; negative before its start.
    time_s: f64,
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// Imposed speed and turn rate, by id. If empty, the rules choose both.
    gaits: Vec<Gait>,
    room: Room,
    hunter: Option<Hunter>,
    meeting: Option<Meeting>,
}

impl<'a> Boids<'a> {
    /// Returns boids that have formed a flock.
    pub fn new(
        params: &'a Params,
        calibration: &'a Calibration,
        place: (&'a Lens, &'a Tank),
        fps: f64,
    ) -> Self {
        let mut boids = Boids::at_random(params, calibration, place, fps);
        let Ok(()) = boids.form(|| Ok::<(), Infallible>(()));
        boids
    }

    /// Returns boids at random positions that have not formed a flock yet. The stronger the alignment, the
    /// more similar their first headings.
    pub fn at_random(
        params: &'a Params,
        calibration: &'a Calibration,
        (lens, tank): (&'a Lens, &'a Tank),
        fps: f64,
    ) -> Self {
        let longest_s = LONGEST_STEP_BL / calibration.speed_limits_bl_per_s[1];
        let n_substeps = (1.0 / (fps * longest_s)).ceil().clamp(1.0, 1000.0) as u32;
        let n = params.most_individuals() as usize;
        let closeness = tank.closeness(n);
        let n_frames_before = n_frames_before(calibration, fps);
        let n_steps = n_frames_before as f64 * f64::from(n_substeps);
        let step_s = 1.0 / (fps * f64::from(n_substeps));
        let mut boids = Boids {
            params: Params {
                rules: params.rules.closer(closeness),
                ..params.clone()
            },
            habitat: Habitat::new(params, lens, tank),
            overlap_bl: tank.overlap_bl(n),
            calibration,
            tank,
            step_s,
            n_substeps,
            n_frames_before,
            step_idx: 0,
            time_s: -n_steps * step_s,
            positions: vec![[0.0; 3]; n],
            velocities: vec![[0.0; 3]; n],
            gaits: Vec::new(),
            room: Room::of(n),
            hunter: None,
            meeting: None,
        };
        boids.start();
        boids
    }

    /// Returns the number of frames before the video in which a flock forms. A school may take up to twice as
    /// many.
    pub fn n_frames_before(&self) -> usize {
        self.n_frames_before
    }

    /// Simulates until the flock has formed. `go_on` is called before each frame; its error ends the
    /// simulation.
    pub fn form<E>(&mut self, mut go_on: impl FnMut() -> Result<(), E>) -> Result<(), E> {
        for _ in 0..self.n_frames_before {
            go_on()?;
            self.advance();
        }
        let mut n_left = self.n_frames_before;
        while n_left > 0 && !self.has_formed() {
            go_on()?;
            self.set_back(1);
            self.advance();
            n_left -= 1;
        }
        self.hunter = self.habitat.hunter();
        Ok(())
    }

    fn has_formed(&self) -> bool {
        let rules = &self.params.rules;
        let is_school = rules.alignment > 0.0 && rules.zones.is_none();
        !is_school || measures::polarization(&self.velocities) >= FORMED
    }

    /// Returns the position of the predator, if there is one.
    pub fn predator(&self) -> Option<Vec3> {
        Some(self.hunter?.position)
    }

    /// Returns the positions, by id, body lengths.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Returns the velocities, by id, body lengths per second.
    pub fn velocities(&self) -> &[Vec3] {
        &self.velocities
    }

    /// Delays the start of the video by `n_frames`.
    pub fn set_back(&mut self, n_frames: usize) {
        self.time_s -= n_frames as f64 * f64::from(self.n_substeps) * self.step_s;
    }

    /// Sets the positions and velocities to steer toward, besides the rules, from the next step on.
    pub fn meet(&mut self, meeting: Meeting) {
        self.meeting = Some(meeting);
    }

    /// Sets positions and velocities, by id, and the position of the predator.
    pub fn show(&mut self, positions: Vec<Vec3>, velocities: Vec<Vec3>, hunter: Option<Vec3>) {
        (self.positions, self.velocities) = (positions, velocities);
        self.swim_from_here();
        if let (Some(hunter), Some(position)) = (&mut self.hunter, hunter) {
            hunter.position = position;
        }
    }

    /// Returns the collective order at this moment.
    pub fn order(&self) -> measures::Order {
        let up = self.tank.up();
        let is_outside =
            |&&place: &&Vec3| !(self.tank.holds(place) && self.habitat.is_clear(place));
        measures::Order {
            n_outside: self.positions.iter().filter(is_outside).count() as u32,
            ..measures::order(&self.positions, &self.velocities, up, self.overlap_bl)
        }
    }

    /// Returns the distance that boids keep from each other, body lengths.
    pub fn overlap_bl(&self) -> f64 {
        self.overlap_bl
    }

    /// Returns the greatest speed of the calibration, body lengths per second.
    pub fn fastest_bl_per_s(&self) -> f64 {
        self.calibration.speed_limits_bl_per_s[1]
    }

    /// Returns a position moved into the tank and out of obstacles.
    pub fn inside(&self, mut place: Vec3) -> Vec3 {
        self.habitat.keep_out(&mut place, &mut [0.0; 3]);
        place
    }

    /// Returns the depth of the front of the tank, body lengths from the camera.
    pub fn front_bl(&self) -> f64 {
        self.tank.corners[0][2]
    }

    /// Advances by one output frame.
    pub fn advance(&mut self) {
        for _ in 0..self.n_substeps {
            self.step();
        }
    }

    fn start(&mut self) {
        let [least, greatest] = self.tank.corners;
        // Boids that align start aligned, because a school takes long to form.
        let course =
            std::f64::consts::PI * (2.0 * random::unit(self.params.seed, &[draw::COURSE])).floor();
        let spread = std::f64::consts::PI / (1.0 + 4.0 * self.params.rules.alignment);
        for id in 0..self.positions.len() {
            let key = |word| [draw::START, id as u64, word];
            let at = |word| random::unit(self.params.seed, &key(word));
            let angle = course + spread * (2.0 * at(3) - 1.0);
            let (cos, sin) = (libm::cos(angle), libm::sin(angle));
            let direction = if self.tank.is_flat() {
                [cos, sin, 0.0]
            } else {
                [cos, 0.0, sin]
            };
            self.positions[id] = std::array::from_fn(|axis| {
                least[axis] + at(axis as u64) * (greatest[axis] - least[axis])
            });
            self.velocities[id] = scaled(self.calibration.cruise_bl_per_s, direction);
            self.habitat
                .keep_out(&mut self.positions[id], &mut self.velocities[id]);
        }
        self.swim_from_here();
    }
}

/// Returns the number of frames in which a flock forms.
fn n_frames_before(calibration: &Calibration, fps: f64) -> usize {
    let [least_s, most_s] = WARM_UP_S;
    let warm_up_s = (WARM_UP_BL / calibration.cruise_bl_per_s).clamp(least_s, most_s);
    (warm_up_s * fps).ceil() as usize
}

#[cfg(test)]
mod bits;
#[cfg(test)]
mod presets;
#[cfg(test)]
mod tests;
