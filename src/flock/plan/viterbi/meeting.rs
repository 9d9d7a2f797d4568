//! Where the two halves of a plan meet (ALGORITHMS.md 6): one came as time runs, the other against it.
//!
//! Both know for each state what the cheapest way to it costs by how long ago it landed, so that a run
//! of at least `dwell` frames may lie across the meeting.

use super::half::Half;
use super::{Film, Rows, UNREACHED};
use crate::flock::plan::landings::Way;

/// The end of a half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    pub(super) station: usize,
    /// It landed so many frames ago; `dwell - 1`, at least so many, and may jump.
    pub(super) ago: usize,
}

/// The cheapest way across, or the cheapest end where there is but one half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// Turns.
    pub(super) cost: u32,
    pub(super) first: Stand,
    pub(super) second: Stand,
}

const NOWHERE: Stand = Stand { station: 0, ago: 0 };

/// The cheapest end of a plan that has one half, given what its ends cost; `None` when all are dead.
/// Ties go to the latest landing, there to the smallest station.
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

/// The cheapest way across; `None` when there is none. Ties go to going on,
/// there to the latest landing in the first half and the smallest state; then to the first jump as `Landings`
/// has them.
pub(super) fn across<R: Rows>(first: &Half<'_, R>, second: &Half<'_, R>) -> Option<Meeting> {
    let film = first.film;
    let (n_states, held) = (film.trellis.n_states(), film.dwell - 1);
    let mut best = (UNREACHED, NOWHERE, NOWHERE);
    let since = [&first.ends, &second.ends].map(|ends| at_least(ends));
    for ago in 0..held.max(1) {
        // A run of `dwell` frames, two at least, that landed here and is left there.
        let rest = held.saturating_sub(1) - ago;
        // The state after the first's last is the second's last.
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

/// `[ago][station]`: the least of all that landed so many frames ago or more.
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

/// Which of those that landed so many frames ago or more costs least: the latest of them.
fn exactly(ends: &[Vec<u32>], station: usize, ago: usize) -> Stand {
    let ago = (ago..ends.len()).min_by_key(|&ago| ends[ago][station]);
    Stand {
        station,
        ago: ago.unwrap_or(ends.len() - 1),
    }
}
