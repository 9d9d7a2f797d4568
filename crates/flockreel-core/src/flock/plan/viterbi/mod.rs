//! Exact planning: the cheapest path through the trellis, by dynamic programming over frames
//! (docs/explanation/algorithms.md, "Planning").
//!
//! After a jump at least `dwell` frames are played. Only the beginning and the end of the plan may cut that
//! run short. A state reached by a jump can therefore be left by another jump only `dwell` frames later.
//! Frames are processed in blocks of up to eight, at most `dwell`, side by side in the lanes of a vector. A
//! block takes two steps: first everything that plays on (`front`), then all jumps (`landing`). A plan read
//! backward is a plan too. Both ends are therefore extended at once, on two threads, until the halves meet
//! (`meeting`).
//!
//! Terms: a station is a state numbered in the direction of processing, a landing is the arrival of a jump,
//! and V is the least cost of a path that may jump.

mod block;
mod column;
mod front;
mod half;
mod landing;
mod meeting;
mod offers;
mod trace;
mod trace_pool;
mod traceback;

pub use self::block::{Block, FRAMES, Moments};
use self::column::Column;
use self::half::Half;
use self::trace::Trace;
pub use self::trace_pool::TracePool;
use super::landings::Pass;
use super::trellis::Trellis;
use crate::cpu::Level;

/// Cost of a state that no path reaches, in turns. A plan of 10,000 frames stays below it if each frame
/// costs less than 2^17 and each jump less than 2^16. Sums of this value and all costs of a film stay below
/// 2^32.
pub(super) const UNREACHED: u32 = i32::MAX as u32;

/// Maximum memory for the trace of one half, in bytes. A larger trace is kept one segment at a time. Free
/// choice.
const TRACE_BUDGET_BYTES: usize = 64 << 20;

/// Cheapest path of one individual through the trellis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// State shown at each output frame.
    pub states: Vec<u32>,
    /// Cost, in turns.
    pub cost: u32,
}

/// Costs of showing each state, for one individual.
pub trait StateCosts {
    /// Writes the costs at the frames of `block` of the stations from `first` on, in turns. The stations of
    /// a block are requested from 0 up. Costs are below 2^17, except where conditions of segments and loops
    /// add more. Barriers may have any cost.
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]);
}

/// Costs given by a function of frame and state.
impl<F: FnMut(usize, usize) -> u32> StateCosts for F {
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        for (station, out) in (first..).zip(out) {
            *out = block.times.map(|t| self(t, block.state(station)));
        }
    }
}

/// Search for the cheapest path of a film.
#[derive(Clone, Copy, Debug)]
pub struct PathSearch<'a> {
    /// States and the jumps between them.
    pub trellis: &'a Trellis,
    /// Number of frames.
    pub n_frames: usize,
    /// Least number of frames between two jumps.
    pub dwell: usize,
    /// Vector instructions to use; this machine must have them.
    pub cpu: Level,
    /// Memory for traces, reused from path to path.
    pub trace_pool: &'a TracePool,
}

impl PathSearch<'_> {
    /// Returns the cheapest path, exactly. `None` if no path is long enough.
    pub fn cheapest_path(
        &self,
        state_costs: &(impl StateCosts + Clone + Send + Sync),
    ) -> Option<Path> {
        self.cheapest_path_by_segments(state_costs, self.segment_blocks())
    }

    /// Returns the cost of the cheapest path, in turns. `None` if no path is long enough.
    pub fn least_cost(&self, state_costs: &mut impl StateCosts) -> Option<u32> {
        let mut column = Column::new(self, Pass::Forward, self.n_frames);
        while column.n_left() > 0 {
            column.advance_untraced(self, state_costs);
        }
        let (cost, _) = meeting::cheapest_end(&column.ends(self))?;
        Some(cost)
    }

    /// Returns, by state, the cost of the cheapest path that begins with it as if just jumped to, in turns.
    /// `UNREACHED` if there is no such path.
    pub fn costs_from(&self, state_costs: &mut impl StateCosts) -> Vec<u32> {
        let mut column = Column::new(self, Pass::Backward, self.n_frames);
        while column.n_left() > 0 {
            column.advance_untraced(self, state_costs);
        }
        // The first frame of the film is processed last, and stations are in reverse order of states.
        let mut costs: Vec<u32> = column.values().collect();
        costs.reverse();
        costs
    }

    fn segment_blocks(&self) -> usize {
        let n_blocks = self.n_frames.div_ceil(2 * block::width(self.dwell)).max(1);
        if Trace::block_bytes(self, Pass::Forward) * n_blocks <= TRACE_BUDGET_BYTES {
            n_blocks
        } else {
            n_blocks.isqrt() + 1
        }
    }

    /// Returns the cheapest path and keeps the trace for `segment` blocks at a time.
    fn cheapest_path_by_segments<R>(&self, state_costs: &R, segment: usize) -> Option<Path>
    where
        R: StateCosts + Clone + Send + Sync,
    {
        assert!(
            self.n_frames > 0 && self.dwell > 0 && segment > 0,
            "nothing to plan"
        );
        if self.trellis.n_states() == 0 {
            return None;
        }
        let n_second = self.n_frames / 2;
        let n_first = self.n_frames - n_second;
        let half = |pass, n_frames| Half::run(self, pass, state_costs.clone(), n_frames, segment);
        let (first, second) = rayon::join(
            || half(Pass::Forward, n_first),
            || (n_second > 0).then(|| half(Pass::Backward, n_second)),
        );
        let Some(second) = second else {
            let (cost, end) = meeting::cheapest_end(&first.ends)?;
            let states = first.trace_back(end);
            return Some(Path { states, cost });
        };
        let meeting = meeting::cheapest_meeting(&first, &second)?;
        let mut states = first.trace_back(meeting.first);
        states.extend(second.trace_back(meeting.second).iter().rev());
        let cost = meeting.cost;
        Some(Path { states, cost })
    }

    /// Returns the output frame that is processed after `age` others.
    fn time(&self, pass: Pass, age: usize) -> usize {
        match pass {
            Pass::Forward => age,
            Pass::Backward => self.n_frames - 1 - age,
        }
    }
}

#[cfg(test)]
mod tests;
