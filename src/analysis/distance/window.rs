//! From distances of frames to distances of clips: D(i, j) = sum over k < f of d(i + k, j + k),
//! O (2), by sums that slide along the diagonals (ALGORITHMS.md 5).
//!
//! Rows are held by their offset j - i, so that a diagonal is a column: sliding along it is one
//! addition and one subtraction, and f rows of d are all that is remembered.

/// Slides over the rows of d, from the first, and yields the rows of D.
pub(super) struct WindowSums {
    ring: Vec<Vec<u64>>,
    sums: Vec<u64>,
    n_pushed: usize,
}

impl WindowSums {
    /// For windows of `clip_frames` >= 1 over `n_frames` frames.
    pub(super) fn new(clip_frames: usize, n_frames: usize) -> WindowSums {
        WindowSums {
            ring: vec![Vec::new(); clip_frames],
            sums: vec![0; n_frames],
            n_pushed: 0,
        }
    }

    /// Takes d(r, r..) for the next r. From r = f - 1 on it returns D(i, i..) for i = r - f + 1.
    pub(super) fn push(&mut self, row: &[u64]) -> Option<(usize, &[u64])> {
        let clip_frames = self.ring.len();
        let oldest = &mut self.ring[self.n_pushed % clip_frames];
        for (sum, old) in self.sums.iter_mut().zip(oldest.iter()) {
            *sum -= old;
        }
        for (sum, new) in self.sums.iter_mut().zip(row) {
            *sum += new;
        }
        oldest.clear();
        oldest.extend_from_slice(row);
        self.n_pushed += 1;
        let clip_idx = self.n_pushed.checked_sub(clip_frames)?;
        Some((clip_idx, &self.sums[..row.len()]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rows_of_d_become_sums_along_diagonals() {
        // d(i, j) = 10 i + j over 4 frames, f = 2: D(i, j) = d(i, j) + d(i + 1, j + 1).
        let mut window = WindowSums::new(2, 4);
        assert_eq!(window.push(&[0, 1, 2, 3]), None);
        assert_eq!(window.push(&[11, 12, 13]), Some((0, &[11, 13, 15][..])));
        assert_eq!(window.push(&[22, 23]), Some((1, &[33, 35][..])));
        assert_eq!(window.push(&[33]), Some((2, &[55][..])));
    }

    #[test]
    fn a_window_of_one_frame_changes_nothing() {
        let mut window = WindowSums::new(1, 2);
        assert_eq!(window.push(&[0, 7]), Some((0, &[0, 7][..])));
        assert_eq!(window.push(&[0]), Some((1, &[0][..])));
    }
}
