//! One of the two ways to where a plan's halves meet (ALGORITHMS.md 6): the recursion over its frames,
//! and the way back. Above a budget of memory what led where is kept for a segment at a time, each
//! played again from its checkpoint.

use super::column::Column;
use super::walk::{Trace, Walk};
use super::{Film, Rows};
use crate::flock::plan::landings::Way;

/// The recursion at its last frame, and how it came there.
pub(super) struct Half<'a, const LANES: usize, R> {
    pub(super) film: &'a Film<'a>,
    way: Way,
    rows: R,
    n_frames: usize,
    segment: usize,
    pub(super) column: Column<LANES>,
    /// Of the last segment.
    trace: Trace<'a, LANES>,
    /// Before each segment, if there are several.
    checkpoints: Vec<Column<LANES>>,
}

impl<'a, const LANES: usize, R: Rows<LANES>> Half<'a, LANES, R> {
    /// Goes over `n_frames` > 0 frames, keeping what led where for `segment` of them at a time.
    pub(super) fn run(
        film: &'a Film<'a>,
        way: Way,
        mut rows: R,
        n_frames: usize,
        segment: usize,
    ) -> Half<'a, LANES, R> {
        let column = Column::start(film, way, &mut rows);
        let mut half = Half {
            film,
            way,
            rows,
            n_frames,
            segment,
            column,
            trace: Trace::new(film, way, segment.min(n_frames)),
            checkpoints: Vec::new(),
        };
        for start in half.starts() {
            if n_frames - 1 > segment {
                half.checkpoints.push(half.column.clone());
            }
            half.play(start);
        }
        half
    }

    /// The paths of all lanes by age, each from its last state, before which nothing landed for so many
    /// frames.
    pub(super) fn walk(mut self, ends: [(usize, usize); LANES]) -> [Vec<u32>; LANES] {
        let mut walks = ends.map(|(state, held)| Walk::new(self.n_frames, state, held));
        for (idx, start) in self
            .starts()
            .enumerate()
            .collect::<Vec<_>>()
            .into_iter()
            .rev()
        {
            if idx + 1 < self.checkpoints.len() {
                self.column = self.checkpoints.swap_remove(idx);
                self.play(start);
            }
            for (lane, walk) in walks.iter_mut().enumerate() {
                walk.back_to(start, self.film, self.way, &self.trace, lane);
            }
        }
        walks.map(Walk::finish)
    }

    /// The ages at which segments begin.
    fn starts(&self) -> impl Iterator<Item = usize> + use<LANES, R> {
        (1..self.n_frames).step_by(self.segment)
    }

    fn play(&mut self, start: usize) {
        self.trace.restart(start);
        for _ in start..(start + self.segment).min(self.n_frames) {
            self.column
                .advance(self.film, &mut self.rows, &mut self.trace);
        }
    }
}
