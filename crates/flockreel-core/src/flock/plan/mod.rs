//! Planning: which source frame each individual shows at each output frame.
//!
//! For each individual, the planner finds the sequence of real frames that follows its boid at the least
//! cost, exactly (Okabe et al., section 5.1; docs/explanation/algorithms.md, "Planning"). `cost` and
//! `crowd` define the costs, `recursion` finds the cheapest path, `loops` handles loops.

pub mod cost;
pub mod crowd;
mod individual_plan;
pub mod loops;
pub mod recursion;
pub mod segment;
mod state_costs;
pub mod trellis;

use std::sync::Mutex;

use rayon::prelude::*;

use self::cost::{Feature, Weights};
use self::crowd::{Crowd, Place};
pub use self::individual_plan::{CostParts, Plan};
use self::loops::LoopEnds;
use self::recursion::{CEILING, Path, PathSearch, StateCosts};
use self::segment::{FORBIDDEN, future_costs};
use self::state_costs::IndividualCosts;
use self::trellis::Trellis;
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

/// Planner of all individuals of a film.
pub struct Planner<'a> {
    model: &'a Model,
    /// Positions of all boids: `[frame][id]`.
    places: Vec<Vec<Place>>,
    /// Features that each boid asks for: `[id][frame]`.
    wanted: Vec<Vec<Feature>>,
    /// In a loop, the ends of each plan, by id; else empty.
    ends: Vec<LoopEnds>,
    /// Memory of searches, which is reused.
    memory: Mutex<Vec<Vec<u32>>>,
}

impl<'a> Planner<'a> {
    /// Returns a planner for a film.
    pub fn new(model: &'a Model, boids: &[BoidTrack]) -> Planner<'a> {
        let n_frames = boids.first().map_or(0, |boid| boid.heading_rad.len());
        let place = |t| {
            (boids.iter())
                .map(|boid| model.crowd.place(boid, t))
                .collect()
        };
        Planner {
            model,
            places: (0..n_frames).map(place).collect(),
            wanted: boids.par_iter().map(|boid| model.wanted(boid)).collect(),
            ends: Vec::new(),
            memory: Mutex::default(),
        }
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
        let open = self.paths(progress)?;
        let first_states = self.first_states(&open, continuations, progress)?;
        let next = continuations.iter().map(|&id| first_states[id as usize]);
        self.ends = (first_states.iter().zip(next))
            .map(|(&first, next)| LoopEnds { first, next })
            .collect();
        self.plan(progress)
    }

    /// Returns the plans of all boids, by id. Each plan is the cheapest, given the plans of the individuals
    /// that it watches. The least cost of each individual without crowd cost is computed in parallel, as
    /// the lower bound.
    pub fn plan(&self, progress: &dyn Progress) -> Result<Vec<Plan>, Error> {
        let (paths, bounds) = rayon::join(|| self.paths(progress), || self.least_costs(progress));
        let (paths, bounds) = (paths?, bounds?);
        Ok((paths.par_iter().enumerate())
            .map(|(id, path)| self.costed(id, path, bounds[id]))
            .collect())
    }

    /// Returns the paths of all boids, by id. They are computed in rounds of individuals that watch the same
    /// others: each of the first 64 is a round of its own. Fails if an individual has no path.
    fn paths(&self, progress: &dyn Progress) -> Result<Vec<Path>, Error> {
        let n_watched = |id| self.model.crowd.n_watched(id);
        let mut shown = vec![Vec::new(); self.places.len()];
        let mut paths = Vec::with_capacity(self.wanted.len());
        while paths.len() < self.wanted.len() {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let rest = paths.len()..self.wanted.len();
            let round = rest
                .clone()
                .take_while(|&id| n_watched(id) == n_watched(rest.start))
                .count();
            let ids = rest.start..rest.start + round;
            let path = |id: usize| self.path_among(id, &shown);
            let round: Vec<Path> = ids.into_par_iter().map(path).collect::<Result<_, _>>()?;
            for path in &round {
                shown
                    .iter_mut()
                    .zip(&path.states)
                    .for_each(|(shown, &state)| shown.push(state));
            }
            paths.extend(round);
        }
        Ok(paths)
    }

    /// Returns the cheapest path of one individual, given the states that those of smaller id show.
    fn path_among(&self, id: usize, shown: &[Vec<u32>]) -> Result<Path, Error> {
        let costs = IndividualCosts {
            planner: self,
            wanted: &self.wanted[id],
            among: Some((id, shown)),
        };
        let Some(ends) = self.ends.get(id) else {
            return self
                .cheapest_path(&self.search(), &costs)
                .ok_or(Error::NoTransitions);
        };
        let start = self.beginning_with(ends.first);
        let path = self.cheapest_path(&self.search_between(&start, Some(ends.next)), &costs);
        path.ok_or(Error::LoopDoesNotClose(self.places.len()))
    }

    /// Returns the cheapest path of a search.
    fn cheapest_path(&self, search: &PathSearch, costs: &impl StateCosts) -> Option<Path> {
        let pool = || {
            self.memory
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner)
        };
        let mut memory = pool().pop().unwrap_or_default();
        let path = search.cheapest_path(costs, &mut memory);
        pool().push(memory);
        path
    }

    /// Returns the cost of each individual's cheapest path without crowd cost, in turns.
    fn least_costs(&self, progress: &dyn Progress) -> Result<Vec<u32>, Error> {
        let least = |wanted: &Vec<Feature>| {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let costs = IndividualCosts {
                planner: self,
                wanted,
                among: None,
            };
            self.search().least_cost(&costs).ok_or(Error::NoTransitions)
        };
        self.wanted.par_iter().map(least).collect()
    }

    /// Returns the search for paths of the film.
    fn search(&self) -> PathSearch<'_> {
        PathSearch {
            trellis: &self.model.trellis,
            n_frames: self.places.len(),
            dwell: self.model.dwell,
            start: None,
            end: None,
            cpu: Level::detect(),
        }
    }

    /// Returns the plan of a path with its cost in parts. The parts are summed from the states; the rest of
    /// the path's cost is the crowd cost.
    fn costed(&self, id: usize, path: &Path, lower_bound: u32) -> Plan {
        let (mut heading, mut speed, mut alone) = (0, 0, 0);
        for (&wanted, &state) in self.wanted[id].iter().zip(&path.states) {
            let feature = self.model.features[state as usize];
            let [h, s] = self.model.weights.parts_of(wanted, feature);
            heading += u64::from(h);
            speed += u64::from(s);
            alone += self.model.weights.total(wanted, feature);
        }
        let [jumps, repetition] = self.jump_costs(path);
        Plan {
            states: path.states[..self.places.len()].to_vec(),
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
