//! Boids: simulated individuals that move as a flock, within the limits measured on the animal. Sources:
//! Okabe et al., section 4; Reynolds 1987; docs/explanation/algorithms.md, "Boids".
//!
//! In top view boids swim in the image plane. In side view they swim in a tank behind it. There they turn
//! through the depth, as the animal does, and not through the vertical. An output frame takes one step, or
//! several if a step would be long. All numbers are the same for any number of threads.

pub mod calibration;
pub mod grid;
pub mod habitat;
mod imposed;
pub mod leadership;
pub mod measures;
pub mod nearest;
mod overlap;
pub mod params;
pub mod rules;
mod step;
pub mod tank;
pub mod vector;
mod walls;
mod workspace;

use std::f64::consts::PI;

use self::calibration::Calibration;
use self::habitat::{Habitat, PredatorState};
pub use self::imposed::{ImposedMotion, TargetStates};
use self::tank::Tank;
use self::vector::{CosSin, Vec3, scaled};
use self::workspace::Workspace;
use super::lens::Lens;
use super::params::Params;
use crate::random;

/// Greatest distance covered in one step, body lengths (docs/explanation/algorithms.md, "Boids").
const MAX_STEP_BL: f64 = 0.2;
/// Distance below which boids are pushed apart after each step, body lengths, if the tank is large enough.
const OVERLAP_BL: f64 = 0.5;
/// Distance that boids swim before the first frame while the flock forms, body lengths. Free choice.
const WARM_UP_BL: f64 = 10.0;
/// Least and greatest time in which the flock forms, seconds. Free choice.
const WARM_UP_S: [f64; 2] = [10.0, 60.0];
/// Polarization at which a school has formed. A slow school in front of a wall may take a whole short video
/// to turn, and swims in two directions until then. Free choice.
const FORMED_POLARIZATION: f64 = 0.9;
/// Boids per unit of parallel work. Free choice.
const CHUNK: usize = 64;

/// Purposes of random numbers: the first words of their keys.
mod random_key {
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
    n_warm_up_frames: usize,
    step_idx: u64,
    /// Time of the video, seconds; negative before its start.
    time_s: f64,
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// Imposed speed and turn rate, by id. If empty, the rules choose both.
    imposed: Vec<ImposedMotion>,
    workspace: Workspace,
    predator: Option<PredatorState>,
    targets: Option<TargetStates>,
}

impl<'a> Boids<'a> {
    /// Returns boids at random positions that have not formed a flock yet. The stronger the alignment, the
    /// more similar their first headings.
    pub fn at_random(
        params: &'a Params,
        calibration: &'a Calibration,
        lens: &'a Lens,
        tank: &'a Tank,
        fps: f64,
    ) -> Self {
        let max_step_s = MAX_STEP_BL / calibration.speed_limits_bl_per_s[1];
        let n_substeps = (1.0 / (fps * max_step_s)).ceil().clamp(1.0, 1000.0) as u32;
        let n = params.most_individuals() as usize;
        let n_warm_up_frames = n_warm_up_frames(calibration, fps);
        let n_steps = n_warm_up_frames as f64 * f64::from(n_substeps);
        let step_s = 1.0 / (fps * f64::from(n_substeps));
        let mut boids = Boids {
            params: Params {
                rules: params.rules.closer(tank.radius_scale(n)).social(),
                ..params.clone()
            },
            habitat: Habitat::new(params, lens, tank),
            overlap_bl: tank.overlap_bl(n),
            calibration,
            tank,
            step_s,
            n_substeps,
            n_warm_up_frames,
            step_idx: 0,
            time_s: -n_steps * step_s,
            positions: vec![[0.0; 3]; n],
            velocities: vec![[0.0; 3]; n],
            imposed: Vec::new(),
            workspace: Workspace::new(n),
            predator: None,
            targets: None,
        };
        boids.start_at_random();
        boids
    }

    /// Returns the number of frames before the video in which a flock forms. A school may take up to twice as
    /// many.
    pub fn n_warm_up_frames(&self) -> usize {
        self.n_warm_up_frames
    }

    /// Simulates until the flock has formed. `before_frame` is called before each frame; its error ends the
    /// simulation.
    pub fn form<E>(&mut self, mut before_frame: impl FnMut() -> Result<(), E>) -> Result<(), E> {
        for _ in 0..self.n_warm_up_frames {
            before_frame()?;
            self.advance();
        }
        let mut n_left = self.n_warm_up_frames;
        while n_left > 0 && !self.has_formed() {
            before_frame()?;
            self.delay_start(1);
            self.advance();
            n_left -= 1;
        }
        self.predator = self.habitat.initial_predator();
        Ok(())
    }

    fn has_formed(&self) -> bool {
        let rules = &self.params.rules;
        let is_school = rules.alignment > 0.0 && rules.zones.is_none();
        !is_school || measures::polarization(&self.velocities) >= FORMED_POLARIZATION
    }

    /// Returns the position of the predator, if there is one.
    pub fn predator(&self) -> Option<Vec3> {
        Some(self.predator?.position)
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
    pub fn delay_start(&mut self, n_frames: usize) {
        self.time_s -= n_frames as f64 * f64::from(self.n_substeps) * self.step_s;
    }

    /// Sets the positions and velocities to steer toward, besides the rules, from the next step on.
    pub fn steer_toward(&mut self, targets: TargetStates) {
        self.targets = Some(targets);
    }

    /// Sets positions and velocities, by id, and the position of the predator.
    pub fn set_states(
        &mut self,
        positions: Vec<Vec3>,
        velocities: Vec<Vec3>,
        predator: Option<Vec3>,
    ) {
        (self.positions, self.velocities) = (positions, velocities);
        self.load_states();
        if let (Some(state), Some(position)) = (&mut self.predator, predator) {
            state.position = position;
        }
    }

    /// Returns the collective order at this moment.
    pub fn order(&self) -> measures::Order {
        let up = self.tank.up();
        let is_outside =
            |&&position: &&Vec3| !(self.tank.contains(position) && self.habitat.is_clear(position));
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
    pub fn max_speed_bl_per_s(&self) -> f64 {
        self.calibration.speed_limits_bl_per_s[1]
    }

    /// Returns a position moved into the tank and out of obstacles.
    pub fn confined(&self, mut position: Vec3) -> Vec3 {
        self.habitat.confine(&mut position, &mut [0.0; 3]);
        position
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

    fn start_at_random(&mut self) {
        let [least, greatest] = self.tank.corners;
        // Boids that align start aligned, because a school takes long to form.
        let half_turns = (2.0 * random::uniform(self.params.seed, &[random_key::COURSE])).floor();
        let course = PI * half_turns;
        let spread = PI / (1.0 + 4.0 * self.params.rules.alignment);
        for id in 0..self.positions.len() {
            let key = |word| [random_key::START, id as u64, word];
            let at = |word| random::uniform(self.params.seed, &key(word));
            let CosSin { cos, sin } = CosSin::new(course + spread * (2.0 * at(3) - 1.0));
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
                .confine(&mut self.positions[id], &mut self.velocities[id]);
        }
        self.load_states();
    }
}

/// Returns the number of frames in which a flock forms.
fn n_warm_up_frames(calibration: &Calibration, fps: f64) -> usize {
    let [least_s, most_s] = WARM_UP_S;
    let warm_up_s = (WARM_UP_BL / calibration.cruise_bl_per_s).clamp(least_s, most_s);
    (warm_up_s * fps).ceil() as usize
}

#[cfg(test)]
mod digests;
#[cfg(test)]
mod presets;
#[cfg(test)]
mod tests;
