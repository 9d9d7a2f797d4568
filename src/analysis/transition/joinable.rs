//! Which pairs of clips may be joined at all, whatever their distance (ALGORITHMS.md 5, candidates), and which
//! of those an approximate search compares (above 50 000 frames).

use super::Search;
use crate::analysis::distance::{Asked, Lists, Marks, Side};
use crate::random;

/// Clips whose pairs recall is measured on.
const N_SAMPLED: usize = 256;
/// Of the numbers that choose them.
const SEED: u64 = 0x5eed;

/// What an approximate search leaves out, and how that is measured.
pub(super) struct Approximate {
    pub(super) lists: Lists,
    /// The clips that are compared with all later ones, to see what the lists miss.
    pub(super) sampled: Vec<bool>,
}

impl Approximate {
    /// A search by these lists among so many clips.
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
