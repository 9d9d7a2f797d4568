//! Which distances are asked for at all (ALGORITHMS.md 5, exact pruning: the gate comes first).
//!
//! A transition joins only clips that point the same way, but it is kept only where none of its neighbors is
//! nearer, whichever way those point. So what is asked for are the pairs that may be joined; and where one of
//! these is near, so are all around it that local minima look at: with their distances the minima among the former
//! come out the same as with all distances.

use super::marks::Marks;
use super::minima::REACH;

/// Says of pairs of clips whether their distance matters.
pub trait Asked: Sync {
    /// Marks the pairs of clip `i` that matter: entry k of `row` is (i, i + k).
    fn mark(&self, i: usize, row: &mut Marks);

    /// How many clips away, in each clip of a pair that matters, the others are that it competes with.
    fn reach(&self) -> usize {
        REACH
    }
}

/// Every distance.
pub struct Everything;

impl Asked for Everything {
    fn mark(&self, _: usize, row: &mut Marks) {
        row.mark_all();
    }

    fn reach(&self) -> usize {
        0
    }
}

/// All within `reach` of what is marked, in clips in succession, but for what was asked for already.
pub(super) fn competing(near: &[Marks], asked: &[Marks], reach: usize) -> Vec<Marks> {
    let reach = reach as isize;
    let of_clip = |(clip, asked): (usize, &Marks)| {
        let mut row = Marks::none(asked.len());
        for other in (-reach..=reach).filter(|_| reach > 0) {
            let Some(near) = clip.checked_add_signed(other).and_then(|at| near.get(at)) else {
                continue;
            };
            // The same column stands as many entries later there as that clip begins earlier.
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
