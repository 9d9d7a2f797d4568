//! Computes only the distances below a limit, and skips most others
//! (docs/explanation/algorithms.md, "Distances").
//!
//! For the needed pairs of a panel (see `asked`), bounds from 16 x 16 squares come first. Pairs with a bound
//! below the limit get bounds from 8 x 8 squares. Pairs that remain, and their competitors, get exact
//! distances. A needed pair is skipped only if a bound proves that its distance is not below the limit.
//!
//! Pairs are indexed by their offset j - i. All frame pairs of one clip pair are then in one column.

use std::ops::Range;

use rayon::prelude::*;

use super::asked::{self, Asked};
use super::bounds::SquareSums;
use super::group::{GROUP, Group, GroupMemory};
use super::kernel::{self, SadTile, Tile, Wanted};
use super::marks::Marks;
use super::{Cancelled, ClipPair, Distances, Side};
use crate::progress::Progress;

/// Approximate memory of a panel, bytes. Groups in the temporary storage are read once per panel. Free
/// choice.
const PANEL_BYTES: usize = 128 << 20;
/// Memory per pair of frames, bytes: its bound and its entry in a tile.
const PAIR_BYTES: usize = size_of::<u32>() + size_of::<u64>();
/// Largest number of groups in a panel. Tests use 1, so that their short films have several panels.
const MOST_GROUPS: usize = if cfg!(test) { 1 } else { 8 };

impl Distances<'_> {
    /// Calls `on_row(i, pairs)` for every clip i in order. The pairs (i, j) have D(i, j) < `limit` and
    /// ascending j >= i.
    ///
    /// They are all needed pairs and some of their competitors. Fails when cancelled.
    pub fn for_each_row_below(
        &self,
        limit: u64,
        asked: &impl Asked,
        progress: &dyn Progress,
        mut on_row: impl FnMut(usize, &[ClipPair]),
    ) -> Result<(), Cancelled> {
        let (n_frames, n_clips) = (self.pixels.n_frames(), self.n_clips());
        let n_groups = PANEL_BYTES / (GROUP * n_frames.max(1) * PAIR_BYTES);
        let n_rows = GROUP * n_groups.clamp(1, MOST_GROUPS);
        let mut panel = Panel::new(self, limit);
        for first in (0..n_clips).step_by(n_rows) {
            if progress.cancelled() {
                return Err(Cancelled);
            }
            let rest = 1.0 - first as f64 / n_frames as f64;
            progress.report("distances", 1.0 - rest * rest);
            let clips = first..n_clips.min(first + n_rows);
            for (i, pairs) in clips.clone().zip(panel.pairs(clips, asked)) {
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
    most: u32,
    /// The first clip.
    first: usize,
    /// Lower bounds of d by frame of these clips and by offset; valid only where computed.
    least: Vec<Vec<u32>>,
    /// Buffers for the row groups.
    memory: Vec<GroupMemory>,
}

impl<'a> Panel<'a> {
    fn new(distances: &'a Distances<'a>, limit: u64) -> Panel<'a> {
        let weights = distances.clip.weights();
        let most = u64::from(u32::MAX) / weights.iter().sum::<u64>();
        Panel {
            distances,
            limit,
            most: most.min(limit) as u32,
            weights,
            first: 0,
            least: Vec::new(),
            memory: Vec::new(),
        }
    }

    /// Returns the pairs below the limit for each of the clips, ascending.
    fn pairs(&mut self, clips: Range<usize>, asked: &impl Asked) -> Vec<Vec<ClipPair>> {
        let (reach, n_clips) = (asked.reach(), self.distances.n_clips());
        // Pairs of earlier or later clips may have competitors among these clips.
        let around = clips.start.saturating_sub(reach)..n_clips.min(clips.end + reach);
        let ask = |i: usize| {
            let mut row = Marks::none(n_clips - i);
            asked.mark(i, &mut row);
            row
        };
        let asked: Vec<Marks> = around.clone().into_par_iter().map(ask).collect();
        self.begin_at(around.clone());
        let pixels = self.distances.pixels;
        let [rows, columns] = [self.distances.side, Side::Plain].map(|side| pixels.bounds(side));
        let mut near = asked.clone();
        self.drop_far(&mut near, &rows.coarse, &columns.coarse);
        self.drop_far(&mut near, &rows.fine, &columns.fine);
        let mut competing = asked::competing(&near, &asked, reach);
        self.drop_far(&mut competing, &rows.fine, &columns.fine);
        let both = near.iter_mut().zip(&competing);
        both.for_each(|(near, competing)| near.add(competing, 0));
        self.exact(
            clips.start,
            &near[clips.start - around.start..][..clips.len()],
        )
    }

    fn begin_at(&mut self, clips: Range<usize>) {
        let frames = clips.start..clips.end + self.distances.clip.frames - 1;
        let n_frames = self.distances.pixels.n_frames();
        self.first = clips.start;
        self.least.resize_with(frames.len(), Vec::new);
        // Old values from an earlier panel are never read, because each bound is computed before it is used.
        let rows = self.least.iter_mut().zip(frames);
        rows.for_each(|(least, row)| least.resize(n_frames - row, 0));
    }

    /// Computes the bounds for the frames of all pairs in `near`, and drops the pairs whose bound reaches the
    /// limit.
    fn drop_far(&mut self, near: &mut [Marks], rows: &SquareSums, columns: &SquareSums) {
        let (first, f, cpu) = (self.first, self.distances.clip.frames, self.distances.cpu);
        let (most, limit, weights) = (self.most, self.limit, &self.weights);
        let of_frame = |(k, least): (usize, &mut Vec<u32>)| {
            let row = first + k;
            for run in frames_of(near, k, f).runs() {
                let least = &mut least[run.clone()];
                rows.against(cpu, row, columns, row + run.start, least);
                least
                    .iter_mut()
                    .for_each(|least| *least = (*least).min(most));
            }
        };
        self.least.par_iter_mut().enumerate().for_each(of_frame);
        let least = &self.least;
        let clips = near.par_iter_mut().enumerate();
        clips.for_each(|(clip, near)| drop_far_of(near, &least[clip..], weights, limit));
    }

    /// Returns the marked pairs of these clips with an exact distance below the limit.
    fn exact(&mut self, first: usize, near: &[Marks]) -> Vec<Vec<ClipPair>> {
        let tiles = Tiles::of(self.distances, first, near, &mut self.memory);
        let one = |(from, near): (usize, &Marks)| {
            let pair = |offset: usize| {
                let weighed = (from..).zip(&self.weights);
                let d = weighed.map(|(row, w)| w * tiles.sad(row, row + offset));
                ClipPair {
                    from,
                    to: from + offset,
                    distance: d.sum(),
                }
            };
            let pairs = near.ones().map(pair);
            pairs.filter(|pair| pair.distance < self.limit).collect()
        };
        let clips = (first..first + near.len()).into_par_iter().zip(near);
        clips.map(one).collect()
    }
}

/// Returns which frame pairs of frame `row` the pairs of clips contain. `row` counts from the first of the
/// clips.
fn frames_of(clips: &[Marks], row: usize, f: usize) -> Marks {
    let within = clips[..clips.len().min(row + 1)].iter();
    let mut within = within.skip((row + 1).saturating_sub(f));
    let mut frames = within.next().cloned().unwrap_or_default();
    within.for_each(|clip| frames.add(clip, 0));
    frames
}

/// Drops the pairs of a clip whose summed bounds reach the limit. The sums fit 32 bits.
fn drop_far_of(near: &mut Marks, least: &[Vec<u32>], weights: &[u64], limit: u64) {
    let mut sums = Vec::new();
    let runs: Vec<Range<usize>> = near.runs().collect();
    for run in runs {
        sums.clear();
        sums.resize(run.len(), 0u32);
        for (&weight, row) in weights.iter().zip(least) {
            let each = sums.iter_mut().zip(&row[run.clone()]);
            match weight as u32 {
                1 => each.for_each(|(sum, least)| *sum += least),
                weight => each.for_each(|(sum, least)| *sum += least * weight),
            }
        }
        let far = run.zip(&sums).filter(|&(_, &sum)| u64::from(sum) >= limit);
        far.for_each(|(offset, _)| near.unmark(offset));
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
    fn of(
        distances: &Distances<'_>,
        first_clip: usize,
        clips: &[Marks],
        memory: &mut Vec<GroupMemory>,
    ) -> Tiles {
        let f = distances.clip.frames;
        let frames: Vec<Marks> = (0..clips.len() + f - 1)
            .map(|row| frames_of(clips, row, f))
            .collect();
        let first = first_clip / GROUP;
        let last = (first_clip + frames.len() - 1) / GROUP;
        memory.resize_with(memory.len().max(last + 1 - first), GroupMemory::default);
        let rows: Vec<Group<'_>> = (first..=last)
            .zip(memory)
            .map(|(group_idx, memory)| distances.row_group(group_idx, memory))
            .collect();
        let of_columns = |memory: &mut GroupMemory, column_idx: usize| {
            let wanted = |row_idx: usize| wanted(&frames, first_clip, [row_idx, column_idx]);
            let wanted: Vec<Wanted> = (first..=last).map(wanted).collect();
            if wanted.as_flattened().iter().all(|&bits| bits == 0) {
                return vec![None; rows.len()];
            }
            let columns = distances.pixels.group(column_idx, memory);
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
            tiles: columns.map_init(GroupMemory::default, of_columns).collect(),
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
