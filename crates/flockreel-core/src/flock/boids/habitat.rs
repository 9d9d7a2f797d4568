//! Goals, obstacles and predator in the tank (docs/explanation/algorithms.md, "Boids"). Lengths are in body
//! lengths.

use super::calibration::Calibration;
use super::params::{Goal, Obstacle, Predator, Waypoint};
use super::tank::Tank;
use super::vector::{CosSin, Vec3, add_scaled, dot, minus, norm, scaled, turned_at_most, unit};
use crate::flock::lens::Lens;
use crate::flock::params::Params;

/// Distance between a boid and an obstacle, body lengths. Free choice.
const CLEARANCE_BL: f64 = 0.3;
/// Distance from a goal below which a boid slows down, body lengths. Free choice.
const SLOWING_DISTANCE_BL: f64 = 2.0;
/// Speed and turn rate of a hunting predator, as multiples of those of the animal. Free choices.
const PREDATOR_SPEED_FACTOR: f64 = 1.3;
const PREDATOR_TURN_FACTOR: f64 = 1.5;
/// Weight of fleeing (docs/explanation/algorithms.md, "Boids").
const FLEE_WEIGHT: f64 = 3.0;

/// Goals, obstacles and predator, with the tank and its projection.
#[derive(Clone, Debug)]
pub struct Habitat<'a> {
    pub(super) lens: &'a Lens,
    tank: &'a Tank,
    goals: &'a [Goal],
    obstacles: &'a [Obstacle],
    predator: Option<&'a Predator>,
}

/// Free distance between a position and an obstacle with its margin.
struct Clearance {
    /// Body lengths, negative inside.
    distance: f64,
    /// Unit vector away from the obstacle.
    outward: Vec3,
}

/// State of the predator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredatorState {
    /// Position, body lengths.
    pub position: Vec3,
    velocity: Vec3,
}

impl<'a> Habitat<'a> {
    /// Returns the habitat that the parameters describe.
    pub fn new(params: &'a Params, lens: &'a Lens, tank: &'a Tank) -> Habitat<'a> {
        Habitat {
            lens,
            tank,
            goals: &params.goals,
            obstacles: &params.obstacles,
            predator: params.predator.as_ref(),
        }
    }

    /// Returns the sum of the requests for all goals at `time_s`, in cruising speeds. A request is the wanted
    /// velocity minus the current one. Without a goal the sum is 0.
    pub fn toward_goals(&self, time_s: f64, position: Vec3, velocity: Vec3, cruise: f64) -> Vec3 {
        let mut sum = [0.0; 3];
        for goal in self.goals {
            if time_s < goal.from_s || goal.until_s.is_some_and(|until_s| until_s <= time_s) {
                continue;
            }
            let path = minus(self.position_of(goal.at_px, goal.depth_bl), position);
            let share = (norm(path) / SLOWING_DISTANCE_BL).min(1.0);
            let gap = minus(scaled(cruise * share, unit(path)), velocity);
            sum = add_scaled(sum, goal.weight / cruise, gap);
        }
        sum
    }

    /// Returns the push away from obstacles that a boid would reach within `horizon_s`. It grows to 1 at the
    /// obstacle.
    pub fn avoidance(&self, position: Vec3, velocity: Vec3, horizon_s: f64) -> Vec3 {
        self.obstacles.iter().fold([0.0; 3], |push, obstacle| {
            let Clearance { distance, outward } = self.clearance(obstacle, position);
            let approach = -dot(outward, velocity) * horizon_s;
            if approach > distance.max(0.0) {
                add_scaled(push, (approach - distance.max(0.0)) / approach, outward)
            } else {
                push
            }
        })
    }

    /// Returns whether a position is clear of all obstacles.
    pub fn is_clear(&self, position: Vec3) -> bool {
        let obstacles = self.obstacles.iter();
        obstacles
            .map(|obstacle| self.clearance(obstacle, position))
            .all(|clearance| clearance.distance >= -1e-9)
    }

    /// Moves a position out of the obstacles and into the tank. Reflects the part of the velocity that leads
    /// into an obstacle or out of the tank.
    pub fn confine(&self, position: &mut Vec3, velocity: &mut Vec3) {
        // Between an obstacle and a wall this may take a few rounds. Each round ends with the tank.
        for _ in 0..4 {
            for obstacle in self.obstacles {
                let Clearance { distance, outward } = self.clearance(obstacle, *position);
                if distance < 0.0 {
                    let inward_speed = dot(outward, *velocity).min(0.0);
                    *position = add_scaled(*position, -distance, outward);
                    *velocity = add_scaled(*velocity, -2.0 * inward_speed, outward);
                }
            }
            if !self.tank.keep_inside(position, velocity) || self.obstacles.is_empty() {
                break;
            }
        }
    }

    /// Returns the predator at the start, if there is one.
    pub fn initial_predator(&self) -> Option<PredatorState> {
        let center = self.tank.center;
        let left_end = [self.tank.corners[0][0], center[1], center[2]];
        let position = match self.predator?.path.first() {
            Some(waypoint) => self.position_of(waypoint.at_px, waypoint.depth_bl),
            None => self.tank.clip_segment(center, left_end),
        };
        Some(PredatorState {
            position,
            velocity: [0.0; 3],
        })
    }

    /// Moves the predator by one step: along its path, or toward the nearest boid.
    pub fn advance(
        &self,
        predator: &mut PredatorState,
        time_s: f64,
        step_s: f64,
        flock: &[Vec3],
        speeds: &Calibration,
    ) {
        let path = self.predator.map_or(&[][..], |predator| &predator.path);
        if !path.is_empty() {
            predator.position = self.position_on_path(path, time_s);
            return;
        }
        let distance = |p: &&Vec3| norm(minus(**p, predator.position));
        let nearest = (flock.iter()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(prey) = nearest else {
            return;
        };
        let speed = PREDATOR_SPEED_FACTOR * speeds.cruise_bl_per_s;
        let desired = scaled(speed, unit(minus(*prey, predator.position)));
        let max_turn = CosSin::new(PREDATOR_TURN_FACTOR * speeds.turn_rad_per_s * step_s);
        let sideways = [-predator.velocity[1], predator.velocity[0], 0.0];
        predator.velocity = turned_at_most(predator.velocity, desired, max_turn, sideways);
        predator.position = add_scaled(predator.position, step_s, predator.velocity);
        self.confine(&mut predator.position, &mut predator.velocity);
    }

    /// Returns the request to flee from the predator. It grows as the predator comes near and is 0 beyond its
    /// reach.
    pub fn escape(&self, position: Vec3, predator: Option<&PredatorState>) -> Vec3 {
        let Some((away, share)) = self.away(position, predator) else {
            return [0.0; 3];
        };
        scaled(FLEE_WEIGHT * (1.0 - share).max(0.0), unit(away))
    }

    /// Returns whether a boid is within the reach of the predator.
    pub fn is_fleeing(&self, position: Vec3, predator: Option<&PredatorState>) -> bool {
        (self.away(position, predator)).is_some_and(|(_, share)| share < 1.0)
    }

    /// Returns the vector from the predator to a boid, and its length as a share of the reach.
    fn away(&self, position: Vec3, predator: Option<&PredatorState>) -> Option<(Vec3, f64)> {
        let away = minus(position, predator?.position);
        Some((away, norm(away) / self.predator?.flee_bl()))
    }

    fn position_on_path(&self, path: &[Waypoint], time_s: f64) -> Vec3 {
        let next = path.partition_point(|waypoint| waypoint.time_s <= time_s);
        let [before, after] =
            [next.saturating_sub(1), next.min(path.len() - 1)].map(|at| &path[at]);
        let position = |waypoint: &Waypoint| self.position_of(waypoint.at_px, waypoint.depth_bl);
        let (from, to) = (position(before), position(after));
        let span_s = after.time_s - before.time_s;
        if span_s > 0.0 {
            add_scaled(from, (time_s - before.time_s) / span_s, minus(to, from))
        } else {
            from
        }
    }

    /// Returns the position of an image point, by default at half the depth of the tank.
    fn position_of(&self, at_px: [f64; 2], depth_bl: Option<f64>) -> Vec3 {
        let front = self.tank.corners[0][2];
        let depth = depth_bl.map_or(self.tank.center[2], |depth| front + depth);
        self.lens.place_bl(at_px, depth)
    }

    fn clearance(&self, obstacle: &Obstacle, position: Vec3) -> Clearance {
        let offset = |px| minus(position, self.lens.place_bl(px, position[2]));
        let px_per_bl = self.lens.px_per_bl(position[2]);
        match *obstacle {
            Obstacle::Circle {
                center_px,
                radius_px,
            } => disk_clearance(offset(center_px), radius_px / px_per_bl),
            Obstacle::Box {
                box_px: [x, y, w, h],
            } => {
                let half_px = [0.5 * w, 0.5 * h];
                let center_px = [x + half_px[0], y + half_px[1]];
                box_clearance(offset(center_px), half_px.map(|px| px / px_per_bl))
            }
        }
    }
}

/// Returns the clearance from a disk at `offset` from its center.
fn disk_clearance(offset: Vec3, radius: f64) -> Clearance {
    let is_central = norm(offset) <= 1e-9;
    Clearance {
        distance: norm(offset) - radius - CLEARANCE_BL,
        outward: if is_central {
            [1.0, 0.0, 0.0]
        } else {
            unit(offset)
        },
    }
}

/// Returns the clearance from a box of half size `half`, at `offset` from its center.
fn box_clearance(offset: Vec3, half: [f64; 2]) -> Clearance {
    let beyond = [0, 1].map(|axis| offset[axis].abs() - half[axis]);
    let sign = [0, 1].map(|axis| if offset[axis] < 0.0 { -1.0 } else { 1.0 });
    if beyond[0] <= 0.0 && beyond[1] <= 0.0 {
        let axis = usize::from(beyond[1] > beyond[0]);
        let mut outward = [0.0; 3];
        outward[axis] = sign[axis];
        return Clearance {
            distance: beyond[axis] - CLEARANCE_BL,
            outward,
        };
    }
    let [x, y] = [0, 1].map(|axis| sign[axis] * beyond[axis].max(0.0));
    let outside = [x, y, 0.0];
    Clearance {
        distance: norm(outside) - CLEARANCE_BL,
        outward: unit(outside),
    }
}
