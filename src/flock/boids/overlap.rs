//! Overlap resolution (docs/explanation/algorithms.md, "Boids"). After each step, boids nearer than the least
//! distance are pushed apart, and then those that they are pushed onto, until none overlap.
//!
//! Candidates are found in the cells that boids had before the step. The search radius grows by the longest
//! displacement since then.

use rayon::prelude::*;

use super::room::Room;
use super::vector::{Vec3, add_scaled, dot, minus, norm, scaled};
use super::{Boids, CHUNK};

/// Largest number of neighbors that push a boid. Free choice.
const MOST: usize = 16;
/// Largest number of rounds of pushes after one step. In a tank without room they would never end. Free
/// choice.
const ROUNDS: usize = 500;
/// Number of successive rounds without fewer pushed boids than ever before, after which pushes end. Free
/// choice.
const PATIENCE: usize = 150;
/// Factor on the least distance, because a boid between others or at a wall moves only a part of the way in a
/// round. Free choice.
const FARTHER: f64 = 1.01;

/// Share of its displacement by which a boid is pushed back before it turns round. Free choice.
const BLOCKED: f64 = 0.5;

/// A boid that is too near: squared distance, slot, and vector to it.
type Near = (f64, usize, Vec3);

/// Slot of a pushed boid, and its new position and velocity.
type Pushed = (usize, Vec3, Vec3);

impl Boids<'_> {
    /// Moves overlapping pairs apart, each boid by half of the missing distance, until none overlap. No boid
    /// has moved farther than `farthest_bl` since the grid was filled.
    pub(super) fn push_apart(&self, room: &mut Room, mut farthest_bl: f64) {
        // Boids farther apart than this before the step cannot overlap after it.
        let most_bl = (self.overlap_bl + 2.0 * farthest_bl) * (1.0 + 1e-9);
        let everybody = (0..room.next.boids.len()).into_par_iter();
        let may_overlap = |slot: usize| room.next.inners[slot].nearest_bl2 <= most_bl * most_bl;
        let mut pushed = self.pushed(everybody, may_overlap, (room, farthest_bl));
        let (mut least, mut n_in_vain) = (usize::MAX, 0);
        for _ in 1..ROUNDS {
            n_in_vain = if pushed.len() < least {
                0
            } else {
                n_in_vain + 1
            };
            if pushed.is_empty() || n_in_vain == PATIENCE {
                break;
            }
            least = least.min(pushed.len());
            farthest_bl += self.put(room, &pushed);
            let touched = self.touched(&pushed, (room, farthest_bl));
            pushed = self.pushed(touched.into_par_iter(), |_| true, (room, farthest_bl));
        }
        self.put(room, &pushed);
    }

    /// Returns the boids among `slots` that others are too near to, with new positions and velocities.
    fn pushed(
        &self,
        slots: impl IndexedParallelIterator<Item = usize>,
        may_overlap: impl Fn(usize) -> bool + Sync,
        (room, farthest_bl): (&Room, f64),
    ) -> Vec<Pushed> {
        let push = |mut pushed: Vec<Pushed>, slot| {
            if may_overlap(slot) {
                let near = self.too_near(slot, room, farthest_bl);
                if !near.is_empty() {
                    let (position, velocity) = self.apart(slot, &near, room);
                    pushed.push((slot, position, velocity));
                }
            }
            pushed
        };
        let chunks = slots.fold_chunks(CHUNK, Vec::new, push);
        chunks.flatten_iter().collect()
    }

    /// Moves the pushed boids to their new positions. Returns the length of the longest push.
    fn put(&self, room: &mut Room, pushed: &[Pushed]) -> f64 {
        let mut longest_bl = 0.0;
        for &(slot, position, velocity) in pushed {
            let (boid, inner) = (&mut room.next.boids[slot], &mut room.next.inners[slot]);
            let (way, push) = (
                scaled(self.step_s, boid.velocity),
                minus(position, boid.position),
            );
            inner.is_blocked |= dot(push, way) < -BLOCKED * dot(way, way);
            longest_bl = f64::max(longest_bl, norm(push));
            (boid.position, boid.velocity) = (position, velocity);
        }
        longest_bl
    }

    /// Returns the slots of pushed boids that still overlap, and of the boids that they overlap with.
    fn touched(&self, pushed: &[Pushed], (room, farthest_bl): (&Room, f64)) -> Vec<usize> {
        let around = |&(slot, ..): &Pushed| {
            let near = self.too_near(slot, room, farthest_bl);
            let itself = (!near.is_empty()).then_some(slot);
            let others = near.into_iter().map(|(_, other, _)| other);
            others.chain(itself)
        };
        let mut touched: Vec<usize> = pushed.par_iter().flat_map_iter(around).collect();
        touched.par_sort_unstable();
        touched.dedup();
        touched
    }

    /// Returns the boids that overlap with the one at `slot`: the nearest first, equal distances by id, at
    /// most `MOST`.
    fn too_near(&self, slot: usize, room: &Room, farthest_bl: f64) -> Vec<Near> {
        let boids = &room.next.boids;
        let place = boids[slot].position;
        let most_bl2 = self.overlap_bl * self.overlap_bl;
        let mut near = Vec::new();
        for (from, to) in (room.grid).rows(place, self.overlap_bl + farthest_bl) {
            for other in from..to {
                let offset = minus(boids[other].position, place);
                let square_bl2 = dot(offset, offset);
                if square_bl2 < most_bl2 && other != slot {
                    near.push((square_bl2, other, offset));
                }
            }
        }
        near.sort_unstable_by(|a, b| {
            let by_id = boids[a.1].id.cmp(&boids[b.1].id);
            a.0.total_cmp(&b.0).then(by_id)
        });
        near.truncate(MOST);
        near
    }

    /// Returns the new position and velocity of a boid that others are too near to.
    fn apart(&self, slot: usize, near: &[Near], room: &Room) -> (Vec3, Vec3) {
        let boid = &room.next.boids[slot];
        let (mut position, mut reflected) = (boid.position, boid.velocity);
        for &(square_bl2, other, offset) in near {
            let distance = square_bl2.sqrt();
            let away = match distance > 1e-9 {
                true => scaled(-1.0 / distance, offset),
                // At the same position: apart along x, by id.
                false => [
                    if boid.id < room.next.boids[other].id {
                        -1.0
                    } else {
                        1.0
                    },
                    0.0,
                    0.0,
                ],
            };
            let missing_bl = FARTHER * self.overlap_bl - distance;
            position = add_scaled(position, 0.5 * missing_bl, away);
        }
        self.habitat.keep_out(&mut position, &mut reflected);
        let velocity = match reflected == boid.velocity {
            true => boid.velocity,
            false => self.turned(room.grid.at(slot).velocity, reflected),
        };
        (
            position,
            self.within_limits(velocity, position, boid.velocity),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::Params;
    use crate::flock::boids::calibration::Calibration;
    use crate::flock::boids::tank::Tank;
    use crate::flock::boids::vector::norm;
    use crate::flock::lens::Lens;
    use crate::parameters::Parameters;

    #[test]
    fn two_that_only_meet_in_the_step_are_pushed_apart() {
        let params = Params {
            count: Some(2),
            leaders: false,
            ..Params::default()
        };
        let calibration = Calibration {
            cruise_bl_per_s: 1.5,
            speed_limits_bl_per_s: [1.5, 1.5],
            turn_rad_per_s: 0.5,
            ..Calibration::default()
        };
        let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], [12.0, 9.0, 0.0]));
        let mut boids = Boids::at_random(&params, &calibration, (&lens, &tank), 30.0);
        let positions = vec![[5.0, 4.0, 0.0], [5.59, 4.0, 0.0]];
        let velocities = vec![[1.5, 0.0, 0.0], [-1.5, 0.0, 0.0]];
        boids.show(positions, velocities, None);
        boids.advance();
        let apart_bl = norm(minus(boids.positions()[1], boids.positions()[0]));
        assert!(
            (apart_bl - FARTHER * boids.overlap_bl).abs() < 1e-9,
            "{apart_bl}"
        );
    }

    /// Returns the share of boids and seconds in which a boid gets no farther than 0.15 of its path.
    fn jammed(preset: &str, seed: u64) -> f64 {
        let params = Params {
            count: Some(12),
            seed,
            ..Params::preset(preset).expect("a known preset")
        };
        let calibration = Calibration {
            cruise_bl_per_s: 0.5,
            speed_limits_bl_per_s: [0.25, 1.0],
            wander_rad_per_s: 1.0,
            ..Calibration::default()
        };
        let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], [4.0, 3.0, 0.0]));
        let mut boids = Boids::new(&params, &calibration, (&lens, &tank), 30.0);
        let (mut jams, n_seconds) = (0, 20);
        for _ in 0..n_seconds {
            let from = boids.positions().to_vec();
            let (mut ways, mut farthest) = (vec![0.0; from.len()], vec![0.0; from.len()]);
            for _ in 0..30 {
                boids.advance();
                for id in 0..from.len() {
                    ways[id] += norm(boids.velocities()[id]) / 30.0;
                    farthest[id] =
                        f64::max(farthest[id], norm(minus(boids.positions()[id], from[id])));
                }
            }
            jams += (ways.iter().zip(&farthest))
                .filter(|&(way, far)| *far < 0.15 * way)
                .count();
        }
        f64::from(jams as u32) / f64::from(n_seconds * params.most_individuals())
    }

    #[test]
    fn nobody_pushes_others_forever() {
        for preset in ["school", "swarm", "mill"] {
            let jams: f64 = (1..=20).map(|seed| jammed(preset, seed)).sum();
            // Measured for a school over sixty seeds: 0.016 on average; 0.19 if boids do not turn round.
            assert!(jams / 20.0 < 0.025, "{preset} {}", jams / 20.0);
        }
    }
}
