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
mod shelf;
mod walk;

pub use self::block::{Block, FRAMES, Moments};
use self::column::Column;
use self::half::Half;
use self::meeting::Meeting;
pub use self::shelf::Shelf;
use self::walk::Trace;
use super::landings::Way;
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
pub trait Rows {
    /// Writes the costs at the frames of `block` of the stations from `first` on, in turns. The stations of
    /// a block are requested from 0 up. Costs are below 2^17, except where conditions of segments and loops
    /// add more. Barriers may have any cost.
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]);
}

/// Costs given by a function of frame and state.
impl<F: FnMut(usize, usize) -> u32> Rows for F {
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        for (station, out) in (first..).zip(out) {
            *out = block.times.map(|t| self(t, block.state(station)));
        }
    }
}

/// Film to be planned.
#[derive(Clone, Copy, Debug)]
pub struct Film<'a> {
    /// States and the jumps between them.
    pub trellis: &'a Trellis,
    /// Number of frames.
    pub n_frames: usize,
    /// Least number of frames between two jumps.
    pub dwell: usize,
    /// Vector instructions to use; this machine must have them.
    pub cpu: Level,
    /// Memory that is reused from plan to plan.
    pub shelf: &'a Shelf,
}

impl Film<'_> {
    /// Returns the cheapest path, exactly. `None` if no path is long enough.
    pub fn cheapest_path(&self, rows: &(impl Rows + Clone + Send + Sync)) -> Option<Path> {
        self.cheapest_path_by_segments(rows, self.segment_blocks())
    }

    /// Returns the cost of the cheapest path, in turns. `None` if no path is long enough.
    pub fn least_cost(&self, rows: &mut impl Rows) -> Option<u32> {
        let mut column = Column::new(self, Way::Ahead, self.n_frames);
        while column.n_left() > 0 {
            column.advance_untraced(self, rows);
        }
        let end = meeting::end(self, &column.ends(self))?;
        Some(end.cost)
    }

    /// Returns, by state, the cost of the cheapest path that begins with it as if just jumped to, in turns.
    /// `UNREACHED` if there is no such path.
    pub fn costs_from(&self, rows: &mut impl Rows) -> Vec<u32> {
        let mut column = Column::new(self, Way::Back, self.n_frames);
        while column.n_left() > 0 {
            column.advance_untraced(self, rows);
        }
        // The first frame of the film is processed last, and stations are in reverse order of states.
        let last = column.lanes().end - 1;
        let mut costs: Vec<u32> = column.values(last).collect();
        costs.reverse();
        costs
    }

    fn segment_blocks(&self) -> usize {
        let n_blocks = self.n_frames.div_ceil(2 * block::width(self.dwell)).max(1);
        if Trace::block_bytes(self, Way::Ahead) * n_blocks <= TRACE_BUDGET_BYTES {
            n_blocks
        } else {
            n_blocks.isqrt() + 1
        }
    }

    /// Returns the cheapest path and keeps the trace for `segment` blocks at a time.
    fn cheapest_path_by_segments<R>(&self, rows: &R, segment: usize) -> Option<Path>
    where
        R: Rows + Clone + Send + Sync,
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
        let half = |way, n_frames| Half::run(self, way, rows.clone(), n_frames, segment);
        let (first, second) = rayon::join(
            || half(Way::Ahead, n_first),
            || (n_second > 0).then(|| half(Way::Back, n_second)),
        );
        let meeting: Meeting = match &second {
            Some(second) => meeting::across(&first, second)?,
            None => meeting::end(self, &first.ends)?,
        };
        let mut states = first.walk(meeting.first);
        if let Some(second) = second {
            states.extend(second.walk(meeting.second).iter().rev());
        }
        let cost = meeting.cost;
        Some(Path { states, cost })
    }

    /// Returns the output frame that is processed after `age` others.
    fn time(&self, way: Way, age: usize) -> usize {
        match way {
            Way::Ahead => age,
            Way::Back => self.n_frames - 1 - age,
        }
    }
}

#[cfg(test)]
mod tests;
