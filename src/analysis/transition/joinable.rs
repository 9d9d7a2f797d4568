//! Selects the pairs of clips that may be joined, independent of their distance
//! (docs/explanation/algorithms.md, "Transitions and playback").

use super::Search;
use crate::analysis::distance::{Asked, Marks, Side};

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
}

impl Asked for Joinable<'_> {
    fn mark(&self, i: usize, row: &mut Marks) {
        if !self.search.clips.usable[i] {
            return;
        }
        let mirrored = self.side == Side::Mirrored;
        self.search.gate.mark(i, mirrored, row);
        row.unmark_first(self.least_gap);
        row.keep(&self.search.usable, i);
    }
}
