//! The whole matrix D, for those who ask for it: as numbers, or min-pooled to a picture's size
//! (ALGORITHMS.md 5; O's figure 2). Transitions never need it.

use super::{Cancelled, Distances};
use crate::progress::Progress;

/// All D(i, j), symmetric; half of it is held, eight bytes a number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DistanceMatrix {
    n_clips: usize,
    /// D(i, i..) for every i, one after the other.
    triangle: Vec<u64>,
}

impl DistanceMatrix {
    /// Computes every distance. The caller bounds N: 8192 clips take 268 MB.
    pub fn of(distances: &Distances<'_>, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let n_clips = distances.n_clips();
        let mut triangle = Vec::with_capacity(n_clips * (n_clips + 1) / 2);
        distances.for_each_row(progress, |_, row| triangle.extend_from_slice(row))?;
        Ok(DistanceMatrix { n_clips, triangle })
    }

    /// A matrix of given numbers.
    #[cfg(test)]
    pub(crate) fn of_triangle(n_clips: usize, triangle: Vec<u64>) -> Self {
        DistanceMatrix { n_clips, triangle }
    }

    /// Rows and columns: N - f + 1.
    pub fn n_clips(&self) -> usize {
        self.n_clips
    }

    /// D(i, j). Panics beyond the last clip.
    pub fn distance(&self, i: usize, j: usize) -> u64 {
        let (i, j) = (i.min(j), i.max(j));
        assert!(j < self.n_clips, "there are {} clips, no {j}", self.n_clips);
        // Rows above i hold n, n - 1, ..., n - i + 1 numbers.
        let row = i * self.n_clips - i * i.saturating_sub(1) / 2;
        self.triangle[row + j - i]
    }

    /// The largest D; 0 when there are no clips.
    pub fn max(&self) -> u64 {
        self.triangle.iter().copied().max().unwrap_or(0)
    }
}

/// D with every cell the least distance of the pairs that fall into it, so that a single like
/// moment in a long footage still shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PooledMatrix {
    /// Rows and columns: the lesser of the number of clips and what was asked for.
    pub side: usize,
    /// Row by row; symmetric.
    pub cells: Vec<u64>,
}

impl PooledMatrix {
    /// Pools D(i, j) into cell (i side / n, j side / n), divisions rounded down, with
    /// `side` = min(n, `largest_side`).
    pub fn of(
        distances: &Distances<'_>,
        largest_side: usize,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let n_clips = distances.n_clips();
        let side = n_clips.min(largest_side);
        let mut cells = vec![u64::MAX; side * side];
        let cell = |clip_idx: usize| clip_idx * side / n_clips;
        distances.for_each_row(progress, |i, row| {
            let pooled = &mut cells[cell(i) * side..][..side];
            for (j, &distance) in (i..).zip(row) {
                let least = &mut pooled[cell(j)];
                *least = distance.min(*least);
            }
        })?;
        for row in 0..side {
            for column in 0..row {
                cells[row * side + column] = cells[column * side + row];
            }
        }
        Ok(PooledMatrix { side, cells })
    }
}
