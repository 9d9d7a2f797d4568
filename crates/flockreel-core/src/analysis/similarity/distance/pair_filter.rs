//! Selects the distances that the search for transitions needs (docs/explanation/algorithms.md, "Distances").
//!
//! A transition joins only clips that pass the gate. It is kept only if it is a local minimum among all its
//! neighbors, whether these pass the gate or not. The search therefore requests the pairs that pass. Around
//! each of these that is below the limit, it also computes the neighbors. The local minima are then the same
//! as with all distances.

use super::marks::Marks;
use super::minima::RADIUS;

/// Selects the pairs of clips whose distance is needed.
pub trait PairFilter: Sync {
    /// Marks the needed pairs of clip `i`: entry k of `row` is the pair (i, i + k).
    fn mark(&self, i: usize, row: &mut Marks);

    /// Returns the distance, in clips, within which neighbors of a needed pair compete with it.
    fn radius(&self) -> usize {
        RADIUS
    }
}

/// Requests every distance.
pub struct AllPairs;

impl PairFilter for AllPairs {
    fn mark(&self, _: usize, row: &mut Marks) {
        row.mark_all();
    }

    fn radius(&self) -> usize {
        0
    }
}

/// Returns the pairs within `radius` of the pairs in `near`, without those in `requested`. Both hold
/// successive clips.
pub(super) fn neighbors(near: &[Marks], requested: &[Marks], radius: usize) -> Vec<Marks> {
    let radius = radius as isize;
    let of_clip = |(clip, requested): (usize, &Marks)| {
        let mut row = Marks::none(requested.len());
        for other in (-radius..=radius).filter(|_| radius > 0) {
            let Some(near) = clip.checked_add_signed(other).and_then(|at| near.get(at)) else {
                continue;
            };
            // Rows are indexed by offset from their clip, so the same column is shifted by the difference of
            // the clips.
            (-radius..=radius).for_each(|column| row.union(near, column - other));
        }
        row.subtract(requested);
        row
    };
    requested.iter().enumerate().map(of_clip).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_of_a_near_pair_are_found_without_the_requested_pairs() {
        let n = 8;
        for pair in [(0, 7), (3, 5), (4, 4), (6, 7)] {
            let mut near: Vec<Marks> = (0..n).map(|i| Marks::none(n - i)).collect();
            near[pair.0].mark(pair.1 - pair.0);
            let mut requested = near.clone();
            requested[2].mark(1);
            let found = neighbors(&near, &requested, RADIUS);
            for (i, row) in found.iter().enumerate() {
                let wanted = |&k: &usize| {
                    let near = i.abs_diff(pair.0) <= RADIUS && (i + k).abs_diff(pair.1) <= RADIUS;
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
                neighbors(&near, &requested, 0)
                    .iter()
                    .all(|row| row.ones().count() == 0)
            );
        }
    }
}
