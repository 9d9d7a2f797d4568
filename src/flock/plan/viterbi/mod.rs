//! The exact plan: the cheapest path through the trellis (ALGORITHMS.md 6), by dynamic programming
//! over frames.
//!
//! After a jump at least `dwell` frames are played; only the end of the plan may cut that run short, as
//! its beginning may. So where a jump leads becomes known `dwell` frames before anything can
//! leave from there, and a block of up to eight frames, if that is no more than `dwell`, is gone through
//! in two strokes, its frames side by side in the lanes of a vector: first all that goes on
//! (`column`), then all that jumps (`landing`).
//!
//! And a plan read backward is a plan too: it is found from both ends at once, one half
//! as time runs, the other against it, each on a thread of its own, until they meet (`meeting`).

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

/// No path leads here. Costs of a whole plan stay below (at most 10 000 frames of less than 2^17, and
/// a jump of less than 2^16 each), and what is added to it along a film stays below 2^32.
pub(super) const UNREACHED: u32 = i32::MAX as u32;

/// Memory for what led where in one half, before that is cut into segments.
const TRACE_BUDGET_BYTES: usize = 64 << 20;

/// The cheapest way through the trellis for one individual.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// The state shown at each output frame.
    pub states: Vec<u32>,
    /// Its cost, turns.
    pub cost: u32,
}

/// What showing each state costs an individual.
pub trait Rows {
    /// Fills in the costs at the frames of `block` of the stations from `first` on, turns below 2^17.
    /// The stations of a block are asked for from 0 up; barriers may cost anything below 2^17.
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]);
}

/// From the cost of a frame and a state.
impl<F: FnMut(usize, usize) -> u32> Rows for F {
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        for (station, out) in (first..).zip(out) {
            *out = block.times.map(|t| self(t, block.state(station)));
        }
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
    /// Where memory lies between plans.
    pub shelf: &'a Shelf,
}

impl Film<'_> {
    /// The cheapest path, exactly. `None` when no path is long enough.
    pub fn cheapest_path(&self, rows: &(impl Rows + Clone + Send + Sync)) -> Option<Path> {
        self.cheapest_path_by_segments(rows, self.segment_blocks())
    }

    /// What the cheapest path costs, turns. `None` when no path is long enough.
    pub fn least_cost(&self, rows: &mut impl Rows) -> Option<u32> {
        let mut column = Column::new(self, Way::Ahead, self.n_frames);
        while column.n_left() > 0 {
            column.advance_untraced(self, rows);
        }
        let end = meeting::end(self, &column.ends(self))?;
        Some(end.cost)
    }

    /// What the cheapest path costs that begins with each state as if just jumped to, by state, turns;
    /// `UNREACHED` where none does.
    pub fn costs_from(&self, rows: &mut impl Rows) -> Vec<u32> {
        let mut column = Column::new(self, Way::Back, self.n_frames);
        while column.n_left() > 0 {
            column.advance_untraced(self, rows);
        }
        // The first frame gone through comes last, and stations against the states.
        let last = column.lanes().end - 1;
        let mut costs: Vec<u32> = column.values(last).collect();
        costs.reverse();
        costs
    }

    /// What the cheapest way costs to every state that may jump, at every frame: what
    /// the certificate checks.
    pub fn potentials(&self, rows: &mut impl Rows) -> Vec<Vec<u32>> {
        let mut column = Column::new(self, Way::Ahead, self.n_frames);
        let mut columns = Vec::with_capacity(self.n_frames);
        while column.n_left() > 0 {
            column.advance_untraced(self, rows);
            for lane in column.lanes() {
                columns.push(column.values(lane).collect());
            }
        }
        columns
    }

    fn segment_blocks(&self) -> usize {
        let n_blocks = self.n_frames.div_ceil(2 * block::width(self.dwell)).max(1);
        if Trace::block_bytes(self, Way::Ahead) * n_blocks <= TRACE_BUDGET_BYTES {
            n_blocks
        } else {
            n_blocks.isqrt() + 1
        }
    }

    /// As `cheapest_path`, keeping what led where for `segment` blocks at a time.
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

    /// The output frame that is gone to after `age` others.
    fn time(&self, way: Way, age: usize) -> usize {
        match way {
            Way::Ahead => age,
            Way::Back => self.n_frames - 1 - age,
        }
    }
}

#[cfg(test)]
mod tests;
