//! Steering rules: separation, alignment, cohesion, walls, circling and wander, granted in order of priority.
//! Sources: Reynolds 1987; Okabe et al., section 4; docs/explanation/algorithms.md, "Boids".
//!
//! Requests are scaled by the usual acceleration of the animal, so that the same weights suit slow and fast
//! animals. Their sum is limited to the greatest acceleration of the animal.

mod seen;
mod zones;

use self::seen::{Seen, is_seen};
use super::calibration::Calibration;
use super::habitat::{Habitat, Hunter};
use super::nearest::Neighbor;
use super::tank::Tank;
use super::vector::{Vec3, add_scaled, cross, dot, minus, norm, plus, scaled, unit};
use crate::flock::params::{Params, Separation, Zones};

/// Time ahead within which a path that meets a wall is steered away from it, seconds
/// (docs/explanation/algorithms.md, "Boids").
const WALL_HORIZON_S: f64 = 1.0;
/// Least distance ahead within which a boid at cruising speed notices a wall, body lengths. A slow boid that
/// notices a wall late turns by itself, while the others push on. Free choice.
const WALL_HORIZON_BL: f64 = 0.7;

/// Share of a wall's braking that is removed when a turn replaces it. Free choice.
const BRAKED: f64 = 0.7;
/// Weight of the zonal course, so large that only the turn rate limits the turn. Free choice.
const WITHOUT_DELAY: f64 = 20.0;
/// Radius of circling, as a share of the way from the middle to the walls. Free choice.
const RING: f64 = 0.65;
/// Additional speed while circling of a boid with all neighbors behind it, in cruising speeds. Free choice.
const SPREADING: f64 = 0.5;
/// Time constant of the return to the wanted slope, seconds. Free choice.
const LEVEL_S: f64 = 0.25;
/// Weight of swimming across the line of sight rather than along it. Free choice.
const BROADSIDE: f64 = 1.5;

/// State of a boid at one moment.
pub struct Moment<'a> {
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
}

/// Inputs of steering that all boids share.
pub struct Steering<'a> {
    /// Weights and radii.
    pub params: &'a Params,
    /// Limits measured on the animal.
    pub calibration: &'a Calibration,
    /// Tank with the walls.
    pub tank: &'a Tank,
    /// Goals, obstacles and predator.
    pub habitat: &'a Habitat<'a>,
    /// Time of the video, seconds.
    pub time_s: f64,
    /// State of the predator, if there is one.
    pub hunter: Option<&'a Hunter>,
    /// Cosine of half the field of view.
    pub cos_half_view: f64,
}

impl Steering<'_> {
    /// Returns the granted acceleration, at most the greatest of the calibration, body lengths per second
    /// squared.
    pub fn acceleration(&self, moment: &Moment) -> Vec3 {
        let most = self.calibration.acceleration_bl_per_s2();
        let usual = self.calibration.usual_acceleration_bl_per_s2();
        let (position, velocity) = (moment.position, moment.velocity);
        let horizon_s = self.wall_horizon_s();
        let walls = plus(
            self.tank.push(position, velocity, horizon_s),
            self.habitat.push(position, velocity, horizon_s),
        );
        let walls = self.aside(walls, moment);
        let flight = self.habitat.flight(position, self.hunter);
        let walls = add_scaled(flight, self.params.rules.walls, walls);
        let cruise = self.calibration.cruise_bl_per_s;
        let goals = (self.habitat).toward_goals(self.time_s, position, velocity, cruise);
        let nothing = [0.0; 3];
        let (urgent, [together, around, broadside, near], wander) = match &self.params.rules.zones {
            Some(zones) => {
                let course = self.with_zones(zones, moment);
                (nothing, [course, nothing, nothing, nothing], nothing)
            }
            None => {
                let (urgent, wishes) = self.with_rules(moment);
                (urgent, wishes, self.wander(moment))
            }
        };
        let urgent = plus(urgent, walls);
        let cruise = self.cruise(moment);
        granted(
            &[
                scaled(usual, urgent),
                scaled(usual, together),
                scaled(usual, around),
                scaled(usual, broadside),
                scaled(usual, near),
                scaled(usual, goals),
                wander,
                cruise,
            ],
            most,
        )
    }

    /// Returns the time ahead within which walls count, seconds.
    fn wall_horizon_s(&self) -> f64 {
        WALL_HORIZON_S.max(WALL_HORIZON_BL / self.calibration.cruise_bl_per_s)
    }

    /// Replaces most of the braking part of a push by a turn. A boid that only slows down would linger in
    /// front of a wall.
    ///
    /// Three terms choose the side: the lateral part of the push, the turns of the neighbors (0 without
    /// alignment), and the way to the middle of the tank. A circling boid uses its circle instead of the
    /// middle.
    fn aside(&self, push: Vec3, moment: &Moment) -> Vec3 {
        let ahead = unit(moment.velocity);
        let brake = -dot(push, ahead);
        if brake <= 0.0 {
            return push;
        }
        let side = unit(cross(self.tank.up(), ahead));
        let mut turned = 0.0;
        for neighbor in moment.neighbors {
            turned += dot(unit(neighbor.velocity), side);
        }
        // Boids that do not align do not follow others either.
        let follow = self.params.rules.alignment.min(1.0) / moment.divisor();
        let home = if self.params.rules.circling > 0.0 {
            self.circling(moment)
        } else {
            minus(self.tank.middle, moment.position)
        };
        let chosen = dot(push, side) / brake + follow * turned + dot(unit(home), side);
        let turn = scaled(brake.copysign(chosen), side);
        plus(add_scaled(push, BRAKED * brake, ahead), turn)
    }

    /// Returns the wishes by the rules of Reynolds 1987: first separation, then alignment, circling,
    /// broadside and cohesion in order of priority.
    fn with_rules(&self, moment: &Moment) -> (Vec3, [Vec3; 4]) {
        let rules = &self.params.rules;
        let ahead = unit(moment.velocity);
        let seen = Seen::of(moment.neighbors, ahead, self.cos_half_view, rules);
        let alignment = self.alignment(&seen, moment);
        let apart = match self.params.separation {
            Separation::Repulsion => seen.apart,
            Separation::Papers => self.rule_a_of_the_papers(moment, ahead, alignment),
        };
        let together = if moment.leads { 0.0 } else { 1.0 };
        let wishes = [
            scaled(together * rules.alignment, alignment),
            scaled(rules.circling, self.circling(moment)),
            scaled(BROADSIDE, self.broadside(moment)),
            scaled(together * rules.cohesion, seen.cohesion(rules)),
        ];
        (scaled(rules.separation, apart), wishes)
    }

    /// Returns the wish by the zonal model of Couzin et al. 2002: the fastest turn onto its course.
    fn with_zones(&self, zones: &Zones, moment: &Moment) -> Vec3 {
        let (velocity, cos) = (moment.velocity, self.cos_half_view);
        let course = zones::course(zones, velocity, moment.neighbors, cos);
        let wished = unit(plus(course, moment.noise));
        let cruise = self.calibration.cruise_bl_per_s;
        let gap = minus(scaled(cruise, wished), velocity);
        scaled(WITHOUT_DELAY / cruise, gap)
    }

    /// Returns mean v_j - v_i, in cruising speeds.
    fn alignment(&self, seen: &Seen, moment: &Moment) -> Vec3 {
        if seen.n_along == 0.0 {
            return [0.0; 3];
        }
        let gap = minus(scaled(1.0 / seen.n_along, seen.along), moment.velocity);
        scaled(1.0 / self.calibration.cruise_bl_per_s, gap)
    }

    /// Returns the wish by rule A of Okabe et al., section 4: slower when ahead of the neighbors, faster when
    /// behind, and in their direction.
    fn rule_a_of_the_papers(&self, moment: &Moment, ahead: Vec3, alignment: Vec3) -> Vec3 {
        let (mut lead, mut n) = (0.0, 0.0);
        for neighbor in moment.neighbors {
            if is_seen(neighbor, ahead, self.cos_half_view) {
                lead -= dot(ahead, unit(neighbor.offset));
                n += 1.0;
            }
        }
        if n == 0.0 {
            return [0.0; 3];
        }
        add_scaled(scaled(-lead / n, ahead), 0.5, alignment)
    }

    /// Returns the wish to circle around the middle of the tank, in the plane of swimming, on a ring that
    /// fits its narrower side.
    fn circling(&self, moment: &Moment) -> Vec3 {
        if self.params.rules.circling == 0.0 {
            return [0.0; 3];
        }
        let up = self.tank.up();
        let from_middle = minus(moment.position, self.tank.middle);
        let from_middle = add_scaled(from_middle, -dot(from_middle, up), up);
        let [width, height, depth] = self.tank.reach_bl;
        let room = width.min(if self.tank.is_flat() { height } else { depth });
        let outward = unit(from_middle);
        let off = RING - norm(from_middle) / room.max(1e-6);
        let inward = scaled(2.0 * off.clamp(-1.0, 1.0), outward);
        let course = unit(plus(inward, cross(up, outward)));
        // Boids ahead of their neighbors swim faster, those behind slower, so that the ring fills evenly.
        let mut lead = 0.0;
        for neighbor in moment.neighbors {
            lead -= dot(course, unit(neighbor.offset));
        }
        let lead = lead / moment.divisor();
        let cruise = self.calibration.cruise_bl_per_s;
        let pace = cruise * (1.0 + SPREADING * lead);
        let gap = minus(scaled(pace, course), moment.velocity);
        scaled(1.0 / cruise, gap)
    }

    /// Returns the wish to leave the line of sight, in side view. Footage shows an animal best broadside. A
    /// flock that lingers in depth would be seen end-on half of the time.
    ///
    /// The boid's own direction and those of its neighbors choose the side. Boids that do not align avoid the
    /// side of their neighbors. The wish grows with the share of the velocity along the line of sight.
    fn broadside(&self, moment: &Moment) -> Vec3 {
        if self.tank.is_flat() || self.params.rules.circling > 0.0 {
            return [0.0; 3];
        }
        let [x, _, z] = self.habitat.lens.sight(moment.position);
        let sight = unit([x, 0.0, z]);
        let across = [sight[2], 0.0, -sight[0]];
        // Directions count, not speeds: slow boids would otherwise not settle on a side.
        let ahead = unit(moment.velocity);
        let (mut sum, mut n) = (0.0, 0.0);
        for neighbor in moment.neighbors {
            if is_seen(neighbor, ahead, self.cos_half_view) {
                sum += dot(unit(neighbor.velocity), across);
                n += 1.0;
            }
        }
        let follow = (3.0 * self.params.rules.alignment.min(1.0) - 1.0) / f64::max(n, 1.0);
        let side = (dot(ahead, across) + follow * sum).clamp(-1.0, 1.0);
        let cruise = self.calibration.cruise_bl_per_s;
        // A wall on this side pushes toward the other side.
        let aside = scaled(cruise.copysign(side), across);
        let push = self
            .tank
            .push(moment.position, aside, self.wall_horizon_s());
        let side = (side + 2.0 * dot(push, across)).clamp(-1.0, 1.0);
        let end_on = dot(ahead, sight);
        let into = end_on * end_on * dot(moment.velocity, sight) / cruise;
        add_scaled(scaled(side * into.abs(), across), -into, sight)
    }

    /// Returns the acceleration of the wandering turn and of the return to the slopes of the animal. Without
    /// this return, boids swim as steeply as they may. A steep boid seen nearly end-on then has a heading in
    /// the image that the animal never had.
    fn wander(&self, moment: &Moment) -> Vec3 {
        let up = self.tank.up();
        let sideways = cross(up, moment.velocity);
        let turn = scaled(moment.wander[0], sideways);
        let Some(slopes) = &self.calibration.slopes else {
            return turn;
        };
        let [x, y, z] = moment.velocity;
        let wished = slopes.usual + slopes.spread * moment.wander[1];
        let gap = wished * norm([x, 0.0, z]) - y;
        add_scaled(turn, gap / LEVEL_S, up)
    }

    /// Returns the acceleration back to cruising speed. Leaders cruise at 1.4 times that speed.
    fn cruise(&self, moment: &Moment) -> Vec3 {
        let speed = norm(moment.velocity);
        let pace = if moment.leads { 1.4 } else { 1.0 };
        let gap = pace * self.calibration.cruise_bl_per_s - speed;
        scaled(gap * self.calibration.turn_rad_per_s, unit(moment.velocity))
    }
}

impl Moment<'_> {
    /// Returns the number of neighbors, or 1 if there are none, as a divisor.
    fn divisor(&self) -> f64 {
        self.neighbors.len().max(1) as f64
    }
}

/// Returns the sum of the requests in order, until the sum of their sizes reaches `most`. The last one is
/// cut.
fn granted(requests: &[Vec3], most: f64) -> Vec3 {
    let (mut left, mut sum) = (most, [0.0; 3]);
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
    fn urgent_requests_leave_what_they_do_not_use_to_the_others() {
        let requests = [[3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 9.0]];
        assert_eq!(granted(&requests, 5.0), [3.0, 2.0, 0.0]);
        assert_eq!(granted(&requests, 2.0), [2.0, 0.0, 0.0]);
    }
}
