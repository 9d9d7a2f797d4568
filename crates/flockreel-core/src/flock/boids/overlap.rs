//! Overlap resolution (docs/explanation/algorithms.md, "Boids"). After each step, boids nearer than the least
//! distance are pushed apart, and then those that they are pushed onto, until none overlap.
//!
//! Candidates are found in the cells that boids had before the step. The search radius grows by the longest
//! displacement since then.

use rayon::prelude::*;

use super::vector::{Vec3, add_scaled, dot, minus, norm, scaled};
use super::workspace::Workspace;
use super::{Boids, CHUNK};

/// Largest number of neighbors that push a boid. Free choice.
const MAX_PUSHING: usize = 16;
/// Largest number of rounds of pushes after one step. In a full tank they would never end. Free choice.
const MAX_ROUNDS: usize = 500;
/// Number of successive rounds without fewer pushed boids than ever before, after which pushes end. Free
/// choice.
const MAX_ROUNDS_WITHOUT_PROGRESS: usize = 150;
/// Factor on the least distance, because a boid between others or at a wall moves only a part of the way in a
/// round. Free choice.
const DISTANCE_FACTOR: f64 = 1.01;

/// Share of its displacement by which a boid is pushed back before it turns round. Free choice.
const BLOCKED_SHARE: f64 = 0.5;

/// A boid that is too near to another one.
struct Overlap {
    square_bl2: f64,
    slot: usize,
    /// Vector to it.
    offset: Vec3,
}

/// New position and velocity of a pushed boid.
struct Push {
    slot: usize,
    position: Vec3,
    velocity: Vec3,
}

impl Boids<'_> {
    /// Moves overlapping pairs apart, each boid by half of the missing distance, until none overlap. No boid
    /// has moved farther than `farthest_bl` since the grid was filled.
    pub(super) fn push_apart(&self, workspace: &mut Workspace, mut farthest_bl: f64) {
        // Boids farther apart than this before the step cannot overlap after it.
        let most_bl = (self.overlap_bl + 2.0 * farthest_bl) * (1.0 + 1e-9);
        let internals = &workspace.next.internals;
        let may_overlap = |&slot: &usize| internals[slot].nearest_bl2 <= most_bl * most_bl;
        let all = (0..internals.len()).into_par_iter().with_min_len(CHUNK);
        let slots: Vec<usize> = all.filter(may_overlap).collect();
        let mut pushes = self.pushes(&slots, workspace, farthest_bl);
        let (mut fewest, mut n_without_progress) = (usize::MAX, 0);
        for _ in 1..MAX_ROUNDS {
            n_without_progress = if pushes.len() < fewest {
                0
            } else {
                n_without_progress + 1
            };
            if pushes.is_empty() || n_without_progress == MAX_ROUNDS_WITHOUT_PROGRESS {
                break;
            }
            fewest = fewest.min(pushes.len());
            farthest_bl += self.apply(&pushes, workspace);
            let slots = self.still_overlapping(&pushes, workspace, farthest_bl);
            pushes = self.pushes(&slots, workspace, farthest_bl);
        }
        self.apply(&pushes, workspace);
    }

    /// Returns the pushes of those boids among `slots` that others are too near to.
    fn pushes(&self, slots: &[usize], workspace: &Workspace, farthest_bl: f64) -> Vec<Push> {
        let push = |&slot: &usize| {
            let overlaps = self.overlaps(slot, workspace, farthest_bl);
            (!overlaps.is_empty()).then(|| self.push(slot, &overlaps, workspace))
        };
        let slots = slots.par_iter().with_min_len(CHUNK);
        slots.filter_map(push).collect()
    }

    /// Moves the pushed boids to their new positions. Returns the length of the longest push.
    fn apply(&self, pushes: &[Push], workspace: &mut Workspace) -> f64 {
        let next = &mut workspace.next;
        let mut longest_bl = 0.0;
        for push in pushes {
            let boid = &mut next.boids[push.slot];
            let displacement = scaled(self.step_s, boid.velocity);
            let pushed = minus(push.position, boid.position);
            let square_bl2 = dot(displacement, displacement);
            let is_blocked = dot(pushed, displacement) < -BLOCKED_SHARE * square_bl2;
            next.internals[push.slot].is_blocked |= is_blocked;
            longest_bl = f64::max(longest_bl, norm(pushed));
            (boid.position, boid.velocity) = (push.position, push.velocity);
        }
        longest_bl
    }

    /// Returns the slots of pushed boids that still overlap, and of the boids that they overlap with.
    fn still_overlapping(
        &self,
        pushes: &[Push],
        workspace: &Workspace,
        farthest_bl: f64,
    ) -> Vec<usize> {
        let around = |push: &Push| {
            let overlaps = self.overlaps(push.slot, workspace, farthest_bl);
            let itself = (!overlaps.is_empty()).then_some(push.slot);
            let others = overlaps.into_iter().map(|overlap| overlap.slot);
            others.chain(itself)
        };
        let mut slots: Vec<usize> = pushes.par_iter().flat_map_iter(around).collect();
        slots.par_sort_unstable();
        slots.dedup();
        slots
    }

    /// Returns the boids that overlap with the one at `slot`: the nearest first, equal distances by id, at
    /// most `MAX_PUSHING`.
    fn overlaps(&self, slot: usize, workspace: &Workspace, farthest_bl: f64) -> Vec<Overlap> {
        let boids = &workspace.next.boids;
        let position = boids[slot].position;
        let overlap_bl2 = self.overlap_bl * self.overlap_bl;
        let mut overlaps = Vec::new();
        let radius_bl = self.overlap_bl + farthest_bl;
        workspace.grid.for_each_row(position, radius_bl, |slots| {
            for other in slots {
                let offset = minus(boids[other].position, position);
                let square_bl2 = dot(offset, offset);
                if square_bl2 < overlap_bl2 && other != slot {
                    overlaps.push(Overlap {
                        square_bl2,
                        slot: other,
                        offset,
                    });
                }
            }
        });
        overlaps.sort_unstable_by(|a, b| {
            let by_id = boids[a.slot].id.cmp(&boids[b.slot].id);
            a.square_bl2.total_cmp(&b.square_bl2).then(by_id)
        });
        overlaps.truncate(MAX_PUSHING);
        overlaps
    }

    /// Returns the push of a boid away from those that are too near.
    fn push(&self, slot: usize, overlaps: &[Overlap], workspace: &Workspace) -> Push {
        let boids = &workspace.next.boids;
        let boid = &boids[slot];
        let (mut position, mut reflected) = (boid.position, boid.velocity);
        for overlap in overlaps {
            let distance_bl = overlap.square_bl2.sqrt();
            let away = if distance_bl > 1e-9 {
                scaled(-1.0 / distance_bl, overlap.offset)
            } else {
                // At the same position: apart along x, by id.
                let is_first = boid.id < boids[overlap.slot].id;
                [if is_first { -1.0 } else { 1.0 }, 0.0, 0.0]
            };
            let missing_bl = DISTANCE_FACTOR * self.overlap_bl - distance_bl;
            position = add_scaled(position, 0.5 * missing_bl, away);
        }
        self.habitat.confine(&mut position, &mut reflected);
        let velocity = if reflected == boid.velocity {
            boid.velocity
        } else {
            self.turned_toward(workspace.grid.at(slot).velocity, reflected)
        };
        Push {
            slot,
            position,
            velocity: self.within_limits(velocity, position, boid.velocity),
        }
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
    fn boids_that_meet_within_a_step_are_pushed_apart() {
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
        let mut boids = Boids::at_random(&params, &calibration, &lens, &tank, 30.0);
        let positions = vec![[5.0, 4.0, 0.0], [5.59, 4.0, 0.0]];
        let velocities = vec![[1.5, 0.0, 0.0], [-1.5, 0.0, 0.0]];
        boids.set_states(positions, velocities, None);
        boids.advance();
        let apart_bl = norm(minus(boids.positions()[1], boids.positions()[0]));
        let wanted_bl = DISTANCE_FACTOR * boids.overlap_bl;
        assert!((apart_bl - wanted_bl).abs() < 1e-9, "{apart_bl}");
    }

    /// Returns the share of boids and seconds in which a boid gets no farther than 0.15 of its path.
    fn jammed_share(preset: &str, seed: u64) -> f64 {
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
        let mut boids = Boids::new(&params, &calibration, &lens, &tank, 30.0);
        let (mut jams, n_seconds) = (0, 20);
        for _ in 0..n_seconds {
            let from = boids.positions().to_vec();
            let (mut paths, mut farthest) = (vec![0.0; from.len()], vec![0.0; from.len()]);
            for _ in 0..30 {
                boids.advance();
                for id in 0..from.len() {
                    paths[id] += norm(boids.velocities()[id]) / 30.0;
                    let off = norm(minus(boids.positions()[id], from[id]));
                    farthest[id] = f64::max(farthest[id], off);
                }
            }
            let is_jammed = |&(path, far): &(&f64, &f64)| *far < 0.15 * path;
            jams += paths.iter().zip(&farthest).filter(is_jammed).count();
        }
        f64::from(jams as u32) / f64::from(n_seconds * params.most_individuals())
    }

    #[test]
    fn boids_do_not_jam() {
        for preset in ["school", "swarm", "mill"] {
            let jams: f64 = (1..=20).map(|seed| jammed_share(preset, seed)).sum();
            // Measured for a school over sixty seeds: 0.016 on average; 0.19 if boids do not turn round.
            assert!(jams / 20.0 < 0.025, "{preset} {}", jams / 20.0);
        }
    }
}
