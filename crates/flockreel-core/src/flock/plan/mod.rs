//! Planning: which source frame each individual shows at each output frame.
//!
//! For each individual, the planner finds the sequence of real frames that follows its boid at the least
//! cost, exactly (Okabe et al., section 5.1; docs/explanation/algorithms.md, "Planning"). `cost` and
//! `crowd` define the costs, `viterbi` finds the cheapest path, `segment` and `loops` handle segments and
//! loops.

mod conditions;
pub mod cost;
pub mod crowd;
mod fill;
mod individual_plan;
pub mod landings;
#[cfg(target_arch = "x86_64")]
mod lanes;
pub mod loops;
mod range_costs;
mod round;
pub mod segment;
mod state_costs;
pub mod trellis;
pub mod viterbi;

use rayon::prelude::*;

use self::conditions::FORBIDDEN;
use self::cost::{CEILING, Feature, Weights};
use self::crowd::{Crowd, FinalPlans, Places};
pub use self::individual_plan::{CostParts, Plan};
use self::loops::LoopEnds;
use self::segment::{PlaybackStatus, future_costs};
use self::trellis::Trellis;
use self::viterbi::{Path, PathSearch, TracePool};
use super::error::Error;
use super::individual::BoidTrack;
use super::motion::FrameMotion;
use super::params::Params;
use crate::cpu::Level;
use crate::library::{Jump, Library};
use crate::progress::Progress;

/// Trellis and costs of states and jumps, for all plans of one library and one set of parameters.
pub struct Model {
    /// States and the steps between them.
    pub trellis: Trellis,
    /// Future cost by state, in turns; `FORBIDDEN` for a state from which playback cannot continue.
    future: Vec<u32>,
    /// Least number of frames between two jumps.
    pub dwell: usize,
    weights: Weights,
    /// Features by state.
    features: Vec<Feature>,
    crowd: Crowd,
    /// By state: the states that look like it, as first and one past the last.
    alike: Vec<[u32; 2]>,
    fps: f64,
    trace_pool: TracePool,
    /// Target state and cost of each jump, in turns, by source state.
    jumps: Vec<Vec<(u32, u32)>>,
}

impl Model {
    /// Returns the model of a library.
    pub fn new(library: &Library, motion: &[FrameMotion], params: &Params) -> Model {
        let weights = Weights::new(&params.matching, library);
        let dwell = params
            .dwell_frames
            .map_or(library.clip_frames, |frames| frames as usize)
            .max(1);
        let playback = library.playback.without_dead_ends(params.mirror, dwell);
        let trellis = Trellis::new(&playback, params.mirror, |jump| weights.jump_cost(jump));
        let fps = library.poses.fps;
        let length_px = library.stats.length_px.unwrap_or(1.0).max(1.0);
        let crowd = Crowd::new(params.matching.w_c, fps, length_px);
        let mut jumps = vec![Vec::new(); trellis.n_states()];
        for (k, &target) in trellis.targets().iter().enumerate() {
            for &(source, cost) in trellis.sources(k) {
                jumps[source as usize].push((target, cost));
            }
        }
        Model {
            features: weights.features(&trellis, motion),
            alike: crowd.alike(&trellis),
            crowd,
            future: future_costs(&trellis, dwell),
            dwell,
            trellis,
            weights,
            fps,
            trace_pool: TracePool::default(),
            jumps,
        }
    }

    /// Returns the jumps from a state: target state and cost, in turns.
    pub fn jumps_from(&self, state: u32) -> &[(u32, u32)] {
        &self.jumps[state as usize]
    }

    /// Returns the features that a boid asks for at each frame.
    pub fn wanted(&self, boid: &BoidTrack) -> Vec<Feature> {
        self.weights.wanted(boid, self.fps)
    }

    /// Returns the costs of showing a state where `wanted` is asked for, in turns: heading and speed.
    pub fn match_costs(&self, wanted: Feature, state: u32) -> [u32; 2] {
        let [heading, speed] = (self.weights).parts_of(wanted, self.features[state as usize]);
        let heading = heading.min(CEILING - 1);
        [heading, speed.min(CEILING - 1 - heading)]
    }

    /// Returns the future cost of a state, in turns.
    pub fn future(&self, state: u32) -> u32 {
        self.future[state as usize]
    }

    /// Returns whether two states look alike.
    pub fn looks_alike(&self, state: u32, other: u32) -> bool {
        let [first, end] = self.alike[state as usize];
        (first..end).contains(&other)
    }

    /// Returns the cost of looking like an animal at an offset in the image, body lengths, in turns.
    pub fn crowd_cost(&self, offset_bl: [f64; 2]) -> u32 {
        let [x, y] = offset_bl.map(|bl| (32.0 * bl).round() as i32);
        self.crowd.cost_at([x, y, 0], [0; 3])
    }

    /// Returns the frame and mirror side of each state. Barriers are left out.
    pub fn shown(&self, states: &[u32]) -> Vec<(u32, bool)> {
        let shown = states.iter();
        shown
            .filter_map(|&state| self.trellis.shown(state as usize))
            .collect()
    }

    /// Returns whether endless playback can continue from a state.
    pub fn is_endless(&self, state: u32) -> bool {
        self.future[state as usize] < FORBIDDEN
    }

    /// Returns the part of a jump's cost for showing frames again, in turns.
    fn repetition_cost(&self, from: u32, to: u32) -> u32 {
        let ends = [from, to].map(|state| self.trellis.shown(state as usize));
        let [Some((from, from_side)), Some((to, side))] = ends else {
            return 0;
        };
        self.weights.repetition_cost(&Jump {
            from,
            to,
            cost: 0,
            mirrored: from_side != side,
        })
    }

    /// Returns the heading cost of a state at the first frame of a boid's track, in turns.
    pub fn heading_cost(&self, boid: &BoidTrack, state: usize) -> u32 {
        let wanted = self.weights.wanted(boid, self.fps)[0];
        self.weights.parts_of(wanted, self.features[state])[0]
    }
}

/// Planner of all individuals, for a whole film or for one segment.
pub struct Planner<'a> {
    model: &'a Model,
    /// Positions of all boids, by frame.
    places: Vec<Places>,
    boids: &'a [BoidTrack],
    /// State of each individual before the segment, by id; empty for the first segment. In later segments,
    /// entry 0 of `places` belongs to the last frame of the previous segment.
    statuses: &'a [PlaybackStatus],
    /// Whether no segment follows.
    is_last: bool,
    /// In a loop, the ends of each plan, by id; else empty.
    ends: Vec<LoopEnds>,
}

impl<'a> Planner<'a> {
    /// Returns a planner for a whole film.
    pub fn new(model: &'a Model, boids: &'a [BoidTrack]) -> Planner<'a> {
        Planner::for_segment(model, boids, &[], true)
    }

    /// Returns a planner for a segment. `boids` are the tracks within that segment.
    pub fn for_segment(
        model: &'a Model,
        boids: &'a [BoidTrack],
        statuses: &'a [PlaybackStatus],
        is_last: bool,
    ) -> Planner<'a> {
        let n_frames = boids.first().map_or(0, |boid| boid.heading_rad.len());
        let place = |t| {
            boids
                .iter()
                .map(|boid| model.crowd.place(boid, t))
                .collect()
        };
        let before = (!statuses.is_empty()).then_some(0);
        Planner {
            model,
            places: before.into_iter().chain(0..n_frames).map(place).collect(),
            boids,
            statuses,
            is_last,
            ends: Vec::new(),
        }
    }

    /// Returns the number of entries of `places` before the first planned frame.
    fn n_before(&self) -> usize {
        usize::from(!self.statuses.is_empty())
    }

    /// Returns the plans of all boids of a loop, by id. `continuations[id]` is the individual as which
    /// `id` continues, so the last frame of its plan leads to the first frame of that plan. Fails if no
    /// loop of this length closes.
    pub fn plan_loop(
        mut self,
        continuations: &[u32],
        progress: &dyn Progress,
    ) -> Result<Vec<Plan>, Error> {
        if self.places.len() <= self.model.dwell {
            return Err(Error::LoopDoesNotClose(self.places.len()));
        }
        let wanted = self.wanted();
        let mut final_plans = FinalPlans::new(self.places.len());
        let open = self.paths(&wanted, &mut final_plans, progress)?;
        let first_states = self.first_states(&open, &wanted, continuations, progress)?;
        let next = continuations.iter().map(|&id| first_states[id as usize]);
        self.ends = (first_states.iter().zip(next))
            .map(|(&first, next)| LoopEnds { first, next })
            .collect();
        self.plan(progress)
    }

    /// Returns the features that each boid asks for, by id and frame.
    fn wanted(&self) -> Vec<Vec<Feature>> {
        let before = vec![Feature::default(); self.n_before()];
        (self.boids.par_iter())
            .map(|boid| {
                let wanted = self.model.weights.wanted(boid, self.model.fps);
                before.iter().copied().chain(wanted).collect()
            })
            .collect()
    }

    /// Returns the plans of all boids, by id. Each plan is the cheapest, given the plans of the individuals
    /// that it watches. The least cost of each individual without crowd cost is computed in parallel, as
    /// the lower bound.
    pub fn plan(&self, progress: &dyn Progress) -> Result<Vec<Plan>, Error> {
        let wanted = self.wanted();
        let mut final_plans = FinalPlans::new(self.places.len());
        let (paths, bounds) = rayon::join(
            || self.paths(&wanted, &mut final_plans, progress),
            || self.least_costs(&wanted, progress),
        );
        let (paths, bounds) = (paths?, bounds?);
        Ok((paths.par_iter().enumerate())
            .map(|(id, path)| self.costed(path, &wanted[id], bounds[id]))
            .collect())
    }

    /// Returns the paths of all boids, by id, computed in rounds. The paths of a round are final before the
    /// next round starts.
    fn paths(
        &self,
        wanted: &[Vec<Feature>],
        final_plans: &mut FinalPlans,
        progress: &dyn Progress,
    ) -> Result<Vec<Path>, Error> {
        let mut paths = Vec::with_capacity(wanted.len());
        while paths.len() < wanted.len() {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let first = paths.len();
            let n_watched = self.model.crowd.n_watched(first);
            let alike = |id: &usize| self.model.crowd.n_watched(*id) == n_watched;
            let end = first + (first..wanted.len()).take_while(alike).count();
            let round = self.paths_of_round(first, &wanted[first..end], final_plans)?;
            for path in &round {
                final_plans.push(self.states_in_film(path), &self.model.alike);
            }
            paths.extend(round);
        }
        Ok(paths)
    }

    /// Returns the search for the paths of all individuals.
    fn search(&self) -> PathSearch<'_> {
        PathSearch {
            trellis: &self.model.trellis,
            n_frames: self.places.len() + usize::from(!self.ends.is_empty()),
            dwell: self.model.dwell,
            cpu: Level::detect(),
            trace_pool: &self.model.trace_pool,
        }
    }

    /// Returns the plan of a path with its cost in parts. The parts are summed from the states; the rest of
    /// the path's cost is the crowd cost.
    fn costed(&self, path: &Path, wanted: &[Feature], lower_bound: u32) -> Plan {
        let n_before = self.n_before();
        let (mut heading, mut speed, mut alone) = (0, 0, 0);
        let states = &self.states_in_film(path)[n_before..];
        for (&wanted, &state) in wanted[n_before..].iter().zip(states) {
            let feature = self.model.features[state as usize];
            let [h, s] = self.model.weights.parts_of(wanted, feature);
            heading += u64::from(h);
            speed += u64::from(s);
            alone += self.model.weights.total(wanted, feature);
        }
        let [jumps, repetition] = self.jump_costs(path);
        Plan {
            states: states.to_vec(),
            cost: CostParts {
                heading,
                speed,
                transition: u64::from(jumps - repetition),
                crowd: u64::from(path.cost - alone - jumps),
                repetition: u64::from(repetition),
                total: u64::from(path.cost),
                lower_bound: u64::from(lower_bound),
                weighs_places: false,
            },
        }
    }

    /// Returns the cost of a path, given the final plans of others, without the future cost of its last
    /// state, in turns.
    fn cost_among(
        &self,
        id: usize,
        wanted: &[Feature],
        final_plans: &FinalPlans,
        path: &Path,
    ) -> u32 {
        let model = self.model;
        let n_watched = model.crowd.n_watched(id);
        let [mut cost, _] = self.jump_costs(path);
        for (t, &state) in self
            .states_in_film(path)
            .iter()
            .enumerate()
            .skip(self.n_before())
        {
            let places = &self.places[t];
            let of_one = |other: usize| {
                let [first, end] = model.alike[final_plans.at(t)[other] as usize];
                let is_alike = (first..end).contains(&state);
                is_alike.then(|| model.crowd.cost_at(places.of(id), places.of(other)))
            };
            let crowd: u32 = (0..n_watched).filter_map(of_one).sum();
            let alone = (model.weights).total(wanted[t], model.features[state as usize]);
            cost += (alone + crowd).min(CEILING - 1);
        }
        cost
    }

    /// Returns the states of a path within the film. A loop's path has one more state.
    fn states_in_film<'b>(&self, path: &'b Path) -> &'b [u32] {
        &path.states[..self.places.len()]
    }

    /// Returns the cost of a path's jumps, in turns, and the part of it for showing frames again. In a loop
    /// the jump after the last frame is included.
    fn jump_costs(&self, path: &Path) -> [u32; 2] {
        let steps = path.states.windows(2);
        let jumps = steps.filter(|step| step[1] != step[0] + 1);
        let costs = jumps.map(|step| {
            let cost = self.model.trellis.jump_cost(step[0], step[1]);
            [cost, self.model.repetition_cost(step[0], step[1])]
        });
        costs.fold([0; 2], |sum, cost| [sum[0] + cost[0], sum[1] + cost[1]])
    }
}

#[cfg(test)]
mod tests;
