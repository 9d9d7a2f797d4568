//! Meeting of the two halves of a plan, one of which runs forward in time and the other backward
//! (docs/explanation/algorithms.md, "Planning").
//!
//! For each state, both halves know the least cost by the number of frames since the last landing. A run of
//! at least `dwell` frames may therefore lie across the meeting.

use super::half::Half;
use super::{Film, Rows, UNREACHED};
use crate::flock::plan::landings::Way;

/// End of a half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    pub(super) station: usize,
    /// Number of frames since the landing. `dwell - 1` stands for this number or more; the path may then
    /// jump.
    pub(super) ago: usize,
}

/// Cheapest connection of two halves, or the cheapest end if there is only one half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// Cost, in turns.
    pub(super) cost: u32,
    pub(super) first: Stand,
    pub(super) second: Stand,
}

const NOWHERE: Stand = Stand { station: 0, ago: 0 };

/// Returns the cheapest end of a plan with one half, given the costs of its ends. `None` if no end is
/// reached. Ties go to the latest landing, then to the smallest station.
pub(super) fn end(film: &Film<'_>, ends: &[Vec<u32>]) -> Option<Meeting> {
    debug_assert_eq!(ends.len(), film.dwell);
    let stands = ends.iter().enumerate().flat_map(|(ago, ends)| {
        let stand = move |station| Stand { station, ago };
        ends.iter().zip(0..).map(move |(&cost, s)| (cost, stand(s)))
    });
    let (cost, first) = stands.min_by_key(|&(cost, _)| cost)?;
    let second = NOWHERE;
    (cost < UNREACHED).then_some(Meeting {
        cost,
        first,
        second,
    })
}

/// Returns the cheapest connection of two halves; `None` if there is none. Ties go to playing on, then to
/// the latest landing in the first half, then to the smallest state. Ties between jumps go to the first in
/// the order of `Landings`.
pub(super) fn across<R: Rows>(first: &Half<'_, R>, second: &Half<'_, R>) -> Option<Meeting> {
    let film = first.film;
    let (n_states, held) = (film.trellis.n_states(), film.dwell - 1);
    let mut best = (UNREACHED, NOWHERE, NOWHERE);
    let since = [&first.ends, &second.ends].map(|ends| at_least(ends));
    for ago in 0..held.max(1) {
        // A run of at least `dwell` frames, and at least two, that lies across the meeting.
        let rest = held.saturating_sub(1) - ago;
        // The state after the last state of the first half is the last state of the second half.
        let after = since[1][rest].iter().rev().skip(1);
        let ways = since[0][ago].iter().zip(after).map(|(a, b)| a + b);
        if let Some((cost, state)) = ways.zip(0..).min()
            && cost < best.0
        {
            let station = Way::Back.station(n_states, state + 1);
            best = (
                cost,
                exactly(&first.ends, state, ago),
                exactly(&second.ends, station, rest),
            );
        }
    }
    for (target, jumps) in film.trellis.landings(Way::Ahead).iter() {
        let station = Way::Back.station(n_states, target);
        let after = second.ends[held][station];
        for jump in jumps {
            let from = jump.from as usize;
            let before = first.ends[held][from].min(UNREACHED - jump.cost);
            let cost = before + jump.cost + after;
            if cost < best.0 {
                let stand = |station| Stand { station, ago: held };
                best = (cost, stand(from), stand(station));
            }
        }
    }
    let (cost, first, second) = best;
    (cost < UNREACHED).then_some(Meeting {
        cost,
        first,
        second,
    })
}

/// Returns `[ago][station]`: the least cost of paths that landed `ago` or more frames ago.
fn at_least(ends: &[Vec<u32>]) -> Vec<Vec<u32>> {
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
fn exactly(ends: &[Vec<u32>], station: usize, ago: usize) -> Stand {
    let ago = (ago..ends.len()).min_by_key(|&ago| ends[ago][station]);
    Stand {
        station,
        ago: ago.unwrap_or(ends.len() - 1),
    }
}
