//! Only the distances below a limit, without computing most of the others (ALGORITHMS.md 5, exact pruning).
//!
//! Of the pairs of clips in a panel that are asked for the sums over 16 x 16 squares are compared; where the
//! bound of a pair is below the limit, those over 8 x 8 squares; where it still is, the pixels. What comes out
//! is exact: a distance that is asked for is left out only when a bound says that it is not below the limit.
//!
//! Pairs of clips are told by their offset j - i, so that all that one of them adds up stands in one column.

use rayon::prelude::*;

use super::asked::{self, Asked};
use super::bounds::SquareSums;
use super::group::{GROUP, Group, GroupMemory};
use super::kernel::{self, SadTile, Tile, Wanted};
use super::{Cancelled, Distances, Side};
use crate::progress::Progress;

/// Bytes that the bounds of a panel take, about.
const PANEL_BYTES: usize = 16 << 20;
/// Most groups of clips in a panel.
const MOST_GROUPS: usize = 4;

/// Stands for a distance that is not below the limit.
pub const NOT_BELOW: u64 = u64::MAX;

impl Distances<'_> {
    /// As [`for_each_row`](Distances::for_each_row), but of the distances that are not below `limit` it
    /// is only told that they are not: they are [`NOT_BELOW`]. So are those not asked for.
    pub fn for_each_row_below(
        &self,
        limit: u64,
        asked: &impl Asked,
        progress: &dyn Progress,
        mut on_row: impl FnMut(usize, &[u64]),
    ) -> Result<(), Cancelled> {
        let (n_frames, n_clips) = (self.pixels.n_frames(), self.n_clips());
        let n_groups = PANEL_BYTES / (GROUP * n_frames.max(1) * size_of::<u32>());
        let n_rows = GROUP * n_groups.clamp(1, MOST_GROUPS);
        for first in (0..n_clips).step_by(n_rows) {
            if progress.cancelled() {
                return Err(Cancelled);
            }
            let rest = 1.0 - first as f64 / n_frames as f64;
            progress.report("distances", 1.0 - rest * rest);
            let n_rows = n_rows.min(n_clips - first);
            let asked = asked::rows(asked, [first, n_rows, n_clips]);
            let rows = Panel::of(self, first, limit, asked).distances();
            for (clip_idx, row) in (first..).zip(rows) {
                on_row(clip_idx, &row);
            }
        }
        progress.report("distances", 1.0);
        Ok(())
    }
}

impl Distances<'_> {
    /// Calls `on_clip(j)` for every clip j >= i with D(i, j) < `limit`, of those asked for.
    pub fn for_each_below(
        &self,
        i: usize,
        limit: u64,
        asked: &impl Asked,
        progress: &dyn Progress,
        on_clip: impl FnMut(usize),
    ) -> Result<(), Cancelled> {
        if progress.cancelled() {
            return Err(Cancelled);
        }
        let asked = asked::rows(asked, [i, 1, self.n_clips()]);
        let row = Panel::of(self, i, limit, asked).distances().remove(0);
        let below = (i..).zip(row).filter(|(_, d)| *d != NOT_BELOW);
        below.map(|(j, _)| j).for_each(on_clip);
        Ok(())
    }
}

/// Some clips against all that come after them.
struct Panel<'a> {
    distances: &'a Distances<'a>,
    limit: u64,
    weights: Vec<u64>,
    /// The first clip.
    first: usize,
    /// Per clip: which pairs with so many clips after it may be below the limit.
    near: Vec<Vec<bool>>,
    /// Per frame of these clips: at least d of it and the frame so many after it, where that was looked at.
    least: Vec<Vec<u32>>,
}

impl<'a> Panel<'a> {
    /// Of the clips from `first` on, of which these pairs are asked for.
    fn of(
        distances: &'a Distances<'a>,
        first: usize,
        limit: u64,
        asked: Vec<Vec<bool>>,
    ) -> Panel<'a> {
        let n_frames = distances.pixels.n_frames();
        let last = first + asked.len() + distances.clip.frames - 1;
        Panel {
            distances,
            limit,
            weights: distances.clip.weights(),
            first,
            near: asked,
            least: (first..last).map(|row| vec![0; n_frames - row]).collect(),
        }
    }

    /// D of every clip of the panel and all from it on.
    fn distances(mut self) -> Vec<Vec<u64>> {
        let pixels = self.distances.pixels;
        let [rows, columns] = [self.distances.side, Side::Plain].map(|side| pixels.bounds(side));
        self.look_at(&rows.coarse, &columns.coarse);
        self.look_at(&rows.fine, &columns.fine);
        let tiles = Tiles::of(&self, &self.frames());
        let one = |(clip, near): (usize, &Vec<bool>)| {
            let exact = |(offset, &near): (usize, &bool)| match near {
                false => NOT_BELOW,
                true => self.exact(&tiles, [clip, offset]),
            };
            near.iter().enumerate().map(exact).collect()
        };
        self.near.par_iter().enumerate().map(one).collect()
    }

    /// Raises the bounds of the frames of all pairs that are near to those of such squares, and drops the
    /// pairs that are not near by these.
    fn look_at(&mut self, rows: &SquareSums, columns: &SquareSums) {
        let wanted = self.frames();
        let (first, cpu) = (self.first, self.distances.cpu);
        // So low that all that is added up fits 32 bits, and where it can be as high as the limit.
        let most = u64::from(u32::MAX) / self.weights.iter().sum::<u64>();
        let most = most.min(self.limit) as u32;
        let of_frame = |(k, (least, wanted)): (usize, (&mut Vec<u32>, &Vec<bool>))| {
            let row = first + k;
            for run in asked::runs(wanted) {
                let least = &mut least[run.clone()];
                rows.against(cpu, row, columns, row + run.start, least);
                least
                    .iter_mut()
                    .for_each(|least| *least = (*least).min(most));
            }
        };
        let frames = self.least.par_iter_mut().zip(&wanted);
        frames.enumerate().for_each(of_frame);
        let (least, weights, limit) = (&self.least, &self.weights, self.limit);
        let clips = self.near.par_iter_mut().enumerate();
        clips.for_each(|(clip, near)| drop_far(near, &least[clip..], weights, limit));
    }

    /// Which pairs of frames the pairs of clips that are near consist of.
    fn frames(&self) -> Vec<Vec<bool>> {
        let f = self.distances.clip.frames;
        let of_frame = |row: usize| {
            let mut wanted = vec![false; self.least[row].len()];
            for clip in &self.near[(row + 1).saturating_sub(f)..self.near.len().min(row + 1)] {
                let both = wanted.iter_mut().zip(clip);
                both.for_each(|(wanted, near)| *wanted |= near);
            }
            wanted
        };
        (0..self.least.len())
            .into_par_iter()
            .map(of_frame)
            .collect()
    }

    fn exact(&self, tiles: &Tiles, [clip, offset]: [usize; 2]) -> u64 {
        let first = self.first + clip;
        let weighed = (first..).zip(&self.weights);
        let sum = weighed
            .map(|(row, w)| w * tiles.sad(row, row + offset))
            .sum();
        if sum < self.limit { sum } else { NOT_BELOW }
    }
}

/// Drops the pairs of a clip that the bounds of their frames say are not below the limit. All that is
/// added up fits 32 bits.
fn drop_far(near: &mut [bool], least: &[Vec<u32>], weights: &[u64], limit: u64) {
    let mut sums = Vec::new();
    let asked: Vec<_> = asked::runs(near).collect();
    for run in asked {
        sums.clear();
        sums.resize(run.len(), 0u32);
        for (&weight, row) in weights.iter().zip(least) {
            let each = sums.iter_mut().zip(&row[run.clone()]);
            match weight as u32 {
                1 => each.for_each(|(sum, least)| *sum += least),
                weight => each.for_each(|(sum, least)| *sum += least * weight),
            }
        }
        for (near, &sum) in near[run].iter_mut().zip(&sums) {
            *near &= u64::from(sum) < limit;
        }
    }
}

/// d of some pairs of frames, by tiles of 48 x 48.
struct Tiles {
    /// The first group of rows; columns are counted from it too.
    first: usize,
    /// By groups of columns, then of rows.
    tiles: Vec<Vec<Option<Box<SadTile>>>>,
}

impl Tiles {
    /// Computes the wanted ones.
    fn of(panel: &Panel<'_>, wanted: &[Vec<bool>]) -> Tiles {
        let distances = panel.distances;
        let first = panel.first / GROUP;
        let last = (panel.first + wanted.len() - 1) / GROUP;
        let mut memory: Vec<GroupMemory> = (first..=last).map(|_| GroupMemory::default()).collect();
        let rows: Vec<Group<'_>> = (first..=last)
            .zip(&mut memory)
            .map(|(group_idx, memory)| distances.row_group(group_idx, memory))
            .collect();
        let masks = masks(
            panel.first,
            wanted,
            [first, last],
            distances.pixels.n_groups(),
        );
        let tiles = (first..)
            .zip(&masks)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map_init(GroupMemory::default, |memory, (column_idx, masks)| {
                if masks.iter().flatten().all(|&bits| bits == 0) {
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
                rows.iter().zip(masks).map(tile).collect()
            })
            .collect();
        Tiles { first, tiles }
    }

    /// d of a pair that was wanted.
    fn sad(&self, row: usize, column: usize) -> u64 {
        let tile = &self.tiles[column / GROUP - self.first][row / GROUP - self.first];
        tile.as_ref()
            .map_or(0, |tile| tile[row % GROUP][column % GROUP])
    }
}

/// Which pairs of each tile are wanted: by groups of columns, then of rows, both from `first_group` on.
fn masks(
    first_row: usize,
    wanted: &[Vec<bool>],
    [first_group, last_group]: [usize; 2],
    n_groups: usize,
) -> Vec<Vec<Wanted>> {
    let nothing = vec![[0; GROUP]; last_group + 1 - first_group];
    let mut masks = vec![nothing; n_groups - first_group];
    for (row, wanted) in (first_row..).zip(wanted) {
        for (column, _) in (row..).zip(wanted).filter(|(_, wanted)| **wanted) {
            let of_group = &mut masks[column / GROUP - first_group][row / GROUP - first_group];
            of_group[row % GROUP] |= 1 << (column % GROUP);
        }
    }
    masks
}
