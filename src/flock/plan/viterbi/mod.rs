//! The exact plan: for each individual the cheapest path through the trellis (ALGORITHMS.md 6),
//! by dynamic programming over frames with `LANES` individuals side by side.
//!
//! After a jump at least `dwell` frames are played; only the end of the plan may cut that run short.
//! A jump is thus an edge of `dwell` frames, whose forced costs come from sums along the diagonal.
//! Ties go to continuing, then to the smaller state, as time runs. What led where is kept as one
//! winner a jump target and the ends of runs; above a budget the film is cut into segments, each
//! played again from its checkpoint.

mod column;
mod walk;

use self::column::Column;
use self::walk::{Trace, Walk};
use super::trellis::Trellis;
use crate::cpu::Level;

/// No path leads here. Costs of a whole plan stay below (at most 10 000 frames of less than 2^17, and
/// a jump of less than 2^16 each), and what is added to it along a film stays below 2^32.
pub(super) const UNREACHED: u32 = i32::MAX as u32;

/// Memory for what led where, before the film is cut into segments.
const TRACE_BUDGET_BYTES: usize = 128 << 20;

/// The cheapest way through the trellis for one individual.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// The state shown at each output frame.
    pub states: Vec<u32>,
    /// Its cost, turns.
    pub cost: u32,
}

/// What showing each state costs each individual.
pub trait Rows<const LANES: usize> {
    /// Fills in the costs at frame `t` of the states from `first` on, turns below 2^17. Each frame is
    /// asked for from state 0 up; barriers may cost anything below 2^17.
    fn fill(&mut self, t: usize, first: usize, out: &mut [[u32; LANES]]);
}

impl<const LANES: usize, F: FnMut(usize, usize, &mut [[u32; LANES]])> Rows<LANES> for F {
    #[inline(always)]
    fn fill(&mut self, t: usize, first: usize, out: &mut [[u32; LANES]]) {
        self(t, first, out);
    }
}

/// A film to be planned.
#[derive(Clone, Copy, Debug)]
pub struct Film<'a> {
    /// What may follow what.
    pub trellis: &'a Trellis,
    /// Its length.
    pub n_frames: usize,
    /// Least frames between two jumps.
    pub dwell: usize,
    /// Which instructions to use; this machine must have them.
    pub cpu: Level,
}

impl Film<'_> {
    /// The cheapest paths of `LANES` individuals, each exactly. `None` when no path is long enough.
    pub fn cheapest_paths<const LANES: usize>(
        &self,
        rows: &mut impl Rows<LANES>,
    ) -> Option<[Path; LANES]> {
        self.cheapest_paths_by_segments(rows, self.segment_frames(LANES))
    }

    /// Every state's cheapest cost at every frame, for one individual: what the certificate checks.
    pub fn potentials(&self, rows: &mut impl Rows<1>) -> Vec<Vec<u32>> {
        let mut column = Column::start(self.trellis, self.dwell, rows);
        let mut trace = Trace::default();
        let mut columns = vec![column.costs(0, 0).collect()];
        for t in 1..self.n_frames {
            trace.restart(t);
            column.advance(self, t, rows, &mut trace);
            columns.push(column.costs(t, 0).collect());
        }
        columns
    }

    fn segment_frames(&self, lanes: usize) -> usize {
        let frame_bytes = self.trellis.targets().len() * (lanes * 2 + 8);
        if frame_bytes * self.n_frames <= TRACE_BUDGET_BYTES {
            self.n_frames
        } else {
            self.n_frames.isqrt() + 1
        }
    }

    /// As `cheapest_paths`, keeping what led where for `segment` frames at a time.
    fn cheapest_paths_by_segments<const LANES: usize>(
        &self,
        rows: &mut impl Rows<LANES>,
        segment: usize,
    ) -> Option<[Path; LANES]> {
        let (n_frames, dwell) = (self.n_frames, self.dwell);
        assert!(n_frames > 0 && dwell > 0 && segment > 0, "nothing to plan");
        if self.trellis.n_states() == 0 {
            return None;
        }
        let mut column = Column::start(self.trellis, dwell, rows);
        let mut trace = Trace::default();
        let mut play = |column: &mut Column<LANES>, trace: &mut Trace<LANES>, from, to| {
            trace.restart(from);
            for t in from..to {
                column.advance(self, t, rows, trace);
            }
        };
        let mut checkpoints = Vec::new();
        let starts: Vec<usize> = (1..n_frames).step_by(segment).collect();
        for &start in &starts {
            if starts.len() > 1 {
                checkpoints.push(column.clone());
            }
            let end = (start + segment).min(n_frames);
            play(&mut column, &mut trace, start, end);
        }
        let mut walks = Vec::with_capacity(LANES);
        for lane in 0..LANES {
            let end = column.cheapest_end(self.trellis, n_frames, lane)?;
            walks.push(Walk::from_end(self.trellis, n_frames, end));
        }
        for (segment_idx, &start) in starts.iter().enumerate().rev() {
            if segment_idx + 1 < starts.len() {
                column = checkpoints.swap_remove(segment_idx);
                play(&mut column, &mut trace, start, starts[segment_idx + 1]);
            }
            for (lane, walk) in walks.iter_mut().enumerate() {
                walk.back_to(start, self.trellis, dwell, &trace, lane);
            }
        }
        let paths: Vec<Path> = walks.into_iter().map(Walk::finish).collect();
        paths.try_into().ok()
    }
}

#[cfg(test)]
mod tests;
