//! Nobody lies upon another: one pass of pushing apart after each step (ALGORITHMS.md 7).
//!
//! Who may overlap is found in the cells that boids had before the step: none has gone farther since than the
//! one that went farthest.

use rayon::prelude::*;

use super::step::{Next, Room};
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
        let moved: Vec<(usize, Vec3, Vec3)> = (0..room.next.len())
            .into_par_iter()
            .fold_chunks(CHUNK, Vec::new, |mut moved, slot| {
                let near = self.too_near(slot, room, farthest_bl);
                if !near.is_empty() {
                    let id = room.grid.by_cell()[slot];
                    let (position, velocity) = self.apart(id, &room.next[slot], &near);
                    moved.push((slot, position, velocity));
                }
                moved
            })
            .flatten_iter()
            .collect();
        for (slot, position, velocity) in moved {
            (room.next[slot].position, room.next[slot].velocity) = (position, velocity);
        }
    }

    /// The others that overlap with whoever stands at `slot`, nearest first, equal distances by id.
    fn too_near(&self, slot: usize, room: &Room, farthest_bl: f64) -> Vec<Near> {
        let place = room.next[slot].position;
        let most_bl2 = self.overlap_bl * self.overlap_bl;
        let mut near = Vec::new();
        for (from, to) in (room.grid).rows(place, self.overlap_bl + farthest_bl) {
            for other in from..to {
                let offset = minus(room.next[other].position, place);
                let square_bl2 = dot(offset, offset);
                if square_bl2 < most_bl2 && other != slot {
                    near.push((square_bl2, room.grid.by_cell()[other], offset));
                }
            }
        }
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(MOST);
        near
    }

    /// Where one goes that others are too near to.
    fn apart(&self, id: u32, next: &Next, near: &[Near]) -> (Vec3, Vec3) {
        let (mut position, mut velocity) = (next.position, next.velocity);
        for &(square_bl2, other, offset) in near {
            let distance = square_bl2.sqrt();
            let away = match distance > 1e-9 {
                true => scaled(-1.0 / distance, offset),
                // In one place: apart along x, by id.
                false => [if id < other { -1.0 } else { 1.0 }, 0.0, 0.0],
            };
            position = add_scaled(position, 0.5 * (self.overlap_bl - distance), away);
        }
        self.habitat.keep_out(&mut position, &mut velocity);
        let along = next.velocity;
        (position, self.within_limits(velocity, position, along))
    }
}
