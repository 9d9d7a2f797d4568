//! Sums frame distances to clip distances: D(i, j) = sum over k < f of w(k) d(i + k, j + k) (Okabe et al.,
//! equation 2, with w = 1; docs/explanation/algorithms.md, "Distances").
//!
//! The sums slide along the diagonals. Rows are indexed by offset j - i, so a diagonal is a column. Each step
//! is then one addition and one subtraction, and only f rows of d are stored. Binomial weights (Schoedl et
//! al., Video Textures, 2000) emphasise the middle of the clip. They are computed by f - 1 successive sums of
//! two.

use crate::analysis::params::ClipWeights;

/// The frames that are summed to a clip distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clip {
    /// Clip length f, frames, at least 1.
    pub frames: usize,
    /// Weights of the frames.
    pub weights: ClipWeights,
}

impl Clip {
    /// Returns w(k) for every k < f: 1, or the binomial coefficient of k out of f - 1.
    pub fn weights(&self) -> Vec<u64> {
        let next = |w: &mut u64, k: usize| {
            let this = *w;
            *w = match self.weights {
                ClipWeights::Uniform => 1,
                ClipWeights::Binomial => this * (self.frames - 1 - k) as u64 / (k + 1) as u64,
            };
            Some(this)
        };
        (0..self.frames).scan(1, next).collect()
    }
}

/// Turns successive rows of d into rows of D.
pub(super) struct WindowSums {
    sums: Vec<SlidingSum>,
}

impl WindowSums {
    /// Creates the sums for a footage of `n_frames` frames.
    pub(super) fn new(clip: Clip, n_frames: usize) -> WindowSums {
        let [n_sums, n_rows] = match clip.weights {
            ClipWeights::Uniform => [1, clip.frames],
            ClipWeights::Binomial => [clip.frames - 1, 2],
        };
        let sum = || SlidingSum::new(n_rows, n_frames);
        WindowSums {
            sums: std::iter::repeat_with(sum).take(n_sums).collect(),
        }
    }

    /// Takes d(r, r..) for the next r. From r = f - 1 on, returns D(i, i..) for i = r - f + 1.
    pub(super) fn push<'a>(&'a mut self, row: &'a [u64]) -> Option<&'a [u64]> {
        self.sums.iter_mut().try_fold(row, |row, sum| sum.push(row))
    }
}

/// A sliding sum of successive rows.
struct SlidingSum {
    ring: Vec<Vec<u64>>,
    sums: Vec<u64>,
    n_pushed: usize,
}

impl SlidingSum {
    fn new(n_rows: usize, n_frames: usize) -> SlidingSum {
        SlidingSum {
            ring: vec![Vec::new(); n_rows],
            sums: vec![0; n_frames],
            n_pushed: 0,
        }
    }

    fn push(&mut self, row: &[u64]) -> Option<&[u64]> {
        let n_rows = self.ring.len();
        let oldest = &mut self.ring[self.n_pushed % n_rows];
        for (sum, old) in self.sums.iter_mut().zip(oldest.iter()) {
            *sum -= old;
        }
        for (sum, new) in self.sums.iter_mut().zip(row) {
            *sum += new;
        }
        oldest.clear();
        oldest.extend_from_slice(row);
        self.n_pushed += 1;
        (self.n_pushed >= n_rows).then(|| &self.sums[..row.len()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(frames: usize, weights: ClipWeights) -> Clip {
        Clip { frames, weights }
    }

    #[test]
    fn the_rows_of_d_become_sums_along_diagonals() {
        // d(i, j) = 10 i + j over 4 frames, f = 2: D(i, j) = d(i, j) + d(i + 1, j + 1).
        let mut window = WindowSums::new(clip(2, ClipWeights::Uniform), 4);
        assert_eq!(window.push(&[0, 1, 2, 3]), None);
        assert_eq!(window.push(&[11, 12, 13]), Some(&[11, 13, 15][..]));
        assert_eq!(window.push(&[22, 23]), Some(&[33, 35][..]));
        assert_eq!(window.push(&[33]), Some(&[55][..]));
    }

    #[test]
    fn a_window_of_one_frame_changes_nothing() {
        for weights in [ClipWeights::Uniform, ClipWeights::Binomial] {
            let mut window = WindowSums::new(clip(1, weights), 2);
            assert_eq!(window.push(&[0, 7]), Some(&[0, 7][..]));
            assert_eq!(window.push(&[0]), Some(&[0][..]));
        }
    }

    #[test]
    fn binomial_weights_are_those_of_pascals_triangle() {
        let clip = clip(5, ClipWeights::Binomial);
        assert_eq!(clip.weights(), [1, 4, 6, 4, 1]);
        let mut window = WindowSums::new(clip, 6);
        let rows: [&[u64]; 6] = [&[1; 6], &[0; 5], &[0; 4], &[10; 3], &[0; 2], &[0]];
        let sums: Vec<_> = rows
            .iter()
            .map(|row| window.push(row).map(<[u64]>::to_vec))
            .collect();
        assert_eq!(sums[3], None);
        assert_eq!(sums[4], Some(vec![1 + 4 * 10; 2]));
        assert_eq!(sums[5], Some(vec![6 * 10]));
    }
}
