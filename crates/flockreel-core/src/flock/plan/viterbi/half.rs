//! One of the two halves of a plan: the recursion over its frames, and the traceback
//! (docs/explanation/algorithms.md, "Planning").
//!
//! If the trace needs more memory than the budget, it is kept for one segment at a time. Each segment is
//! then computed again from its checkpoint.

use super::column::Column;
use super::trace::Trace;
use super::traceback::{PathEnd, Traceback};
use super::{PathSearch, StateCosts};
use crate::flock::plan::landings::Pass;

/// Recursion after the last frame of the half, with its trace.
pub(super) struct Half<'a, R> {
    pub(super) search: &'a PathSearch<'a>,
    pass: Pass,
    state_costs: R,
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

impl<'a, R: StateCosts> Half<'a, R> {
    /// Processes `n_frames` > 0 frames and keeps the trace of `segment` blocks at a time.
    pub(super) fn run(
        search: &'a PathSearch<'a>,
        pass: Pass,
        state_costs: R,
        n_frames: usize,
        segment: usize,
    ) -> Half<'a, R> {
        let column = Column::new(search, pass, n_frames);
        let mut half = Half {
            search,
            pass,
            state_costs,
            n_frames,
            segment,
            ends: Vec::new(),
            trace: Trace::new(search, pass, segment.min(column.n_left())),
            column,
            checkpoints: Vec::new(),
        };
        let has_segments = half.column.n_left() > segment;
        while half.column.n_left() > 0 {
            if has_segments {
                half.checkpoints.push(half.column.clone());
            }
            half.process_segment();
        }
        half.ends = half.column.ends(search);
        half
    }

    /// Returns the states of the path with the given end, by age.
    pub(super) fn trace_back(mut self, end: PathEnd) -> Vec<u32> {
        let mut traceback = Traceback::new(self.search, self.n_frames, end);
        self.checkpoints.pop();
        loop {
            traceback.back(self.search, self.pass, &self.trace);
            let Some(column) = self.checkpoints.pop() else {
                return traceback.finish();
            };
            self.column = column;
            self.process_segment();
        }
    }

    /// Processes one segment.
    fn process_segment(&mut self) {
        self.trace.restart(self.column.clock());
        for _ in 0..self.segment.min(self.column.n_left()) {
            let steps = self.trace.next_block();
            self.column
                .advance(self.search, &mut self.state_costs, steps);
        }
    }
}
