//! One of the two halves of a plan: the recursion over its frames, and the walk back
//! (docs/explanation/algorithms.md, "Planning").
//!
//! If the trace needs more memory than the budget, it is kept for one segment at a time. Each segment is
//! then computed again from its checkpoint.

use super::column::Column;
use super::meeting::Stand;
use super::walk::{Trace, Walk};
use super::{Film, Rows};
use crate::flock::plan::landings::Way;

/// Recursion after the last frame of the half, with its trace.
pub(super) struct Half<'a, R> {
    pub(super) film: &'a Film<'a>,
    way: Way,
    rows: R,
    n_frames: usize,
    /// Number of blocks in a segment.
    segment: usize,
    column: Column,
    /// Costs of its ends, as returned by `Column::ends`.
    pub(super) ends: Vec<Vec<u32>>,
    /// Trace of the last segment.
    trace: Trace<'a>,
    /// Recursion before each segment, if there are several.
    checkpoints: Vec<Column>,
}

impl<'a, R: Rows> Half<'a, R> {
    /// Processes `n_frames` > 0 frames and keeps the trace of `segment` blocks at a time.
    pub(super) fn run(
        film: &'a Film<'a>,
        way: Way,
        rows: R,
        n_frames: usize,
        segment: usize,
    ) -> Half<'a, R> {
        let column = Column::new(film, way, n_frames);
        let mut half = Half {
            film,
            way,
            rows,
            n_frames,
            segment,
            ends: Vec::new(),
            trace: Trace::new(film, way, segment.min(column.n_left())),
            column,
            checkpoints: Vec::new(),
        };
        let has_segments = half.column.n_left() > segment;
        while half.column.n_left() > 0 {
            if has_segments {
                half.checkpoints.push(half.column.clone());
            }
            half.play();
        }
        half.ends = half.column.ends(film);
        half
    }

    /// Returns the states of the path with the given end, by age.
    pub(super) fn walk(mut self, end: Stand) -> Vec<u32> {
        let mut walk = Walk::new(self.film, self.n_frames, end);
        self.checkpoints.pop();
        loop {
            walk.back(self.film, self.way, &self.trace);
            let Some(column) = self.checkpoints.pop() else {
                return walk.finish();
            };
            self.column = column;
            self.play();
        }
    }

    /// Processes one segment.
    fn play(&mut self) {
        self.trace.restart(self.column.clock());
        for _ in 0..self.segment.min(self.column.n_left()) {
            let steps = self.trace.next_block();
            self.column.advance(self.film, &mut self.rows, steps);
        }
    }
}
