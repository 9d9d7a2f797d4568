//! Selects the distances that the search for transitions needs (docs/explanation/algorithms.md, "Distances").
//!
//! A transition joins only clips that pass the gate. It is kept only if it is a local minimum among all its
//! neighbors, whether these pass the gate or not. The search therefore asks for the pairs that pass. Around
//! each of these that is below the limit, it also computes the neighbors. The local minima are then the same
//! as with all distances.

use super::marks::Marks;
use super::minima::REACH;

/// Tells which pairs of clips need their distance.
pub trait Asked: Sync {
    /// Marks the needed pairs of clip `i`: entry k of `row` is the pair (i, i + k).
    fn mark(&self, i: usize, row: &mut Marks);

    /// Returns the distance, in clips, within which neighbors of a needed pair compete with it.
    fn reach(&self) -> usize {
        REACH
    }
}

/// Asks for every distance.
pub struct Everything;

impl Asked for Everything {
    fn mark(&self, _: usize, row: &mut Marks) {
        row.mark_all();
    }

    fn reach(&self) -> usize {
        0
    }
}

/// Returns the pairs within `reach` of the pairs in `near`, without those in `asked`. Both hold successive
/// clips.
pub(super) fn competing(near: &[Marks], asked: &[Marks], reach: usize) -> Vec<Marks> {
    let reach = reach as isize;
    let of_clip = |(clip, asked): (usize, &Marks)| {
        let mut row = Marks::none(asked.len());
        for other in (-reach..=reach).filter(|_| reach > 0) {
            let Some(near) = clip.checked_add_signed(other).and_then(|at| near.get(at)) else {
                continue;
            };
            // Rows are indexed by offset from their clip, so the same column is shifted by the difference of
            // the clips.
            (-reach..=reach).for_each(|column| row.add(near, column - other));
        }
        row.drop(asked);
        row
    };
    asked.iter().enumerate().map(of_clip).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_a_near_pair_competes_with_is_looked_at_but_for_what_was_already() {
        let n = 8;
        for pair in [(0, 7), (3, 5), (4, 4), (6, 7)] {
            let mut near: Vec<Marks> = (0..n).map(|i| Marks::none(n - i)).collect();
            near[pair.0].mark(pair.1 - pair.0);
            let mut asked = near.clone();
            asked[2].mark(1);
            let found = competing(&near, &asked, REACH);
            for (i, row) in found.iter().enumerate() {
                let wanted = |&k: &usize| {
                    let near = i.abs_diff(pair.0) <= REACH && (i + k).abs_diff(pair.1) <= REACH;
                    near && (i, i + k) != pair && (i, k) != (2, 1)
                };
                let expected: Vec<usize> = (0..n - i).filter(wanted).collect();
                assert_eq!(
                    row.ones().collect::<Vec<_>>(),
                    expected,
                    "{pair:?}, clip {i}"
                );
            }
            assert!(
                competing(&near, &asked, 0)
                    .iter()
                    .all(|row| row.ones().count() == 0)
            );
        }
    }
}
