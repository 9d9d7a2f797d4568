//! Local minima of D: of many pairs of clips around one moment, the best one (Kovar, Gleicher & Pighin,
//! Motion Graphs, 2002; docs/explanation/algorithms.md, "Transitions and playback").
//!
//! A pair is a local minimum if no other pair within two frames of it, in either clip, has a smaller D. Among
//! equals, the smaller (i, j) wins. Only pairs of usable clips with the minimum gap compete. Otherwise the
//! pairs of a resting animal would lose to useless pairs close to the diagonal.

use std::cmp::Ordering;

/// Radius of the neighborhood in each clip, clips. Free choice.
pub(super) const RADIUS: usize = 2;
const N_ROWS: usize = 2 * RADIUS + 1;

/// A pair of clips, `from <= to`, and its distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClipPair {
    /// First frame of the earlier clip.
    pub from: usize,
    /// First frame of the later clip.
    pub to: usize,
    /// D, or Dm for mirrored pairs.
    pub distance: u64,
}

/// Finds the local minima below a limit in a stream of rows.
pub struct LocalMinima<'a> {
    usable: &'a [bool],
    min_gap: usize,
    limit: u64,
    rows: [Row; N_ROWS],
    n_rows: usize,
}

/// The competing pairs of one clip.
#[derive(Default)]
struct Row {
    pairs: Vec<ClipPair>,
    /// Distances of the pairs by j - i; `u64::MAX` for pairs that do not compete.
    by_gap: Vec<u64>,
}

impl LocalMinima<'_> {
    /// Starts a search among pairs of `usable` clips at least `min_gap` apart. Only D < `limit` is
    /// reported.
    pub fn new(usable: &[bool], min_gap: usize, limit: u64) -> LocalMinima<'_> {
        LocalMinima {
            usable,
            min_gap,
            limit,
            rows: Default::default(),
            n_rows: 0,
        }
    }

    /// Adds the pairs (i, j) with j >= i of the next clip i, and reports the minima that are then certain.
    /// Missing pairs count as infinitely distant.
    pub fn push(&mut self, pairs: &[ClipPair], on_minimum: impl FnMut(ClipPair)) {
        let i = self.n_rows;
        let competes = |pair: &&ClipPair| {
            self.usable[i] && self.usable[pair.to] && pair.to - i >= self.min_gap
        };
        let pairs = pairs.iter().filter(competes).copied();
        self.rows[i % N_ROWS].fill(self.usable.len() - i, pairs);
        self.n_rows += 1;
        if let Some(settled) = i.checked_sub(RADIUS) {
            self.report(settled, on_minimum);
        }
    }

    /// Reports the minima of the last rows.
    pub fn finish(self, mut on_minimum: impl FnMut(ClipPair)) {
        for i in self.n_rows.saturating_sub(RADIUS)..self.n_rows {
            self.report(i, &mut on_minimum);
        }
    }

    fn report(&self, from: usize, on_minimum: impl FnMut(ClipPair)) {
        let pairs = self.rows[from % N_ROWS].pairs.iter().copied();
        let minima = pairs.filter(|&pair| pair.distance < self.limit && self.is_minimum(pair));
        minima.for_each(on_minimum);
    }

    fn is_minimum(&self, pair: ClipPair) -> bool {
        let around = |center: usize| center.saturating_sub(RADIUS)..=center + RADIUS;
        around(pair.from).all(|a| {
            around(pair.to).all(|b| {
                self.distance(a, b)
                    .is_none_or(|other| order(other, pair) != Ordering::Less)
            })
        })
    }

    /// Returns the pair of clips a and b with the smaller clip first, or `None` if its row is not known.
    fn distance(&self, a: usize, b: usize) -> Option<ClipPair> {
        let (from, to) = (a.min(b), a.max(b));
        if from >= self.n_rows {
            return None;
        }
        let distance = *self.rows[from % N_ROWS].by_gap.get(to - from)?;
        Some(ClipPair { from, to, distance })
    }
}

impl Row {
    fn fill(&mut self, n_clips: usize, pairs: impl Iterator<Item = ClipPair>) {
        for pair in self.pairs.drain(..) {
            self.by_gap[pair.to - pair.from] = u64::MAX;
        }
        self.pairs.extend(pairs);
        self.by_gap.resize(n_clips, u64::MAX);
        for pair in &self.pairs {
            self.by_gap[pair.to - pair.from] = pair.distance;
        }
    }
}

fn order(a: ClipPair, b: ClipPair) -> Ordering {
    (a.distance, a.from, a.to).cmp(&(b.distance, b.from, b.to))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn minima(rows: &[&[u64]], usable: &[bool], limit: u64) -> Vec<(usize, usize)> {
        let mut found = Vec::new();
        let mut minima = LocalMinima::new(usable, 0, limit);
        for (from, row) in rows.iter().enumerate() {
            let pairs: Vec<ClipPair> = (from..)
                .zip(*row)
                .map(|(to, &distance)| ClipPair { from, to, distance })
                .collect();
            minima.push(&pairs, |pair| found.push((pair.from, pair.to)));
        }
        minima.finish(|pair| found.push((pair.from, pair.to)));
        found
    }

    #[test]
    fn only_the_best_pair_around_a_moment_is_kept() {
        let rows: [&[u64]; 8] = [
            &[0, 9, 9, 9, 9, 9, 5, 9],
            &[0, 9, 9, 9, 9, 4, 5],
            &[0, 9, 9, 9, 9, 9],
            &[0, 9, 9, 9, 9],
            &[0, 9, 9, 9],
            &[0, 9, 9],
            &[0, 9],
            &[0],
        ];
        let off_diagonal = |pairs: Vec<(usize, usize)>| -> Vec<_> {
            pairs.into_iter().filter(|(i, j)| i != j).collect()
        };
        assert_eq!(off_diagonal(minima(&rows, &[true; 8], 9)), [(1, 6)]);
        let mut usable = [true; 8];
        usable[1] = false;
        assert_eq!(off_diagonal(minima(&rows, &usable, 9)), [(0, 6)]);
        assert_eq!(off_diagonal(minima(&rows, &[true; 8], 4)), []);
    }

    #[test]
    fn ties_go_to_the_smaller_pair() {
        let row = [7u64; 6];
        let rows: Vec<&[u64]> = (0..6).map(|i| &row[i..]).collect();
        assert_eq!(minima(&rows, &[true; 6], 8), [(0, 0)]);
    }
}
