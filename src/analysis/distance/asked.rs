//! Which distances are asked for at all (ALGORITHMS.md 5, exact pruning: the gate comes first).
//!
//! A transition joins only clips that point the same way, but it is kept only where none of its neighbors is
//! nearer, whichever way those point. So what is asked for are the pairs that may be joined, and all around
//! them that local minima look at: with their distances the minima among the former come out the same
//! as with all distances.

use rayon::prelude::*;

use super::minima::REACH;

/// Says of pairs of clips whether their distance matters.
pub trait Asked: Sync {
    /// Which pairs of clip `i` matter: entry k of `row` is (i, i + k).
    fn mark(&self, i: usize, row: &mut [bool]);

    /// How many clips away, in each clip of a pair that matters, the others are that it competes with.
    fn reach(&self) -> usize {
        REACH
    }
}

/// Every distance.
pub struct Everything;

impl Asked for Everything {
    fn mark(&self, _: usize, row: &mut [bool]) {
        row.fill(true);
    }

    fn reach(&self) -> usize {
        0
    }
}

/// The pairs asked for of `n_rows` clips from `first` on, with those around them: entry k of row r is
/// (first + r, first + r + k).
pub(super) fn rows(asked: &impl Asked, [first, n_rows, n_clips]: [usize; 3]) -> Vec<Vec<bool>> {
    let reach = asked.reach();
    let (before, end) = (
        first.saturating_sub(reach),
        (first + n_rows + reach).min(n_clips),
    );
    let widened: Vec<Vec<bool>> = (before..end)
        .into_par_iter()
        .map(|i| {
            let mut row = vec![false; n_clips - i];
            asked.mark(i, &mut row);
            widen(&row, reach)
        })
        .collect();
    (first..first + n_rows)
        .into_par_iter()
        .map(|i| {
            let mut row = vec![false; n_clips - i];
            for around in i.saturating_sub(reach).max(before)..end.min(i + reach + 1) {
                // The same column stands as many entries later there as it begins earlier.
                add(&mut row, &widened[around - before][i + reach - around..]);
            }
            row
        })
        .collect()
}

/// Every entry, or one up to `reach` away: entry k is of entry k - `reach`.
fn widen(row: &[bool], reach: usize) -> Vec<bool> {
    let mut wide = vec![false; row.len() + reach];
    for by in 0..=2 * reach.min(wide.len()) {
        add(wide.get_mut(by..).unwrap_or_default(), row);
    }
    wide
}

fn add(to: &mut [bool], row: &[bool]) {
    to.iter_mut().zip(row).for_each(|(to, &more)| *to |= more);
}

/// The stretches of a row that are marked, but for gaps too short to be worth stopping for.
pub(super) fn runs(marked: &[bool]) -> impl Iterator<Item = std::ops::Range<usize>> {
    const GAP: usize = 3;
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + marked[at..].iter().position(|&m| m)?;
        let mut end = start + 1;
        at = end;
        while at < marked.len() && at - end <= GAP {
            at += 1;
            if marked[at - 1] {
                end = at;
            }
        }
        Some(start..end)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two clips of eight may be joined.
    struct One(usize, usize);

    impl Asked for One {
        fn mark(&self, i: usize, row: &mut [bool]) {
            row.iter_mut()
                .zip(i..)
                .for_each(|(m, j)| *m = (i, j) == (self.0, self.1));
        }
    }

    #[test]
    fn all_that_a_pair_competes_with_is_asked_for_too_in_every_panel() {
        for pair in [(0, 7), (3, 5), (4, 4), (6, 7)] {
            let wanted = |(i, k): (usize, usize)| {
                i.abs_diff(pair.0) <= REACH && (i + k).abs_diff(pair.1) <= REACH
            };
            for [first, n_rows] in [[0, 8], [0, 3], [3, 3], [6, 2]] {
                let found = rows(&One(pair.0, pair.1), [first, n_rows, 8]);
                for (i, row) in (first..).zip(&found) {
                    let expected: Vec<bool> = (0..8 - i).map(|k| wanted((i, k))).collect();
                    assert_eq!(row, &expected, "{pair:?}, clip {i} from {first} on");
                }
            }
        }
    }

    #[test]
    fn runs_cover_all_that_is_marked_and_pass_over_short_gaps() {
        let marked = b"..##.#....#...#.".map(|c| c == b'#');
        let found: Vec<_> = runs(&marked).collect();
        assert_eq!(found, [2..6, 10..15]);
        assert_eq!(runs(&[]).count(), 0);
    }
}
