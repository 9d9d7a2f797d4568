//! Which pairs of clips may be joined at all, whatever their distance (ALGORITHMS.md 5, candidates), and how
//! many of those alike a search by lists finds (above 50 000 frames).

use super::Search;
use crate::analysis::distance::{Asked, Marks, Side};
use crate::random;

/// Clips whose pairs recall is measured on.
const N_SAMPLED: usize = 256;
/// Of the numbers that choose them.
const SEED: u64 = 0x5eed;

/// The pairs of clips that may be joined, whatever their distance.
pub(super) struct Joinable<'a> {
    pub(super) search: &'a Search<'a>,
    pub(super) side: Side,
    pub(super) least_gap: usize,
}

impl Joinable<'_> {
    /// Of two clips at least the least gap apart.
    pub(super) fn holds(&self, i: usize, j: usize) -> bool {
        let usable = &self.search.clips.usable;
        let mirrored = self.side == Side::Mirrored;
        usable[i] && usable[j] && self.search.gate.pass(i, j, mirrored).is_some()
    }

    /// Of two such clips, whether they are compared.
    pub(super) fn is_compared(&self, i: usize, j: usize) -> bool {
        let lists = self.search.lists.as_ref();
        lists.is_none_or(|lists| lists.holds(self.side, i, j))
    }

    fn mark_all(&self, i: usize, row: &mut Marks) {
        if !self.search.clips.usable[i] {
            return;
        }
        let mirrored = self.side == Side::Mirrored;
        self.search.gate.mark(i, mirrored, row);
        row.unmark_first(self.least_gap);
        row.keep(&self.search.usable, i);
    }

    /// Of 256 clips chosen at random: how many pairs with later ones may be joined and have D < epsilon, and
    /// how many of those are compared.
    pub(super) fn found_of_sample(&self, epsilon: u64) -> [u64; 2] {
        let distances = crate::analysis::distance::Distances {
            side: self.side,
            ..self.search.distances
        };
        let n_clips = distances.n_clips() as u64;
        let mut clips: Vec<u64> = (0..n_clips).collect();
        clips.sort_unstable_by_key(|&i| (random::bits(SEED, &[i]), i));
        let mut counts = [0; 2];
        for &i in clips.iter().take(N_SAMPLED) {
            let i = i as usize;
            for pair in distances.row_below(i, epsilon, &Whole(self)) {
                let counted = u64::from(self.holds(i, pair.to));
                counts[0] += counted;
                counts[1] += counted * u64::from(self.is_compared(i, pair.to));
            }
        }
        counts
    }
}

impl Asked for Joinable<'_> {
    fn mark(&self, i: usize, row: &mut Marks) {
        self.mark_all(i, row);
        if let Some(lists) = &self.search.lists {
            let mut compared = Marks::none(row.len());
            lists.mark(self.side, i, &mut compared);
            row.keep(&compared, 0);
        }
    }
}

/// All that may be joined, compared or not, and nothing around it.
struct Whole<'a>(&'a Joinable<'a>);

impl Asked for Whole<'_> {
    fn mark(&self, i: usize, row: &mut Marks) {
        self.0.mark_all(i, row);
    }

    fn reach(&self) -> usize {
        0
    }
}
