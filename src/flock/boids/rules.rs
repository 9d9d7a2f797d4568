//! What a boid asks of itself: separation, alignment, cohesion, walls, circling and wander, granted
//! in order of priority (Reynolds 1987; O 4; ALGORITHMS.md 7).
//!
//! Requests are measured against the acceleration that the animal usually makes, so that one set of weights
//! serves a slow animal and a fast one, and their sum is cut to the greatest it was seen to make.

use super::calibration::Calibration;
use super::habitat::{Habitat, Hunter};
use super::nearest::Neighbor;
use super::tank::Tank;
use super::vector::{Vec3, add_scaled, cross, dot, minus, norm, scaled, unit};
use super::zones;
use crate::flock::params::{Params, Rules, Separation, Zones};

/// A wall is steered from when the path over this time meets it.
const WALL_HORIZON_S: f64 = 1.0;

/// The share of a wall's braking that becomes a turn alone.
const BRAKED: f64 = 0.7;
/// So strong a wish is granted as far as the turn rate allows.
const WITHOUT_DELAY: f64 = 20.0;
/// Whoever circles does so at this share of the way from the middle to the walls.
const RING: f64 = 0.65;
/// By how much of the cruising speed whoever circles goes ahead of a crowd behind it.
const SPREADING: f64 = 0.5;
/// Time constant of coming back to a slope that the animal has.
const LEVEL_S: f64 = 0.25;
/// Weight of swimming across the picture rather than into it.
const BROADSIDE: f64 = 1.5;

/// One boid's moment.
pub struct Moment<'a> {
    /// Where it is.
    pub position: Vec3,
    /// Its velocity, body lengths a second.
    pub velocity: Vec3,
    /// Nearest first; all that its rules may need.
    pub neighbors: &'a [Neighbor],
    /// The wandering turn rate in the plane of swimming, and how many standard deviations the wished slope is off
    /// the usual one.
    pub wander: [f64; 2],
    /// It leads: alignment and cohesion are off.
    pub leads: bool,
    /// What its course is wrong by, with zones.
    pub noise: Vec3,
}

/// Everything that steering depends on besides the moment.
pub struct Steering<'a> {
    /// Weights and radii.
    pub params: &'a Params,
    /// The animal's limits.
    pub calibration: &'a Calibration,
    /// Where the walls are.
    pub tank: &'a Tank,
    /// What else there is.
    pub habitat: &'a Habitat<'a>,
    /// Seconds of the film.
    pub time_s: f64,
    /// The predator.
    pub hunter: Option<&'a Hunter>,
    /// cos of half the field of view.
    pub cos_half_view: f64,
}

/// What a boid sees of its neighbors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Seen {
    /// sum (p_i - p_j)/|.| (r_s/|.| - 1) over those nearer than r_s.
    apart: Vec3,
    /// sum v_j over those nearer than r_a, and how many they are.
    along: Vec3,
    n_along: f64,
    /// sum p_j - p_i over those nearer than r_c, and how many they are.
    toward: Vec3,
    n_toward: f64,
}

impl Steering<'_> {
    /// The acceleration granted, at most the calibration's, BL/s^2.
    #[inline(always)]
    pub fn acceleration(&self, moment: &Moment) -> Vec3 {
        let most = self.calibration.acceleration_bl_per_s2();
        let usual = self.calibration.usual_acceleration_bl_per_s2();
        let (position, velocity) = (moment.position, moment.velocity);
        let walls = add_scaled(
            self.tank.push(position, velocity, WALL_HORIZON_S),
            1.0,
            self.habitat.push(position, velocity, WALL_HORIZON_S),
        );
        let walls = self.aside(walls, moment);
        let flight = self.habitat.flee(position, self.hunter).unwrap_or_default();
        let walls = add_scaled(flight, self.params.rules.walls, walls);
        let goals = self.habitat.toward_goals(
            self.time_s,
            position,
            velocity,
            self.calibration.cruise_bl_per_s,
        );
        let (urgent, wishes) = match &self.params.rules.zones {
            Some(zones) => (
                [0.0; 3],
                [self.with_zones(zones, moment), [0.0; 3], [0.0; 3], [0.0; 3]],
            ),
            None => self.with_rules(moment),
        };
        let urgent = add_scaled(urgent, 1.0, walls);
        let [together, around, broadside, near] = wishes;
        let wishes = [urgent, together, around, broadside, near, goals].map(|w| scaled(usual, w));
        let wander = match self.params.rules.zones {
            Some(_) => [0.0; 3],
            None => self.wander(moment),
        };
        let [urgent, together, around, broadside, near, goals] = wishes;
        let cruise = self.cruise(moment);
        granted(
            &[
                urgent, together, around, broadside, near, goals, wander, cruise,
            ],
            most,
        )
    }

    /// A push as a turn: who is only slowed down by a wall dawdles before it. What of the push would brake leads to
    /// the side instead that the rest of it points to, or, head-on, to the one where the neighbors turn, as far as
    /// it aligns, and where the tank's middle lies, or its circle leads.
    fn aside(&self, push: Vec3, moment: &Moment) -> Vec3 {
        let ahead = unit(moment.velocity);
        let brake = -dot(push, ahead);
        if brake <= 0.0 {
            return push;
        }
        let side = unit(cross(self.tank.up(), ahead));
        let velocities = (moment.neighbors.iter()).map(|n| n.velocity);
        let turned: f64 = velocities.map(|velocity| dot(unit(velocity), side)).sum();
        // Who does not align does not follow others either.
        let follow = self.params.rules.alignment.min(1.0) / moment.neighbors.len().max(1) as f64;
        let home = match self.params.rules.circling > 0.0 {
            true => self.circling(moment),
            false => minus(self.tank.middle, moment.position),
        };
        let chosen = dot(push, side) / brake + follow * turned + dot(unit(home), side);
        let turn = scaled(brake.copysign(chosen), side);
        add_scaled(add_scaled(push, BRAKED * brake, ahead), 1.0, turn)
    }

    /// Reynolds 1987: what is urgent, and alignment, circling, broadside and cohesion in this order.
    #[inline(always)]
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

    /// Couzin et al. 2002: as fast as may be onto the course of the zones.
    fn with_zones(&self, zones: &Zones, moment: &Moment) -> Vec3 {
        let (velocity, cos) = (moment.velocity, self.cos_half_view);
        let course = zones::course(zones, velocity, moment.neighbors, cos);
        let course = course.unwrap_or_else(|| unit(moment.velocity));
        let wished = unit(add_scaled(course, 1.0, moment.noise));
        let cruise = self.calibration.cruise_bl_per_s;
        let gap = minus(scaled(cruise, wished), moment.velocity);
        scaled(WITHOUT_DELAY / cruise, gap)
    }

    /// mean v_j - v_i, in cruising speeds.
    #[inline(always)]
    fn alignment(&self, seen: &Seen, moment: &Moment) -> Vec3 {
        if seen.n_along == 0.0 {
            return [0.0; 3];
        }
        let gap = minus(scaled(1.0 / seen.n_along, seen.along), moment.velocity);
        scaled(1.0 / self.calibration.cruise_bl_per_s, gap)
    }

    /// O 4, rule A: slower when ahead of the neighbors, faster when behind, and their direction.
    fn rule_a_of_the_papers(&self, moment: &Moment, ahead: Vec3, alignment: Vec3) -> Vec3 {
        let neighbors = moment.neighbors.iter();
        let seen = neighbors.filter(|n| is_seen(n, ahead, self.cos_half_view));
        let (lead, n) = seen.fold((0.0, 0.0), |(lead, n), neighbor| {
            (lead - dot(ahead, unit(neighbor.offset)), n + 1.0)
        });
        if n == 0.0 {
            return [0.0; 3];
        }
        add_scaled(scaled(-lead / n, ahead), 0.5, alignment)
    }

    /// Toward swimming round the middle of the tank, on a ring that its narrower side holds, in
    /// the plane of swimming.
    fn circling(&self, moment: &Moment) -> Vec3 {
        if self.params.rules.circling == 0.0 {
            return [0.0; 3];
        }
        let up = self.tank.up();
        let level = |v: Vec3| add_scaled(v, -dot(v, up), up);
        let from_middle = level(minus(moment.position, self.tank.middle));
        let [width, height, depth] = self.tank.reach_bl;
        let room = width.min(if self.tank.is_flat() { height } else { depth });
        let outward = unit(from_middle);
        let inward = scaled(
            2.0 * (RING - norm(from_middle) / room.max(1e-6)).clamp(-1.0, 1.0),
            outward,
        );
        let course = unit(add_scaled(inward, 1.0, cross(up, outward)));
        // Faster than those behind, slower than those ahead: the ring is to be as full all the way round.
        let behind = |n: &Neighbor| -dot(course, unit(n.offset));
        let lead: f64 = moment.neighbors.iter().map(behind).sum();
        let lead = lead / moment.neighbors.len().max(1) as f64;
        let cruise = self.calibration.cruise_bl_per_s;
        let pace = cruise * (1.0 + SPREADING * lead);
        let gap = minus(scaled(pace, course), moment.velocity);
        scaled(1.0 / cruise, gap)
    }

    /// In side view: out of the line of sight, to the side where the neighbors go, or, where nobody aligns, where fewer
    /// go; the more so, the nearer to end-on. Footage shows an animal best broadside, and a flock that lingers in depth
    /// would be seen end-on half the time.
    fn broadside(&self, moment: &Moment) -> Vec3 {
        if self.tank.is_flat() || self.params.rules.circling > 0.0 {
            return [0.0; 3];
        }
        let [x, _, z] = self.habitat.lens.sight(moment.position);
        let sight = unit([x, 0.0, z]);
        let across = [sight[2], 0.0, -sight[0]];
        // Courses count, not speeds: slow ones would never find a side to turn to.
        let ahead = unit(moment.velocity);
        let seen = (moment.neighbors.iter()).filter(|n| is_seen(n, ahead, self.cos_half_view));
        let (sum, n) = seen.fold((0.0, 0.0), |(sum, n), neighbor| {
            (sum + dot(unit(neighbor.velocity), across), n + 1.0)
        });
        let follow = (3.0 * self.params.rules.alignment.min(1.0) - 1.0) / f64::max(n, 1.0);
        let side = (dot(ahead, across) + follow * sum).clamp(-1.0, 1.0);
        let cruise = self.calibration.cruise_bl_per_s;
        // Not onto a wall: its push leads back.
        let aside = scaled(cruise.copysign(side), across);
        let wall = dot(
            self.tank.push(moment.position, aside, WALL_HORIZON_S),
            across,
        );
        let side = (side + 2.0 * wall).clamp(-1.0, 1.0);
        let end_on = dot(ahead, sight);
        let into = end_on * end_on * dot(moment.velocity, sight) / cruise;
        add_scaled(scaled(side * into.abs(), across), -into, sight)
    }

    /// The wandering turn, as the acceleration that makes it, and the way back to the slopes that the animal has:
    /// left to the rules alone, boids swim as steeply as they may, and who is both steep and seen nearly end-on
    /// heads in the picture where the animal never did.
    #[inline(always)]
    fn wander(&self, moment: &Moment) -> Vec3 {
        let up = self.tank.up();
        let sideways = cross(up, moment.velocity);
        let turn = scaled(moment.wander[0], sideways);
        let Some(slopes) = &self.calibration.slopes else {
            return turn;
        };
        let [x, y, z] = moment.velocity;
        let wished = slopes.usual + slopes.spread * moment.wander[1];
        add_scaled(turn, (wished * norm([x, 0.0, z]) - y) / LEVEL_S, up)
    }

    /// Back to cruising speed; leaders are faster.
    #[inline(always)]
    fn cruise(&self, moment: &Moment) -> Vec3 {
        let speed = norm(moment.velocity);
        let pace = if moment.leads { 1.4 } else { 1.0 };
        let gap = pace * self.calibration.cruise_bl_per_s - speed;
        scaled(gap * self.calibration.turn_rad_per_s, unit(moment.velocity))
    }
}

impl Seen {
    /// Of neighbors, nearest first, who looks `ahead`, a unit vector.
    #[inline(always)]
    fn of(neighbors: &[Neighbor], ahead: Vec3, cos_half_view: f64, rules: &Rules) -> Seen {
        let apart_bl2 = rules.separation_bl * rules.separation_bl;
        let along_bl2 = rules.alignment_bl * rules.alignment_bl;
        let toward_bl2 = rules.cohesion_bl * rules.cohesion_bl;
        let mut seen = Seen::default();
        for neighbor in neighbors {
            // Nothing is added instead of nothing being done: who is seen is not to be guessed.
            let sees = one_if(is_seen(neighbor, ahead, cos_half_view));
            let along = sees * one_if(neighbor.square_bl2 < along_bl2);
            let toward = sees * one_if(neighbor.square_bl2 < toward_bl2);
            seen.n_along += along;
            seen.n_toward += toward;
            seen.along = add_scaled(seen.along, along, neighbor.velocity);
            seen.toward = add_scaled(seen.toward, toward, neighbor.offset);
        }
        let near = neighbors.iter().take_while(|n| n.square_bl2 < apart_bl2);
        for neighbor in near.filter(|n| is_seen(n, ahead, cos_half_view)) {
            let distance = neighbor.square_bl2.sqrt().max(0.05);
            let strength = (rules.separation_bl / distance - 1.0) / distance;
            seen.apart = add_scaled(seen.apart, -strength, neighbor.offset);
        }
        seen
    }

    /// mean p_j - p_i over those nearer than r_c, in r_c.
    #[inline(always)]
    fn cohesion(&self, rules: &Rules) -> Vec3 {
        if self.n_toward == 0.0 {
            return self.toward;
        }
        scaled(1.0 / (self.n_toward * rules.cohesion_bl), self.toward)
    }
}

#[inline(always)]
fn one_if(is: bool) -> f64 {
    if is { 1.0 } else { 0.0 }
}

#[inline(always)]
fn is_seen(neighbor: &Neighbor, ahead: Vec3, cos_half_view: f64) -> bool {
    dot(ahead, neighbor.offset) >= cos_half_view * neighbor.square_bl2.sqrt()
}

/// Requests in order, until the sum of their sizes reaches `most`; the last one is cut.
#[inline(always)]
fn granted(requests: &[Vec3], most: f64) -> Vec3 {
    let mut left = most;
    let mut sum = [0.0; 3];
    for &request in requests {
        let size = norm(request);
        let share = if size > left { left / size } else { 1.0 };
        sum = add_scaled(sum, share, request);
        left -= size.min(left);
        if left <= 0.0 {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn neighbor(offset: Vec3) -> Neighbor {
        Neighbor {
            id: 1,
            offset,
            square_bl2: dot(offset, offset),
            velocity: [0.0; 3],
        }
    }

    #[test]
    fn a_near_neighbor_pushes_away_and_a_farther_one_attracts() {
        let (near, far) = (neighbor([0.5, 0.0, 0.0]), neighbor([3.0, 0.0, 0.0]));
        let rules = Rules::default();
        let seen = |neighbor| Seen::of(&[neighbor], [1.0, 0.0, 0.0], 0.0, &rules);
        assert_eq!(seen(near).apart, [-1.0, 0.0, 0.0]);
        assert_eq!(seen(far).apart, [0.0; 3]);
        assert_eq!(seen(far).cohesion(&rules), [0.5, 0.0, 0.0]);
        assert_eq!(seen(neighbor([-0.5, 0.0, 0.0])), Seen::default(), "behind");
    }

    #[test]
    fn urgent_requests_leave_what_they_do_not_use_to_the_others() {
        let requests = [[3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 9.0]];
        assert_eq!(granted(&requests, 5.0), [3.0, 2.0, 0.0]);
        assert_eq!(granted(&requests, 2.0), [2.0, 0.0, 0.0]);
    }
}
