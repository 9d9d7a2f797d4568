//! The whole matrix D, for export. Transitions do not need it.

use super::{Cancelled, Distances};
use crate::progress::Progress;

/// All D(i, j). The matrix is symmetric; only half of it is stored, eight bytes per entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DistanceMatrix {
    n_clips: usize,
    /// D(i, i..) for every i, concatenated.
    triangle: Vec<u64>,
}

impl DistanceMatrix {
    /// Computes every distance. Memory grows with the square of the number of clips: 8192 clips take 268 MB.
    pub fn compute(distances: &Distances<'_>, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let n_clips = distances.n_clips();
        let mut triangle = Vec::with_capacity(n_clips * (n_clips + 1) / 2);
        distances.for_each_row(progress, |_, row| triangle.extend_from_slice(row))?;
        Ok(DistanceMatrix { n_clips, triangle })
    }

    /// Creates a matrix from its upper triangle, by rows.
    #[cfg(test)]
    pub(crate) fn from_triangle(n_clips: usize, triangle: Vec<u64>) -> Self {
        DistanceMatrix { n_clips, triangle }
    }

    /// Returns the number of rows and columns, N - f + 1.
    pub fn n_clips(&self) -> usize {
        self.n_clips
    }

    /// Returns D(i, j). Panics if a clip does not exist.
    pub fn distance(&self, i: usize, j: usize) -> u64 {
        let (i, j) = (i.min(j), i.max(j));
        assert!(j < self.n_clips, "there are {} clips, no {j}", self.n_clips);
        // The rows above row i have n, n - 1, ..., n - i + 1 entries.
        let row = i * self.n_clips - i * i.saturating_sub(1) / 2;
        self.triangle[row + j - i]
    }

    /// Returns the largest D, or 0 without clips.
    pub fn max(&self) -> u64 {
        self.triangle.iter().copied().max().unwrap_or(0)
    }
}
