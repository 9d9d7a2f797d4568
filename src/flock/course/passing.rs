//! Collision avoidance where the end of a loop is led into its beginning
//! (docs/explanation/algorithms.md, "Boids").
//!
//! Two boids that would pass too near to each other move aside, across their relative motion, and then back.
//! Pairs that would have to swim too fast for that are left as they are.

use rayon::prelude::*;

use super::seam::{Moment, slope, smooth};
use crate::flock::boids::measures::pairs_within;
use crate::flock::boids::vector::{Vec3, add_scaled, dot, minus, norm, scaled, unit};

/// Times in which a boid moves aside, and in which it comes back, seconds. The shortest is taken that is not
/// too fast to swim. Free choices.
const ASIDE_S: [f64; 3] = [0.8, 1.6, 3.2];
/// Greatest speed while moving aside, as a multiple of the greatest speed seen. Free choice.
const HASTE: f64 = 1.3;
/// Largest number of passes over all pairs. A boid that moves aside may come too near to others. Free choice.
const N_PASSES: usize = 60;
/// Factor on the distance to keep. It covers the rounding of positions in files.
const FARTHER: f64 = 1.01;

/// First frame of an avoidance, and by frame the share of the full displacement, 0..=1, and its change per
/// frame.
type Course = (usize, Vec<(f64, f64)>);

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
pub(super) fn go_aside(moments: &mut [Moment], limits: Limits, inside: impl Fn(Vec3) -> Vec3) {
    for _ in 0..N_PASSES {
        let mut is_done = true;
        for encounter in encounters(moments, limits.apart_bl) {
            let aside = encounter.aside(moments, limits.apart_bl);
            let ways = ASIDE_S.map(|aside_s| ((aside_s * limits.fps).round() as usize).max(1));
            let mut courses = ways.map(|n| encounter.course(moments.len(), n)).into_iter();
            let can_be_swum = |course: &Course| encounter.can_swim(course, moments, aside, limits);
            let Some((start, course)) = courses.find(can_be_swum) else {
                continue;
            };
            for ((share, slope), moment) in course.into_iter().zip(&mut moments[start..]) {
                for (id, side) in encounter.sides() {
                    let (place, velocity) = (&mut moment.positions[id], &mut moment.velocities[id]);
                    *place = inside(add_scaled(*place, side * share, aside));
                    *velocity = add_scaled(*velocity, side * slope * limits.fps, aside);
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
fn encounters(moments: &[Moment], apart_bl: f64) -> Vec<Encounter> {
    let near = |t: usize| {
        let pairs = pairs_within(&moments[t].positions, apart_bl);
        pairs.into_iter().map(move |ids| (ids, t))
    };
    let all = (0..moments.len()).into_par_iter().flat_map_iter(near);
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
    fn aside(&self, moments: &[Moment], apart_bl: f64) -> Vec3 {
        let [a, b] = self.ids;
        let between = |t: usize| minus(moments[t].positions[b], moments[t].positions[a]);
        let distance = |&t: &usize| norm(between(t));
        let [first, last] = self.frames;
        let nearest = (first..=last).min_by(|s, t| distance(s).total_cmp(&distance(t)));
        let at = nearest.unwrap_or(first);
        let passing = unit(minus(moments[at].velocities[b], moments[at].velocities[a]));
        let between = between(at);
        let across = add_scaled(between, -dot(between, passing), passing);
        let side = match (norm(across) > 1e-6, passing) {
            (true, _) => unit(across),
            // The boids pass straight through each other.
            (_, [x, y, _]) if x != 0.0 || y != 0.0 => unit([-y, x, 0.0]),
            _ => [1.0, 0.0, 0.0],
        };
        let missing_bl = FARTHER * apart_bl - dot(between, side);
        scaled(missing_bl.max(0.0), side)
    }

    /// Returns both boids with the share of the displacement that each takes.
    fn sides(&self) -> [(usize, f64); 2] {
        [(self.ids[0], -0.5), (self.ids[1], 0.5)]
    }

    /// Returns whether neither boid swims too fast on a course with the displacement `aside`.
    fn can_swim(
        &self,
        (start, course): &Course,
        moments: &[Moment],
        aside: Vec3,
        limits: Limits,
    ) -> bool {
        let most = HASTE * limits.fastest_bl_per_s;
        course
            .iter()
            .zip(&moments[*start..])
            .all(|((_, slope), moment)| {
                self.sides().into_iter().all(|(id, side)| {
                    let velocity = moment.velocities[id];
                    let bent = add_scaled(velocity, side * slope * limits.fps, aside);
                    norm(bent) <= norm(velocity).max(most)
                })
            })
    }

    /// Returns a course that moves aside in `n_aside` frames and back in as many, or fewer at the start and
    /// the end of the video. The course is empty if the video starts or ends with the encounter.
    fn course(&self, n_frames: usize, n_aside: usize) -> Course {
        let [first, last] = self.frames;
        let [before, after] = [first, n_frames - 1 - last].map(|n| n.min(n_aside));
        if before == 0 || after == 0 {
            return (first, Vec::new());
        }
        let share = |k: usize, n: usize, sign: f64| {
            let gone = k as f64 / n as f64;
            (smooth(gone), sign * slope(gone) / n as f64)
        };
        let going = (0..before).map(|k| share(k, before, 1.0));
        let passing = (first..=last).map(|_| (1.0, 0.0));
        let coming_back = (0..after).rev().map(|k| share(k, after, -1.0));
        (
            first - before,
            going.chain(passing).chain(coming_back).collect(),
        )
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
    fn moments(ways: &[[Vec3; 2]]) -> Vec<Moment> {
        let moment = |t: usize| {
            let gone = (t as f64 - 30.0) / 60.0;
            let speed = if (0.0..1.0).contains(&gone) {
                FPS / 60.0
            } else {
                0.0
            };
            let place =
                |[from, to]: &[Vec3; 2]| add_scaled(*from, gone.clamp(0.0, 1.0), minus(*to, *from));
            Moment {
                positions: ways.iter().map(place).collect(),
                velocities: (ways
                    .iter()
                    .map(|[from, to]| scaled(speed, minus(*to, *from))))
                .collect(),
                hunter: None,
            }
        };
        (0..120).map(moment).collect()
    }

    fn n_too_near(moments: &[Moment]) -> usize {
        let pairs = |moment: &Moment| pairs_within(&moment.positions, 0.5).len();
        moments.iter().map(pairs).sum()
    }

    #[test]
    fn two_that_swim_straight_through_each_other_pass_by_smoothly() {
        for depth in [0.0, 0.02] {
            let before = moments(&[
                [[0.0, 1.0, 0.0], [6.0, 1.0, 0.0]],
                [[6.0, 1.0, depth], [0.0, 1.0, depth]],
            ]);
            let mut film = before.clone();
            assert!(n_too_near(&film) > 4);
            go_aside(&mut film, LIMITS, |place| place);
            assert_eq!(n_too_near(&film), 0);
            for end in [0, 119] {
                assert_eq!(film[end].positions, before[end].positions);
            }
            // Not at the frames at which boids start and stop abruptly.
            for t in (1..120).filter(|t| ![30, 31, 90, 91].contains(t)) {
                for id in 0..2 {
                    let step = minus(film[t].positions[id], film[t - 1].positions[id]);
                    let told = scaled(1.0 / FPS, film[t].velocities[id]);
                    assert!(norm(minus(step, told)) < 0.006, "{t} {step:?} {told:?}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn nobody_passes_through_anybody_in_a_tank(
            ways in prop::collection::vec(prop::array::uniform2(prop::array::uniform3(0.0..5.0)), 2..7),
        ) {
            // At both ends the boids are apart, one above the other.
            let apart = |(k, way): (usize, &[Vec3; 2])| way.map(|[x, _, z]| [x, 0.6 * k as f64, z]);
            let mut ways: Vec<[Vec3; 2]> = ways.iter().enumerate().map(apart).collect();
            let n = ways.len();
            for k in 0..n {
                ways[k][1][1] = 0.6 * ((k + 1) % n) as f64;
            }
            let mut film = moments(&ways);
            let inside = |place: Vec3| place.map(|x| x.clamp(0.0, 5.0));
            go_aside(&mut film, LIMITS, inside);
            prop_assert_eq!(n_too_near(&film), 0);
            for moment in &film {
                prop_assert!(moment.positions.iter().all(|&place| place == inside(place)));
            }
        }
    }
}
