//! Goals, obstacles and predator in the tank (docs/explanation/algorithms.md, "Boids"). Lengths are in body
//! lengths.

use super::calibration::Calibration;
use super::params::{Goal, Obstacle, Predator, Waypoint};
use super::tank::Tank;
use super::vector::{Vec3, add_scaled, dot, minus, norm, scaled, turned_at_most, unit};
use crate::flock::lens::Lens;
use crate::flock::params::Params;

/// Distance between a boid and an obstacle, body lengths. Free choice.
const CLEARANCE_BL: f64 = 0.3;
/// Distance from a goal below which a boid slows down, body lengths. Free choice.
const THERE_BL: f64 = 2.0;
/// Speed and turn rate of a hunting predator, as multiples of those of the animal. Free choices.
const HUNTER_PACE: f64 = 1.3;
const HUNTER_TURN: f64 = 1.5;
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

/// State of the predator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hunter {
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

    /// Returns the sum of the wishes for all goals at `time_s`, in cruising speeds. A wish is the wanted
    /// velocity minus the current one. Without a goal the sum is 0.
    pub fn toward_goals(&self, time_s: f64, position: Vec3, velocity: Vec3, cruise: f64) -> Vec3 {
        let mut sum = [0.0; 3];
        for goal in self.goals {
            if time_s < goal.from_s || goal.until_s.is_some_and(|until_s| until_s <= time_s) {
                continue;
            }
            let way = minus(self.place(goal.at_px, goal.depth_bl), position);
            let share = (norm(way) / THERE_BL).min(1.0);
            let gap = minus(scaled(cruise * share, unit(way)), velocity);
            sum = add_scaled(sum, goal.weight / cruise, gap);
        }
        sum
    }

    /// Returns the push away from obstacles that a boid would reach within `horizon_s`. It grows to 1 at the
    /// obstacle.
    pub fn push(&self, position: Vec3, velocity: Vec3, horizon_s: f64) -> Vec3 {
        self.obstacles.iter().fold([0.0; 3], |push, obstacle| {
            let (room, outward) = self.room(obstacle, position);
            let approach = -dot(outward, velocity) * horizon_s;
            if approach > room.max(0.0) {
                add_scaled(push, (approach - room.max(0.0)) / approach, outward)
            } else {
                push
            }
        })
    }

    /// Returns whether a position is clear of all obstacles.
    pub fn is_clear(&self, position: Vec3) -> bool {
        (self.obstacles.iter()).all(|obstacle| self.room(obstacle, position).0 >= -1e-9)
    }

    /// Moves a position out of the obstacles and into the tank. Reflects the part of the velocity that leads
    /// into an obstacle or out of the tank.
    pub fn keep_out(&self, position: &mut Vec3, velocity: &mut Vec3) {
        // Between an obstacle and a wall this may take a few rounds. Each round ends with the tank.
        for _ in 0..4 {
            for obstacle in self.obstacles {
                let (room, outward) = self.room(obstacle, *position);
                if room < 0.0 {
                    let inward_speed = dot(outward, *velocity).min(0.0);
                    *position = add_scaled(*position, -room, outward);
                    *velocity = add_scaled(*velocity, -2.0 * inward_speed, outward);
                }
            }
            if !self.tank.keep_inside(position, velocity) || self.obstacles.is_empty() {
                break;
            }
        }
    }

    /// Returns the predator at the start, if there is one.
    pub fn hunter(&self) -> Option<Hunter> {
        let predator = self.predator?;
        let far_off = [
            self.tank.corners[0][0],
            self.tank.middle[1],
            self.tank.middle[2],
        ];
        let position = match predator.path.first() {
            Some(waypoint) => self.waypoint(waypoint),
            None => self.tank.on_the_way(self.tank.middle, far_off),
        };
        Some(Hunter {
            position,
            velocity: [0.0; 3],
        })
    }

    /// Moves the predator by one step: along its path, or toward the nearest boid.
    pub fn advance(
        &self,
        hunter: &mut Hunter,
        time_s: f64,
        step_s: f64,
        flock: &[Vec3],
        speeds: &Calibration,
    ) {
        let path = self.predator.map_or(&[][..], |predator| &predator.path);
        if !path.is_empty() {
            hunter.position = self.on_path(path, time_s);
            return;
        }
        let far = |p: &&Vec3| norm(minus(**p, hunter.position));
        let Some(prey) = flock.iter().min_by(|a, b| far(a).total_cmp(&far(b))) else {
            return;
        };
        let pace = HUNTER_PACE * speeds.cruise_bl_per_s;
        let wished = scaled(pace, unit(minus(*prey, hunter.position)));
        let turn_rad = HUNTER_TURN * speeds.turn_rad_per_s * step_s;
        let aside = [-hunter.velocity[1], hunter.velocity[0], 0.0];
        let cos_sin = (libm::cos(turn_rad), libm::sin(turn_rad));
        hunter.velocity = turned_at_most(hunter.velocity, wished, cos_sin, aside);
        hunter.position = add_scaled(hunter.position, step_s, hunter.velocity);
        self.keep_out(&mut hunter.position, &mut hunter.velocity);
    }

    /// Returns the wish to flee from the predator. It grows as the predator comes near and is 0 beyond its
    /// reach.
    pub fn flight(&self, position: Vec3, hunter: Option<&Hunter>) -> Vec3 {
        let Some((away, share)) = self.away(position, hunter) else {
            return [0.0; 3];
        };
        scaled(FLEE_WEIGHT * (1.0 - share).max(0.0), unit(away))
    }

    /// Returns whether a boid is within the reach of the predator.
    pub fn flees(&self, position: Vec3, hunter: Option<&Hunter>) -> bool {
        (self.away(position, hunter)).is_some_and(|(_, share)| share < 1.0)
    }

    /// Returns the vector from the predator to a boid, and its length as a share of the reach.
    fn away(&self, position: Vec3, hunter: Option<&Hunter>) -> Option<(Vec3, f64)> {
        let away = minus(position, hunter?.position);
        Some((away, norm(away) / self.predator?.flee_bl()))
    }

    fn on_path(&self, path: &[Waypoint], time_s: f64) -> Vec3 {
        let next = path.partition_point(|waypoint| waypoint.time_s <= time_s);
        let [before, after] =
            [next.saturating_sub(1), next.min(path.len() - 1)].map(|at| &path[at]);
        let (from, to) = (self.waypoint(before), self.waypoint(after));
        let span_s = after.time_s - before.time_s;
        if span_s > 0.0 {
            add_scaled(from, (time_s - before.time_s) / span_s, minus(to, from))
        } else {
            from
        }
    }

    fn waypoint(&self, waypoint: &Waypoint) -> Vec3 {
        self.place(waypoint.at_px, waypoint.depth_bl)
    }

    fn place(&self, at_px: [f64; 2], depth_bl: Option<f64>) -> Vec3 {
        let front = self.tank.corners[0][2];
        let depth = depth_bl.map_or(self.tank.middle[2], |depth| front + depth);
        self.lens.place_bl(at_px, depth)
    }

    /// Returns the distance of a position from an obstacle and its clearance, negative inside, and the unit
    /// vector away from it.
    fn room(&self, obstacle: &Obstacle, position: Vec3) -> (f64, Vec3) {
        let place = |px| self.lens.place_bl(px, position[2]);
        let px_per_bl = self.lens.px_per_bl(position[2]);
        let (middle, half) = match *obstacle {
            Obstacle::Circle {
                center_px,
                radius_px,
            } => {
                let out = minus(position, place(center_px));
                let room = norm(out) - radius_px / px_per_bl - CLEARANCE_BL;
                return (
                    room,
                    if norm(out) > 1e-9 {
                        unit(out)
                    } else {
                        [1.0, 0.0, 0.0]
                    },
                );
            }
            Obstacle::Box {
                box_px: [x, y, w, h],
            } => {
                let half = [0.5 * w, 0.5 * h].map(|px| px / px_per_bl);
                (place([x + 0.5 * w, y + 0.5 * h]), half)
            }
        };
        let off = minus(position, middle);
        let beyond = [0, 1].map(|axis| off[axis].abs() - half[axis]);
        let sign = [0, 1].map(|axis| if off[axis] < 0.0 { -1.0 } else { 1.0 });
        if beyond[0] <= 0.0 && beyond[1] <= 0.0 {
            let axis = usize::from(beyond[1] > beyond[0]);
            let mut outward = [0.0; 3];
            outward[axis] = sign[axis];
            return (beyond[axis] - CLEARANCE_BL, outward);
        }
        let out = [
            sign[0] * beyond[0].max(0.0),
            sign[1] * beyond[1].max(0.0),
            0.0,
        ];
        (norm(out) - CLEARANCE_BL, unit(out))
    }
}
