//! Meeting of the two halves of a plan, one of which runs forward in time and the other backward
//! (docs/explanation/algorithms.md, "Planning").
//!
//! For each state, both halves know the least cost by the number of frames since the last landing. A run of
//! at least `dwell` frames may therefore lie across the meeting.

use super::half::Half;
use super::traceback::PathEnd;
use super::{StateCosts, UNREACHED};
use crate::flock::plan::landings::Pass;

/// Cheapest connection of two halves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// Cost, in turns.
    pub(super) cost: u32,
    pub(super) first: PathEnd,
    pub(super) second: PathEnd,
}

/// Returns the cheapest end of a plan with one half, with its cost, given the costs of its ends. `None` if
/// no end is reached. Ties go to the latest landing, then to the smallest station.
pub(super) fn cheapest_end(ends: &[Vec<u32>]) -> Option<(u32, PathEnd)> {
    let all = ends.iter().enumerate().flat_map(|(ago, ends)| {
        let end = move |station| PathEnd { station, ago };
        ends.iter().zip(0..).map(move |(&cost, s)| (cost, end(s)))
    });
    let cheapest = all.min_by_key(|&(cost, _)| cost);
    cheapest.filter(|&(cost, _)| cost < UNREACHED)
}

/// Returns the cheapest connection of two halves; `None` if there is none. Ties go to playing on, then to
/// the latest landing in the first half, then to the smallest state. Ties between jumps go to the first in
/// the order of `Landings`.
pub(super) fn cheapest_meeting<R: StateCosts>(
    first: &Half<'_, R>,
    second: &Half<'_, R>,
) -> Option<Meeting> {
    let search = first.search;
    let (n_states, free_row) = (search.trellis.n_states(), search.dwell - 1);
    let nowhere = PathEnd { station: 0, ago: 0 };
    let mut best = Meeting {
        cost: UNREACHED,
        first: nowhere,
        second: nowhere,
    };
    let since = [&first.ends, &second.ends].map(|ends| landed_at_least(ends));
    for ago in 0..free_row.max(1) {
        // A run of at least `dwell` frames, and at least two, that lies across the meeting.
        let rest = free_row.saturating_sub(1) - ago;
        // The state after the last state of the first half is the last state of the second half.
        let after = since[1][rest].iter().rev().skip(1);
        let sums = since[0][ago].iter().zip(after).map(|(a, b)| a + b);
        if let Some((cost, state)) = sums.zip(0..).min()
            && cost < best.cost
        {
            let station = Pass::Backward.station(n_states, state + 1);
            best = Meeting {
                cost,
                first: cheapest_at(&first.ends, state, ago),
                second: cheapest_at(&second.ends, station, rest),
            };
        }
    }
    let free = |station| PathEnd {
        station,
        ago: free_row,
    };
    for (target, jumps) in search.trellis.landings(Pass::Forward).iter() {
        let station = Pass::Backward.station(n_states, target);
        let after = second.ends[free_row][station];
        for jump in jumps {
            let from = jump.from as usize;
            let before = first.ends[free_row][from].min(UNREACHED - jump.cost);
            let cost = before + jump.cost + after;
            if cost < best.cost {
                best = Meeting {
                    cost,
                    first: free(from),
                    second: free(station),
                };
            }
        }
    }
    (best.cost < UNREACHED).then_some(best)
}

/// Returns `[ago][station]`: the least cost of paths that landed `ago` or more frames ago.
fn landed_at_least(ends: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut least = ends.to_vec();
    for ago in (1..ends.len()).rev() {
        let (before, from) = least.split_at_mut(ago);
        for (least, &later) in before[ago - 1].iter_mut().zip(&from[0]) {
            *least = later.min(*least);
        }
    }
    least
}

/// Returns the cheapest end at a station among those that landed `ago` or more frames ago. Ties go to the
/// latest landing.
fn cheapest_at(ends: &[Vec<u32>], station: usize, ago: usize) -> PathEnd {
    let ago = (ago..ends.len()).min_by_key(|&ago| ends[ago][station]);
    PathEnd {
        station,
        ago: ago.unwrap_or(ends.len() - 1),
    }
}
