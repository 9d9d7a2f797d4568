//! Which sprite when: for each individual the sequence of real frames that follows its boid best,
//! exactly (O 5.1; ALGORITHMS.md 6).

pub mod certificate;
pub mod cost;
pub mod crowd;
mod round;
mod rows;
pub mod trellis;
pub mod viterbi;

use rayon::prelude::*;

use self::cost::{CEILING, Feature, Weights};
use self::crowd::{Crowd, Place, ROUND, Settled, n_watched};
use self::round::Round;
use self::trellis::Trellis;
use self::viterbi::{Film, Path};
use super::error::Error;
use super::individual::{BoidTrack, PlanCost, rounded};
use super::motion::FrameMotion;
use super::params::Params;
use crate::cpu::Level;
use crate::geometry::Turns;
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
    /// The states that look like each state.
    alike: Vec<[u32; 2]>,
    /// `[t][id]`: where each boid is.
    places: Vec<Vec<Place>>,
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
        let crowd = Crowd::new(params.matching.w_c, fps, length_px);
        let features = weights.features(&trellis, motion);
        let n_frames = boids.first().map_or(0, |boid| boid.heading_rad.len());
        let place = |t| boids.iter().map(|boid| crowd.place(boid, t)).collect();
        Planner {
            features,
            alike: crowd.alike(&trellis),
            places: (0..n_frames).map(place).collect(),
            crowd,
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

    /// The plans of all boids, by id: each as if alone, then again whoever looks like a near neighbor
    /// that it looks out for.
    pub fn plan(&self, progress: &dyn Progress) -> Result<Vec<Plan>, Error> {
        progress.report("planning", 0.0);
        let n_boids = self.boids.len();
        let wanted: Vec<Vec<Feature>> = (self.boids.par_iter())
            .map(|boid| self.weights.wanted(boid, self.fps))
            .collect();
        let mut settled = Settled::new(self.places.len());
        let mut plans = Vec::with_capacity(n_boids);
        for first in (0..n_boids).step_by(ROUND) {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let round = Round {
                planner: self,
                first,
                wanted: &wanted[first..(first + ROUND).min(n_boids)],
            };
            plans.extend(round.plan(&mut settled)?);
            progress.report("planning", plans.len() as f64 / n_boids as f64);
        }
        Ok(plans)
    }

    fn film(&self) -> Film<'_> {
        Film {
            trellis: &self.trellis,
            n_frames: self.places.len(),
            dwell: self.dwell,
            cpu: Level::detect(),
        }
    }

    /// What looking like those it looks out for adds to each frame of a path, turns.
    fn crowd_costs<'b>(
        &'b self,
        id: usize,
        path: &'b Path,
        settled: &'b Settled,
    ) -> impl Iterator<Item = u32> + 'b {
        let n_watched = n_watched(id);
        path.states.iter().enumerate().map(move |(t, &state)| {
            let [low, high] = self.alike[state as usize];
            let others = settled.at(t)[..n_watched].iter().zip(&self.places[t]);
            others
                .filter(|(other, _)| (low..high).contains(*other))
                .map(|(_, place)| u32::from(self.crowd.cost_at(self.places[t][id], *place)))
                .sum()
        })
    }

    /// The plan with its cost in parts: summed anew from the states. `crowd[t]` is what the crowd
    /// would add without the ceiling.
    fn costed(
        &self,
        path: &Path,
        wanted: &[Feature],
        crowd: impl Iterator<Item = u32>,
        lower_bound: u32,
    ) -> Plan {
        let (mut heading, mut speed, mut transition, mut alike) = (0u32, 0u32, 0u32, 0u32);
        for ((t, &state), crowd) in path.states.iter().enumerate().zip(crowd) {
            let feature = self.features[state as usize];
            let [h, s] = self.weights.of_state(wanted[t], feature);
            heading += h;
            speed += s;
            let alone = self.weights.total(wanted[t], feature);
            alike += (alone + crowd).min(CEILING - 1) - alone;
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
                crowd: rad(alike),
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

#[cfg(test)]
mod tests;
