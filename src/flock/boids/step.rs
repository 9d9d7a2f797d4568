//! One step of all boids (ALGORITHMS.md 7): who is near, what each wishes, how far it may turn and how fast it may
//! swim. It is worked out in the order of cells, where neighbors lie side by side, and put back by id.

use rayon::prelude::*;

use super::grid::{Boid, Grid};
use super::nearest::{Neighbor, Search};
use super::rules::{Moment, Steering};
use super::vector::{Vec3, add_scaled, cross, dot, minus, norm, scaled, turned_at_most, unit};
use super::{Boids, CHUNK, draw, leadership};
use crate::cpu::Level;
use crate::random;

/// Time constant of the wandering turn rate.
const WANDER_S: f64 = 1.0;
/// In flight the greatest speed is so many times the animal's.
const FLIGHT_PACE: f64 = 1.6;
/// The farthest neighbor that counts is looked for a little farther out than it was found a step ago.
const FARTHER: f64 = 1.03;

/// What of a boid nobody sees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inner {
    /// The wandering turn rate, and the wished slope in standard deviations.
    wander: [f64; 2],
    leads_for_s: f64,
    /// How far off the last neighbor was that counted. It only tells where to look first.
    sight_bl: f64,
}

/// All boids, in the order of the cells that they were in a step ago: who is near whom in the tank is so in memory.
#[derive(Default)]
pub(super) struct Room {
    pub(super) now: Vec<Member>,
    /// Where each stands in `now`, by id.
    pub(super) places: Vec<u32>,
    /// In the order of the cells that they are in before the step.
    pub(super) next: Vec<Member>,
    pub(super) grid: Grid,
}

/// A boid with all that the next step asks for.
#[derive(Clone, Copy, Default)]
pub(super) struct Member {
    pub(super) boid: Boid,
    inner: Inner,
    /// Others pushed it back by more than half of its way: it turns round, to the side that it wanders to.
    pub(super) is_blocked: bool,
    /// How far off the nearest other was before the step, squared; the reach when there was none.
    pub(super) nearest_bl2: f64,
}

impl AsRef<Boid> for Member {
    fn as_ref(&self) -> &Boid {
        &self.boid
    }
}

impl Room {
    /// Boids that have not swum yet, by id.
    pub(super) fn of(n: usize) -> Room {
        let member = |id| Member {
            boid: Boid {
                id,
                ..Boid::default()
            },
            ..Member::default()
        };
        Room {
            now: (0..n as u32).map(member).collect(),
            places: (0..n as u32).collect(),
            ..Room::default()
        }
    }
}

/// What is the same for all in one step.
struct Pace<'a> {
    steering: Steering<'a>,
    /// cos and sin of the widest turn.
    cos_sin: (f64, f64),
    /// The share of what wanders that is kept, and the spread of what is added, in its own spreads.
    wander: [f64; 2],
    reach_bl: f64,
    cpu: Level,
}

impl Default for Inner {
    fn default() -> Inner {
        Inner {
            wander: [0.0; 2],
            leads_for_s: 0.0,
            sight_bl: f64::INFINITY,
        }
    }
}

impl Boids<'_> {
    pub(super) fn step(&mut self) {
        self.time_s += self.step_s;
        if let Some(hunter) = &mut self.hunter {
            let (time_s, step_s) = (self.time_s, self.step_s);
            self.habitat
                .advance(hunter, time_s, step_s, &self.positions, self.calibration);
        }
        let mut room = std::mem::take(&mut self.room);
        let Room {
            now, next, grid, ..
        } = &mut room;
        let pace = self.pace();
        grid.sort(now, pace.reach_bl);
        next.resize(now.len(), Member::default());
        let farthest_bl2 = (next.par_chunks_mut(CHUNK).enumerate())
            .map_init(Search::default, |search, (chunk, next)| {
                self.go_on(chunk * CHUNK, next, (now, grid, search), &pace)
            })
            .reduce(|| 0.0, f64::max);
        self.push_apart(&mut room, farthest_bl2.sqrt());
        let (slots, next) = (room.grid.slots(), &room.next);
        (&mut self.positions, &mut self.velocities, &mut room.places)
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(position, velocity, place)| {
                *place = slots[*place as usize];
                let boid = &next[*place as usize].boid;
                (*position, *velocity) = (boid.position, boid.velocity);
            });
        std::mem::swap(&mut room.now, &mut room.next);
        self.room = room;
        self.step_idx += 1;
    }

    /// Has everybody swim on from where `positions` and `velocities` say.
    pub(super) fn swim_from_here(&mut self) {
        for Member { boid, .. } in &mut self.room.now {
            let id = boid.id as usize;
            (boid.position, boid.velocity) = (self.positions[id], self.velocities[id]);
        }
    }

    fn pace(&self) -> Pace<'_> {
        let rules = &self.params.rules;
        let half_view_rad = rules.view_deg.to_radians() / 2.0;
        let turn_rad = self.calibration.turn_rad_per_s * self.step_s;
        let keep = libm::exp(-self.step_s / WANDER_S);
        Pace {
            steering: Steering {
                params: &self.params,
                calibration: self.calibration,
                tank: self.tank,
                habitat: &self.habitat,
                time_s: self.time_s,
                hunter: self.hunter.as_ref(),
                cos_half_view: libm::cos(half_view_rad.min(std::f64::consts::PI)),
            },
            cos_sin: (libm::cos(turn_rad), libm::sin(turn_rad)),
            wander: [keep, (1.0 - keep * keep).sqrt()],
            reach_bl: rules.reach_bl(),
            cpu: Level::detect(),
        }
    }

    /// What they are after the step who stand at `first` and after it; the square of the longest way.
    fn go_on(
        &self,
        first: usize,
        next: &mut [Member],
        near: (&[Member], &Grid, &mut Search),
        pace: &Pace,
    ) -> f64 {
        match pace.cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                // SAFETY: the line above made sure of AVX2, which is all that the callee asks for.
                unsafe {
                    self.go_on_avx2(first, next, near, pace)
                }
            }
            _ => self.go_on_with(first, next, near, pace),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn go_on_avx2(
        &self,
        first: usize,
        next: &mut [Member],
        near: (&[Member], &Grid, &mut Search),
        pace: &Pace,
    ) -> f64 {
        self.go_on_with(first, next, near, pace)
    }

    #[inline(always)]
    fn go_on_with(
        &self,
        first: usize,
        next: &mut [Member],
        (now, grid, search): (&[Member], &Grid, &mut Search),
        pace: &Pace,
    ) -> f64 {
        let mut farthest_bl2 = 0.0f64;
        for (slot, next) in (first..).zip(next) {
            let before = &now[grid.given()[slot] as usize];
            *next = self.next(slot, before, (grid, search), pace);
            let way = minus(next.boid.position, grid.at(slot).position);
            farthest_bl2 = farthest_bl2.max(dot(way, way));
        }
        farthest_bl2
    }

    /// What whoever stands at `slot` is after the step.
    #[inline(always)]
    fn next(
        &self,
        slot: usize,
        before: &Member,
        (grid, search): (&Grid, &mut Search),
        pace: &Pace,
    ) -> Member {
        let &Boid {
            position,
            velocity,
            id: own_id,
        } = grid.at(slot);
        let id = own_id as usize;
        let limit = self.params.rules.neighbors as usize;
        let guess_bl = FARTHER * before.inner.sight_bl;
        let neighbors = search.nearest((grid, slot), (limit, pace.reach_bl), guess_bl, pace.cpu);
        let (nearest, last) = (neighbors.first(), neighbors.get(limit - 1));
        let inner = Inner {
            wander: self.next_wander((id, &before.inner), pace),
            leads_for_s: self.next_lead((id, &before.inner), velocity, neighbors),
            sight_bl: last.map_or(f64::INFINITY, |last| last.square_bl2.sqrt()),
        };
        let acceleration = pace.steering.acceleration(&Moment {
            position,
            velocity,
            neighbors,
            wander: inner.wander,
            leads: inner.leads_for_s > 0.0,
            noise: self.noise(id),
        });
        let sideways = cross(self.tank.up(), velocity);
        let wished = match before.is_blocked {
            true => {
                let speed = self.calibration.cruise_bl_per_s.max(norm(velocity));
                scaled(speed * inner.wander[0].signum(), unit(sideways))
            }
            false => add_scaled(velocity, self.step_s, acceleration),
        };
        let wished = match &self.meeting {
            Some(meeting) => meeting.wish(id, position, wished),
            None => wished,
        };
        let turned = turned_at_most(velocity, wished, pace.cos_sin, sideways);
        let velocity = self.within_limits(turned, position, velocity);
        let mut next = Member {
            boid: Boid {
                position: add_scaled(position, self.step_s, velocity),
                velocity,
                id: own_id,
            },
            inner,
            is_blocked: false,
            nearest_bl2: nearest.map_or(pace.reach_bl * pace.reach_bl, |near| near.square_bl2),
        };
        let boid = &mut next.boid;
        self.habitat
            .keep_out(&mut boid.position, &mut boid.velocity);
        // A slanting wall reflects more steeply than the animal swims.
        boid.velocity = self.within_limits(boid.velocity, position, velocity);
        next
    }

    /// Speed and slope as the animal was seen to have them, in flight faster; the direction of `before` when it
    /// stands.
    pub(super) fn within_limits(&self, mut velocity: Vec3, position: Vec3, before: Vec3) -> Vec3 {
        if let Some(slopes) = &self.calibration.slopes {
            let [level, across] = self.habitat.lens.seen_level(position, velocity);
            let most = slopes.in_picture * across;
            let seen = velocity[1].clamp(level - most, level + most);
            let [up, down] = slopes
                .limits
                .map(|limit| limit * norm([velocity[0], 0.0, velocity[2]]));
            velocity[1] = seen.clamp(-up, down);
        }
        let [least, most] = self.calibration.speed_limits_bl_per_s;
        let flees = self.habitat.flee(position, self.hunter.as_ref()).is_some();
        let most = if flees { FLIGHT_PACE * most } else { most };
        let speed = norm(velocity);
        let direction = if speed > 1e-9 {
            unit(velocity)
        } else {
            unit(before)
        };
        scaled(speed.clamp(least, most), direction)
    }

    /// The error of a course with zones, in each direction.
    fn noise(&self, id: usize) -> Vec3 {
        let Some(zones) = &self.params.rules.zones else {
            return [0.0; 3];
        };
        let n_axes = if self.tank.is_flat() { 2 } else { 3 };
        std::array::from_fn(|axis| {
            let key = [draw::NOISE, id as u64, self.step_idx, axis as u64];
            let is_free = axis < n_axes;
            f64::from(u8::from(is_free)) * zones.noise_rad * random::normal(self.params.seed, &key)
        })
    }

    /// Ornstein-Uhlenbeck: a level turn rate, at weight 1 as varied as the animal's own, and a standard normal
    /// number, which is how far its slope is to be off the usual one. In a flat tank there is no slope.
    fn next_wander(&self, (id, before): (usize, &Inner), pace: &Pace) -> [f64; 2] {
        let [keep, fresh] = pace.wander;
        let next = |k: usize, spread: f64| {
            let key = [draw::WANDER, id as u64, self.step_idx, k as u64];
            keep * before.wander[k] + spread * fresh * random::normal(self.params.seed, &key)
        };
        let turn = next(
            0,
            self.params.rules.wander * self.calibration.wander_rad_per_s,
        );
        match self.tank.is_flat() {
            true => [turn, 0.0],
            false => [turn, next(1, 1.0)],
        }
    }

    fn next_lead(
        &self,
        (id, before): (usize, &Inner),
        velocity: Vec3,
        neighbors: &[Neighbor],
    ) -> f64 {
        let left = before.leads_for_s - self.step_s;
        if left > 0.0 || !self.params.leaders {
            return left.max(0.0);
        }
        let key = [draw::LEAD, id as u64, self.step_idx];
        let scale = (self.params.rules.cohesion_bl, self.step_s);
        leadership::taken(self.params.seed, key, velocity, neighbors, scale).unwrap_or(0.0)
    }
}
