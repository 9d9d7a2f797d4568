//! Collision avoidance where the end of a loop is led into its beginning
//! (docs/explanation/algorithms.md, "Boids").
//!
//! Two boids that would pass too near to each other move aside, across their relative motion, and then back.
//! Pairs that would have to swim too fast for that are left as they are.

use rayon::prelude::*;

use super::seam::{Snapshot, slope, smooth};
use crate::flock::boids::measures::pairs_within;
use crate::flock::boids::vector::{Vec3, add_scaled, dot, minus, norm, scaled, unit};

/// Times in which a boid moves aside, and in which it comes back, seconds. The shortest is taken that is not
/// too fast to swim. Free choices.
const ASIDE_S: [f64; 3] = [0.8, 1.6, 3.2];
/// Greatest speed while moving aside, as a multiple of the greatest speed seen. Free choice.
const MAX_SPEED_FACTOR: f64 = 1.3;
/// Largest number of passes over all pairs. A boid that moves aside may come too near to others. Free choice.
const N_PASSES: usize = 60;
/// Factor on the distance to keep. It covers the rounding of positions in files.
const DISTANCE_FACTOR: f64 = 1.01;

/// Way around another boid: the share of the displacement at each frame.
struct Detour {
    /// First frame.
    start: usize,
    steps: Vec<DetourStep>,
}

/// One frame of a detour.
#[derive(Clone, Copy)]
struct DetourStep {
    /// Share of the full displacement, 0..=1.
    share: f64,
    /// Change of the share per frame.
    slope: f64,
}

/// A run of frames in which two boids are too near to each other.
struct Encounter {
    ids: [usize; 2],
    /// First and last frame.
    frames: [usize; 2],
}

/// Least distance between boids, greatest speed seen, and frames per second.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) apart_bl: f64,
    pub(super) fastest_bl_per_s: f64,
    pub(super) fps: f64,
}

/// Moves boids apart that are too near, except those that would have to swim too fast for it. `inside`
/// returns the nearest position that a boid may have.
pub(super) fn avoid_encounters(
    snapshots: &mut [Snapshot],
    limits: Limits,
    inside: impl Fn(Vec3) -> Vec3,
) {
    for _ in 0..N_PASSES {
        let mut is_done = true;
        for encounter in encounters(snapshots, limits.apart_bl) {
            let displacement = encounter.displacement(snapshots, limits.apart_bl);
            let n_frames = ASIDE_S.map(|aside_s| ((aside_s * limits.fps).round() as usize).max(1));
            let detours = n_frames.map(|n| encounter.detour(snapshots.len(), n));
            let can_swim =
                |detour: &Detour| encounter.can_swim(detour, snapshots, displacement, limits);
            let Some(detour) = detours.into_iter().find(can_swim) else {
                continue;
            };
            for (step, snapshot) in detour.steps.iter().zip(&mut snapshots[detour.start..]) {
                for (id, side) in encounter.sides() {
                    let place = &mut snapshot.positions[id];
                    *place = inside(add_scaled(*place, side * step.share, displacement));
                    let velocity = &mut snapshot.velocities[id];
                    *velocity = add_scaled(*velocity, side * step.slope * limits.fps, displacement);
                }
                is_done = false;
            }
        }
        if is_done {
            break;
        }
    }
}

/// Returns all encounters, ordered by ids and frames.
fn encounters(snapshots: &[Snapshot], apart_bl: f64) -> Vec<Encounter> {
    let near = |t: usize| {
        let pairs = pairs_within(&snapshots[t].positions, apart_bl);
        pairs.into_iter().map(move |ids| (ids, t))
    };
    let all = (0..snapshots.len()).into_par_iter().flat_map_iter(near);
    let mut near: Vec<([usize; 2], usize)> = all.collect();
    near.sort_unstable();
    let runs = near.chunk_by(|a, b| a.0 == b.0 && a.1 + 1 == b.1);
    let encounter = |run: &[([usize; 2], usize)]| Encounter {
        ids: run[0].0,
        frames: [run[0].1, run[run.len() - 1].1],
    };
    runs.map(encounter).collect()
}

impl Encounter {
    /// Returns the vector to add to the offset from the first to the second boid, so that they pass
    /// `apart_bl` apart.
    fn displacement(&self, snapshots: &[Snapshot], apart_bl: f64) -> Vec3 {
        let [a, b] = self.ids;
        let between = |t: usize| minus(snapshots[t].positions[b], snapshots[t].positions[a]);
        let distance = |&t: &usize| norm(between(t));
        let [first, last] = self.frames;
        let nearest = (first..=last).min_by(|s, t| distance(s).total_cmp(&distance(t)));
        let at = nearest.unwrap_or(first);
        let passing = unit(minus(
            snapshots[at].velocities[b],
            snapshots[at].velocities[a],
        ));
        let between = between(at);
        let across = add_scaled(between, -dot(between, passing), passing);
        let side = match (norm(across) > 1e-6, passing) {
            (true, _) => unit(across),
            // The boids pass straight through each other.
            (_, [x, y, _]) if x != 0.0 || y != 0.0 => unit([-y, x, 0.0]),
            _ => [1.0, 0.0, 0.0],
        };
        let missing_bl = DISTANCE_FACTOR * apart_bl - dot(between, side);
        scaled(missing_bl.max(0.0), side)
    }

    /// Returns both boids with the share of the displacement that each takes.
    fn sides(&self) -> [(usize, f64); 2] {
        [(self.ids[0], -0.5), (self.ids[1], 0.5)]
    }

    /// Returns whether neither boid swims too fast on a detour.
    fn can_swim(
        &self,
        detour: &Detour,
        snapshots: &[Snapshot],
        displacement: Vec3,
        limits: Limits,
    ) -> bool {
        let most = MAX_SPEED_FACTOR * limits.fastest_bl_per_s;
        let mut steps = detour.steps.iter().zip(&snapshots[detour.start..]);
        steps.all(|(step, snapshot)| {
            self.sides().into_iter().all(|(id, side)| {
                let velocity = snapshot.velocities[id];
                let bent = add_scaled(velocity, side * step.slope * limits.fps, displacement);
                norm(bent) <= norm(velocity).max(most)
            })
        })
    }

    /// Returns a detour that moves aside in `n_aside` frames and back in as many, or fewer at the start and
    /// the end of the video. It is empty if the video starts or ends with the encounter.
    fn detour(&self, n_frames: usize, n_aside: usize) -> Detour {
        let [first, last] = self.frames;
        let [before, after] = [first, n_frames - 1 - last].map(|n| n.min(n_aside));
        if before == 0 || after == 0 {
            let steps = Vec::new();
            return Detour {
                start: first,
                steps,
            };
        }
        let step = |k: usize, n: usize, sign: f64| {
            let gone = k as f64 / n as f64;
            DetourStep {
                share: smooth(gone),
                slope: sign * slope(gone) / n as f64,
            }
        };
        let beside = DetourStep {
            share: 1.0,
            slope: 0.0,
        };
        let going = (0..before).map(|k| step(k, before, 1.0));
        let passing = (first..=last).map(|_| beside);
        let coming_back = (0..after).rev().map(|k| step(k, after, -1.0));
        Detour {
            start: first - before,
            steps: going.chain(passing).chain(coming_back).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const FPS: f64 = 30.0;
    const LIMITS: Limits = Limits {
        apart_bl: 0.5,
        fastest_bl_per_s: 9.0,
        fps: FPS,
    };

    /// Straight paths that take 60 frames, with 30 frames of rest before and after.
    fn snapshots(ways: &[[Vec3; 2]]) -> Vec<Snapshot> {
        let snapshot = |t: usize| {
            let gone = (t as f64 - 30.0) / 60.0;
            let speed = if (0.0..1.0).contains(&gone) {
                FPS / 60.0
            } else {
                0.0
            };
            let place =
                |[from, to]: &[Vec3; 2]| add_scaled(*from, gone.clamp(0.0, 1.0), minus(*to, *from));
            Snapshot {
                positions: ways.iter().map(place).collect(),
                velocities: (ways
                    .iter()
                    .map(|[from, to]| scaled(speed, minus(*to, *from))))
                .collect(),
                predator: None,
            }
        };
        (0..120).map(snapshot).collect()
    }

    fn n_too_near(snapshots: &[Snapshot]) -> usize {
        let pairs = |snapshot: &Snapshot| pairs_within(&snapshot.positions, 0.5).len();
        snapshots.iter().map(pairs).sum()
    }

    #[test]
    fn boids_on_a_collision_course_pass_each_other_smoothly() {
        for depth in [0.0, 0.02] {
            let before = snapshots(&[
                [[0.0, 1.0, 0.0], [6.0, 1.0, 0.0]],
                [[6.0, 1.0, depth], [0.0, 1.0, depth]],
            ]);
            let mut film = before.clone();
            assert!(n_too_near(&film) > 4);
            avoid_encounters(&mut film, LIMITS, |place| place);
            assert_eq!(n_too_near(&film), 0);
            for end in [0, 119] {
                assert_eq!(film[end].positions, before[end].positions);
            }
            // Not at the frames at which boids start and stop abruptly.
            for t in (1..120).filter(|t| ![30, 31, 90, 91].contains(t)) {
                for id in 0..2 {
                    let step = minus(film[t].positions[id], film[t - 1].positions[id]);
                    let wanted = scaled(1.0 / FPS, film[t].velocities[id]);
                    assert!(norm(minus(step, wanted)) < 0.006, "{t} {step:?} {wanted:?}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn no_boids_overlap_in_a_tank(
            ways in prop::collection::vec(prop::array::uniform2(prop::array::uniform3(0.0..5.0)), 2..7),
        ) {
            // At both ends the boids are apart, one above the other.
            let apart = |(k, way): (usize, &[Vec3; 2])| way.map(|[x, _, z]| [x, 0.6 * k as f64, z]);
            let mut ways: Vec<[Vec3; 2]> = ways.iter().enumerate().map(apart).collect();
            let n = ways.len();
            for k in 0..n {
                ways[k][1][1] = 0.6 * ((k + 1) % n) as f64;
            }
            let mut film = snapshots(&ways);
            let inside = |place: Vec3| place.map(|x| x.clamp(0.0, 5.0));
            avoid_encounters(&mut film, LIMITS, inside);
            prop_assert_eq!(n_too_near(&film), 0);
            for snapshot in &film {
                prop_assert!(snapshot.positions.iter().all(|&place| place == inside(place)));
            }
        }
    }
}
