//! Inverted lists for the approximate search, for footage so long that even the bounds of all pairs take too
//! long (docs/explanation/algorithms.md, "Transitions and playback").
//!
//! The vector of a clip holds the sums over 8 x 8 squares of its middle frame, where playback jumps. K-means
//! groups the vectors around centers. A clip is compared only with the clips of the lists with the nearest
//! centers. Distances of these pairs are exact; `recall` reports the share of similar pairs found. Arithmetic
//! is integer and ties go to the smaller index, so the result does not depend on the number of threads.

use rayon::prelude::*;

use super::Side;
use super::bounds::SquareSums;
use super::kernel::least_differences;
use super::marks::Marks;
use super::pixels::ComparedSprites;
use super::window::Clip;
use crate::cpu::Level;

/// Largest number of lists. For fewer clips it is about the square root of their number. Free choice.
const MOST_LISTS: usize = 1024;
/// A clip is compared with one in this many lists, but with at least `LEAST_PROBED`. Free choice.
const PROBED_SHARE: usize = 16;
const LEAST_PROBED: usize = 8;
/// Number of training vectors per center. Free choice.
const LEARNED_FROM: usize = 48;
/// Number of k-means iterations. Free choice.
const N_ROUNDS: usize = 5;

/// The clips in lists of similar ones.
pub struct Lists {
    /// The list of each clip.
    list_of: Vec<u32>,
    /// The clips of each list, ascending.
    members: Vec<Vec<u32>>,
    /// The lists with which each clip is compared, ascending; plain, then mirrored.
    probed: [Vec<Vec<u32>>; 2],
}

impl Lists {
    /// Builds the lists of all clips. `mirrored` states whether mirrored pairs are searched too.
    pub fn of(pixels: &ComparedSprites, clip: Clip, mirrored: bool, cpu: Level) -> Lists {
        let n_clips = (pixels.n_frames() + 1).saturating_sub(clip.frames);
        let plain = &pixels.bounds(Side::Plain).fine;
        let middle = |i: usize| i + clip.frames / 2;
        let centers = Centers::learn(plain, n_clips, middle, cpu);
        let all = (0..n_clips).into_par_iter();
        let list_of: Vec<u32> = all
            .map(|i| centers.nearest(plain.row(middle(i)), 1)[0])
            .collect();
        let mut members = vec![Vec::new(); centers.n_lists];
        for (i, &list) in (0..).zip(&list_of) {
            members[list as usize].push(i);
        }
        let n_probed = (centers.n_lists / PROBED_SHARE).max(LEAST_PROBED);
        let probed = [Side::Plain, Side::Mirrored].map(|side| {
            let n_asking = if side == Side::Plain || mirrored {
                n_clips
            } else {
                0
            };
            let rows = &pixels.bounds(side).fine;
            let of = |i: usize| {
                let mut lists = centers.nearest(rows.row(middle(i)), n_probed);
                lists.sort_unstable();
                lists
            };
            (0..n_asking).into_par_iter().map(of).collect()
        });
        Lists {
            list_of,
            members,
            probed,
        }
    }

    /// Marks the clips with which clip `i` is compared, from `i` on: entry k of `row` is clip i + k. Other
    /// marks stay.
    pub fn mark(&self, side: Side, i: usize, row: &mut Marks) {
        for &list in &self.probed[side as usize][i] {
            let members = &self.members[list as usize];
            let later = members.partition_point(|&j| (j as usize) < i);
            for &j in &members[later..] {
                row.mark(j as usize - i);
            }
        }
    }

    /// Returns whether clip `i` is compared with clip `j`, for j >= i.
    pub fn holds(&self, side: Side, i: usize, j: usize) -> bool {
        self.probed[side as usize][i]
            .binary_search(&self.list_of[j])
            .is_ok()
    }
}

/// The centers of the lists.
struct Centers {
    cpu: Level,
    n_lists: usize,
    values: Vec<u16>,
}

impl Centers {
    fn learn(
        vectors: &SquareSums,
        n_clips: usize,
        middle: impl Fn(usize) -> usize + Sync,
        cpu: Level,
    ) -> Centers {
        let n_lists = n_clips.isqrt().clamp(1, MOST_LISTS).min(n_clips);
        let spread = |n: usize| {
            let frame = |k: usize| middle(k * n_clips / n.max(1));
            (0..n).map(frame).collect::<Vec<usize>>()
        };
        let first = spread(n_lists);
        let mut centers = Centers {
            cpu,
            n_lists,
            values: first
                .iter()
                .flat_map(|&frame| vectors.row(frame))
                .copied()
                .collect(),
        };
        let sample = spread((LEARNED_FROM * n_lists).min(n_clips));
        for _ in 0..N_ROUNDS {
            let nearest: Vec<u32> = sample
                .par_iter()
                .map(|&frame| centers.nearest(vectors.row(frame), 1)[0])
                .collect();
            centers.move_to(sample.iter().map(|&frame| vectors.row(frame)), &nearest);
        }
        centers
    }

    /// Moves each center to the mean of its vectors, rounded down. A center without vectors stays.
    fn move_to<'a>(&mut self, vectors: impl Iterator<Item = &'a [u16]>, nearest: &[u32]) {
        let n_values = self.values.len() / self.n_lists.max(1);
        let mut sums = vec![0u64; self.values.len()];
        let mut counts = vec![0u64; self.n_lists];
        for (vector, &list) in vectors.zip(nearest) {
            let sums = &mut sums[list as usize * n_values..][..n_values];
            let each = sums.iter_mut().zip(vector);
            each.for_each(|(sum, &value)| *sum += u64::from(value));
            counts[list as usize] += 1;
        }
        for (k, (value, sum)) in self.values.iter_mut().zip(sums).enumerate() {
            if let Some(mean) = sum.checked_div(counts[k / n_values]) {
                *value = mean as u16;
            }
        }
    }

    /// Returns the `n` lists with the nearest centers, the nearest first.
    fn nearest(&self, vector: &[u16], n: usize) -> Vec<u32> {
        let mut away = vec![0; self.n_lists];
        least_differences(self.cpu, vector, &self.values, &mut away);
        let mut lists: Vec<(u32, u32)> = away.into_iter().zip(0..).collect();
        let n = n.min(lists.len());
        if n < lists.len() {
            lists.select_nth_unstable(n);
        }
        lists.truncate(n);
        lists.sort_unstable();
        lists.into_iter().map(|(_, list)| list).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn centers(values: &[[u16; 16]]) -> Centers {
        Centers {
            cpu: Level::detect(),
            n_lists: values.len(),
            values: values.concat(),
        }
    }

    #[test]
    fn the_nearest_lists_come_first_and_of_equals_the_smaller() {
        let centers = centers(&[[9; 16], [4; 16], [6; 16], [5; 16], [0; 16]]);
        assert_eq!(centers.nearest(&[5; 16], 3), [3, 1, 2]);
        assert_eq!(centers.nearest(&[7; 16], 9), [2, 0, 3, 1, 4]);
    }

    #[test]
    fn centers_move_to_the_mean_of_their_own_and_stay_where_they_have_none() {
        let mut centers = centers(&[[0; 16], [100; 16]]);
        let vectors: [&[u16]; 2] = [&[3; 16], &[6; 16]];
        centers.move_to(vectors.into_iter(), &[0, 0]);
        assert_eq!(centers.values, [[4u16; 16], [100; 16]].concat());
    }
}
