//! Only the distances below a limit, without computing most of the others (ALGORITHMS.md 5, exact pruning).
//!
//! For a panel of clips all sums over 16 x 16 squares are compared; where the bound of a pair of clips is
//! below the limit, those over 8 x 8 squares; where it still is, the pixels. What comes out is exact:
//! a distance is left out only when a bound says that it is not below the limit.
//!
//! Pairs of clips are told by their offset j - i, so that all that one of them adds up stands in one column.

use rayon::prelude::*;

use super::group::{GROUP, Group, GroupMemory};
use super::kernel::{self, SadTile, Tile, Wanted};
use super::{Cancelled, Distances};
use crate::progress::Progress;

/// Bytes that the bounds of a panel take, about.
const PANEL_BYTES: usize = 16 << 20;
/// Most groups of clips in a panel.
const MOST_GROUPS: usize = 4;

/// Stands for a distance that is not below the limit.
pub const NOT_BELOW: u64 = u64::MAX;

impl Distances<'_> {
    /// As [`for_each_row`](Distances::for_each_row), but of the distances that are not below `limit` it
    /// is only told that they are not: they are [`NOT_BELOW`].
    pub fn for_each_row_below(
        &self,
        limit: u64,
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
            let rows = Panel::of(self, first, n_rows, limit).distances();
            for (clip_idx, row) in (first..).zip(rows) {
                on_row(clip_idx, &row);
            }
        }
        progress.report("distances", 1.0);
        Ok(())
    }
}

/// Some clips against all that come after them.
struct Panel<'a> {
    distances: &'a Distances<'a>,
    limit: u64,
    /// The first clip, and how many there are.
    first: usize,
    n_clips: usize,
    /// Per frame of these clips: at least d of it and the frame so many after it.
    least: Vec<Vec<u32>>,
}

impl<'a> Panel<'a> {
    fn of(distances: &'a Distances<'a>, first: usize, n_clips: usize, limit: u64) -> Panel<'a> {
        let n_frames = distances.pixels.n_frames();
        let rows = &distances.pixels.bounds(distances.side).coarse;
        let columns = &distances.pixels.bounds(super::Side::Plain).coarse;
        let least = (first..first + n_clips + distances.clip.frames - 1)
            .into_par_iter()
            .map(|row| {
                let mut least = vec![0; n_frames - row];
                rows.against(distances.cpu, row, columns, row, &mut least);
                least
            })
            .collect();
        Panel {
            distances,
            limit,
            first,
            n_clips,
            least,
        }
    }

    /// D of every clip of the panel and all from it on.
    fn distances(mut self) -> Vec<Vec<u64>> {
        let near = self.near();
        self.look_closer(&self.frames_of(&near));
        let near = self.near();
        let tiles = Tiles::of(&self, &self.frames_of(&near));
        let weights = self.distances.clip.weights();
        let one = |(clip, near): (usize, &Vec<bool>)| {
            let exact = |(offset, &near): (usize, &bool)| match near {
                false => NOT_BELOW,
                true => self.exact(&tiles, &weights, [clip, offset]),
            };
            near.iter().enumerate().map(exact).collect()
        };
        near.par_iter().enumerate().map(one).collect()
    }

    /// Which pairs of clips the bounds leave below the limit.
    fn near(&self) -> Vec<Vec<bool>> {
        let weights = self.distances.clip.weights();
        let all_clips = self.distances.n_clips();
        let of_clip = |clip: usize| {
            let mut sums = vec![0u32; all_clips - self.first - clip];
            for (&weight, row) in weights.iter().zip(&self.least[clip..]) {
                let weight = u32::try_from(weight).unwrap_or(u32::MAX);
                for (sum, least) in sums.iter_mut().zip(row) {
                    *sum = sum.saturating_add(least.saturating_mul(weight));
                }
            }
            sums.iter()
                .map(|&sum| u64::from(sum) < self.limit)
                .collect()
        };
        (0..self.n_clips).into_par_iter().map(of_clip).collect()
    }

    /// Which pairs of frames those pairs of clips consist of.
    fn frames_of(&self, near: &[Vec<bool>]) -> Vec<Vec<bool>> {
        let f = self.distances.clip.frames;
        let of_frame = |row: usize| {
            let mut wanted = vec![false; self.least[row].len()];
            for clip in &near[(row + 1).saturating_sub(f)..self.n_clips.min(row + 1)] {
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

    /// Raises the bounds of the wanted pairs of frames to those of the fine squares.
    fn look_closer(&mut self, wanted: &[Vec<bool>]) {
        let Distances {
            pixels, side, cpu, ..
        } = *self.distances;
        let rows = &pixels.bounds(side).fine;
        let columns = &pixels.bounds(super::Side::Plain).fine;
        let first = self.first;
        let of_frame = |(k, (least, wanted)): (usize, (&mut Vec<u32>, &Vec<bool>))| {
            let row = first + k;
            for (offset, least) in least.iter_mut().enumerate().filter(|(k, _)| wanted[*k]) {
                *least = rows.pair(cpu, row, columns, row + offset);
            }
        };
        let rows = self.least.par_iter_mut().zip(wanted);
        rows.enumerate().for_each(of_frame);
    }

    fn exact(&self, tiles: &Tiles, weights: &[u64], [clip, offset]: [usize; 2]) -> u64 {
        let first = self.first + clip;
        let weighed = (first..).zip(weights);
        let sum = weighed
            .map(|(row, w)| w * tiles.sad(row, row + offset))
            .sum();
        if sum < self.limit { sum } else { NOT_BELOW }
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
