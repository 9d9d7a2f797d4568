//! Groups the samples by state of the scene: one state for each light and for each camera position. Each
//! state gets its own background (docs/explanation/algorithms.md, "Background").
//!
//! A state begins where two neighboring samples differ in much of the picture. Before the comparison, the
//! light of one is fitted to the other by gains for the whole picture, rows and columns. States that look
//! alike are merged. Phase correlation (`shift`) then splits a state by camera position. Samples without a
//! scene join no state: black frames, title cards, a hand over the lens.

use super::samples::Samples;
use super::shift::Correlator;
use super::thumbnail::Thumbnail;
use crate::analysis::Error;
use crate::order;

/// Share of differing cells above which two samples show different states, 0..=1. Free choice.
const DIFFERENT: f64 = 0.35;
/// Least number of samples for a background. Free choice; a median of five already ignores two outliers.
pub(super) const LEAST_SAMPLES: u32 = 6;
/// Least number of samples at one of several camera positions; with fewer, the camera only passed. Free
/// choice.
const LEAST_IN_PLACE: u32 = 8;
/// Extra camera positions above which the camera counts as never at rest. Free choice.
const MOST_MOVES: usize = 3;
/// Least share of the samples that must belong to a state, 0..=1; with fewer, the footage is refused. Free
/// choice.
const LEAST_SHARE: f64 = 0.5;
/// Shift above which the camera has moved, pixels. Smaller shifts are within the error of the correlation.
const MOVED_PX: f64 = 0.6;
/// Samples checked for a shift before all samples are. Free choice.
const N_CHECKED: usize = 21;

/// The samples of one state that one background describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// The samples; bit k is sample k.
    pub(super) samples: u64,
    /// Index of the light. Colors are comparable between parts of equal light.
    pub(super) light: usize,
}

/// Groups the samples into parts, those with the most samples first.
///
/// Fails if more than half of the samples belong to no part, with the reason and the time at which the
/// problem begins.
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

/// Returns runs of neighboring samples in one state, as bits. Blank samples belong to no run.
fn segments(thumbnails: &[Thumbnail]) -> Vec<u64> {
    let steps: Vec<f64> = thumbnails
        .windows(2)
        .map(|pair| pair[0].mismatch(&pair[1]))
        .collect();
    // Footage of a bare wall looks blank without the animal. There, blank samples show the scene.
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
        goes_on &= steps[k.max(1) - 1] <= DIFFERENT;
        match segments.last_mut().filter(|_| goes_on) {
            Some(segment) => *segment |= 1 << k,
            None => segments.push(1 << k),
        }
        goes_on = true;
    }
    segments
}

/// Merges the segments that look alike.
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

/// Splits the samples of a state by camera position.
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
            // A sample with unknown shift most likely shares its neighbor's position.
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

/// Returns the reason for which too few samples show a measurable scene, and the time of the first change.
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

/// Returns the indices of the set bits, in ascending order.
pub(super) fn bits(mask: u64) -> impl Iterator<Item = usize> + Clone {
    (0..64).filter(move |k| mask >> k & 1 == 1)
}
