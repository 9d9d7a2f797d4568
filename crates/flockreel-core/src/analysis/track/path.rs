//! Chooses the animal's path: at most one candidate per frame, for the whole film at once.
//!
//! Dynamic programming finds the cheapest path. A candidate costs half its misfit to the subject. A leap to
//! a thing that was seen elsewhere at the same time costs much. A frame without the animal has a fixed cost.
//! A hand, a speck or half a silhouette is thus chosen only where no candidate fits better.

use super::confidence;
use super::sighting::Sighting;
use crate::analysis::params::Follow;
use crate::analysis::subject::{FITS, Look, Subject};
use crate::order;

/// Cost from which a look is never a candidate. Free choice.
pub(super) const MAX_COST: f64 = 24.0;
/// Cost of a frame without the animal. Free choice.
const ABSENCE_COST: f64 = 10.0;
/// A step is a leap beyond this many spreads of the distance. Free choice.
const LEAP_SPREADS: f64 = 2.0;
/// A leap ends at another thing if a thing seen at its start was nearer to its end by this factor. Free choice.
const NEARER_FACTOR: f64 = 3.0;
/// Cost of a leap to a thing that was visible together with the start of the leap. Free choice.
const LEAP_COST: f64 = 400.0;
/// Standard deviation of the change of log area between successive frames. Free choice.
const AREA_CHANGE_SPREAD: f64 = 0.3;
/// Reward of a candidate that the user pointed at; it exceeds the sum of all other costs.
const PIN_REWARD: f64 = 1e9;
/// Greatest number of frames that a step spans; after a longer gap the animal may be anywhere. Free choice.
const MAX_MISSED_FRAMES: usize = 30;

/// A component that may be the animal in a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    /// Its size, color and place.
    pub(super) look: Look,
    /// Its misfit to the subject: see `Subject::cost`.
    pub(super) cost: f64,
    /// Its matte, measured.
    pub(super) sighting: Sighting,
}

/// Chooses a candidate, or none, for each frame, with the probability that it is the animal.
///
/// With `Follow::Largest`, a candidate also costs the logarithm of its size ratio to the largest fitting one.
/// `pin` is a frame and the index of its candidate that is known to be the animal.
pub(super) fn choose(
    frames: &[&[Candidate]],
    subject: &Subject,
    follow: Follow,
    pin: Option<(usize, usize)>,
) -> Vec<Option<(usize, f64)>> {
    let mut paths = Paths {
        frames,
        motion: Motion::new(frames, subject),
        best: Vec::with_capacity(frames.len()),
        forgotten: Path {
            cost: 0.0,
            from: None,
        },
    };
    for (t, candidates) in frames.iter().enumerate() {
        paths.update_forgotten(t);
        let fitting = candidates.iter().filter(|c| c.cost < FITS);
        let largest_px = fitting.map(|c| c.look.area_px).fold(0.0, f64::max);
        let smaller = |candidate: &Candidate| match follow {
            Follow::One => 0.0,
            Follow::Largest => libm::log(largest_px / candidate.look.area_px).max(0.0),
        };
        let path_to = |(at, candidate): (usize, &Candidate)| {
            let mut path = paths.cheapest_to(t, candidate);
            path.cost += 0.5 * candidate.cost + smaller(candidate);
            if pin == Some((t, at)) {
                path.cost -= PIN_REWARD;
            }
            path
        };
        let best = candidates.iter().enumerate().map(path_to).collect();
        paths.best.push(best);
    }
    judge_stretches(&paths.cheapest(), frames, &paths.motion)
}

/// A candidate: its frame and its index in the frame.
type Node = (usize, usize);

/// The cheapest path that ends at a candidate.
#[derive(Clone, Copy)]
struct Path {
    cost: f64,
    /// The previous candidate of the path; `None` at its start.
    from: Option<Node>,
}

/// The cheapest paths to all candidates of the frames processed.
struct Paths<'a> {
    frames: &'a [&'a [Candidate]],
    motion: Motion,
    best: Vec<Vec<Path>>,
    /// The cheapest path that ended too long ago for a step, or the empty path.
    ///
    /// Its cost is relative to missing the animal in all frames up to its end. Later frames are not included.
    forgotten: Path,
}

impl Paths<'_> {
    /// Updates `forgotten` with the paths that end just too far before frame `t` for a step.
    fn update_forgotten(&mut self, t: usize) {
        let Some(old) = t.checked_sub(MAX_MISSED_FRAMES + 1) else {
            return;
        };
        for (at, path) in self.best[old].iter().enumerate() {
            // Subtracts the cost of missing all frames up to the end, to compare ends at different frames.
            let cost = path.cost - ABSENCE_COST * (old + 1) as f64;
            if cost < self.forgotten.cost {
                let from = Some((old, at));
                self.forgotten = Path { cost, from };
            }
        }
    }

    /// Returns the cheapest path to a candidate of frame `t`, without the candidate's own cost.
    fn cheapest_to(&self, t: usize, candidate: &Candidate) -> Path {
        let mut best = Path {
            cost: self.forgotten.cost + ABSENCE_COST * t as f64,
            ..self.forgotten
        };
        for before in t.saturating_sub(MAX_MISSED_FRAMES)..t {
            let n_missed = t - before - 1;
            for (at, previous) in self.frames[before].iter().enumerate() {
                let beside = self.frames[before].iter().enumerate();
                let others = beside.filter(|(k, _)| *k != at).map(|(_, o)| &o.look);
                let cost = self.best[before][at].cost
                    + ABSENCE_COST * n_missed as f64
                    + self
                        .motion
                        .leap_cost(&previous.look, &candidate.look, others);
                if cost < best.cost {
                    let from = Some((before, at));
                    best = Path { cost, from };
                }
            }
        }
        best
    }

    /// Returns the candidates of the cheapest path over all frames.
    fn cheapest(&self) -> Vec<Option<usize>> {
        let n = self.frames.len();
        let ends = self.best.iter().enumerate().flat_map(|(t, paths)| {
            let with_rest = move |(at, path): (usize, &Path)| {
                (path.cost + ABSENCE_COST * (n - 1 - t) as f64, (t, at))
            };
            paths.iter().enumerate().map(with_rest)
        });
        let mut node = ends
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(cost, _)| *cost < ABSENCE_COST * n as f64)
            .map(|(_, node)| node);
        let mut chosen = vec![None; n];
        while let Some((t, at)) = node {
            chosen[t] = Some(at);
            node = self.best[t][at].from;
        }
        chosen
    }
}

/// Returns for each frame the candidate of the path and the probability that it is the animal.
///
/// The path is divided at gaps, leaps and sudden changes of area, so that each stretch shows one thing. The
/// probability follows from the stretch's median misfit: near the lens, in the dark or at the border, an
/// animal differs from its usual look for a while. A stretch that is probably wrong is dropped.
fn judge_stretches(
    chosen: &[Option<usize>],
    frames: &[&[Candidate]],
    motion: &Motion,
) -> Vec<Option<(usize, f64)>> {
    let candidate = |t: usize| chosen[t].map(|at| &frames[t][at]);
    let is_end = |&t: &usize| {
        let before = t.checked_sub(1).and_then(candidate);
        let pair = before.zip(candidate(t));
        pair.is_none_or(|(a, b)| motion.is_break(&a.look, &b.look))
    };
    let ends: Vec<usize> = (0..frames.len())
        .filter(is_end)
        .chain([frames.len()])
        .collect();
    let mut judged = vec![None; frames.len()];
    for stretch in ends.windows(2).map(|ends| ends[0]..ends[1]) {
        let misfits = stretch.clone().filter_map(|t| Some(candidate(t)?.cost));
        let confidence = order::median(misfits).map_or(0.0, confidence::from_misfit);
        if confidence >= confidence::FOUND {
            for t in stretch {
                judged[t] = chosen[t].map(|at| (at, confidence));
            }
        }
    }
    judged
}

/// The animal's usual movement from frame to frame; a much longer one is a leap.
struct Motion {
    /// 90th percentile of the animal's movement from frame to frame, pixels.
    usual_px: f64,
    /// Standard deviation of movement beyond that, pixels.
    spread_px: f64,
}

impl Motion {
    fn new(frames: &[&[Candidate]], subject: &Subject) -> Motion {
        // From the best candidate to the nearest of the next frame: of several animals, any may be the best.
        let fitting = |candidates: &&[Candidate]| -> Vec<[f64; 2]> {
            let mut fitting: Vec<&Candidate> =
                candidates.iter().filter(|c| c.cost < FITS).collect();
            fitting.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            fitting.iter().map(|c| c.look.centroid_px).collect()
        };
        let places: Vec<Vec<[f64; 2]>> = frames.iter().map(fitting).collect();
        let step = |pair: &[Vec<[f64; 2]>]| {
            let from = *pair[0].first()?;
            let steps = pair[1].iter().map(|&to| distance(from, to));
            steps.min_by(f64::total_cmp)
        };
        let mut steps: Vec<f64> = places.windows(2).filter_map(step).collect();
        Motion {
            usual_px: order::percentile(&mut steps, 0.9).unwrap_or(0.0),
            spread_px: (0.5 * subject.diagonal_px).max(4.0),
        }
    }

    fn is_leap(&self, a: &Look, b: &Look) -> bool {
        distance(a.centroid_px, b.centroid_px) > LEAP_SPREADS * self.spread_px + self.usual_px
    }

    /// Returns whether two successive looks may belong to two things: they are a leap apart, or differ in
    /// area.
    fn is_break(&self, a: &Look, b: &Look) -> bool {
        let change = libm::log(b.area_px / a.area_px).abs();
        self.is_leap(a, b) || change > LEAP_SPREADS * AREA_CHANGE_SPREAD
    }

    /// Returns the cost of a leap from `a` to `b` when one of the `others` was much closer to `b`.
    ///
    /// The `others` were seen in the same frame as `a`, so the leap would join two different things.
    fn leap_cost<'a>(&self, a: &Look, b: &Look, mut others: impl Iterator<Item = &'a Look>) -> f64 {
        let leap_px = distance(a.centroid_px, b.centroid_px);
        let nearer =
            |other: &Look| NEARER_FACTOR * distance(other.centroid_px, b.centroid_px) < leap_px;
        if self.is_leap(a, b) && others.any(nearer) {
            LEAP_COST
        } else {
            0.0
        }
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::subject::Color;
    use crate::geometry::Rect;
    use crate::raster::RgbaImage;

    /// A thing of 20 x 10 pixels at column `x` with the given misfit.
    fn candidate(x: f64, cost: f64) -> Candidate {
        let rect = Rect::of_size(20, 10);
        let mut image = RgbaImage::new(20, 10);
        image.pixels.fill(255);
        let look = Look {
            area_px: 200.0,
            color: Color::from_pixels(std::iter::empty()),
            contrast: 60.0,
            box_px: rect,
            centroid_px: [x, 50.0],
            on_border: false,
            is_shadow: false,
            is_ghost: false,
            light: 0,
        };
        Candidate {
            sighting: Sighting::measured(rect, &image).expect("it is opaque"),
            look,
            cost,
        }
    }

    fn judged(frames: &[Vec<Candidate>], pin: Option<(usize, usize)>) -> Vec<Option<(usize, f64)>> {
        let looks = vec![vec![candidate(0.0, 0.0).look]];
        let subject = Subject::learn(&looks, Some((0, 0))).expect("there is a look");
        let frames: Vec<&[Candidate]> = frames.iter().map(Vec::as_slice).collect();
        choose(&frames, &subject, Follow::One, pin)
    }

    fn chosen(frames: &[Vec<Candidate>], pin: Option<(usize, usize)>) -> Vec<Option<usize>> {
        let found = judged(frames, pin).into_iter();
        found.map(|found| Some(found?.0)).collect()
    }

    #[test]
    fn thing_that_came_first_and_fits_less_is_not_chosen() {
        let frames: Vec<Vec<Candidate>> = (0..60)
            .map(|t| {
                let hand = candidate(400.0, 12.0);
                let animal = candidate(100.0 + f64::from(t), 0.5);
                match t {
                    0..10 => vec![hand],
                    10..20 => vec![hand, animal],
                    _ => vec![animal],
                }
            })
            .collect();
        let wanted = |t| (t >= 10).then_some(usize::from(t < 20));
        let wanted: Vec<Option<usize>> = (0..60).map(wanted).collect();
        assert_eq!(chosen(&frames, None), wanted);
    }

    #[test]
    fn hidden_animal_is_not_replaced() {
        let frames: Vec<Vec<Candidate>> = (0..60)
            .map(|t| match t {
                20..30 => vec![candidate(300.0, 23.0)],
                _ => vec![candidate(100.0 + f64::from(t), 0.5)],
            })
            .collect();
        let n_found = chosen(&frames, None).iter().flatten().count();
        assert_eq!(n_found, 50);
    }

    #[test]
    fn pinned_one_of_two_alike_things_is_followed() {
        let frames: Vec<Vec<Candidate>> = (0..40)
            .map(|t| {
                vec![
                    candidate(100.0 + f64::from(t), 0.1),
                    candidate(300.0 - f64::from(t), 0.6),
                ]
            })
            .collect();
        assert!(chosen(&frames, None).iter().all(|&at| at == Some(0)));
        assert!(
            chosen(&frames, Some((30, 1)))
                .iter()
                .all(|&at| at == Some(1))
        );
    }

    #[test]
    fn confidence_follows_the_median_misfit_of_a_stretch() {
        // Two things, a leap apart; the second has a high misfit for ten frames.
        let frames: Vec<Vec<Candidate>> = (0..60)
            .map(|t| match t {
                0..20 => vec![candidate(900.0, 2.0)],
                30..40 => vec![candidate(100.0 + f64::from(t), 9.0)],
                _ => vec![candidate(100.0 + f64::from(t), 0.0)],
            })
            .collect();
        let sure = |t: usize| judged(&frames, None)[t].map_or(0.0, |(_, confidence)| confidence);
        assert!(
            (0..20).all(|t| (0.6..0.95).contains(&sure(t))),
            "{}",
            sure(0)
        );
        assert!(
            (20..60).all(|t| sure(t) > 0.99),
            "{} {}",
            sure(20),
            sure(35)
        );
    }
}
