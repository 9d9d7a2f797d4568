//! A scene that changes for good (bedding kicked about, a toy pushed aside, a light that goes down slowly) is
//! described by several plates, one after the other in time. A part is split where two plates explain its samples much better
//! than one does, told from thumbnails with the animal left out.

use super::states::{LEAST_SAMPLES, Part, bits};
use super::thumbnail::Thumbnail;

/// Cells that differ from the typical ones, as a share of the picture, below which one plate is good enough.
const GOOD: f64 = 0.004;
/// A split is worth it when the two halves together differ in at most this share of what the whole differs in.
const BETTER: f64 = 0.65;

/// What is there for a smaller share of the samples is a visitor before the scene.
const FOR_GOOD: f64 = 0.33;

/// Samples of a short window.
const SHORT: usize = 8;

/// Splits a part in time as far as that is worth it. `is_free(k, cell)` tells whether a cell shows the scene in sample
/// k. The parts are in the order of time.
pub(super) fn split(
    part: Part,
    thumbnails: &[Thumbnail],
    is_free: &impl Fn(usize, usize) -> bool,
) -> Vec<Part> {
    let members: Vec<usize> = bits(part.samples).collect();
    let least = (LEAST_SAMPLES as usize).max((FOR_GOOD * members.len() as f64).ceil() as usize);
    let whole = unexplained(&members, thumbnails, is_free);
    let n_cells = thumbnails[members[0]].len();
    if members.len() < 2 * least || (whole as f64) < GOOD * (n_cells * members.len()) as f64 {
        return vec![part];
    }
    let places = (least..=members.len() - least).step_by((members.len() / 8).max(1));
    let with_rest = places.map(|at| {
        let (before, after) = members.split_at(at);
        let rest =
            unexplained(before, thumbnails, is_free) + unexplained(after, thumbnails, is_free);
        (rest, at)
    });
    let Some((rest, at)) = with_rest.min() else {
        return vec![part];
    };
    if rest as f64 > BETTER * whole as f64 {
        return vec![part];
    }
    let of = |members: &[usize]| Part {
        samples: members.iter().fold(0, |mask, k| mask | 1 << k),
        ..part
    };
    let (before, after) = members.split_at(at);
    [before, after]
        .into_iter()
        .flat_map(|half| split(of(half), thumbnails, is_free))
        .collect()
}

/// A part in windows of time of about equally many samples, short enough that an animal that moves is not in their
/// median, in the order of time.
pub(super) fn short(part: Part) -> Vec<Part> {
    let members: Vec<usize> = bits(part.samples).collect();
    let n_windows = (members.len() / SHORT).max(1);
    let of = |k: usize| {
        let range = k * members.len() / n_windows..(k + 1) * members.len() / n_windows;
        let samples = members[range].iter().fold(0, |mask, k| mask | 1 << k);
        Part { samples, ..part }
    };
    (0..n_windows).map(of).collect()
}

/// How many free cells of the members differ from the median of the members.
fn unexplained(
    members: &[usize],
    thumbnails: &[Thumbnail],
    is_free: &impl Fn(usize, usize) -> bool,
) -> usize {
    let typical = Thumbnail::median(members.iter().map(|&k| &thumbnails[k]));
    let of = |&k: &usize| {
        let differs = |cell: &usize| is_free(k, *cell) && thumbnails[k].differs_at(&typical, *cell);
        (0..typical.len()).filter(differs).count()
    };
    members.iter().map(of).sum()
}
