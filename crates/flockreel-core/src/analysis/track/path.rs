//! Chooses the animal's path: at most one candidate per frame, for the whole film at once.
//!
//! `stretch` divides the candidates into stretches, each of one body. `identity` returns how likely each stretch
//! shows the same animal as one of them, the anchor: the stretch that the user points at, the one that fits the
//! subject best, or one of the largest body. A hand, a speck or half a silhouette does not fit.

use super::confidence;
use super::identity::Identity;
use super::stretch::{self, Candidate, Stretch};
use crate::analysis::params::Follow;
use crate::analysis::subject::{FITS, Subject};
use crate::order;

/// Cost from which a look is never a candidate. Free choice.
pub(super) const MAX_COST: f64 = 24.0;

/// Least number of frames in which the largest body is followed, as a share of those of the body that is followed
/// longest. A larger one may be a web that trembles. Free choice.
const MIN_FOUND_SHARE: f64 = 0.1;

/// Chooses a candidate, or none, for each frame, with the probability that it is the animal.
///
/// `pin` is a frame and the index of its candidate that is known to be the animal. The probability is that of the
/// stretch: it fits by its median misfit, and it shows the same animal as the anchor.
pub(super) fn choose(
    frames: &[&[Candidate]],
    subject: &Subject,
    follow: Follow,
    pin: Option<(usize, usize)>,
) -> Vec<Option<(usize, f64)>> {
    let stretches = stretch::divide(frames, subject);
    let is_pinned = |stretch: &Stretch| pin.is_some_and(|pin| stretch.has(pin));
    let may_be_animal = |stretch: &&Stretch| stretch.n_bodies == 1 && stretch.misfit < FITS;
    let bodies: Vec<&Stretch> = stretches
        .iter()
        .filter(|stretch| may_be_animal(stretch) || is_pinned(stretch))
        .collect();
    let identity = Identity::new(&bodies, n_others(&stretches, frames.len()));
    let pinned = bodies.iter().position(|body| is_pinned(body));
    let path_of = |anchor: usize| judged(&bodies, &identity.same_as(anchor), frames.len());
    let path = match (pinned, follow) {
        (Some(anchor), _) => Some(path_of(anchor)),
        (None, Follow::One) => best_fitting(&bodies).map(path_of),
        (None, Follow::Largest) => {
            let mut paths: Vec<_> = together(&bodies).into_iter().map(path_of).collect();
            let n_found = |path: &Vec<_>| path.iter().flatten().count();
            let most = paths.iter().map(n_found).max().unwrap_or(0);
            paths.retain(|path| n_found(path) as f64 >= MIN_FOUND_SHARE * most as f64);
            let area_px = |path: &Vec<_>| median_area_px(path, frames);
            (paths.into_iter()).max_by(|a, b| area_px(a).total_cmp(&area_px(b)))
        }
    };
    path.unwrap_or_else(|| vec![None; frames.len()])
}

/// Returns how many bodies besides one are in view in half of the frames or more, groups counted by their bodies.
fn n_others(stretches: &[Stretch], n_frames: usize) -> usize {
    let mut n_in_view = vec![0; n_frames];
    for stretch in stretches
        .iter()
        .filter(|stretch| stretch.misfit < FITS || stretch.n_bodies > 1)
    {
        let in_view = &mut n_in_view[stretch.first..stretch.end()];
        in_view.iter_mut().for_each(|n| *n += stretch.n_bodies);
    }
    let usual = order::median(n_in_view.into_iter().map(|n| n as f64)).unwrap_or(0.0);
    (usual as usize).saturating_sub(1)
}

/// Returns the candidate of each frame whose stretch probably fits and shows the animal; `None` where two do, each a
/// piece of it.
fn judged(bodies: &[&Stretch], same: &[f64], n_frames: usize) -> Vec<Option<(usize, f64)>> {
    let mut path = vec![None; n_frames];
    let mut n_pieces = vec![0; n_frames];
    for (body, same) in bodies.iter().zip(same) {
        let confidence = same * confidence::from_misfit(body.misfit);
        if confidence >= confidence::FOUND {
            for (t, &at) in (body.first..).zip(&body.candidates) {
                n_pieces[t] += 1;
                path[t] = (n_pieces[t] == 1).then_some((at, confidence));
            }
        }
    }
    path
}

/// Returns the index of the stretch that fits best, by misfit and length.
fn best_fitting(bodies: &[&Stretch]) -> Option<usize> {
    let fit = |at: &usize| bodies[*at].candidates.len() as f64 * (1.0 - bodies[*at].misfit / FITS);
    (0..bodies.len()).max_by(|a, b| fit(a).total_cmp(&fit(b)))
}

/// Returns the indices of the stretches in the frame in which the most are seen, each counted by its length.
fn together(bodies: &[&Stretch]) -> Vec<usize> {
    let n_frames = bodies.iter().map(|body| body.end()).max().unwrap_or(0);
    let mut lengths = vec![0; n_frames];
    for body in bodies {
        let in_view = &mut lengths[body.first..body.end()];
        in_view
            .iter_mut()
            .for_each(|length| *length += body.candidates.len());
    }
    let frame_idx = (0..n_frames).max_by_key(|&t| lengths[t]).unwrap_or(0);
    let in_view = |&at: &usize| (bodies[at].first..bodies[at].end()).contains(&frame_idx);
    (0..bodies.len()).filter(in_view).collect()
}

fn median_area_px(path: &[Option<(usize, f64)>], frames: &[&[Candidate]]) -> f64 {
    let areas = path.iter().zip(frames);
    let areas =
        areas.filter_map(|(chosen, candidates)| chosen.map(|(at, _)| candidates[at].look.area_px));
    order::median(areas).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::track::stretch::tests::body;

    /// A thing of 20 x 10 pixels at column `x` with the given misfit.
    fn candidate(x: f64, cost: f64) -> Candidate {
        body([x, 50.0], 200.0, cost)
    }

    fn judged(frames: &[Vec<Candidate>], pin: Option<(usize, usize)>) -> Vec<Option<(usize, f64)>> {
        followed(frames, Follow::One, pin)
    }

    fn followed(
        frames: &[Vec<Candidate>],
        follow: Follow,
        pin: Option<(usize, usize)>,
    ) -> Vec<Option<(usize, f64)>> {
        let looks = vec![vec![candidate(0.0, 0.0).look]];
        let subject = Subject::learn(&looks, Some((0, 0))).expect("there is a look");
        let frames: Vec<&[Candidate]> = frames.iter().map(Vec::as_slice).collect();
        choose(&frames, &subject, follow, pin)
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

    /// Two alike bodies that move toward each other by `step_px` per frame, touch in the frames `touch`, and part.
    fn meeting(step_px: f64, touch: std::ops::Range<u32>) -> Vec<Vec<Candidate>> {
        let frame = |t: u32| {
            let from_middle = step_px * (f64::from(t) - 50.0);
            if touch.contains(&t) {
                vec![body([300.0, 50.0], 400.0, 2.4)]
            } else {
                let [a, b] = [-from_middle, from_middle].map(|off| 300.0 + off);
                vec![body([b, 50.0], 200.0, 0.0), body([a, 54.0], 200.0, 0.1)]
            }
        };
        (0..100).map(frame).collect()
    }

    #[test]
    fn bodies_that_cross_are_told_apart_by_their_motion() {
        let path = judged(&meeting(3.0, 47..53), Some((0, 0)));
        assert!(path[47..53].iter().all(Option::is_none), "one component");
        let is_sure =
            |found: &Option<(usize, f64)>| found.is_some_and(|(at, p)| at == 0 && p > 0.9);
        assert!(
            path[..47].iter().chain(&path[53..]).all(is_sure),
            "{path:?}"
        );
    }

    #[test]
    fn bodies_that_rest_together_are_not_told_apart() {
        // They may have turned back.
        let mut frames = meeting(3.0, 47..53);
        let together = std::iter::repeat_n(frames[50].clone(), 60);
        frames.splice(50..50, together);
        let path = judged(&frames, Some((0, 0)));
        assert!(
            path[..47]
                .iter()
                .all(|found| found.is_some_and(|(_, p)| p > 0.9))
        );
        assert!(
            path[113..]
                .iter()
                .all(|found| found.is_none_or(|(_, p)| p < 0.9)),
            "{path:?}"
        );
    }

    #[test]
    fn largest_body_is_that_of_the_whole_film() {
        // The other one looks larger for a while.
        let frames: Vec<Vec<Candidate>> = (0..60)
            .map(|t| {
                let other_px = if (20..30).contains(&t) { 280.0 } else { 200.0 };
                vec![
                    body([100.0 + f64::from(t), 50.0], other_px, 0.0),
                    body([300.0 - f64::from(t), 80.0], 250.0, 0.5),
                ]
            })
            .collect();
        let path = followed(&frames, Follow::Largest, None);
        assert!(
            path.iter()
                .all(|found| found.is_some_and(|(at, _)| at == 1))
        );
    }

    #[test]
    fn larger_thing_that_is_seen_seldom_is_not_the_largest_body() {
        let frames: Vec<Vec<Candidate>> = (0..100)
            .map(|t| {
                let animal = body([100.0 + f64::from(t), 50.0], 200.0, 0.0);
                let web = body([300.0, 80.0], 300.0, 0.5);
                match t {
                    50..55 => vec![animal, web],
                    _ => vec![animal],
                }
            })
            .collect();
        let path = followed(&frames, Follow::Largest, None);
        assert!(
            path.iter()
                .all(|found| found.is_some_and(|(at, _)| at == 0))
        );
    }

    #[test]
    fn another_body_is_not_taken_for_one_that_left() {
        // The first leaves at frame 40; the other is hidden for five frames then.
        let frames: Vec<Vec<Candidate>> = (0..80)
            .map(|t| {
                let first = body([100.0 + f64::from(t), 50.0], 200.0, 0.0);
                let other = body([200.0 - f64::from(t), 120.0], 200.0, 0.0);
                match t {
                    0..40 => vec![first, other],
                    45..50 => Vec::new(),
                    _ => vec![other],
                }
            })
            .collect();
        let path = judged(&frames, Some((0, 0)));
        assert!(
            path[..40]
                .iter()
                .all(|found| found.is_some_and(|(at, _)| at == 0))
        );
        assert!(path[40..].iter().all(Option::is_none));
    }
}
