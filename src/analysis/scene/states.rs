//! Sorts the samples into the states of the scene: one for each light that was switched and for each place in which
//! the camera stood. Each state gets a plate of its own. Samples that show no scene (black frames, title cards, a
//! hand over the lens) belong to none.
//!
//! A state begins where two neighboring samples differ in much of the picture, after the light of one has been fitted
//! to the other (gain, rows, columns). States that look alike are one state that recurs. Within a state, phase
//! correlation (`shift`) tells whether the camera was moved.

use super::samples::Samples;
use super::shift::Correlator;
use super::thumbnail::Thumbnail;
use crate::analysis::Error;
use crate::order;

/// Neighboring samples that differ in more than this share of the picture show two states ...
const DIFFERENT: f64 = 0.35;
/// ... if that is this many times the usual share. A large animal alone differs in twice its area.
const UNUSUAL: f64 = 2.5;
/// Fewer samples than this do not give a plate: the median of five still ignores two.
pub(super) const LEAST_SAMPLES: u32 = 6;
/// A place in which the camera stood for fewer samples than this was passed by on the way.
const LEAST_IN_PLACE: u32 = 8;
/// A camera that was moved more often than this never stands still.
const MOST_MOVES: usize = 3;
/// States must hold this share of the samples, or the film has no scene that could be measured.
const LEAST_SHARE: f64 = 0.5;
/// A camera that moves by more than this between two samples has been moved, pixels. Smaller shifts are within the
/// error of the correlation.
const MOVED_PX: f64 = 0.6;
/// How many samples are checked for a shift before all are.
const N_CHECKED: usize = 21;

/// Samples of one state that one plate describes, a bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// The samples.
    pub(super) samples: u64,
    /// Which light they were filmed in; parts of one light are comparable.
    pub(super) light: usize,
}

/// Sorts the samples into parts, the longest first.
///
/// Fails when most of them belong to none, with the reason and the time at which the trouble begins.
pub(super) fn sort(samples: &Samples) -> Result<Vec<Part>, Error> {
    let thumbnails = samples.thumbnails();
    let segments = segments(&thumbnails);
    let n_samples = samples.frames.len() as u32;
    let (mut kept, mut dropped) = (Vec::new(), Vec::new());
    for (light, of_light) in alike(&thumbnails, segments).into_iter().enumerate() {
        let places = places(samples, of_light);
        let least = if places.len() > 1 {
            LEAST_IN_PLACE
        } else {
            LEAST_SAMPLES
        };
        for of_place in places {
            let part = Part {
                samples: of_place,
                light,
            };
            match part.samples.count_ones() >= least.min(n_samples.div_ceil(2)) {
                true => kept.push(part),
                false => dropped.push(part),
            }
        }
    }
    let n_kept: u32 = kept.iter().map(|part| part.samples.count_ones()).sum();
    if f64::from(n_kept) < LEAST_SHARE * f64::from(n_samples) {
        return Err(reason(samples, &thumbnails, &dropped));
    }
    kept.sort_by_key(|part| (std::cmp::Reverse(part.samples.count_ones()), part.samples));
    Ok(kept)
}

/// Runs of neighboring samples that show the scene in one state; blank samples are left out.
fn segments(thumbnails: &[Thumbnail]) -> Vec<u64> {
    let steps: Vec<f64> = thumbnails
        .windows(2)
        .map(|pair| pair[0].mismatch(&pair[1]))
        .collect();
    let usual = order::median(steps.iter().copied()).unwrap_or(0.0);
    let limit = DIFFERENT.max(UNUSUAL * usual);
    // A film of a bare wall is blank wherever the animal is away: there blank is the scene.
    let n_blank = thumbnails
        .iter()
        .filter(|thumbnail| thumbnail.is_blank())
        .count();
    let is_wall = 2 * n_blank > thumbnails.len();
    let mut segments: Vec<u64> = Vec::new();
    let mut goes_on = false;
    for (k, thumbnail) in thumbnails.iter().enumerate() {
        if thumbnail.is_blank() && !is_wall {
            goes_on = false;
            continue;
        }
        goes_on &= steps[k.max(1) - 1] <= limit;
        match segments.last_mut().filter(|_| goes_on) {
            Some(segment) => *segment |= 1 << k,
            None => segments.push(1 << k),
        }
        goes_on = true;
    }
    segments
}

/// Joins the segments that look alike.
fn alike(thumbnails: &[Thumbnail], segments: Vec<u64>) -> Vec<u64> {
    let mut states: Vec<(u64, Thumbnail)> = Vec::new();
    for segment in segments {
        let typical = Thumbnail::median(bits(segment).map(|k| &thumbnails[k]));
        let known = states
            .iter_mut()
            .find(|(_, state)| state.mismatch(&typical) <= DIFFERENT);
        match known {
            Some((samples, _)) => *samples |= segment,
            None => states.push((segment, typical)),
        }
    }
    states.into_iter().map(|(samples, _)| samples).collect()
}

/// Splits the samples of a state by where the camera stood.
fn places(samples: &Samples, state: u64) -> Vec<u64> {
    let members: Vec<usize> = bits(state).collect();
    let correlator = Correlator::of(&samples.frames[members[members.len() / 2]]);
    let step = members.len().div_ceil(N_CHECKED);
    let checked: Vec<usize> = members.iter().copied().step_by(step).collect();
    let has_moved = |shift: &Option<[f64; 2]>| shift.is_some_and(|s| length(s) > MOVED_PX);
    if !correlator
        .shifts_px(&samples.frames, &checked)
        .iter()
        .any(has_moved)
    {
        return vec![state];
    }
    let mut places: Vec<(u64, Vec<[f64; 2]>)> = Vec::new();
    let mut here = 0;
    for (&k, shift) in members
        .iter()
        .zip(correlator.shifts_px(&samples.frames, &members))
    {
        let Some(shift) = shift else {
            // A sample whose shift is unknown most likely shows what its neighbor shows.
            if let Some((samples, _)) = places.get_mut(here) {
                *samples |= 1 << k;
            }
            continue;
        };
        let off = |shifts: &[[f64; 2]]| {
            let middle = [0, 1].map(|c| order::median(shifts.iter().map(|s| s[c])).unwrap_or(0.0));
            length([shift[0] - middle[0], shift[1] - middle[1]])
        };
        let nearest =
            (0..places.len()).min_by(|&a, &b| off(&places[a].1).total_cmp(&off(&places[b].1)));
        here = match nearest.filter(|&at| off(&places[at].1) <= MOVED_PX) {
            Some(at) => at,
            None => {
                places.push((0, Vec::new()));
                places.len() - 1
            }
        };
        places[here].0 |= 1 << k;
        places[here].1.push(shift);
    }
    places.into_iter().map(|(samples, _)| samples).collect()
}

/// Why too few samples show a measurable scene, and from when on.
fn reason(samples: &Samples, thumbnails: &[Thumbnail], dropped: &[Part]) -> Error {
    let n_lights = dropped.iter().map(|part| part.light + 1).max().unwrap_or(0);
    let first_change = dropped
        .iter()
        .map(|part| part.samples.trailing_zeros())
        .filter(|&k| k > 0)
        .min();
    let at_s = samples.time_s(first_change.unwrap_or(0) as usize);
    if n_lights + MOST_MOVES < dropped.len() {
        return Error::BackgroundNotStatic { at_s, box_px: None };
    }
    if n_lights < dropped.len() {
        return Error::CameraMoves { at_s };
    }
    let same_structure = thumbnails
        .windows(2)
        .filter(|pair| pair[0].correlation(&pair[1]) > 0.5)
        .count();
    match 2 * same_structure > thumbnails.len() {
        true => Error::LightChanges { at_s },
        false => Error::SceneChanges { at_s },
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    libm::hypot(x, y)
}

/// The indices of the set bits.
pub(super) fn bits(mask: u64) -> impl Iterator<Item = usize> + Clone {
    (0..64).filter(move |k| mask >> k & 1 == 1)
}
