//! Splits a scene that changes for good into groups of consecutive samples. Examples are bedding kicked about, a
//! toy pushed aside and light that dims slowly.
//!
//! A group is split where two backgrounds explain its samples much better than one. The comparison uses thumbnails
//! and leaves out the cells that the animal covers. The module also cuts groups into short windows of equal size.

use super::samples::indices;
use super::states::thumbnail::Thumbnail;
use super::states::{MIN_SAMPLES, SampleGroup};

/// Share of differing cells below which one background is enough, 0..=1. Free choice.
const GOOD_SHARE: f64 = 0.004;
/// Largest ratio of differing cells after a split to those before it. Free choice.
const MAX_SPLIT_RATIO: f64 = 0.65;

/// Least share of a group's samples on each side of a split, 0..=1. A shorter change is a passing object. Free
/// choice.
const MIN_SPLIT_SHARE: f64 = 0.33;

/// Splits a group in time, recursively, while a split explains the samples much better. `is_free(k, cell)`
/// tells whether sample `k` shows the scene at a thumbnail cell. Returns the pieces in order of time.
pub(super) fn split(
    group: SampleGroup,
    thumbnails: &[Thumbnail],
    is_free: &impl Fn(usize, usize) -> bool,
) -> Vec<SampleGroup> {
    let members: Vec<usize> = indices(group.samples).collect();
    let least =
        (MIN_SAMPLES as usize).max((MIN_SPLIT_SHARE * members.len() as f64).ceil() as usize);
    let whole = unexplained(&members, thumbnails, is_free);
    let n_cells = thumbnails[members[0]].len();
    if members.len() < 2 * least || (whole as f64) < GOOD_SHARE * (n_cells * members.len()) as f64 {
        return vec![group];
    }
    let places = (least..=members.len() - least).step_by((members.len() / 8).max(1));
    let with_rest = places.map(|at| {
        let (before, after) = members.split_at(at);
        let rest =
            unexplained(before, thumbnails, is_free) + unexplained(after, thumbnails, is_free);
        (rest, at)
    });
    let Some((rest, at)) = with_rest.min() else {
        return vec![group];
    };
    if rest as f64 > MAX_SPLIT_RATIO * whole as f64 {
        return vec![group];
    }
    let group_of = |members: &[usize]| SampleGroup {
        samples: members.iter().fold(0, |mask, k| mask | 1 << k),
        ..group
    };
    let (before, after) = members.split_at(at);
    [before, after]
        .into_iter()
        .flat_map(|half| split(group_of(half), thumbnails, is_free))
        .collect()
}

/// Splits a group into short time windows with about equally many samples each, in order of time. They are so
/// short that a moving animal rarely enters their median.
pub(super) fn short_windows(group: SampleGroup) -> Vec<SampleGroup> {
    let members: Vec<usize> = indices(group.samples).collect();
    let n_windows = (members.len() / MIN_SAMPLES as usize).max(1);
    let window = |k: usize| {
        let range = k * members.len() / n_windows..(k + 1) * members.len() / n_windows;
        let samples = members[range].iter().fold(0, |mask, k| mask | 1 << k);
        SampleGroup { samples, ..group }
    };
    (0..n_windows).map(window).collect()
}

/// Returns the number of free cells, over all members, that differ from the members' median thumbnail.
fn unexplained(
    members: &[usize],
    thumbnails: &[Thumbnail],
    is_free: &impl Fn(usize, usize) -> bool,
) -> usize {
    let typical = Thumbnail::median(members.iter().map(|&k| &thumbnails[k]));
    let n_differing = |&k: &usize| {
        let differs = |cell: &usize| is_free(k, *cell) && thumbnails[k].differs_at(&typical, *cell);
        (0..typical.len()).filter(differs).count()
    };
    members.iter().map(n_differing).sum()
}
