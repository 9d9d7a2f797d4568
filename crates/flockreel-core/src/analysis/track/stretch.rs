//! Divides the candidates of a film into stretches: one body each, followed through successive frames.
//!
//! Two candidates of successive frames are linked if each is the nearest to the other, and nothing else could be
//! meant. A stretch also ends where two bodies touch and become one component, and where this component divides.
//! The stretch in between shows a group. See docs/explanation/algorithms.md, "Tracking".

use super::sighting::Sighting;
use crate::analysis::subject::{FITS, Look, Subject};
use crate::geometry::Rect;
use crate::order;

/// Greatest change of log area between successive frames of one body. Free choice.
const MAX_AREA_CHANGE: f64 = 0.6;
/// Another candidate may be meant unless it is farther away than the nearest one by this factor. Free choice.
const FARTHER_FACTOR: f64 = 3.0;

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

/// The same component in successive frames.
pub(super) struct Stretch {
    /// Index of its first frame.
    pub(super) first: usize,
    /// Index of its candidate in each frame from `first` on.
    pub(super) candidates: Vec<usize>,
    /// Centroid in each frame, pixels.
    pub(super) places_px: Vec<[f64; 2]>,
    /// Natural logarithm of the area in each frame.
    pub(super) log_areas: Vec<f64>,
    /// Their median.
    pub(super) log_area: f64,
    /// Median misfit to the subject.
    pub(super) misfit: f64,
    /// Number of bodies that it shows: more than one where they touch, none in the smaller pieces of one.
    pub(super) n_bodies: usize,
}

impl Stretch {
    /// Returns the index of the frame after the last one.
    pub(super) fn end(&self) -> usize {
        self.first + self.candidates.len()
    }

    /// Returns whether `next` may show the same body from some frame on.
    ///
    /// It starts later and ends later. A body behind a post is in view on both sides for a while: then each of the two
    /// is a piece, and both together are nearer to the usual area of either than it is by itself.
    pub(super) fn may_go_on_as(&self, next: &Stretch) -> bool {
        let both = next.first..self.end();
        let pieces = |whole: &Stretch| {
            let off = |log_area: f64| (log_area - whole.log_area).abs();
            let gains = both.clone().map(|t| {
                let [a, b, own] = [self, next, whole].map(|s| s.log_areas[t - s.first]);
                off(own) - off(libm::log(libm::exp(a) + libm::exp(b)))
            });
            gains.sum::<f64>() > 0.0
        };
        self.first < next.first
            && self.end() < next.end()
            && (both.is_empty() || (pieces(self) && pieces(next)))
    }

    /// Returns whether a candidate, given by its frame and its index there, belongs to the stretch.
    pub(super) fn has(&self, (frame_idx, at): (usize, usize)) -> bool {
        let k = frame_idx.checked_sub(self.first);
        k.and_then(|k| self.candidates.get(k)) == Some(&at)
    }
}

/// Returns the stretches by first frame; each candidate belongs to one.
pub(super) fn divide(frames: &[&[Candidate]], subject: &Subject) -> Vec<Stretch> {
    let reach_px = subject.diagonal_px + usual_step_px(frames);
    let fitting = frames.iter().copied().flatten();
    let fitting = fitting.filter(|candidate| candidate.cost < FITS);
    let area_px = order::median(fitting.map(|candidate| candidate.look.area_px)).unwrap_or(1.0);
    let mut done: Vec<Stretch> = Vec::new();
    let mut open: Vec<Stretch> = Vec::new();
    for (t, &candidates) in frames.iter().enumerate() {
        let before = t.checked_sub(1).map_or(&[][..], |before| frames[before]);
        let starts = starts(before, candidates, &mut open, area_px);
        let mut earlier: Vec<Option<Stretch>> = open.into_iter().map(Some).collect();
        open = Vec::with_capacity(candidates.len());
        for (at, candidate) in candidates.iter().enumerate() {
            let from = partner(candidate, before, candidates, reach_px);
            let from = from.filter(|_| !starts[at].is_sure);
            let known = from.and_then(|from| earlier[from].take());
            let mut stretch = known.unwrap_or_else(|| Stretch::starting(t, starts[at].n_bodies));
            stretch.add(at, candidate);
            open.push(stretch);
        }
        done.extend(earlier.into_iter().flatten());
    }
    done.extend(open);
    for stretch in &mut done {
        let nodes = (stretch.first..).zip(&stretch.candidates);
        let misfits = nodes.map(|(t, &at)| frames[t][at].cost);
        stretch.misfit = order::median(misfits).unwrap_or(0.0);
        stretch.log_area = order::median(stretch.log_areas.iter().copied()).unwrap_or(0.0);
    }
    done.sort_by_key(|stretch| stretch.first);
    done
}

/// A stretch that may start at a candidate.
#[derive(Clone, Copy)]
struct Start {
    /// Number of bodies that it would show.
    n_bodies: usize,
    /// Whether it starts there for certain: bodies touched or parted, or a piece came off.
    is_sure: bool,
}

/// Returns the start at each candidate, from the stretches that are `open` in the frame before, one per candidate.
fn starts(
    before: &[Candidate],
    candidates: &[Candidate],
    open: &mut [Stretch],
    area_px: f64,
) -> Vec<Start> {
    let new = Start {
        n_bodies: 1,
        is_sure: false,
    };
    let mut starts = vec![new; candidates.len()];
    for (whole, stretch) in before.iter().zip(open.iter_mut()) {
        let (parts, are_bodies) = parts_of(whole, candidates, before, area_px);
        if are_bodies {
            stretch.n_bodies = stretch.n_bodies.max(parts.len());
        }
        let area = |part: &usize| candidates[*part].look.area_px;
        let whole_px: f64 = parts.iter().map(area).sum();
        let largest = parts.iter().copied();
        let largest = largest.max_by(|a, b| area(a).total_cmp(&area(b)));
        for &part in &parts {
            let is_main = Some(part) == largest;
            let share = area(&part) / whole_px * stretch.n_bodies as f64;
            starts[part] = Start {
                n_bodies: (share.round() as usize).max(usize::from(are_bodies || is_main)),
                is_sure: are_bodies || !is_main,
            };
        }
    }
    for (start, whole) in starts.iter_mut().zip(candidates) {
        let (parts, are_bodies) = parts_of(whole, before, candidates, area_px);
        let in_parts = parts.iter().map(|&part| open[part].n_bodies);
        if are_bodies {
            start.n_bodies = in_parts.sum();
            start.is_sure = true;
        } else if let Some(most) = in_parts.max() {
            start.n_bodies = most;
        }
    }
    starts
}

impl Stretch {
    fn starting(first: usize, n_bodies: usize) -> Stretch {
        Stretch {
            first,
            candidates: Vec::new(),
            places_px: Vec::new(),
            log_areas: Vec::new(),
            log_area: 0.0,
            misfit: 0.0,
            n_bodies,
        }
    }

    fn add(&mut self, at: usize, candidate: &Candidate) {
        self.candidates.push(at);
        self.places_px.push(candidate.look.centroid_px);
        self.log_areas.push(libm::log(candidate.look.area_px));
    }
}

/// Returns the 90th percentile of the distance from a fitting candidate to the nearest of the next frame, pixels.
fn usual_step_px(frames: &[&[Candidate]]) -> f64 {
    let steps = frames.windows(2).flat_map(|pair| {
        let fitting = pair[0].iter().filter(|candidate| candidate.cost < FITS);
        fitting.filter_map(|from| Some(distance_px(from, &pair[1][nearest(from, pair[1])?])))
    });
    order::percentile(&mut steps.collect::<Vec<f64>>(), 0.9).unwrap_or(0.0)
}

/// Returns the index of the one candidate of the frame before that `candidate` continues; `beside` holds all
/// candidates of its own frame.
fn partner(
    candidate: &Candidate,
    before: &[Candidate],
    beside: &[Candidate],
    reach_px: f64,
) -> Option<usize> {
    let from = nearest(candidate, before)?;
    let step_px = distance_px(candidate, &before[from]);
    let change = libm::log(candidate.look.area_px / before[from].look.area_px).abs();
    // A second candidate within the factor would make the choice doubtful, from either end.
    let doubtful = |end: &Candidate, all: &[Candidate]| {
        let fitting = all.iter().filter(|other| other.cost < FITS);
        let near = fitting.filter(|other| distance_px(end, other) <= FARTHER_FACTOR * step_px);
        near.count() > 1
    };
    let is_sure = nearest(&before[from], beside)
        .is_some_and(|back| std::ptr::eq(&raw const beside[back], candidate))
        && step_px <= reach_px
        && change <= MAX_AREA_CHANGE
        && !doubtful(candidate, before)
        && !doubtful(&before[from], beside);
    is_sure.then_some(from)
}

/// Returns the indices of the candidates of the frame before or after, `parts`, that `whole` shows as one component,
/// none if it is only one, and whether they are bodies.
///
/// They lie in its box and continue nowhere else among `beside`, the candidates of its own frame. If they are pieces of
/// one body, the whole is nearer to the usual area `area_px` than they are together.
fn parts_of(
    whole: &Candidate,
    parts: &[Candidate],
    beside: &[Candidate],
    area_px: f64,
) -> (Vec<usize>, bool) {
    let off = |c: &Candidate| libm::log(c.look.area_px / area_px).abs();
    let is_inside = |at: &usize| {
        let to = nearest(&parts[*at], beside).map(|to| &raw const beside[to]);
        contains(whole.look.box_px, parts[*at].look.centroid_px)
            && to.is_some_and(|to| std::ptr::eq(to, whole))
    };
    let inside: Vec<usize> = (0..parts.len()).filter(is_inside).collect();
    let off_parts: f64 = inside.iter().map(|&at| off(&parts[at])).sum();
    let n_parts = inside.len();
    let parts = if n_parts > 1 { inside } else { Vec::new() };
    (parts, n_parts > 1 && off(whole) > off_parts)
}

fn contains(rect: Rect, [x, y]: [f64; 2]) -> bool {
    rect.contains(x.round() as u32, y.round() as u32)
}

fn nearest(from: &Candidate, all: &[Candidate]) -> Option<usize> {
    let distance = |at: &usize| distance_px(from, &all[*at]);
    (0..all.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn distance_px(a: &Candidate, b: &Candidate) -> f64 {
    let ([ax, ay], [bx, by]) = (a.look.centroid_px, b.look.centroid_px);
    libm::hypot(ax - bx, ay - by)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::analysis::subject::Color;
    use crate::raster::RgbaImage;

    /// A component of ten rows with the given centroid, area and misfit.
    pub(in crate::analysis::track) fn body(
        centroid_px: [f64; 2],
        area_px: f64,
        cost: f64,
    ) -> Candidate {
        let w = (area_px / 10.0) as u32;
        let box_px = Rect {
            x: (centroid_px[0] as u32).saturating_sub(w / 2),
            y: centroid_px[1] as u32 - 5,
            w,
            h: 10,
        };
        let mut image = RgbaImage::new(w, 10);
        image.pixels.fill(255);
        let look = Look {
            area_px,
            color: Color::from_pixels(std::iter::empty()),
            contrast: 60.0,
            box_px,
            centroid_px,
            on_border: false,
            is_shadow: false,
            is_ghost: false,
            light: 0,
        };
        Candidate {
            sighting: Sighting::measured(box_px, &image).expect("it is opaque"),
            look,
            cost,
        }
    }

    /// Returns frame range, centroid in the first frame and number of bodies of each stretch.
    fn divided(frames: &[Vec<Candidate>]) -> Vec<(std::ops::Range<usize>, f64, usize)> {
        let looks = vec![vec![body([0.0, 50.0], 200.0, 0.0).look]];
        let subject = Subject::learn(&looks, Some((0, 0))).expect("there is a look");
        let frames: Vec<&[Candidate]> = frames.iter().map(Vec::as_slice).collect();
        let stretches = divide(&frames, &subject).into_iter();
        let told = stretches.map(|s| (s.first..s.end(), s.places_px[0][0], s.n_bodies));
        told.collect()
    }

    #[test]
    fn group_keeps_its_number_of_bodies_when_it_divides() {
        let row = |bodies: &[(f64, f64)]| -> Vec<Candidate> {
            let body = |&(x, area_px): &(f64, f64)| body([x, 50.0], area_px, 0.0);
            bodies.iter().map(body).collect()
        };
        let alone = row(&[(100.0, 200.0), (124.0, 200.0), (148.0, 200.0)]);
        let frames: Vec<Vec<Candidate>> = (0..80)
            .map(|t| match t {
                30..40 => row(&[(124.0, 600.0)]),
                40..50 => row(&[(112.0, 400.0), (148.0, 200.0)]),
                _ => alone.clone(),
            })
            .collect();
        let groups = divided(&frames).into_iter().filter(|stretch| stretch.2 > 1);
        let groups: Vec<_> = groups.collect();
        assert_eq!(groups, [(30..40, 124.0, 3), (40..50, 112.0, 2)]);
    }

    #[test]
    fn pieces_of_one_body_are_no_group() {
        let frames: Vec<Vec<Candidate>> = (0..60)
            .map(|t| match t {
                20..23 => vec![
                    body([94.0, 50.0], 100.0, 2.4),
                    body([106.0, 50.0], 100.0, 2.4),
                ],
                _ => vec![body([100.0, 50.0], 200.0, 0.0)],
            })
            .collect();
        assert!(divided(&frames).iter().all(|stretch| stretch.2 == 1));
    }
}
