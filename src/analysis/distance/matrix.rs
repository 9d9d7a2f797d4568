//! The whole matrix D, for those who ask for it as numbers (ALGORITHMS.md 5). Transitions never need it.

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
