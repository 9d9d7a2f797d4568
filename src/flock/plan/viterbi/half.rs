//! One of the two ways to where a plan's halves meet (ALGORITHMS.md 6): the recursion over its frames,
//! and the way back. Above a budget of memory what led where is kept for a segment at a time, each
//! played again from its checkpoint.

use super::column::Column;
use super::meeting::Stand;
use super::walk::{Trace, Walk};
use super::{Film, Rows};
use crate::flock::plan::landings::Way;

/// The recursion at its last frame, and how it came there.
pub(super) struct Half<'a, R> {
    pub(super) film: &'a Film<'a>,
    way: Way,
    rows: R,
    n_frames: usize,
    /// Blocks of a segment.
    segment: usize,
    column: Column,
    /// What its ends cost, as `Column::ends` has them.
    pub(super) ends: Vec<Vec<u32>>,
    /// Of the last segment.
    trace: Trace<'a>,
    /// Before each segment, if there are several.
    checkpoints: Vec<Column>,
}

impl<'a, R: Rows> Half<'a, R> {
    /// Goes over `n_frames` > 0 frames, keeping what led where for `segment` blocks of them at a time.
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

    /// The states of the path that ends so, by age.
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

    /// Goes over a segment.
    fn play(&mut self) {
        self.trace.restart(self.column.clock());
        for _ in 0..self.segment.min(self.column.n_left()) {
            let steps = self.trace.next_block();
            self.column.advance(self.film, &mut self.rows, steps);
        }
    }
}
