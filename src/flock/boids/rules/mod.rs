//! Steering rules: separation, alignment, cohesion, walls, circling and wander, granted in order of priority.
//! Sources: Reynolds 1987; Okabe et al., section 4; docs/explanation/algorithms.md, "Boids".
//!
//! Requests are scaled by the usual acceleration of the animal, so that the same weights suit slow and fast
//! animals. Their sum is limited to the greatest acceleration of the animal.

mod seen;
mod zones;

use self::seen::{Seen, at_least_one, is_seen};
use super::calibration::Calibration;
use super::habitat::{Habitat, Hunter};
use super::lanes::{Lanes, select3, splat3};
use super::nearest::Neighbor;
use super::tank::Tank;
use super::vector::{add_scaled, cross, dot, minus, norm, plus, scaled, unit};
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

/// State of some boids at one moment.
pub struct Moment<'a, L: Lanes> {
    /// Positions, body lengths.
    pub position: [L; 3],
    /// Velocities, body lengths per second.
    pub velocity: [L; 3],
    /// Neighbors, nearest first: all that the rules may need.
    pub neighbors: &'a [Neighbor<L>],
    /// Wandering turn rate in the plane of swimming, radians per second, and wanted slope in standard
    /// deviations from the usual one.
    pub wander: [L; 2],
    /// Boids that lead. Their alignment and cohesion are off.
    pub leads: L::Mask,
    /// Random error of the course in the zonal model.
    pub noise: [L; 3],
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
    #[inline(always)]
    pub fn acceleration<L: Lanes>(&self, moment: &Moment<L>) -> [L; 3] {
        let most = self.calibration.acceleration_bl_per_s2();
        let usual = L::splat(self.calibration.usual_acceleration_bl_per_s2());
        let (position, velocity) = (moment.position, moment.velocity);
        let horizon_s = self.wall_horizon_s();
        let walls = plus(
            self.tank.push(position, velocity, horizon_s),
            self.habitat.push(position, velocity, horizon_s),
        );
        let walls = self.aside(walls, moment);
        let flight = self.habitat.flight(position, self.hunter);
        let walls = add_scaled(flight, L::splat(self.params.rules.walls), walls);
        let cruise = self.calibration.cruise_bl_per_s;
        let goals = (self.habitat).toward_goals(self.time_s, position, velocity, cruise);
        let nothing = [L::splat(0.0); 3];
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
    #[inline(always)]
    fn aside<L: Lanes>(&self, push: [L; 3], moment: &Moment<L>) -> [L; 3] {
        let ahead = unit(moment.velocity);
        let brake = -dot(push, ahead);
        let is_braked = L::splat(0.0).less(brake);
        if !L::any(is_braked) {
            return push;
        }
        let side = unit(cross(splat3(self.tank.up()), ahead));
        let mut turned = L::splat(0.0);
        for neighbor in moment.neighbors {
            turned = turned + dot(unit(neighbor.velocity), side);
        }
        // Boids that do not align do not follow others either.
        let follow = L::splat(self.params.rules.alignment.min(1.0)) / at_least_one(moment.count());
        let home = match self.params.rules.circling > 0.0 {
            true => self.circling(moment),
            false => minus(splat3(self.tank.middle), moment.position),
        };
        let chosen = dot(push, side) / brake + follow * turned + dot(unit(home), side);
        let turn = scaled(brake.copysign(chosen), side);
        let turned = plus(add_scaled(push, L::splat(BRAKED) * brake, ahead), turn);
        select3::<L>(is_braked, turned, push)
    }

    /// Returns the wishes by the rules of Reynolds 1987: first separation, then alignment, circling,
    /// broadside and cohesion in order of priority.
    #[inline(always)]
    fn with_rules<L: Lanes>(&self, moment: &Moment<L>) -> ([L; 3], [[L; 3]; 4]) {
        let rules = &self.params.rules;
        let ahead = unit(moment.velocity);
        let seen = Seen::of(moment.neighbors, ahead, self.cos_half_view, rules);
        let alignment = self.alignment(&seen, moment);
        let apart = match self.params.separation {
            Separation::Repulsion => seen.apart,
            Separation::Papers => self.rule_a_of_the_papers(moment, ahead, alignment),
        };
        let together = L::select(moment.leads, L::splat(0.0), L::splat(1.0));
        let wishes = [
            scaled(together * L::splat(rules.alignment), alignment),
            scaled(L::splat(rules.circling), self.circling(moment)),
            scaled(L::splat(BROADSIDE), self.broadside(moment)),
            scaled(together * L::splat(rules.cohesion), seen.cohesion(rules)),
        ];
        (scaled(L::splat(rules.separation), apart), wishes)
    }

    /// Returns the wish by the zonal model of Couzin et al. 2002: the fastest turn onto its course.
    #[inline(always)]
    fn with_zones<L: Lanes>(&self, zones: &Zones, moment: &Moment<L>) -> [L; 3] {
        let (velocity, cos) = (moment.velocity, self.cos_half_view);
        let course = zones::course(zones, velocity, moment.neighbors, cos);
        let wished = unit(plus(course, moment.noise));
        let cruise = self.calibration.cruise_bl_per_s;
        let gap = minus(scaled(L::splat(cruise), wished), velocity);
        scaled(L::splat(WITHOUT_DELAY / cruise), gap)
    }

    /// Returns mean v_j - v_i, in cruising speeds.
    #[inline(always)]
    fn alignment<L: Lanes>(&self, seen: &Seen<L>, moment: &Moment<L>) -> [L; 3] {
        let one = L::splat(1.0);
        let gap = minus(scaled(one / seen.n_along, seen.along), moment.velocity);
        let wished = scaled(L::splat(1.0 / self.calibration.cruise_bl_per_s), gap);
        select3::<L>(seen.n_along.at_least(one), wished, [L::splat(0.0); 3])
    }

    /// Returns the wish by rule A of Okabe et al., section 4: slower when ahead of the neighbors, faster when
    /// behind, and in their direction.
    #[inline(always)]
    fn rule_a_of_the_papers<L: Lanes>(
        &self,
        moment: &Moment<L>,
        ahead: [L; 3],
        alignment: [L; 3],
    ) -> [L; 3] {
        let (mut lead, mut n) = (L::splat(0.0), L::splat(0.0));
        for neighbor in moment.neighbors {
            let sees = L::one_where(is_seen(neighbor, ahead, self.cos_half_view));
            lead = lead - sees * dot(ahead, unit(neighbor.offset));
            n = n + sees;
        }
        let half = L::splat(0.5);
        let wished = add_scaled(scaled(-lead / n, ahead), half, alignment);
        select3::<L>(half.less(n), wished, [L::splat(0.0); 3])
    }

    /// Returns the wish to circle around the middle of the tank, in the plane of swimming, on a ring that
    /// fits its narrower side.
    #[inline(always)]
    fn circling<L: Lanes>(&self, moment: &Moment<L>) -> [L; 3] {
        if self.params.rules.circling == 0.0 {
            return [L::splat(0.0); 3];
        }
        let up = splat3(self.tank.up());
        let from_middle = minus(moment.position, splat3(self.tank.middle));
        let from_middle = add_scaled(from_middle, -dot(from_middle, up), up);
        let [width, height, depth] = self.tank.reach_bl;
        let room = width.min(if self.tank.is_flat() { height } else { depth });
        let (one, outward) = (L::splat(1.0), unit(from_middle));
        let off = L::splat(RING) - norm(from_middle) / L::splat(room.max(1e-6));
        let inward = scaled(L::splat(2.0) * off.clamp(-one, one), outward);
        let course = unit(plus(inward, cross(up, outward)));
        // Boids ahead of their neighbors swim faster, those behind slower, so that the ring fills evenly.
        let mut lead = L::splat(0.0);
        for neighbor in moment.neighbors {
            lead = lead - dot(course, unit(neighbor.offset));
        }
        let lead = lead / at_least_one(moment.count());
        let cruise = self.calibration.cruise_bl_per_s;
        let pace = L::splat(cruise) * (one + L::splat(SPREADING) * lead);
        let gap = minus(scaled(pace, course), moment.velocity);
        scaled(L::splat(1.0 / cruise), gap)
    }

    /// Returns the wish to leave the line of sight, in side view. Footage shows an animal best broadside. A
    /// flock that lingers in depth would be seen end-on half of the time.
    ///
    /// The boid's own direction and those of its neighbors choose the side. Boids that do not align avoid the
    /// side of their neighbors. The wish grows with the share of the velocity along the line of sight.
    #[inline(always)]
    fn broadside<L: Lanes>(&self, moment: &Moment<L>) -> [L; 3] {
        let (nothing, one) = (L::splat(0.0), L::splat(1.0));
        if self.tank.is_flat() || self.params.rules.circling > 0.0 {
            return [nothing; 3];
        }
        let [x, _, z] = self.habitat.lens.sight(moment.position);
        let sight = unit([x, nothing, z]);
        let across = [sight[2], nothing, -sight[0]];
        // Directions count, not speeds: slow boids would otherwise not settle on a side.
        let ahead = unit(moment.velocity);
        let (mut sum, mut n) = (nothing, nothing);
        for neighbor in moment.neighbors {
            let sees = L::one_where(is_seen(neighbor, ahead, self.cos_half_view));
            sum = sum + sees * dot(unit(neighbor.velocity), across);
            n = n + sees;
        }
        let follow = 3.0 * self.params.rules.alignment.min(1.0) - 1.0;
        let follow = L::splat(follow) / at_least_one(n);
        let side = (dot(ahead, across) + follow * sum).clamp(-one, one);
        let cruise = L::splat(self.calibration.cruise_bl_per_s);
        // A wall on this side pushes toward the other side.
        let aside = scaled(cruise.copysign(side), across);
        let push = self
            .tank
            .push(moment.position, aside, self.wall_horizon_s());
        let side = (side + L::splat(2.0) * dot(push, across)).clamp(-one, one);
        let end_on = dot(ahead, sight);
        let into = end_on * end_on * dot(moment.velocity, sight) / cruise;
        add_scaled(scaled(side * into.abs(), across), -into, sight)
    }

    /// Returns the acceleration of the wandering turn and of the return to the slopes of the animal. Without
    /// this return, boids swim as steeply as they may. A steep boid seen nearly end-on then has a heading in
    /// the image that the animal never had.
    #[inline(always)]
    fn wander<L: Lanes>(&self, moment: &Moment<L>) -> [L; 3] {
        let up = splat3(self.tank.up());
        let sideways = cross(up, moment.velocity);
        let turn = scaled(moment.wander[0], sideways);
        let Some(slopes) = &self.calibration.slopes else {
            return turn;
        };
        let [x, y, z] = moment.velocity;
        let wished = L::splat(slopes.usual) + L::splat(slopes.spread) * moment.wander[1];
        let gap = wished * norm([x, L::splat(0.0), z]) - y;
        add_scaled(turn, gap / L::splat(LEVEL_S), up)
    }

    /// Returns the acceleration back to cruising speed. Leaders cruise at 1.4 times that speed.
    #[inline(always)]
    fn cruise<L: Lanes>(&self, moment: &Moment<L>) -> [L; 3] {
        let speed = norm(moment.velocity);
        let pace = L::select(moment.leads, L::splat(1.4), L::splat(1.0));
        let gap = pace * L::splat(self.calibration.cruise_bl_per_s) - speed;
        let turn = L::splat(self.calibration.turn_rad_per_s);
        scaled(gap * turn, unit(moment.velocity))
    }
}

impl<L: Lanes> Moment<'_, L> {
    /// Returns the number of neighbors of each boid.
    #[inline(always)]
    fn count(&self) -> L {
        let mut count = L::splat(0.0);
        for neighbor in self.neighbors {
            count = count + L::one_where(neighbor.is_there());
        }
        count
    }
}

/// Returns the sum of the requests in order, until the sum of their sizes reaches `most`. The last one is
/// cut.
#[inline(always)]
fn granted<L: Lanes>(requests: &[[L; 3]], most: f64) -> [L; 3] {
    let mut left = L::splat(most);
    let mut sum = [L::splat(0.0); 3];
    for &request in requests {
        let size = norm(request);
        let share = L::select(left.less(size), left / size, L::splat(1.0));
        sum = add_scaled(sum, share, request);
        left = left - size.min(left);
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
