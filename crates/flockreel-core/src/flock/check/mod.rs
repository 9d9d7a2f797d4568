//! Independent check of a stored plan: `flockreel check-plan` (docs/explanation/algorithms.md, "Planning").
//!
//! Every step must be the next frame or a jump of the library, after the dwell. The total cost must be right,
//! and no cheaper plan may exist. Plans with `position: film` also weigh places, whose costs are not in the
//! file. Only their steps and costs are checked; in files up to schema 2 they must be the cheapest too. Whole
//! films, segments and loops are checked in every view, but not with `matching.by: direction`. The division of a
//! total into its parts is not checked, only their sum.
//!
//! `costs` and `optimum` use no code of `flock::plan`. The motion of the filmed animal and the limits of
//! segments are not computed again: `motion`, `lens` and `follow::segments` are read here too.

mod costs;
pub(in crate::flock) mod optimum;
#[cfg(test)]
mod tests;

use std::ops::Range;

use rayon::prelude::*;

use self::costs::{Costs, Feature};
use self::optimum::{Graph, NEVER};
use super::follow::segments;
use super::params::{MatchBy, Position};
use super::{Flock, Individual};
use crate::geometry::Turns;
use crate::library::Library;
use crate::parameters::Parameters;
use crate::progress::Progress;

/// Tolerance of a cost in the file, radians: it has 6 decimals, and a turn has 0.0001 rad.
const TOLERANCE_RAD: f64 = 2e-5;

/// First violation found: a stable code and one sentence. Individuals are named by id, frames are output
/// frames, counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message} ({code})")]
pub struct Violation {
    code: &'static str,
    message: String,
}

/// Checks every individual of a flock. Returns the number of jumps, or the first violation. Reports the
/// stage `checking`.
pub fn check(
    library: &Library,
    flock: &Flock,
    progress: &dyn Progress,
) -> Result<usize, Violation> {
    let (params, n) = (&flock.params, flock.individuals.len());
    params.check().or_else(|why| refuse("bad_params", why))?;
    let has_all = Some(n as u32) == params.count;
    if library.poses.fps != flock.fps || !has_all || !flock.fits(library) {
        return refuse("other_library", "not a flock of this library");
    }
    if params.matching.by == MatchBy::Direction {
        return refuse("not_checked", "matching.by: direction is not checked");
    }
    let continuations = flock.individuals.iter().filter_map(|one| one.continues_as);
    let mut continuations: Vec<u32> = continuations.collect();
    continuations.sort_unstable();
    let n_continued = if params.is_loop { n as u32 } else { 0 };
    if !continuations.into_iter().eq(0..n_continued) {
        return refuse("wrong_continuation", "continues_as must name each id once");
    }
    let checker = Checker::new(library, flock);
    let mut n_jumps = 0;
    for batch in flock.individuals.chunks(rayon::current_num_threads()) {
        progress.report("checking", f64::from(batch[0].id) / n as f64);
        let checked: Vec<_> = batch.par_iter().map(|one| checker.check(one)).collect();
        n_jumps += checked.into_iter().sum::<Result<usize, Violation>>()?;
    }
    progress.report("checking", 1.0);
    Ok(n_jumps)
}

fn refuse<T>(code: &'static str, message: impl Into<String>) -> Result<T, Violation> {
    let message = message.into();
    Err(Violation { code, message })
}

struct Checker<'a> {
    costs: Costs<'a>,
    graph: Graph,
    /// Least number of frames between two jumps.
    dwell: usize,
    /// Cost of endless playback from each state, in turns; at least `NEVER` if playback ends.
    future: Vec<u64>,
    /// First frame of each segment, and at the end the number of frames.
    ends: Vec<usize>,
}

/// Frame of a plan.
#[derive(Clone, Copy)]
struct Step {
    state: usize,
    /// Number of frames since the last jump, from 1 to the dwell.
    since: usize,
    /// Cost of the jump to this frame, in turns.
    jump: Option<u64>,
}

impl<'a> Checker<'a> {
    fn new(library: &'a Library, flock: &'a Flock) -> Checker<'a> {
        let params = &flock.params;
        let (dwell, n_frames) = (params.dwell_frames, params.frames as usize);
        let dwell = dwell.map_or(library.clip_frames, |n| n as usize).max(1);
        let ends = match params.position {
            Position::Film => segments(n_frames, params.matching.segment_frames, flock.fps),
            _ => vec![0, n_frames],
        };
        let costs = Costs::new(library, flock);
        let graph = costs.graph(dwell);
        let future = costs::future(&graph, dwell);
        Checker {
            costs,
            graph,
            dwell,
            future,
            ends,
        }
    }

    /// Checks one individual. Returns the number of its jumps.
    fn check(&self, one: &Individual) -> Result<usize, Violation> {
        let (id, cost) = (one.id, &one.cost);
        let plan = self.plan(one)?;
        if !cost.exact && self.costs.flock.params.position != Position::Film {
            return refuse(
                "not_cheapest",
                format!("individual {id}: the plan is not exact"),
            );
        }
        let [mut total, mut lower_bound] = [0; 2];
        for ends in self.ends.windows(2) {
            let frames = ends[0]..ends[1];
            let wanted = self.costs.wanted(&one.boid.part(frames.clone()));
            let alone = wanted.iter().map(|&wanted| self.costs.row(wanted, None));
            if !cost.exact {
                let shown = plan[frames].iter().zip(alone);
                total += shown
                    .map(|(step, row)| step.jump.unwrap_or(0) + row[step.state])
                    .sum::<u64>();
                continue;
            }
            lower_bound += self.least_cost(&plan, frames.start, alone);
            let [paid, future, least] = self.segment(one, &plan, frames.clone(), &wanted);
            total += paid;
            if paid + future != least {
                let [paid, least] = [paid + future, least].map(rad);
                let named = format!("individual {id}, from frame {} on", frames.start);
                let message =
                    format!("{named}: the plan costs {paid:.6} rad, {least:.6} rad is possible");
                return refuse("not_cheapest", message);
            }
        }
        let sum = cost.heading + cost.speed + cost.transition + cost.crowd + cost.repetition;
        let is_wrong = |stored: f64| (stored - rad(total)).abs() > TOLERANCE_RAD;
        if is_wrong(cost.total) || is_wrong(sum) {
            let message = format!(
                "individual {id}: cost.total or its parts are not {:.6} rad",
                rad(total)
            );
            return refuse("wrong_cost", message);
        }
        if cost.lower_bound > rad(lower_bound) + TOLERANCE_RAD {
            let message = format!("individual {id}: a plan costs less than cost.lower_bound");
            return refuse("wrong_lower_bound", message);
        }
        Ok(plan.iter().filter(|step| step.jump.is_some()).count())
    }

    /// Returns for a segment the cost of the plan, the future cost of its last state, and the least sum of
    /// both.
    fn segment(
        &self,
        one: &Individual,
        plan: &[Step],
        frames: Range<usize>,
        wanted: &[Feature],
    ) -> [u64; 3] {
        let mut paid: u64 = plan[frames.clone()]
            .iter()
            .filter_map(|step| step.jump)
            .sum();
        let is_last = frames.end == one.source_frame.len();
        let future = if is_last {
            0
        } else {
            self.future[plan[frames.end - 1].state]
        };
        let rows = frames.clone().zip(wanted).map(|(t, &wanted)| {
            let mut row = self.costs.row(wanted, Some((one.id as usize, t)));
            paid += row[plan[t].state];
            if t + 1 == frames.end && !is_last {
                let states = row.iter_mut().zip(&self.future);
                states.for_each(|(cost, future)| *cost += future);
            }
            row
        });
        let Some(end) = plan.get(one.source_frame.len()) else {
            let least = self.least_cost(plan, frames.start, rows);
            return [paid, future, least];
        };
        let mut after_end = vec![NEVER; self.future.len()];
        after_end[end.state] = 0;
        let (starts, rows) = ([(plan[0].state, 1)], rows.chain([after_end]));
        let least = self.graph.least_cost(self.dwell, &starts, rows);
        [paid + end.jump.unwrap_or(0), 0, least]
    }

    /// Returns the least cost of a segment that begins at frame `first`, after the step before it.
    fn least_cost(&self, plan: &[Step], first: usize, rows: impl Iterator<Item = Vec<u64>>) -> u64 {
        let n_states = self.future.len();
        let Some(before) = first.checked_sub(1).map(|t| plan[t]) else {
            let starts: Vec<_> = (0..n_states).map(|state| (state, self.dwell)).collect();
            return self.graph.least_cost(self.dwell, &starts, rows);
        };
        let (starts, free) = ([(before.state, before.since)], vec![0; n_states]);
        let rows = std::iter::once(free).chain(rows);
        self.graph.least_cost(self.dwell, &starts, rows)
    }

    /// Returns the plan of an individual. In a loop the state after the last frame follows. Fails if a step
    /// is not allowed.
    fn plan(&self, one: &Individual) -> Result<Vec<Step>, Violation> {
        let next = one
            .continues_as
            .map(|id| &self.costs.flock.individuals[id as usize]);
        let shown = one.source_frame.iter().zip(&one.mirrored);
        let after = next.map(|next| (&next.source_frame[0], &next.mirrored[0]));
        // The first frame of a loop counts as just jumped to.
        let since = if next.is_some() { 1 } else { self.dwell };
        let mut plan: Vec<Step> = Vec::new();
        for (t, (&frame, &side)) in shown.chain(after).enumerate() {
            let named = format!("individual {}, frame {t}: source frame {frame}", one.id);
            let Some(state) = self.costs.state(frame, side) else {
                return refuse("outside_component", format!("{named} is not playable"));
            };
            let (since, jump) = match plan.last() {
                None => (since, None),
                Some(last) if self.graph.next[last.state] == Some(state) => {
                    ((last.since + 1).min(self.dwell), None)
                }
                Some(last) => {
                    let Some(cost) = self.graph.jump_cost(last.state, state) else {
                        let message = format!("{named} cannot follow the last one");
                        return refuse("illegal_step", message);
                    };
                    if last.since < self.dwell {
                        let message =
                            format!("{named} comes {} frames after the last jump", last.since);
                        return refuse("dwell_too_short", message);
                    }
                    (1, Some(cost))
                }
            };
            plan.push(Step { state, since, jump });
        }
        Ok(plan)
    }
}

/// Converts a cost from turns to radians.
fn rad(turns: u64) -> f64 {
    turns as f64 / Turns::PER_RAD
}
