//! Selects the pairs of clips that may be joined, independent of their distance, and those that an
//! approximate search compares (docs/explanation/algorithms.md, "Transitions and playback").

use super::Search;
use crate::analysis::distance::{Asked, Lists, Marks, Side};
use crate::random;

/// Number of clips in the sample that measures recall. Free choice.
const N_SAMPLED: usize = 256;
/// Random seed of the sample.
const SEED: u64 = 0x5eed;

/// An approximate search: its candidate lists, and the sample that measures what it misses.
pub(super) struct Approximate {
    pub(super) lists: Lists,
    /// True for the clips of the sample. They are compared with all later clips.
    pub(super) sampled: Vec<bool>,
}

impl Approximate {
    /// Creates the search for a number of clips.
    pub(super) fn new(lists: Lists, n_clips: usize) -> Approximate {
        let mut clips: Vec<usize> = (0..n_clips).collect();
        clips.sort_unstable_by_key(|&i| (random::bits(SEED, &[i as u64]), i));
        let mut sampled = vec![false; n_clips];
        clips
            .iter()
            .take(N_SAMPLED)
            .for_each(|&i| sampled[i] = true);
        Approximate { lists, sampled }
    }
}

/// The pairs of clips that may be joined, independent of their distance.
pub(super) struct Joinable<'a> {
    pub(super) search: &'a Search<'a>,
    pub(super) side: Side,
    pub(super) least_gap: usize,
}

impl Joinable<'_> {
    /// Returns whether two clips may be joined. The caller checks the minimum gap between them.
    pub(super) fn holds(&self, i: usize, j: usize) -> bool {
        let usable = &self.search.clips.usable;
        let mirrored = self.side == Side::Mirrored;
        usable[i] && usable[j] && self.search.gate.pass(i, j, mirrored).is_some()
    }

    /// Returns whether the search compares two joinable clips. An exact search compares all.
    pub(super) fn is_compared(&self, i: usize, j: usize) -> bool {
        let approximate = self.search.approximate.as_ref();
        approximate.is_none_or(|found_by| found_by.lists.holds(self.side, i, j))
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
}

impl Asked for Joinable<'_> {
    fn mark(&self, i: usize, row: &mut Marks) {
        self.mark_all(i, row);
        if let Some(approximate) = &self.search.approximate
            && !approximate.sampled[i]
        {
            let mut compared = Marks::none(row.len());
            approximate.lists.mark(self.side, i, &mut compared);
            row.keep(&compared, 0);
        }
    }
}
