//! The exact plan: for each individual the cheapest path through the trellis (ALGORITHMS.md 6),
//! by dynamic programming over frames with `LANES` individuals side by side.
//!
//! After a jump at least `dwell` frames are played; only the end of the plan may cut that run short, as
//! its beginning may. So a plan read backward is a plan too, and is found from both ends at once: one half
//! as time runs, the other against it, each on a thread of its own, until they meet. Ties go to continuing,
//! then to the smaller state, seen from either end.

mod column;
mod half;
mod landing;
mod meeting;
mod shelf;
mod walk;

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

/// What showing each state costs each individual.
pub trait Rows<const LANES: usize> {
    /// Fills in the costs at frame `t` of the states from `first` on, turns below 2^17. Frames are asked
    /// for in either order, each from state 0 up; barriers may cost anything below 2^17.
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
    /// Where memory lies between plans.
    pub shelf: &'a Shelf,
}

impl Film<'_> {
    /// The cheapest paths of `LANES` individuals, each exactly. `None` when no path is long enough.
    pub fn cheapest_paths<const LANES: usize, R>(&self, rows: &R) -> Option<[Path; LANES]>
    where
        R: Rows<LANES> + Clone + Send + Sync,
    {
        self.cheapest_paths_by_segments(rows, self.segment_frames::<LANES>())
    }

    /// What the cheapest paths of `LANES` individuals cost, turns. `None` when no path is long enough.
    pub fn least_costs<const LANES: usize>(
        &self,
        rows: &mut impl Rows<LANES>,
    ) -> Option<[u32; LANES]> {
        let mut column = Column::start(self, Way::Ahead, rows);
        for _ in 1..self.n_frames {
            column.advance_untraced(self, rows);
        }
        let least = |lane| column.landed_since(self, 1, lane).min();
        let costs = std::array::from_fn(|lane| least(lane).unwrap_or(UNREACHED));
        (!costs.contains(&UNREACHED)).then_some(costs)
    }

    /// What the cheapest way costs to every state that may jump, at every frame, for one individual: what
    /// the certificate checks.
    pub fn potentials(&self, rows: &mut impl Rows<1>) -> Vec<Vec<u32>> {
        let mut column = Column::start(self, Way::Ahead, rows);
        let mut trace = Trace::new(self, Way::Ahead, 1);
        let values = |column: &Column<1>| {
            let values = column.values().as_flattened().iter();
            values.map(|&v| v.min(UNREACHED)).collect()
        };
        let mut columns = vec![values(&column)];
        for _ in 1..self.n_frames {
            column.advance(self, rows, &mut trace);
            columns.push(values(&column));
        }
        columns
    }

    fn segment_frames<const LANES: usize>(&self) -> usize {
        let frame_bytes = Trace::<LANES>::frame_bytes(self, Way::Ahead);
        if frame_bytes * self.n_frames / 2 <= TRACE_BUDGET_BYTES {
            self.n_frames
        } else {
            self.n_frames.isqrt() + 1
        }
    }

    /// As `cheapest_paths`, keeping what led where for `segment` frames at a time.
    fn cheapest_paths_by_segments<const LANES: usize, R>(
        &self,
        rows: &R,
        segment: usize,
    ) -> Option<[Path; LANES]>
    where
        R: Rows<LANES> + Clone + Send + Sync,
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
        let mut meetings = Vec::with_capacity(LANES);
        for lane in 0..LANES {
            meetings.push(match &second {
                Some(second) => meeting::across(&first, second, lane)?,
                None => meeting::end(&first, lane)?,
            });
        }
        let meetings: [Meeting; LANES] = meetings.try_into().ok()?;
        let (mut firsts, seconds) = rayon::join(
            || first.walk(meetings.map(|meeting| meeting.first)),
            || second.map(|second| second.walk(meetings.map(|meeting| meeting.second))),
        );
        for (first, second) in firsts.iter_mut().zip(seconds.iter().flatten()) {
            first.extend(second.iter().rev());
        }
        let mut costs = meetings.iter().map(|meeting| meeting.cost);
        Some(firsts.map(|states| Path {
            states,
            cost: costs.next().unwrap_or(UNREACHED),
        }))
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
