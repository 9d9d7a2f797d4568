//! Which clips may be alike, without asking every pair: inverted lists, for footage so long that even bounds
//! of all pairs take long (ALGORITHMS.md 5, above 50 000 frames).
//!
//! The sums over 8 x 8 squares of the frame in a clip's middle, where playback jumps, are its vector. Vectors
//! are gathered around centers (k-means, from vectors spread evenly through the footage), and a clip is compared with those
//! of the lists whose centers are nearest to it. What is found is measured exactly afterward; what is
//! missed is told as recall. Whole numbers and ties to the smaller: the same with any number of threads.

use rayon::prelude::*;

use super::Side;
use super::bounds::SquareSums;
use super::kernel::least_differences;
use super::marks::Marks;
use super::pixels::ComparedSprites;
use super::window::Clip;
use crate::cpu::Level;

/// Lists at most; about the square root of the number of clips below.
const MOST_LISTS: usize = 1024;
/// The share of all lists that a clip is compared with, at least `LEAST_PROBED`.
const PROBED_SHARE: usize = 16;
const LEAST_PROBED: usize = 8;
/// Vectors that the centers are learned from, for each of them; and how often.
const LEARNED_FROM: usize = 48;
const N_ROUNDS: usize = 5;

/// Clips in lists of those that look alike.
pub struct Lists {
    /// Of each clip its list.
    list_of: Vec<u32>,
    /// Of each list its clips, rising.
    members: Vec<Vec<u32>>,
    /// Of each clip the lists that it is compared with, rising; as it is, and mirrored.
    probed: [Vec<Vec<u32>>; 2],
}

impl Lists {
    /// Of all clips; `mirrored`: they will be asked for mirrored too.
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

    /// Marks those that clip `i` is compared with, from itself on: entry k of `row` is clip i + k. Nothing else
    /// is changed.
    pub fn mark(&self, side: Side, i: usize, row: &mut Marks) {
        for &list in &self.probed[side as usize][i] {
            let members = &self.members[list as usize];
            let later = members.partition_point(|&j| (j as usize) < i);
            for &j in &members[later..] {
                row.mark(j as usize - i);
            }
        }
    }

    /// Whether clip `i` is compared with clip `j` >= i.
    pub fn holds(&self, side: Side, i: usize, j: usize) -> bool {
        self.probed[side as usize][i]
            .binary_search(&self.list_of[j])
            .is_ok()
    }
}

/// What lists are gathered around.
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

    /// Moves each center to the mean of those nearest to it, rounded down, if there are any.
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

    /// The `n` lists whose centers are nearest, the nearest first.
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
