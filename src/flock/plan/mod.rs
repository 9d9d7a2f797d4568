//! Which sprite when: for each individual the sequence of real frames that follows its boid best,
//! exactly (O 5.1; ALGORITHMS.md 6).

pub mod certificate;
pub mod cost;
pub mod crowd;
pub mod trellis;
pub mod viterbi;

use rayon::prelude::*;

use self::cost::{CEILING, Feature, FrameMotion, Weights};
use self::crowd::{Crowd, Lookalike};
use self::trellis::Trellis;
use self::viterbi::{Path, cheapest_paths};
use super::error::Error;
use super::individual::{BoidTrack, PlanCost, rounded};
use super::params::Params;
use crate::geometry::{Turns, wrap_rad};
use crate::library::Library;
use crate::progress::Progress;

/// Individuals planned side by side.
const LANES: usize = 8;

/// What one individual shows, and what that costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Source frame and mirror side at every output frame.
    pub shown: Vec<(u32, bool)>,
    /// What it costs.
    pub cost: PlanCost,
}

/// Everything that plans are computed from.
pub struct Planner<'a> {
    trellis: Trellis,
    weights: Weights,
    features: Vec<Feature>,
    crowd: Crowd,
    dwell: usize,
    fps: f64,
    boids: &'a [BoidTrack],
}

impl<'a> Planner<'a> {
    /// Lays out the library's playback for the plan of `boids`.
    pub fn new(
        library: &Library,
        motion: &[FrameMotion],
        boids: &'a [BoidTrack],
        params: &Params,
    ) -> Planner<'a> {
        let weights = Weights::new(&params.matching, library);
        let trellis = Trellis::new(&library.playback, params.mirror, |distance| {
            weights.of_jump(distance, library.epsilon)
        });
        let fps = library.poses.fps;
        let length_px = library.stats.length_px.unwrap_or(1.0).max(1.0);
        Planner {
            features: weights.features(&trellis, motion),
            crowd: Crowd::new(params.matching.w_c, fps, length_px),
            dwell: params
                .dwell_frames
                .map_or(library.clip_frames, |frames| frames as usize)
                .max(1),
            trellis,
            weights,
            fps,
            boids,
        }
    }

    /// The plans of all boids, by id: first all at once as if alone, then again, in order of id,
    /// whoever looks like a near neighbor of smaller id.
    pub fn plan(&self, progress: &dyn Progress) -> Result<Vec<Plan>, Error> {
        progress.report("planning", 0.0);
        let wanted: Vec<Vec<Feature>> = self.boids.iter().map(|b| self.wanted(b)).collect();
        let alone = self.plan_alone(&wanted)?;
        let bounds: Vec<u32> = alone.iter().map(|path| path.cost).collect();
        let mut states: Vec<Vec<u32>> = Vec::with_capacity(alone.len());
        let mut plans = Vec::with_capacity(alone.len());
        for (id, path) in alone.into_iter().enumerate() {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let crowd = self.crowd_of(id, &states);
            let clones = self.crowd_cost(&crowd, &path.states) > 0;
            let path = match clones {
                true => self.plan_in_crowd(&wanted[id], &crowd)?,
                false => path,
            };
            plans.push(self.costed(&path, &wanted[id], &crowd, bounds[id]));
            states.push(path.states);
            progress.report("planning", (id + 1) as f64 / self.boids.len() as f64);
        }
        Ok(plans)
    }

    fn plan_alone(&self, wanted: &[Vec<Feature>]) -> Result<Vec<Path>, Error> {
        let batches: Vec<&[Vec<Feature>]> = wanted.chunks(LANES).collect();
        let paths: Option<Vec<[Path; LANES]>> = batches
            .par_iter()
            .map(|batch| {
                let lane_of = |lane: usize| &batch[lane.min(batch.len() - 1)];
                cheapest_paths(
                    &self.trellis,
                    batch[0].len(),
                    self.dwell,
                    |t, row: &mut [[u32; LANES]]| {
                        let wanted: [Feature; LANES] = std::array::from_fn(|l| lane_of(l)[t]);
                        for (out, &feature) in row.iter_mut().zip(&self.features) {
                            for lane in 0..LANES {
                                out[lane] = self.weights.total(wanted[lane], feature);
                            }
                        }
                    },
                )
            })
            .collect();
        let mut paths: Vec<Path> = paths
            .ok_or(Error::NoTransitions)?
            .into_iter()
            .flatten()
            .collect();
        paths.truncate(wanted.len());
        Ok(paths)
    }

    fn plan_in_crowd(&self, wanted: &[Feature], crowd: &[Vec<Lookalike>]) -> Result<Path, Error> {
        let [path] = cheapest_paths(
            &self.trellis,
            wanted.len(),
            self.dwell,
            |t, row: &mut [[u32; 1]]| self.row_in_crowd(t, wanted, crowd, row),
        )
        .ok_or(Error::NoTransitions)?;
        Ok(path)
    }

    fn row_in_crowd(
        &self,
        t: usize,
        wanted: &[Feature],
        crowd: &[Vec<Lookalike>],
        row: &mut [[u32; 1]],
    ) {
        for (out, &feature) in row.iter_mut().zip(&self.features) {
            out[0] = self.weights.total(wanted[t], feature);
        }
        self.crowd.add_to_row(&self.trellis, &crowd[t], row);
        for out in row {
            out[0] = out[0].min(CEILING - 1);
        }
    }

    /// Whom individual `id` should not look like, at every frame.
    fn crowd_of(&self, id: usize, states: &[Vec<u32>]) -> Vec<Vec<Lookalike>> {
        let boid = &self.boids[id];
        let others = || self.boids.iter().zip(states.iter().map(Vec::as_slice));
        (0..boid.heading_rad.len())
            .map(|t| self.crowd.lookalikes(boid, others(), t))
            .collect()
    }

    fn crowd_cost(&self, crowd: &[Vec<Lookalike>], states: &[u32]) -> u32 {
        let at = |(near, &state): (&Vec<Lookalike>, &u32)| {
            self.crowd.cost_of(&self.trellis, near, state)
        };
        crowd.iter().zip(states).map(at).sum()
    }

    /// What a boid wants at every frame, from its track as the file holds it.
    fn wanted(&self, boid: &BoidTrack) -> Vec<Feature> {
        let turns = turn_rates(&boid.heading_rad, self.fps);
        let speeds = &boid.speed_bl_per_s;
        (0..turns.len())
            .map(|t| {
                self.weights
                    .wanted(boid.heading_rad[t], turns[t], speeds[t])
            })
            .collect()
    }

    /// The plan with its cost in parts: summed anew from the states.
    fn costed(
        &self,
        path: &Path,
        wanted: &[Feature],
        crowd: &[Vec<Lookalike>],
        lower_bound: u32,
    ) -> Plan {
        let (mut heading, mut speed, mut transition) = (0u32, 0u32, 0u32);
        for (t, &state) in path.states.iter().enumerate() {
            let [h, s] = self
                .weights
                .of_state(wanted[t], self.features[state as usize]);
            heading += h;
            speed += s;
            if t > 0 && path.states[t - 1] + 1 != state {
                transition += self.jump_cost(path.states[t - 1], state);
            }
        }
        let rad = |turns: u32| rounded(f64::from(turns) / Turns::PER_RAD, 6);
        Plan {
            shown: path
                .states
                .iter()
                .filter_map(|&state| self.trellis.shown(state as usize))
                .collect(),
            cost: PlanCost {
                total: rad(path.cost),
                heading: rad(heading),
                speed: rad(speed),
                transition: rad(transition),
                crowd: rad(self.crowd_cost(crowd, &path.states)),
                lower_bound: rad(lower_bound),
                exact: true,
            },
        }
    }

    fn jump_cost(&self, from: u32, to: u32) -> u32 {
        let k = self.trellis.targets().binary_search(&to);
        let sources = k.map_or(&[][..], |k| self.trellis.sources(k));
        let at = sources.binary_search_by_key(&from, |source| source.0);
        at.map_or(0, |at| sources[at].1)
    }
}

/// The turn rate at every frame of a track: central differences, one-sided at the ends.
pub fn turn_rates(heading_rad: &[f64], fps: f64) -> Vec<f64> {
    let last = heading_rad.len().saturating_sub(1);
    (0..heading_rad.len())
        .map(|t| {
            let (before, after) = (t.saturating_sub(1), (t + 1).min(last));
            let span_s = (after - before).max(1) as f64 / fps;
            wrap_rad(heading_rad[after] - heading_rad[before]) / span_s
        })
        .collect()
}

#[cfg(test)]
mod tests;
