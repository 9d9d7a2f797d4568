//! One step of all boids (docs/explanation/algorithms.md, "Boids"): neighbors, wanted velocities, and limits
//! of turn rate and speed. Boids are processed in the order of the grid's cells, where neighbors are adjacent
//! in memory, and written back by id.

use rayon::prelude::*;

use super::grid::{Boid, Grid};
use super::lanes::{self, Lanes, by_lane, in_lane, select3, splat3};
#[cfg(target_arch = "x86_64")]
use super::lanes::{Eight, Four};
use super::nearest::{Neighbor, Search};
use super::room::{Crowd, Inner, Part, Room};
use super::rules::{Moment, Steering};
use super::vector::{add_scaled, cross, dot, minus, norm, scaled, turned_at_most, unit};
use super::{Boids, CHUNK, draw, leadership};
#[cfg(target_arch = "x86_64")]
use crate::cpu::Level;
use crate::random::{self, Row};

/// Time constant of the wandering turn rate, seconds. Free choice.
const WANDER_S: f64 = 1.0;
/// Greatest speed in flight, as a multiple of that of the animal (docs/explanation/algorithms.md, "Boids").
const FLIGHT_PACE: f64 = 1.6;
/// Factor on the distance of the farthest neighbor of the previous step, for the first search radius. It
/// affects the speed, not the result. Free choice.
const FARTHER: f64 = 1.03;

/// Values of one step that all boids share.
pub(super) struct Pace<'a> {
    steering: Steering<'a>,
    /// Greatest turn in one step, radians, and its cosine and sine.
    pub(super) turn_rad: f64,
    pub(super) cos_sin: (f64, f64),
    /// Share of the wander that is kept in one step, and standard deviation of what is added, relative to
    /// that of the wander.
    wander: [f64; 2],
    /// Random numbers added to turn rate and slope, by id.
    kicks: [Row; 2],
    reach_bl: f64,
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
        grid.sort(&now.boids, pace.reach_bl);
        next.boids.resize(now.boids.len(), Boid::default());
        next.inners.resize(now.boids.len(), Inner::default());
        let farthest_bl2 = self.all_go_on(next, (&now.inners, grid), &pace);
        self.push_apart(&mut room, farthest_bl2.sqrt());
        let (slots, boids) = (room.grid.slots(), &room.next.boids);
        (&mut self.positions, &mut self.velocities, &mut room.places)
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(position, velocity, place)| {
                *place = slots[*place as usize];
                let boid = &boids[*place as usize];
                (*position, *velocity) = (boid.position, boid.velocity);
            });
        std::mem::swap(&mut room.now, &mut room.next);
        self.room = room;
        self.step_idx += 1;
    }

    /// Copies `positions` and `velocities` to the working state of all boids.
    pub(super) fn swim_from_here(&mut self) {
        for boid in &mut self.room.now.boids {
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
            turn_rad,
            cos_sin: (libm::cos(turn_rad), libm::sin(turn_rad)),
            wander: [keep, (1.0 - keep * keep).sqrt()],
            kicks: [0, 1].map(|k| random::row(self.params.seed, &[draw::WANDER, self.step_idx, k])),
            reach_bl: rules.reach_bl(),
        }
    }

    /// Computes all boids after the step, with the widest vectors of this machine. Returns the squared length
    /// of the longest displacement.
    fn all_go_on(&self, next: &mut Crowd, before: (&[Inner], &Grid), pace: &Pace) -> f64 {
        match self.cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 if is_x86_feature_detected!("avx512f") => {
                by_chunks(next, |first, next, search| {
                    #[expect(unsafe_code, reason = "the same code, compiled for AVX-512 F")]
                    // SAFETY: the match guard found AVX-512 F, which includes AVX2. The callee needs both.
                    unsafe {
                        self.go_on_avx512(first, next, (before, search), pace)
                    }
                })
            }
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                by_chunks(next, |first, next, search| {
                    #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                    // SAFETY: the match guard found AVX2, which is all that the callee needs.
                    unsafe {
                        self.go_on_avx2(first, next, (before, search), pace)
                    }
                })
            }
            _ => by_chunks(next, |first, next, search| {
                self.go_on::<f64>(first, next, (before, search), pace)
            }),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,avx512f")]
    fn go_on_avx512(
        &self,
        first: usize,
        next: Part,
        near: ((&[Inner], &Grid), &mut Search<Eight>),
        pace: &Pace,
    ) -> f64 {
        self.go_on(first, next, near, pace)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn go_on_avx2(
        &self,
        first: usize,
        next: Part,
        near: ((&[Inner], &Grid), &mut Search<Four>),
        pace: &Pace,
    ) -> f64 {
        self.go_on(first, next, near, pace)
    }

    /// Computes the boids from slot `first` on after the step. Returns the squared length of the longest
    /// displacement.
    #[inline(always)]
    fn go_on<L: Lanes>(
        &self,
        first: usize,
        (boids, inners): Part,
        ((now, grid), search): ((&[Inner], &Grid), &mut Search<L>),
        pace: &Pace,
    ) -> f64 {
        let last = first + boids.len() - 1;
        let mut farthest_bl2 = L::splat(0.0);
        let groups = boids.chunks_mut(L::N).zip(inners.chunks_mut(L::N));
        for (group, next) in groups.enumerate() {
            // Lanes without a boid repeat the last one.
            let mut slots = [0; lanes::MOST];
            for lane in 0..L::N {
                slots[lane] = (first + group * L::N + lane).min(last) as u32;
            }
            let way = self.next((&slots, now), next, (grid, search), pace);
            farthest_bl2 = farthest_bl2.max(dot(way, way));
        }
        let squares_bl2 = farthest_bl2.numbers();
        squares_bl2[..L::N].iter().copied().fold(0.0, f64::max)
    }

    /// Computes the boids at `slots` after the step. Returns their displacements, body lengths.
    #[inline(always)]
    fn next<L: Lanes>(
        &self,
        (slots, now): (&[u32; lanes::MOST], &[Inner]),
        (boids, inners): Part,
        (grid, search): (&Grid, &mut Search<L>),
        pace: &Pace,
    ) -> [L; 3] {
        let before = slots.map(|slot| &now[grid.given()[slot as usize] as usize]);
        let ids = slots.map(|slot| grid.at(slot as usize).id);
        let (position, velocity) = L::gather(grid.boids(), slots);
        let limits = (self.params.rules.neighbors as usize, pace.reach_bl);
        let guesses_bl = before.map(|before| FARTHER * before.sight_bl);
        let neighbors = search.nearest((grid, slots), limits, &guesses_bl, self.cpu);
        let inner = self.next_inners((&ids, &before), velocity, neighbors, pace);
        let moment = Moment {
            position,
            velocity,
            neighbors,
            wander: [
                L::from_fn(|lane| inner[lane].wander[0]),
                L::from_fn(|lane| inner[lane].wander[1]),
            ],
            leads: L::mask(|lane| inner[lane].leads_for_s > 0.0),
            noise: self.noise(&ids),
        };
        let wished = self.wished(&moment, (&ids, &before), pace);
        let sideways = cross(splat3(self.tank.up()), velocity);
        let ahead = self.turned_as_filmed(&ids, velocity);
        let turned = turned_at_most(ahead, wished, self.widest_turn(&ids, pace), sideways);
        let next = self.within_limits(turned, position, velocity);
        let way = self.at_filmed_speed(&ids, position, next);
        let place = add_scaled(position, L::splat(self.step_s), way);
        let (place, next) = self.kept_in(place, (velocity, next));
        // A slanted wall may reflect to a steeper slope than the animal swims.
        let next = self.within_limits(next, position, velocity);
        for (lane, boid) in boids.iter_mut().enumerate() {
            *boid = Boid {
                position: in_lane(place, lane),
                velocity: in_lane(next, lane),
                id: ids[lane],
            };
        }
        inners.copy_from_slice(&inner[..inners.len()]);
        minus(place, position)
    }

    /// Returns the inner state of each boid after the step.
    #[inline(always)]
    fn next_inners<L: Lanes>(
        &self,
        (ids, before): (&[u32; lanes::MOST], &[&Inner; lanes::MOST]),
        velocity: [L; 3],
        neighbors: &[Neighbor<L>],
        pace: &Pace,
    ) -> [Inner; lanes::MOST] {
        let nobody = L::splat(f64::INFINITY);
        let last = self.params.rules.neighbors as usize - 1;
        let (nearest, last) = (neighbors.first(), neighbors.get(last));
        let nearest_bl2 = nearest.map_or(nobody, |nearest| nearest.square_bl2);
        let reach_bl2 = L::splat(pace.reach_bl * pace.reach_bl);
        let nearest_bl2 = nearest_bl2.min(reach_bl2).numbers();
        let sight_bl = last.map_or(nobody, |last| last.square_bl2).sqrt().numbers();
        let mut inners = [Inner::default(); lanes::MOST];
        for lane in 0..L::N {
            let before = (ids[lane] as usize, before[lane]);
            inners[lane] = Inner {
                wander: self.next_wander(before, pace),
                leads_for_s: self.next_lead(before, (lane, velocity), neighbors),
                sight_bl: sight_bl[lane],
                nearest_bl2: nearest_bl2[lane],
                is_blocked: false,
            };
        }
        inners
    }

    /// Returns the velocity that each boid wants, body lengths per second.
    #[inline(always)]
    fn wished<L: Lanes>(
        &self,
        moment: &Moment<L>,
        (ids, before): (&[u32; lanes::MOST], &[&Inner; lanes::MOST]),
        pace: &Pace,
    ) -> [L; 3] {
        let velocity = moment.velocity;
        let acceleration = pace.steering.acceleration(moment);
        let mut wished = add_scaled(velocity, L::splat(self.step_s), acceleration);
        let is_blocked = L::mask(|lane| before[lane].is_blocked);
        if L::any(is_blocked) {
            let speed = norm(velocity).max(L::splat(self.calibration.cruise_bl_per_s));
            let turn = speed.copysign(moment.wander[0]);
            let sideways = cross(splat3(self.tank.up()), velocity);
            wished = select3::<L>(is_blocked, scaled(turn, unit(sideways)), wished);
        }
        let Some(meeting) = &self.meeting else {
            return wished;
        };
        let mut wishes = [[0.0; 3]; lanes::MOST];
        for lane in 0..L::N {
            let (position, wished) = (in_lane(moment.position, lane), in_lane(wished, lane));
            wishes[lane] = meeting.wish(ids[lane] as usize, position, wished);
        }
        by_lane(|lane| wishes[lane])
    }

    /// Limits slope and speed to those of the animal. In flight the greatest speed is higher. A velocity near
    /// 0 gets the direction of `before`.
    #[inline(always)]
    pub(super) fn within_limits<L: Lanes>(
        &self,
        mut velocity: [L; 3],
        position: [L; 3],
        before: [L; 3],
    ) -> [L; 3] {
        if let Some(slopes) = &self.calibration.slopes {
            let [level, across] = self.habitat.lens.seen_level(position, velocity);
            let [up, down] = slopes.in_picture.map(|slope| L::splat(slope) * across);
            let seen = velocity[1].clamp(level - up, level + down);
            let pace = norm([velocity[0], L::splat(0.0), velocity[2]]);
            let [up, down] = slopes.limits.map(|slope| L::splat(slope) * pace);
            velocity[1] = seen.clamp(-up, down);
        }
        let [least, most] = self.calibration.speed_limits_bl_per_s;
        let flees = self.habitat.flees(position, self.hunter.as_ref());
        let most = L::select(flees, L::splat(FLIGHT_PACE * most), L::splat(most));
        let speed = norm(velocity);
        let moves = L::splat(1e-9).less(speed);
        let direction = select3::<L>(moves, velocity, before);
        scaled(speed.clamp(L::splat(least), most), unit(direction))
    }

    /// Returns the random error of each course in the zonal model, along each axis.
    #[inline(always)]
    fn noise<L: Lanes>(&self, ids: &[u32; lanes::MOST]) -> [L; 3] {
        let Some(zones) = &self.params.rules.zones else {
            return [L::splat(0.0); 3];
        };
        let n_axes = if self.tank.is_flat() { 2 } else { 3 };
        by_lane(|lane| {
            std::array::from_fn(|axis| {
                let key = [
                    draw::NOISE,
                    u64::from(ids[lane]),
                    self.step_idx,
                    axis as u64,
                ];
                let is_free = f64::from(u8::from(axis < n_axes));
                is_free * zones.noise_rad * random::normal(self.params.seed, &key)
            })
        })
    }

    /// Returns the next values of two Ornstein-Uhlenbeck processes. The first is a turn rate, at weight 1 as
    /// varied as that of the animal. The second is the wanted slope, in standard deviations from the usual
    /// one. A flat tank has no slope.
    fn next_wander(&self, (id, before): (usize, &Inner), pace: &Pace) -> [f64; 2] {
        let [keep, fresh] = pace.wander;
        let next = |k: usize, spread: f64| {
            keep * before.wander[k] + spread * fresh * pace.kicks[k].bell(id as u64)
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

    #[inline(always)]
    fn next_lead<L: Lanes>(
        &self,
        (id, before): (usize, &Inner),
        (lane, velocity): (usize, [L; 3]),
        neighbors: &[Neighbor<L>],
    ) -> f64 {
        let left = before.leads_for_s - self.step_s;
        if left > 0.0 || !self.params.leaders {
            return left.max(0.0);
        }
        let key = [draw::LEAD, id as u64, self.step_idx];
        let scale = (self.params.rules.cohesion_bl, self.step_s);
        let offsets = neighbors.iter().filter_map(|n| n.offset_in(lane));
        let velocity = in_lane(velocity, lane);
        leadership::taken(self.params.seed, key, velocity, offsets, scale).unwrap_or(0.0)
    }
}

/// Calls `work` for each chunk with the index of its first boid. Returns the greatest result.
fn by_chunks<L: Lanes + Send>(
    next: &mut Crowd,
    work: impl Fn(usize, Part, &mut Search<L>) -> f64 + Sync,
) -> f64 {
    let boids = next.boids.par_chunks_mut(CHUNK);
    (boids.zip(next.inners.par_chunks_mut(CHUNK)).enumerate())
        .map_init(Search::default, |search, (chunk, next)| {
            work(chunk * CHUNK, next, search)
        })
        .reduce(|| 0.0, f64::max)
}
