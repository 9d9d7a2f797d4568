//! Rows of bits that mark pairs of clips or frames. Entry k of row i is the pair (i, i + k).
//!
//! In a long footage every pair is tested before any is compared. The operations therefore process 64 entries
//! at a time.

use std::ops::Range;

/// Number of entries in a word.
const WORD: usize = u64::BITS as usize;
/// Gaps up to this length, in entries, become part of a run. An interruption costs more than it saves.
const SHORT_GAP: usize = 3;

/// A row of entries, each marked or not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Marks {
    n: usize,
    /// Bits after the last entry are 0.
    words: Vec<u64>,
}

impl Marks {
    /// Creates `n` unmarked entries.
    pub fn none(n: usize) -> Marks {
        Marks {
            n,
            words: vec![0; n.div_ceil(WORD)],
        }
    }

    /// Returns the number of entries.
    #[expect(clippy::len_without_is_empty, reason = "no caller needs is_empty")]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Marks entry `k`, which must exist.
    #[cfg(test)]
    pub(super) fn mark(&mut self, k: usize) {
        debug_assert!(k < self.n, "entry {k} of {}", self.n);
        self.words[k / WORD] |= 1 << (k % WORD);
    }

    /// Marks every entry.
    pub fn mark_all(&mut self) {
        self.words.fill(u64::MAX);
        self.clear_padding();
    }

    /// Marks each entry k for which `predicate(values[k])` is true.
    pub fn mark_where<T>(&mut self, values: &[T], predicate: impl Fn(&T) -> bool) {
        for (word, values) in self.words.iter_mut().zip(values.chunks(WORD)) {
            let bits = (0..).zip(values);
            *word |= bits.fold(0, |bits, (k, value)| {
                bits | u64::from(predicate(value)) << k
            });
        }
        self.clear_padding();
    }

    /// Unmarks entry `k`.
    pub fn unmark(&mut self, k: usize) {
        self.words[k / WORD] &= !(1 << (k % WORD));
    }

    /// Unmarks the first `n` entries.
    pub fn unmark_first(&mut self, n: usize) {
        let n = n.min(self.n);
        self.words[..n / WORD].fill(0);
        if !n.is_multiple_of(WORD) {
            self.words[n / WORD] &= u64::MAX << (n % WORD);
        }
    }

    /// Keeps only the marks of entries k for which entry k + `by` of `other` is marked.
    pub fn intersect(&mut self, other: &Marks, by: usize) {
        for (word, at) in self.words.iter_mut().zip((by as isize..).step_by(WORD)) {
            *word &= other.bits(at);
        }
    }

    /// Unmarks the entries that are marked in `other`.
    pub fn subtract(&mut self, other: &Marks) {
        let both = self.words.iter_mut().zip(&other.words);
        both.for_each(|(word, other)| *word &= !other);
    }

    /// Marks also the entries k for which entry k + `by` of `other` is marked.
    pub fn union(&mut self, other: &Marks, by: isize) {
        for (word, at) in self.words.iter_mut().zip((by..).step_by(WORD)) {
            *word |= other.bits(at);
        }
        self.clear_padding();
    }

    /// Returns 64 entries from `at` on, the first in the lowest bit. Entries that do not exist are 0.
    pub fn bits(&self, at: isize) -> u64 {
        let word = |k: isize| {
            let k = usize::try_from(k).ok();
            k.and_then(|k| self.words.get(k)).copied().unwrap_or(0)
        };
        let (k, shift) = (at.div_euclid(WORD as isize), at.rem_euclid(WORD as isize));
        match shift {
            0 => word(k),
            _ => word(k) >> shift | word(k + 1) << (WORD as isize - shift),
        }
    }

    /// Returns the marked entries, ascending.
    pub fn ones(&self) -> impl Iterator<Item = usize> {
        (0..).zip(&self.words).flat_map(|(k, &word)| {
            let rest = |&bits: &u64| Some(bits & (bits - 1)).filter(|&rest| rest != 0);
            std::iter::successors(Some(word).filter(|&word| word != 0), rest)
                .map(move |bits| k * WORD + bits.trailing_zeros() as usize)
        })
    }

    /// Returns the runs of marked entries, including gaps up to `SHORT_GAP`.
    pub fn runs(&self) -> impl Iterator<Item = Range<usize>> {
        let mut next = self.next_marked(0);
        std::iter::from_fn(move || {
            let start = next?;
            loop {
                let end = self.next_unmarked(next?);
                next = self.next_marked(end);
                if next.is_none_or(|next| next - end > SHORT_GAP) {
                    return Some(start..end);
                }
            }
        })
    }

    fn next_marked(&self, from: usize) -> Option<usize> {
        let first = self.words.get(from / WORD)? & u64::MAX << (from % WORD);
        let later = self.words[from / WORD + 1..].iter().copied();
        let words = (from / WORD..).zip(std::iter::once(first).chain(later));
        let found = words.into_iter().find(|&(_, word)| word != 0);
        found.map(|(k, word)| k * WORD + word.trailing_zeros() as usize)
    }

    fn next_unmarked(&self, from: usize) -> usize {
        let mut at = from;
        while at < self.n {
            let ones = (!self.bits(at as isize)).trailing_zeros() as usize;
            at += ones;
            if ones < WORD {
                break;
            }
        }
        at.min(self.n)
    }

    fn clear_padding(&mut self) {
        if let (Some(last), tail @ 1..) = (self.words.last_mut(), self.n % WORD) {
            *last &= !(u64::MAX << tail);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn marks(marked: &[bool]) -> Marks {
        let mut marks = Marks::none(marked.len());
        marks.mark_where(marked, |&marked| marked);
        marks
    }

    fn marked(marks: &Marks) -> Vec<bool> {
        let mut marked = vec![false; marks.n];
        marks.ones().for_each(|k| marked[k] = true);
        marked
    }

    #[test]
    fn runs_cover_all_marks_and_include_short_gaps() {
        let row = marks(&b"..##.#....#...#.".map(|c| c == b'#'));
        assert_eq!(row.runs().collect::<Vec<_>>(), [2..6, 10..15]);
        assert_eq!(marks(&[]).runs().count(), 0);
        let mut long = Marks::none(200);
        long.mark_all();
        assert!(long.runs().eq(std::iter::once(0..200)));
        long.unmark_first(130);
        assert!(long.runs().eq(std::iter::once(130..200)));
    }

    proptest! {
        #[test]
        fn operations_on_words_equal_those_on_single_entries(
            a in proptest::collection::vec(any::<bool>(), 0..300),
            b in proptest::collection::vec(any::<bool>(), 0..300),
            by in -150isize..150,
        ) {
            let of_b = |k: isize| usize::try_from(k).ok().and_then(|k| b.get(k)) == Some(&true);
            let row = marks(&a);
            prop_assert_eq!(&marked(&row), &a);
            let each = |entry: &dyn Fn(usize) -> bool| (0..a.len()).map(entry).collect::<Vec<_>>();

            let mut added = row.clone();
            added.union(&marks(&b), by);
            prop_assert_eq!(marked(&added), each(&|k| a[k] || of_b(k as isize + by)));
            let mut kept = row.clone();
            kept.intersect(&marks(&b), by.unsigned_abs());
            prop_assert_eq!(marked(&kept), each(&|k| a[k] && of_b(k as isize + by.abs())));
            let mut dropped = row.clone();
            dropped.subtract(&marks(&b));
            prop_assert_eq!(marked(&dropped), each(&|k| a[k] && !of_b(k as isize)));
            let mut cut = row.clone();
            cut.unmark_first(by.unsigned_abs());
            prop_assert_eq!(marked(&cut), each(&|k| a[k] && k >= by.unsigned_abs()));

            let bits = row.bits(by);
            for k in 0..64 {
                let at = usize::try_from(by + k).ok();
                prop_assert_eq!(bits >> k & 1 == 1, at.and_then(|at| a.get(at)) == Some(&true));
            }
            // Runs cover all marks and contain no gap longer than three.
            let runs: Vec<_> = row.runs().collect();
            let inside = |k: usize| runs.iter().any(|run| run.contains(&k));
            prop_assert!((0..a.len()).all(|k| !a[k] || inside(k)));
            for run in &runs {
                prop_assert!(a[run.start] && a[run.end - 1]);
                prop_assert!(a[run.clone()].windows(SHORT_GAP + 1).all(|w| w.contains(&true)));
            }
        }
    }
}
