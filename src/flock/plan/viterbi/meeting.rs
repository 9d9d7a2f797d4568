//! Where the two halves of a plan meet (ALGORITHMS.md 6): one came as time runs, the other against it.
//!
//! Both know for each state what the cheapest way to it costs by how long ago it landed, so that a run
//! of at least `dwell` frames may lie across the meeting.

use super::half::Half;
use super::{Rows, UNREACHED};
use crate::flock::plan::landings::Way;

/// The cheapest way across, or the cheapest end where there is but one half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// Turns.
    pub(super) cost: u32,
    /// The state at the end of the first half, and for how many frames nothing landed before it.
    pub(super) first: (usize, usize),
    /// The same of the second.
    pub(super) second: (usize, usize),
}

/// The cheapest end of one individual's plan that has one half; `None` when all ends are dead.
pub(super) fn end<const LANES: usize, R: Rows<LANES>>(
    first: &Half<'_, LANES, R>,
    lane: usize,
) -> Option<Meeting> {
    let costs = first.column.landed_since(first.film, 1, lane);
    let (cost, state) = costs.zip(0..).min()?;
    (cost < UNREACHED).then_some(Meeting {
        cost,
        first: (state, 0),
        second: (0, 0),
    })
}

/// The cheapest way across for one individual; `None` when there is none. Ties go to continuing,
/// there to the latest landing in the first half and the smallest state; then to the first jump as `Landings`
/// has them.
pub(super) fn across<const LANES: usize, R: Rows<LANES>>(
    first: &Half<'_, LANES, R>,
    second: &Half<'_, LANES, R>,
    lane: usize,
) -> Option<Meeting> {
    let film = first.film;
    let mut best = Meeting {
        cost: UNREACHED,
        first: (0, 0),
        second: (0, 0),
    };
    let run = film.dwell.max(2);
    for since in 1..run {
        let before = first.column.landed_since(film, since, lane);
        let after = second.column.landed_since(film, run - since, lane);
        for ((before, after), state) in before.zip(after.skip(1)).zip(0..) {
            let cost = before + after;
            if cost < best.cost {
                let (first, second) = ((state, since - 1), (state + 1, run - since - 1));
                best = Meeting {
                    cost,
                    first,
                    second,
                };
            }
        }
    }
    let held = film.dwell - 1;
    let groups = film.trellis.landings(Way::Ahead).groups();
    let jumps = groups.flat_map(|(targets, jumps)| jumps.iter().map(move |jumps| (targets, jumps)));
    for (targets, jumps) in jumps {
        for ((&target, &source), &cost) in targets.iter().zip(&jumps.sources).zip(&jumps.costs) {
            let before = first.column.values()[source as usize][lane].min(UNREACHED - cost);
            let after = second.column.values()[target as usize][lane].min(UNREACHED);
            let cost = before + cost + after;
            if cost < best.cost {
                let (first, second) = ((source as usize, held), (target as usize, held));
                best = Meeting {
                    cost,
                    first,
                    second,
                };
            }
        }
    }
    (best.cost < UNREACHED).then_some(best)
}
