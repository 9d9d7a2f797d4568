//! Checks whether a plan can be played: its lists, frames, steps and dwell.

use super::graph::Graph;
use super::violation::Violation;
use crate::flock::{Flock, Individual};

/// Jump in a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Taken {
    /// Output frame to which the jump leads.
    pub(super) t: usize,
    /// Source frame and mirror side before and after the jump.
    pub(super) ends: [(u32, bool); 2],
    /// Cost, in turns.
    pub(super) cost: u64,
}

/// Checks that every list that the check reads has one entry per frame.
pub(super) fn lengths(flock: &Flock, id: usize, individual: &Individual) -> Result<(), Violation> {
    let wanted = flock.params.frames as usize;
    let boid = &individual.boid;
    for (list, found) in [
        ("source_frame", individual.source_frame.len()),
        ("mirrored", individual.mirrored.len()),
        ("boid.position", boid.position_px.len()),
        ("boid.heading_rad", boid.heading_rad.len()),
        ("boid.speed", boid.speed_bl_per_s.len()),
    ] {
        if found != wanted {
            return Err(Violation::Length {
                id,
                list,
                found,
                wanted,
            });
        }
    }
    Ok(())
}

/// Returns the plan as states of the graph. Fails if one of them may not be shown.
pub(super) fn states(
    graph: &Graph,
    id: usize,
    individual: &Individual,
) -> Result<Vec<usize>, Violation> {
    let shown = individual.source_frame.iter().zip(&individual.mirrored);
    let state = |(t, (&frame, &side)): (usize, (&u32, &bool))| {
        if side && !graph.mirror {
            return Err(Violation::Mirror { id, t });
        }
        let state = graph.state(frame, side);
        state.ok_or(Violation::OutsideComponent { id, t, frame })
    };
    shown.enumerate().map(state).collect()
}

/// Returns, by individual, the first state of its heir: the individual as which it continues. `None` if the
/// flock is no loop.
pub(super) fn heirs(flock: &Flock, plans: &[Vec<usize>]) -> Result<Option<Vec<usize>>, Violation> {
    let mut is_taken = vec![false; plans.len()];
    let mut nexts = Vec::new();
    for (id, individual) in flock.individuals.iter().enumerate() {
        let heir = individual.continues_as.map(|heir| heir as usize);
        match heir {
            None if !flock.params.is_loop => continue,
            Some(heir) if flock.params.is_loop && is_taken.get(heir) == Some(&false) => {
                is_taken[heir] = true;
                nexts.push(plans[heir][0]);
            }
            _ => return Err(Violation::Heir { id }),
        }
    }
    Ok(flock.params.is_loop.then_some(nexts))
}

/// Returns the jumps of a plan. Fails if a step is not allowed. In a loop `next` follows the last frame,
/// and the first frame counts as just jumped to.
pub(super) fn jumps(
    graph: &Graph,
    dwell: usize,
    id: usize,
    states: &[usize],
    next: Option<usize>,
) -> Result<Vec<Taken>, Violation> {
    let mut jumps: Vec<Taken> = Vec::new();
    let followed: Vec<usize> = states.iter().copied().chain(next).collect();
    for t in 1..followed.len() {
        let (before, state) = (followed[t - 1], followed[t]);
        if graph.next[before] == Some(state) {
            continue;
        }
        let ends = [before, state].map(|state| graph.shown()[state]);
        let [(from, from_side), (to, side)] = ends;
        let cost = graph
            .jump_cost(before, state)
            .ok_or(Violation::IllegalStep {
                id,
                t,
                from,
                to,
                turned: from_side != side,
            })?;
        let from_start = if next.is_some() { t } else { dwell };
        let since = jumps.last().map_or(from_start, |jump| t - jump.t);
        if since < dwell {
            return Err(Violation::Dwell {
                id,
                t,
                since,
                dwell,
            });
        }
        jumps.push(Taken { t, ends, cost });
    }
    Ok(jumps)
}
