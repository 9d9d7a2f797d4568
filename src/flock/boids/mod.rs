//! Boids: simulated individuals that move as a flock and never ask for what the animal was not seen
//! to do (O 4; Reynolds 1987; ALGORITHMS.md 7).
//!
//! In top view they swim in the plane of the picture. In side view they swim in a shallow tank behind
//! it, so that they turn round as the animal does: through the depth, not through the vertical.
//! One step an output frame, less where a step would be long; every number is the same for any
//! number of threads.

pub mod calibration;
mod gait;
pub mod grid;
pub mod habitat;
pub mod lanes;
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
use crate::cpu::Level;
use crate::random;

/// The longest way in one step, body lengths.
const LONGEST_STEP_BL: f64 = 0.2;
/// Boids nearer than this are pushed apart after each step, where the tank has room.
const OVERLAP_BL: f64 = 0.5;
/// How far they swim before the first frame, so that the flock has formed, and for how long at least and at most.
const WARM_UP_BL: f64 = 10.0;
const WARM_UP_S: [f64; 2] = [10.0, 60.0];
/// Who align have formed when they are polarized by this much. A slow school before a wall takes the whole of a short film
/// to turn, all the while of two courses.
const FORMED: f64 = 0.9;
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
    n_frames_before: usize,
    step_idx: u64,
    /// Decides how fast it goes and nothing else.
    cpu: Level,
    /// Of the film; negative before it.
    time_s: f64,
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// How each gets on, by id; when empty, as it swims.
    gaits: Vec<Gait>,
    room: Room,
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
        let Ok(()) = boids.form(|| Ok::<(), Infallible>(()));
        boids
    }

    /// Boids at random places, all of one course as far as they align, before they have formed.
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
            cpu: Level::detect(),
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

    /// Frames in which they form, before the first of the film; a school may take as many again.
    pub fn n_frames_before(&self) -> usize {
        self.n_frames_before
    }

    /// Has them swim until they have formed. Before each frame `go_on` may refuse: then its error comes back.
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

    /// Where the predator is, if there is one.
    pub fn predator(&self) -> Option<Vec3> {
        Some(self.hunter?.position)
    }

    /// Where everybody is, by id, body lengths.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// How fast everybody is, by id, body lengths a second.
    pub fn velocities(&self) -> &[Vec3] {
        &self.velocities
    }

    /// Lets the film begin so many frames later.
    pub fn set_back(&mut self, n_frames: usize) {
        self.time_s -= n_frames as f64 * f64::from(self.n_substeps) * self.step_s;
    }

    /// What they wish for from now on, besides their rules.
    pub fn meet(&mut self, meeting: Meeting) {
        self.meeting = Some(meeting);
    }

    /// Puts everybody into a moment, by id.
    pub fn show(&mut self, positions: Vec<Vec3>, velocities: Vec<Vec3>, hunter: Option<Vec3>) {
        (self.positions, self.velocities) = (positions, velocities);
        self.swim_from_here();
        if let (Some(hunter), Some(position)) = (&mut self.hunter, hunter) {
            hunter.position = position;
        }
    }

    /// How they move as a whole at this moment.
    pub fn order(&self) -> measures::Order {
        let up = self.tank.up();
        let is_outside =
            |&&place: &&Vec3| !(self.tank.holds(place) && self.habitat.is_clear(place));
        measures::Order {
            n_outside: self.positions.iter().filter(is_outside).count() as u32,
            ..measures::order(&self.positions, &self.velocities, up, self.overlap_bl)
        }
    }

    /// How near they may be to each other, body lengths.
    pub fn overlap_bl(&self) -> f64 {
        self.overlap_bl
    }

    /// The greatest speed that the animal was seen at.
    pub fn fastest_bl_per_s(&self) -> f64 {
        self.calibration.speed_limits_bl_per_s[1]
    }

    /// The place nearest to another at which one may be.
    pub fn inside(&self, mut place: Vec3) -> Vec3 {
        self.habitat.keep_out(&mut place, &mut [0.0; 3]);
        place
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
        self.swim_from_here();
    }
}

/// Frames in which a flock forms.
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
