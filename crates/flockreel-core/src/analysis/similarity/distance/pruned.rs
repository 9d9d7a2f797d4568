//! Computes only the distances below a limit, and skips most others
//! (docs/explanation/algorithms.md, "Distances").
//!
//! For the needed pairs of a panel (see `pair_filter`), bounds from 16 x 16 squares come first. Pairs with a
//! bound below the limit get bounds from 8 x 8 squares. Pairs that remain, and their competitors, get exact
//! distances. A needed pair is skipped only if a bound proves that its distance is not below the limit.
//!
//! Pairs are indexed by their offset j - i. All frame pairs of one clip pair are then in one column.

use std::ops::Range;

use rayon::prelude::*;

use super::super::group::{GROUP, Group, GroupBuffer};
use super::super::kernel::{self, SadTile, Tile, Wanted};
use super::bounds::SquareSums;
use super::marks::Marks;
use super::pair_filter::{self, PairFilter};
use super::{Cancelled, ClipPair, Distances, Side};
use crate::analysis::memory::BUDGET_BYTES;
use crate::progress::Progress;

/// Memory per pair of frames, bytes: its bound and its entry in a tile.
const PAIR_BYTES: usize = size_of::<u32>() + size_of::<u64>();
/// Largest number of groups in a panel. Tests use 1, so that their short films have several panels.
const MAX_GROUPS: usize = if cfg!(test) { 1 } else { 8 };

impl Distances<'_> {
    /// Calls `on_row(i, pairs)` for every clip i in order. The pairs (i, j) have D(i, j) < `limit` and
    /// ascending j >= i.
    ///
    /// They are all needed pairs and some of their competitors. Fails when cancelled.
    pub fn for_each_row_below(
        &self,
        limit: u64,
        filter: &impl PairFilter,
        progress: &dyn Progress,
        mut on_row: impl FnMut(usize, &[ClipPair]),
    ) -> Result<(), Cancelled> {
        let (n_frames, n_clips) = (self.pixels.n_frames(), self.n_clips());
        let n_groups = BUDGET_BYTES / (GROUP * n_frames.max(1) * PAIR_BYTES);
        let n_rows = GROUP * n_groups.clamp(1, MAX_GROUPS);
        let mut panel = Panel::new(self, limit);
        for first in (0..n_clips).step_by(n_rows) {
            if progress.cancelled() {
                return Err(Cancelled);
            }
            let rest = 1.0 - first as f64 / n_frames as f64;
            progress.report("distances", 1.0 - rest * rest);
            let clips = first..n_clips.min(first + n_rows);
            for (i, pairs) in clips.clone().zip(panel.pairs(clips, filter)) {
                on_row(i, &pairs);
            }
        }
        progress.report("distances", 1.0);
        Ok(())
    }
}

/// Some clips against all later ones, with the buffers for it.
struct Panel<'a> {
    distances: &'a Distances<'a>,
    limit: u64,
    weights: Vec<u64>,
    /// Largest stored bound. Small enough that weighted sums fit 32 bits; up to the limit where possible.
    max_bound: u32,
    /// The first clip.
    first: usize,
    /// Lower bounds of d by frame of these clips and by offset; valid only where computed.
    bounds: Vec<Vec<u32>>,
    /// Buffers for the row groups.
    buffers: Vec<GroupBuffer>,
}

impl<'a> Panel<'a> {
    fn new(distances: &'a Distances<'a>, limit: u64) -> Panel<'a> {
        let weights = distances.clip.weights();
        let max_bound = u64::from(u32::MAX) / weights.iter().sum::<u64>();
        Panel {
            distances,
            limit,
            max_bound: max_bound.min(limit) as u32,
            weights,
            first: 0,
            bounds: Vec::new(),
            buffers: Vec::new(),
        }
    }

    /// Returns the pairs below the limit for each of the clips, ascending.
    fn pairs(&mut self, clips: Range<usize>, filter: &impl PairFilter) -> Vec<Vec<ClipPair>> {
        let (radius, n_clips) = (filter.radius(), self.distances.n_clips());
        // Pairs of earlier or later clips may have competitors among these clips.
        let with_margin = clips.start.saturating_sub(radius)..n_clips.min(clips.end + radius);
        let request = |i: usize| {
            let mut row = Marks::none(n_clips - i);
            filter.mark(i, &mut row);
            row
        };
        let requested: Vec<Marks> = with_margin.clone().into_par_iter().map(request).collect();
        self.reset(with_margin.clone());
        let pixels = self.distances.pixels;
        let [rows, columns] = [self.distances.side, Side::Plain].map(|side| pixels.bounds(side));
        let mut candidates = requested.clone();
        self.prune(&mut candidates, &rows.coarse, &columns.coarse);
        self.prune(&mut candidates, &rows.fine, &columns.fine);
        let mut neighbors = pair_filter::neighbors(&candidates, &requested, radius);
        self.prune(&mut neighbors, &rows.fine, &columns.fine);
        let each_clip = candidates.iter_mut().zip(&neighbors);
        each_clip.for_each(|(candidates, neighbors)| candidates.union(neighbors, 0));
        self.exact_pairs(
            clips.start,
            &candidates[clips.start - with_margin.start..][..clips.len()],
        )
    }

    fn reset(&mut self, clips: Range<usize>) {
        let frames = clips.start..clips.end + self.distances.clip.frames - 1;
        let n_frames = self.distances.pixels.n_frames();
        self.first = clips.start;
        self.bounds.resize_with(frames.len(), Vec::new);
        // Old values from an earlier panel are never read, because each bound is computed before it is used.
        let rows = self.bounds.iter_mut().zip(frames);
        rows.for_each(|(bounds, row)| bounds.resize(n_frames - row, 0));
    }

    /// Computes the bounds for the frames of all pairs in `candidates`, and drops the pairs whose bound
    /// reaches the limit.
    fn prune(&mut self, candidates: &mut [Marks], rows: &SquareSums, columns: &SquareSums) {
        let (first, f, cpu) = (self.first, self.distances.clip.frames, self.distances.cpu);
        let (max_bound, limit, weights) = (self.max_bound, self.limit, &self.weights);
        let bound_frame = |(k, bounds): (usize, &mut Vec<u32>)| {
            let row = first + k;
            for run in frames_of(candidates, k, f).runs() {
                let bounds = &mut bounds[run.clone()];
                rows.write_bounds(cpu, row, columns, row + run.start, bounds);
                bounds
                    .iter_mut()
                    .for_each(|bound| *bound = (*bound).min(max_bound));
            }
        };
        self.bounds.par_iter_mut().enumerate().for_each(bound_frame);
        let bounds = &self.bounds;
        let clips = candidates.par_iter_mut().enumerate();
        clips
            .for_each(|(clip, candidates)| prune_clip(candidates, &bounds[clip..], weights, limit));
    }

    /// Returns the marked pairs of these clips with an exact distance below the limit.
    fn exact_pairs(&mut self, first: usize, candidates: &[Marks]) -> Vec<Vec<ClipPair>> {
        let tiles = Tiles::new(self.distances, first, candidates, &mut self.buffers);
        let pairs_of_clip = |(from, candidates): (usize, &Marks)| {
            let pair = |offset: usize| {
                let weighted = (from..).zip(&self.weights);
                let d = weighted.map(|(row, w)| w * tiles.sad(row, row + offset));
                ClipPair {
                    from,
                    to: from + offset,
                    distance: d.sum(),
                }
            };
            let pairs = candidates.ones().map(pair);
            pairs.filter(|pair| pair.distance < self.limit).collect()
        };
        let clips = (first..first + candidates.len())
            .into_par_iter()
            .zip(candidates);
        clips.map(pairs_of_clip).collect()
    }
}

/// Returns which frame pairs of frame `row` the pairs of clips contain. `row` counts from the first of the
/// clips.
fn frames_of(clips: &[Marks], row: usize, f: usize) -> Marks {
    let within = clips[..clips.len().min(row + 1)].iter();
    let mut within = within.skip((row + 1).saturating_sub(f));
    let mut frames = within.next().cloned().unwrap_or_default();
    within.for_each(|clip| frames.union(clip, 0));
    frames
}

/// Drops the pairs of a clip whose summed bounds reach the limit. The sums fit 32 bits.
fn prune_clip(candidates: &mut Marks, bounds: &[Vec<u32>], weights: &[u64], limit: u64) {
    let mut sums = Vec::new();
    let runs: Vec<Range<usize>> = candidates.runs().collect();
    for run in runs {
        sums.clear();
        sums.resize(run.len(), 0u32);
        for (&weight, row) in weights.iter().zip(bounds) {
            let each = sums.iter_mut().zip(&row[run.clone()]);
            match weight as u32 {
                1 => each.for_each(|(sum, bound)| *sum += bound),
                weight => each.for_each(|(sum, bound)| *sum += bound * weight),
            }
        }
        let pruned = run.zip(&sums).filter(|&(_, &sum)| u64::from(sum) >= limit);
        pruned.for_each(|(offset, _)| candidates.unmark(offset));
    }
}

/// d of some pairs of frames, in tiles of 48 x 48.
struct Tiles {
    /// The first row group. Column groups count from it too.
    first: usize,
    /// Tiles by column group, then by row group.
    tiles: Vec<Vec<Option<Box<SadTile>>>>,
}

impl Tiles {
    /// Computes the tiles for the frames of the marked pairs. The first clip is `first_clip`.
    fn new(
        distances: &Distances<'_>,
        first_clip: usize,
        clips: &[Marks],
        buffers: &mut Vec<GroupBuffer>,
    ) -> Tiles {
        let f = distances.clip.frames;
        let frames: Vec<Marks> = (0..clips.len() + f - 1)
            .map(|row| frames_of(clips, row, f))
            .collect();
        let first = first_clip / GROUP;
        let last = (first_clip + frames.len() - 1) / GROUP;
        buffers.resize_with(buffers.len().max(last + 1 - first), GroupBuffer::default);
        let rows: Vec<Group<'_>> = (first..=last)
            .zip(buffers)
            .map(|(group_idx, buffer)| distances.row_group(group_idx, buffer))
            .collect();
        let of_columns = |buffer: &mut GroupBuffer, column_idx: usize| {
            let wanted = |row_idx: usize| wanted(&frames, first_clip, [row_idx, column_idx]);
            let wanted: Vec<Wanted> = (first..=last).map(wanted).collect();
            if wanted.as_flattened().iter().all(|&bits| bits == 0) {
                return vec![None; rows.len()];
            }
            let columns = distances.pixels.group(column_idx, buffer);
            let tile = |(&rows, wanted): (&Group<'_>, &Wanted)| {
                let tile = Tile {
                    rows,
                    columns,
                    wanted,
                };
                let any = wanted.iter().any(|&bits| bits != 0);
                any.then(|| kernel::sad_tile(distances.cpu, tile))
            };
            rows.iter().zip(&wanted).map(tile).collect()
        };
        let columns = (first..distances.pixels.n_groups()).into_par_iter();
        Tiles {
            first,
            tiles: columns.map_init(GroupBuffer::default, of_columns).collect(),
        }
    }

    /// Returns d of a pair of frames that was computed.
    fn sad(&self, row: usize, column: usize) -> u64 {
        let tile = &self.tiles[column / GROUP - self.first][row / GROUP - self.first];
        tile.as_ref()
            .map_or(0, |tile| tile[row % GROUP][column % GROUP])
    }
}

/// Returns the needed pairs of a row group and a column group. `first` is the frame of the first entry in
/// `frames`.
fn wanted(frames: &[Marks], first: usize, [row_idx, column_idx]: [usize; 2]) -> Wanted {
    std::array::from_fn(|k| {
        let row = row_idx * GROUP + k;
        let marks = row.checked_sub(first).and_then(|at| frames.get(at));
        let offset = (column_idx * GROUP) as isize - row as isize;
        marks.map_or(0, |marks| marks.bits(offset) & ((1 << GROUP) - 1))
    })
}
