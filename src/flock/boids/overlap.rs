//! Nobody lies upon another: one pass of pushing apart after each step (ALGORITHMS.md 7).
//!
//! Who may overlap is found in the cells that boids had before the step: none has gone farther since than the
//! one that went farthest.

use rayon::prelude::*;

use super::grid::Boid;
use super::room::Room;
use super::vector::{Vec3, add_scaled, dot, minus, scaled};
use super::{Boids, CHUNK};

/// At most so many push one.
const MOST: usize = 16;

/// Somebody too near: the square of the distance, its number, and the way to it.
type Near = (f64, u32, Vec3);

impl Boids<'_> {
    /// One relaxation: each pair that overlaps moves apart by half of what is missing. Nobody has moved farther
    /// than `farthest_bl` since the cells were filled.
    pub(super) fn push_apart(&self, room: &mut Room, farthest_bl: f64) {
        // Who was farther off from all than two come nearer in a step overlaps with nobody.
        let most_bl = (self.overlap_bl + 2.0 * farthest_bl) * (1.0 + 1e-9);
        let moved: Vec<(usize, Vec3, Vec3)> = (0..room.next.boids.len())
            .into_par_iter()
            .fold_chunks(CHUNK, Vec::new, |mut moved, slot| {
                if room.next.inners[slot].nearest_bl2 > most_bl * most_bl {
                    return moved;
                }
                let near = self.too_near(slot, room, farthest_bl);
                if !near.is_empty() {
                    let (position, velocity) = self.apart(&room.next.boids[slot], &near);
                    moved.push((slot, position, velocity));
                }
                moved
            })
            .flatten_iter()
            .collect();
        for (slot, position, velocity) in moved {
            let (boid, inner) = (&mut room.next.boids[slot], &mut room.next.inners[slot]);
            let (way, pushed) = (
                scaled(self.step_s, boid.velocity),
                minus(position, boid.position),
            );
            inner.is_blocked = dot(pushed, way) < -0.5 * dot(way, way);
            (boid.position, boid.velocity) = (position, velocity);
        }
    }

    /// The others that overlap with whoever stands at `slot`, nearest first, equal distances by id.
    fn too_near(&self, slot: usize, room: &Room, farthest_bl: f64) -> Vec<Near> {
        let place = room.next.boids[slot].position;
        let most_bl2 = self.overlap_bl * self.overlap_bl;
        let mut near = Vec::new();
        for (from, to) in (room.grid).rows(place, self.overlap_bl + farthest_bl) {
            for other in from..to {
                let boid = &room.next.boids[other];
                let offset = minus(boid.position, place);
                let square_bl2 = dot(offset, offset);
                if square_bl2 < most_bl2 && other != slot {
                    near.push((square_bl2, boid.id, offset));
                }
            }
        }
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(MOST);
        near
    }

    /// Where one goes that others are too near to.
    fn apart(&self, boid: &Boid, near: &[Near]) -> (Vec3, Vec3) {
        let (mut position, mut velocity) = (boid.position, boid.velocity);
        for &(square_bl2, other, offset) in near {
            let distance = square_bl2.sqrt();
            let away = match distance > 1e-9 {
                true => scaled(-1.0 / distance, offset),
                // In one place: apart along x, by id.
                false => [if boid.id < other { -1.0 } else { 1.0 }, 0.0, 0.0],
            };
            position = add_scaled(position, 0.5 * (self.overlap_bl - distance), away);
        }
        self.habitat.keep_out(&mut position, &mut velocity);
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

    #[test]
    fn two_that_only_meet_in_the_step_are_pushed_apart() {
        let params = Params {
            count: 2,
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
        assert!((apart_bl - boids.overlap_bl).abs() < 1e-9, "{apart_bl}");
    }

    /// The share of boids and seconds in which one never gets 0.15 of its way from where it was.
    fn jammed(preset: &str, seed: u64) -> f64 {
        let params = Params {
            count: 12,
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
        f64::from(jams as u32) / f64::from(n_seconds * params.count)
    }

    #[test]
    fn nobody_pushes_others_forever() {
        for preset in ["school", "swarm", "mill"] {
            let jams: f64 = (1..=6).map(|seed| jammed(preset, seed)).sum();
            assert!(jams / 6.0 < 0.015, "{preset} {}", jams / 6.0);
        }
    }
}
