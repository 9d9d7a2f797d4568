//! Steering rules: separation, alignment, cohesion, walls, circling and wander, allocated in order of priority.
//! Sources: Reynolds 1987; Okabe et al., section 4; docs/explanation/algorithms.md, "Boids".
//!
//! Requests are scaled by the usual acceleration of the animal, so that the same weights suit slow and fast
//! animals. Their sum is limited to the greatest acceleration of the animal.

mod neighbor_sums;
mod zones;

use self::neighbor_sums::{NeighborSums, is_visible};
use super::Boids;
use super::nearest::Neighbor;
use super::vector::{Vec3, add_scaled, cross, dot, minus, norm, plus, scaled, unit};
use crate::flock::params::{Separation, Zones};

/// Time ahead within which a path that meets a wall is steered away from it, seconds
/// (docs/explanation/algorithms.md, "Boids").
const WALL_HORIZON_S: f64 = 1.0;
/// Least distance ahead within which a boid at cruising speed notices a wall, body lengths. A slow boid that
/// notices a wall late turns by itself, while the others push on. Free choice.
const WALL_HORIZON_BL: f64 = 0.7;

/// Share of a wall's braking that is removed when a turn replaces it. Free choice.
const REMOVED_BRAKING: f64 = 0.7;
/// Weight of the zonal course, so large that only the turn rate limits the turn. Free choice.
const ZONAL_WEIGHT: f64 = 20.0;
/// Radius of circling, as a share of the distance from the center to the walls. Free choice.
const RING_RADIUS: f64 = 0.65;
/// Additional speed while circling of a boid with all neighbors behind it, in cruising speeds. Free choice.
const SPREADING_WEIGHT: f64 = 0.5;
/// Time constant of the return to the wanted slope, seconds. Free choice.
const SLOPE_RETURN_S: f64 = 0.25;
/// Weight of swimming across the line of sight rather than along it. Free choice.
const BROADSIDE_WEIGHT: f64 = 1.5;

/// State of a boid and its neighbors at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Situation<'a> {
    /// Position, body lengths.
    pub position: Vec3,
    /// Velocity, body lengths per second.
    pub velocity: Vec3,
    /// Neighbors, nearest first: all that the rules may need.
    pub neighbors: &'a [Neighbor],
    /// Wandering turn rate in the plane of swimming, radians per second, and wanted slope in standard
    /// deviations from the usual one.
    pub wander: [f64; 2],
    /// Whether the boid leads. Its alignment and cohesion are off.
    pub leads: bool,
    /// Random error of the course in the zonal model.
    pub noise: Vec3,
    /// Cosine of half the field of view.
    pub cos_half_view: f64,
}

/// Requested accelerations, relative to the usual one except for `wander`.
#[derive(Default)]
struct Requests {
    /// Separation, and avoidance of walls, obstacles and the predator.
    urgent: Vec3,
    alignment: Vec3,
    circling: Vec3,
    broadside: Vec3,
    cohesion: Vec3,
    /// Body lengths per second squared.
    wander: Vec3,
}

impl Boids<'_> {
    /// Returns the allocated acceleration, at most the greatest of the calibration, body lengths per second
    /// squared.
    pub(super) fn acceleration(&self, situation: &Situation) -> Vec3 {
        let limit = self.calibration.acceleration_bl_per_s2();
        let usual = self.calibration.usual_acceleration_bl_per_s2();
        let (position, velocity) = (situation.position, situation.velocity);
        let horizon_s = self.wall_horizon_s();
        let walls = self.tank.avoidance(position, velocity, horizon_s);
        let obstacles = self.habitat.avoidance(position, velocity, horizon_s);
        let avoidance = self.turn_instead_of_braking(plus(walls, obstacles), situation);
        let escape = self.habitat.escape(position, self.predator.as_ref());
        let avoidance = add_scaled(escape, self.params.rules.walls, avoidance);
        let cruise = self.calibration.cruise_bl_per_s;
        let goals = (self.habitat).toward_goals(self.time_s, position, velocity, cruise);
        let mut requests = match &self.params.rules.zones {
            Some(zones) => Requests {
                alignment: self.zonal_course(zones, situation),
                ..Requests::default()
            },
            None => self.rule_requests(situation),
        };
        requests.urgent = plus(requests.urgent, avoidance);
        let by_priority = [
            scaled(usual, requests.urgent),
            scaled(usual, requests.alignment),
            scaled(usual, requests.circling),
            scaled(usual, requests.broadside),
            scaled(usual, requests.cohesion),
            scaled(usual, goals),
            requests.wander,
            self.cruise(situation),
        ];
        allocated(&by_priority, limit)
    }

    /// Returns the time ahead within which walls count, seconds.
    fn wall_horizon_s(&self) -> f64 {
        WALL_HORIZON_S.max(WALL_HORIZON_BL / self.calibration.cruise_bl_per_s)
    }

    /// Replaces most of the braking part of a push by a turn. A boid that only slows down would linger in
    /// front of a wall.
    ///
    /// Three terms choose the side: the lateral part of the push, the turns of the neighbors (0 without
    /// alignment), and the direction to the center of the tank. A circling boid uses its circle
    /// instead of the center.
    fn turn_instead_of_braking(&self, push: Vec3, situation: &Situation) -> Vec3 {
        let ahead = unit(situation.velocity);
        let brake = -dot(push, ahead);
        if brake <= 0.0 {
            return push;
        }
        let side = unit(cross(self.tank.up(), ahead));
        let mut turned = 0.0;
        for neighbor in situation.neighbors {
            turned += dot(unit(neighbor.velocity), side);
        }
        // Boids that do not align do not follow others either.
        let follow = self.params.rules.alignment.min(1.0) / situation.divisor();
        let home = if self.params.rules.circling > 0.0 {
            self.circling(situation)
        } else {
            minus(self.tank.center, situation.position)
        };
        let chosen = dot(push, side) / brake + follow * turned + dot(unit(home), side);
        let turn = scaled(brake.copysign(chosen), side);
        plus(add_scaled(push, REMOVED_BRAKING * brake, ahead), turn)
    }

    /// Returns the requests of the rules of Reynolds 1987.
    fn rule_requests(&self, situation: &Situation) -> Requests {
        let rules = &self.params.rules;
        let ahead = unit(situation.velocity);
        let sums = NeighborSums::new(situation, ahead, rules);
        let alignment = self.alignment(&sums, situation);
        let separation = match self.params.separation {
            Separation::Repulsion => sums.separation,
            Separation::Papers => self.rule_a_of_the_papers(situation, ahead, alignment),
        };
        let follows = if situation.leads { 0.0 } else { 1.0 };
        Requests {
            urgent: scaled(rules.separation, separation),
            alignment: scaled(follows * rules.alignment, alignment),
            circling: scaled(rules.circling, self.circling(situation)),
            broadside: scaled(BROADSIDE_WEIGHT, self.broadside(situation)),
            cohesion: scaled(follows * rules.cohesion, sums.cohesion(rules)),
            wander: self.wander(situation),
        }
    }

    /// Returns the request of the zonal model of Couzin et al. 2002: the fastest turn onto its course.
    fn zonal_course(&self, zones: &Zones, situation: &Situation) -> Vec3 {
        let velocity = situation.velocity;
        let course = zones::course(zones, situation);
        let direction = unit(plus(course, situation.noise));
        let cruise = self.calibration.cruise_bl_per_s;
        let gap = minus(scaled(cruise, direction), velocity);
        scaled(ZONAL_WEIGHT / cruise, gap)
    }

    /// Returns mean v_j - v_i, in cruising speeds.
    fn alignment(&self, sums: &NeighborSums, situation: &Situation) -> Vec3 {
        if sums.n_aligned == 0.0 {
            return [0.0; 3];
        }
        let mean = scaled(1.0 / sums.n_aligned, sums.velocity);
        let gap = minus(mean, situation.velocity);
        scaled(1.0 / self.calibration.cruise_bl_per_s, gap)
    }

    /// Returns the request of rule A of Okabe et al., section 4: slower when ahead of the neighbors, faster when
    /// behind, and in their direction.
    fn rule_a_of_the_papers(&self, situation: &Situation, ahead: Vec3, alignment: Vec3) -> Vec3 {
        let (mut lead, mut n) = (0.0, 0.0);
        for neighbor in situation.neighbors {
            if is_visible(neighbor, ahead, situation.cos_half_view) {
                lead -= dot(ahead, unit(neighbor.offset));
                n += 1.0;
            }
        }
        if n == 0.0 {
            return [0.0; 3];
        }
        add_scaled(scaled(-lead / n, ahead), 0.5, alignment)
    }

    /// Returns the request to circle around the center of the tank, in the plane of swimming, on a ring that
    /// fits its narrower side.
    fn circling(&self, situation: &Situation) -> Vec3 {
        if self.params.rules.circling == 0.0 {
            return [0.0; 3];
        }
        let up = self.tank.up();
        let from_center = minus(situation.position, self.tank.center);
        let from_center = add_scaled(from_center, -dot(from_center, up), up);
        let [width, height, depth] = self.tank.half_extent_bl;
        let radius_bl = width.min(if self.tank.is_flat() { height } else { depth });
        let outward = unit(from_center);
        let off = RING_RADIUS - norm(from_center) / radius_bl.max(1e-6);
        let inward = scaled(2.0 * off.clamp(-1.0, 1.0), outward);
        let course = unit(plus(inward, cross(up, outward)));
        // Boids ahead of their neighbors swim faster, those behind slower, so that the ring fills evenly.
        let mut lead = 0.0;
        for neighbor in situation.neighbors {
            lead -= dot(course, unit(neighbor.offset));
        }
        let lead = lead / situation.divisor();
        let cruise = self.calibration.cruise_bl_per_s;
        let speed = cruise * (1.0 + SPREADING_WEIGHT * lead);
        let gap = minus(scaled(speed, course), situation.velocity);
        scaled(1.0 / cruise, gap)
    }

    /// Returns the request to leave the line of sight, in side view. Footage shows an animal best broadside. A
    /// flock that lingers in depth would be seen end-on half of the time.
    ///
    /// The boid's own direction and those of its neighbors choose the side. Boids that do not align avoid the
    /// side of their neighbors. The request grows with the share of the velocity along the line of sight.
    fn broadside(&self, situation: &Situation) -> Vec3 {
        if self.tank.is_flat() || self.params.rules.circling > 0.0 {
            return [0.0; 3];
        }
        let [x, _, z] = self.habitat.lens.sight(situation.position);
        let sight = unit([x, 0.0, z]);
        let across = [sight[2], 0.0, -sight[0]];
        // Directions count, not speeds: slow boids would otherwise not settle on a side.
        let ahead = unit(situation.velocity);
        let (mut sum, mut n) = (0.0, 0.0);
        for neighbor in situation.neighbors {
            if is_visible(neighbor, ahead, situation.cos_half_view) {
                sum += dot(unit(neighbor.velocity), across);
                n += 1.0;
            }
        }
        let follow = (3.0 * self.params.rules.alignment.min(1.0) - 1.0) / f64::max(n, 1.0);
        let side = (dot(ahead, across) + follow * sum).clamp(-1.0, 1.0);
        let cruise = self.calibration.cruise_bl_per_s;
        // A wall on this side pushes toward the other side.
        let sideways = scaled(cruise.copysign(side), across);
        let horizon_s = self.wall_horizon_s();
        let push = (self.tank).avoidance(situation.position, sideways, horizon_s);
        let side = (side + 2.0 * dot(push, across)).clamp(-1.0, 1.0);
        let end_on = dot(ahead, sight);
        let into = end_on * end_on * dot(situation.velocity, sight) / cruise;
        add_scaled(scaled(side * into.abs(), across), -into, sight)
    }

    /// Returns the acceleration of the wandering turn and of the return to the slopes of the animal. Without
    /// this return, boids swim as steeply as they may. A steep boid seen nearly end-on then has a heading in
    /// the image that the animal never had.
    fn wander(&self, situation: &Situation) -> Vec3 {
        let up = self.tank.up();
        let sideways = cross(up, situation.velocity);
        let turn = scaled(situation.wander[0], sideways);
        let Some(slopes) = &self.calibration.slopes else {
            return turn;
        };
        let [x, y, z] = situation.velocity;
        let wanted = slopes.usual + slopes.spread * situation.wander[1];
        let gap = wanted * norm([x, 0.0, z]) - y;
        add_scaled(turn, gap / SLOPE_RETURN_S, up)
    }

    /// Returns the acceleration back to cruising speed. Leaders cruise at 1.4 times that speed.
    fn cruise(&self, situation: &Situation) -> Vec3 {
        let speed = norm(situation.velocity);
        let factor = if situation.leads { 1.4 } else { 1.0 };
        let gap = factor * self.calibration.cruise_bl_per_s - speed;
        scaled(
            gap * self.calibration.turn_rad_per_s,
            unit(situation.velocity),
        )
    }
}

impl Situation<'_> {
    /// Returns the number of neighbors, or 1 if there are none, as a divisor.
    fn divisor(&self) -> f64 {
        self.neighbors.len().max(1) as f64
    }
}

/// Returns the sum of the requests in order, until the sum of their sizes reaches `limit`. The last one is
/// cut.
fn allocated(requests: &[Vec3], limit: f64) -> Vec3 {
    let (mut left, mut sum) = (limit, [0.0; 3]);
    for &request in requests {
        let size = norm(request);
        let share = if left < size { left / size } else { 1.0 };
        sum = add_scaled(sum, share, request);
        left -= size.min(left);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_requests_get_the_rest_of_the_limit() {
        let requests = [[3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 9.0]];
        assert_eq!(allocated(&requests, 5.0), [3.0, 2.0, 0.0]);
        assert_eq!(allocated(&requests, 2.0), [2.0, 0.0, 0.0]);
    }
}
