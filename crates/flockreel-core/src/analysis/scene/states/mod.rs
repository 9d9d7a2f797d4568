//! Groups the samples by state of the scene: one state for each light and for each camera position. Each
//! state gets its own background (docs/explanation/algorithms.md, "Background").
//!
//! A state begins where two neighboring samples differ in much of the picture. Before the comparison, the
//! light of one is fitted to the other by gains for the whole picture, rows and columns. States that look alike
//! are merged. Phase correlation (`camera_shift`) then splits a state by camera position. Samples without a
//! scene join no state: black frames, title cards, a hand over the lens.

mod camera_shift;
pub(super) mod thumbnail;

use self::camera_shift::{Correlator, MIN_SHIFT_PX};
use self::thumbnail::Thumbnail;
use super::samples::{Samples, indices};
use crate::analysis::Error;
use crate::order;

/// Share of differing cells above which two samples show different states, 0..=1. Free choice.
const STATE_MISMATCH: f64 = 0.35;
/// Least number of samples for a background. Free choice; with fewer at one position, the camera only passed.
pub(super) const MIN_SAMPLES: u32 = 8;
/// Extra camera positions above which the camera counts as never at rest. Free choice.
const MAX_MOVES: usize = 3;
/// Samples checked for a shift before all samples are. Free choice.
const N_SHIFT_CHECKS: usize = 21;

/// The samples of one state that one background describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SampleGroup {
    /// The samples; bit k is sample k.
    pub(super) samples: u64,
    /// All samples of the state, of which `samples` may be a time window.
    pub(super) state_samples: u64,
    /// Index of the light. Colors are comparable between groups of equal light.
    pub(super) light: usize,
}

impl SampleGroup {
    /// Returns the group of all samples of a state.
    pub(super) fn of_state(samples: u64, light: usize) -> SampleGroup {
        SampleGroup {
            samples,
            state_samples: samples,
            light,
        }
    }
}

/// Groups the samples by state; returns the groups with the most samples first.
///
/// Fails if more than half of the samples belong to no group, with the reason and the time at which the
/// problem begins.
pub(super) fn group_samples(samples: &Samples) -> Result<Vec<SampleGroup>, Error> {
    let thumbnails = samples.thumbnails();
    let segments = segments(&thumbnails);
    let n_samples = samples.frames.len() as u32;
    let (mut kept, mut dropped) = (Vec::new(), Vec::new());
    for (light, of_state) in merge_alike(&thumbnails, segments).into_iter().enumerate() {
        for samples in camera_positions(samples, of_state) {
            let group = SampleGroup::of_state(samples, light);
            if samples.count_ones() >= MIN_SAMPLES.min(n_samples.div_ceil(2)) {
                kept.push(group);
            } else {
                dropped.push(group);
            }
        }
    }
    let n_kept: u32 = kept.iter().map(|group| group.samples.count_ones()).sum();
    if 2 * n_kept < n_samples {
        return Err(refusal(samples, &thumbnails, &dropped));
    }
    kept.sort_by_key(|group| (std::cmp::Reverse(group.samples.count_ones()), group.samples));
    Ok(kept)
}

/// Returns runs of neighboring samples in one state, one bit each. Blank samples belong to no run.
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
    let mut continues = false;
    for (k, thumbnail) in thumbnails.iter().enumerate() {
        if thumbnail.is_blank() && !is_wall {
            continues = false;
            continue;
        }
        continues &= steps[k.max(1) - 1] <= STATE_MISMATCH;
        match segments.last_mut().filter(|_| continues) {
            Some(segment) => *segment |= 1 << k,
            None => segments.push(1 << k),
        }
        continues = true;
    }
    segments
}

/// Merges the segments that look alike.
fn merge_alike(thumbnails: &[Thumbnail], segments: Vec<u64>) -> Vec<u64> {
    let mut states: Vec<(u64, Thumbnail)> = Vec::new();
    for segment in segments {
        let typical = Thumbnail::median(indices(segment).map(|k| &thumbnails[k]));
        let known = states
            .iter_mut()
            .find(|(_, state)| state.mismatch(&typical) <= STATE_MISMATCH);
        match known {
            Some((samples, _)) => *samples |= segment,
            None => states.push((segment, typical)),
        }
    }
    states.into_iter().map(|(samples, _)| samples).collect()
}

/// Splits the samples of a state by camera position.
fn camera_positions(samples: &Samples, state: u64) -> Vec<u64> {
    let members: Vec<usize> = indices(state).collect();
    let correlator = Correlator::new(&samples.frames[members[members.len() / 2]]);
    let step = members.len().div_ceil(N_SHIFT_CHECKS);
    let checked: Vec<usize> = members.iter().copied().step_by(step).collect();
    let has_moved = |shift: &Option<[f64; 2]>| shift.is_some_and(|s| length(s) > MIN_SHIFT_PX);
    if !correlator
        .shifts_px(&samples.frames, &checked)
        .iter()
        .any(has_moved)
    {
        return vec![state];
    }
    let mut positions: Vec<(u64, Vec<[f64; 2]>)> = Vec::new();
    let mut here = 0;
    for (&k, shift) in members
        .iter()
        .zip(correlator.shifts_px(&samples.frames, &members))
    {
        let Some(shift) = shift else {
            // A sample with unknown shift most likely shares its neighbor's position.
            if let Some((samples, _)) = positions.get_mut(here) {
                *samples |= 1 << k;
            }
            continue;
        };
        let off = |shifts: &[[f64; 2]]| {
            let middle = [0, 1].map(|c| order::median(shifts.iter().map(|s| s[c])).unwrap_or(0.0));
            length([shift[0] - middle[0], shift[1] - middle[1]])
        };
        let nearest = (0..positions.len())
            .min_by(|&a, &b| off(&positions[a].1).total_cmp(&off(&positions[b].1)));
        here = match nearest.filter(|&at| off(&positions[at].1) <= MIN_SHIFT_PX) {
            Some(at) => at,
            None => {
                positions.push((0, Vec::new()));
                positions.len() - 1
            }
        };
        positions[here].0 |= 1 << k;
        positions[here].1.push(shift);
    }
    positions.into_iter().map(|(samples, _)| samples).collect()
}

/// Returns the reason for which too few samples show a measurable scene, and the time of the first change.
fn refusal(samples: &Samples, thumbnails: &[Thumbnail], dropped: &[SampleGroup]) -> Error {
    let n_lights = dropped
        .iter()
        .map(|group| group.light + 1)
        .max()
        .unwrap_or(0);
    let first_change = dropped
        .iter()
        .map(|group| group.samples.trailing_zeros())
        .filter(|&k| k > 0)
        .min();
    let at_s = samples.time_s(first_change.unwrap_or(0) as usize);
    if n_lights + MAX_MOVES < dropped.len() {
        return Error::BackgroundNotStatic { at_s, box_px: None };
    }
    if n_lights < dropped.len() {
        return Error::CameraMoves { at_s };
    }
    let same_structure = thumbnails
        .windows(2)
        .filter(|pair| pair[0].correlation(&pair[1]) > 0.5)
        .count();
    if 2 * same_structure > thumbnails.len() {
        Error::LightChanges { at_s }
    } else {
        Error::SceneChanges { at_s }
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    libm::hypot(x, y)
}
