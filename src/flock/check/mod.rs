//! Independent check of a stored plan: `flockreel check-plan` (docs/explanation/algorithms.md, "Planning").
//!
//! The check reads a library and a flock. Every step must be the next frame or a jump of the library.
//! Mirror sides, dwell and costs must be right. No cheaper plan may exist.
//!
//! The costs of states and jumps come from `plan::cost`, `plan::crowd` and `plan::segment`, which define
//! them. Everything else is independent of the search for plans. The check has its own states, edges, sums
//! and recursion, which runs from the last frame to the first, one step per edge.

mod cost;
mod graph;
mod optimum;
mod steps;
#[cfg(test)]
mod tests;
mod violation;

pub use violation::Violation;

use rayon::prelude::*;

use self::cost::Ledger;
use self::graph::Graph;
use super::{Flock, Individual};
use crate::library::Library;
use crate::parameters::Parameters;
use crate::progress::Progress;

/// Individuals checked between two reports of progress. Free choice.
const BATCH: usize = 16;

/// Result of a check that found no violation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Number of individuals.
    pub n_individuals: usize,
    /// Number of output frames of all individuals together.
    pub n_frames: usize,
    /// Number of jumps in all plans.
    pub n_jumps: usize,
    /// Number of edges checked for the proof of optimality.
    pub n_edges: u64,
}

/// Checks every individual of a flock, in order of id. Fails with the first violation. Reports the stage
/// `checking`.
pub fn check(
    library: &Library,
    flock: &Flock,
    progress: &dyn Progress,
) -> Result<Report, Violation> {
    belong_together(library, flock)?;
    for (id, individual) in flock.individuals.iter().enumerate() {
        steps::lengths(flock, id, individual)?;
    }
    let graph = Graph::new(library, flock);
    let individuals = flock.individuals.iter().enumerate();
    let plans: Result<Vec<Vec<usize>>, Violation> = individuals
        .map(|(id, individual)| steps::states(&graph, id, individual))
        .collect();
    let plans = plans?;
    let heirs = steps::heirs(flock, &plans)?;
    let ledger = Ledger::new(library, flock, &graph, &plans);
    let mut report = Report::default();
    let ids: Vec<usize> = (0..flock.individuals.len()).collect();
    for batch in ids.chunks(BATCH) {
        progress.report("checking", batch[0] as f64 / ids.len() as f64);
        let one = |&id: &usize| {
            let next = heirs.as_ref().map(|heirs| heirs[id]);
            individual(&graph, &ledger, id, (&plans[id], next))
        };
        let checked: Vec<Result<Report, Violation>> = batch.par_iter().map(one).collect();
        for one in checked {
            report.add(one?);
        }
    }
    progress.report("checking", 1.0);
    Ok(report)
}

fn individual(
    graph: &Graph,
    ledger: &Ledger<'_>,
    id: usize,
    (states, next): (&[usize], Option<usize>),
) -> Result<Report, Violation> {
    let jumps = steps::jumps(graph, ledger.dwell, id, states, next)?;
    let bill = ledger.bill(id, &jumps)?;
    let n_edges = optimum::check(graph, ledger, id, (states, next), &bill)?;
    Ok(Report {
        n_individuals: 1,
        n_frames: states.len(),
        n_jumps: jumps.len(),
        n_edges,
    })
}

impl Report {
    fn add(&mut self, other: Report) {
        self.n_individuals += other.n_individuals;
        self.n_frames += other.n_frames;
        self.n_jumps += other.n_jumps;
        self.n_edges += other.n_edges;
    }
}

fn belong_together(library: &Library, flock: &Flock) -> Result<(), Violation> {
    flock.params.check().map_err(Violation::Params)?;
    let poses = &library.poses;
    if (poses.fps, poses.image_size_px) != (flock.fps, flock.image_size_px) {
        return Err(Violation::OtherLibrary);
    }
    let n_individuals = flock.individuals.len();
    if Some(n_individuals as u32) != flock.params.count {
        return Err(Violation::Count(
            n_individuals,
            flock.params.count.unwrap_or(0),
        ));
    }
    let misplaced = |(id, one): &(usize, &Individual)| one.id as usize != *id;
    match flock.individuals.iter().enumerate().find(misplaced) {
        Some((id, one)) => Err(Violation::Order(id, one.id)),
        None => Ok(()),
    }
}
