//! Which sprite when: for each individual the sequence of real frames that follows its boid best,
//! exactly (O 5.1; ALGORITHMS.md 6).

mod added;
pub mod certificate;
pub mod circle;
pub mod cost;
pub mod crowd;
mod fill;
pub mod horizon;
pub mod landings;
#[cfg(target_arch = "x86_64")]
mod lanes;
pub mod memory;
mod round;
mod rows;
pub mod trellis;
pub mod viterbi;

use rayon::prelude::*;

use self::circle::Ends;
use self::cost::{CEILING, Feature, Weights};
use self::crowd::{Crowd, Places, Settled};
use self::horizon::Horizon;
use self::memory::Memory;
use self::round::Round;
use self::trellis::Trellis;
use self::viterbi::{Film, Path, Shelf};
use super::error::Error;
use super::individual::{BoidTrack, PlanCost, rounded};
use super::motion::FrameMotion;
use super::params::Params;
use crate::cpu::Level;
use crate::geometry::Turns;
use crate::library::Library;
use crate::progress::Progress;

/// What one individual shows, and what that costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Source frame and mirror side at every output frame.
    pub shown: Vec<(u32, bool)>,
    /// What it costs.
    pub cost: PlanCost,
}

/// The best path found for one individual.
#[derive(Clone, Debug)]
struct Found {
    /// Its cost counts no repetition; in a loop its last state is the first of whom it becomes.
    path: Path,
    /// What its repeats cost, turns.
    repetition: u32,
    /// What no path costs less than, turns.
    least: u32,
}

impl Found {
    fn cost(&self) -> u32 {
        self.path.cost + self.repetition
    }

    /// Becomes another where that costs less.
    fn keep_cheaper(&mut self, other: &Found) {
        if other.cost() < self.cost() {
            self.path = other.path.clone();
            self.repetition = other.repetition;
        }
    }
}

/// Everything that plans are computed from.
pub struct Planner<'a> {
    trellis: Trellis,
    weights: Weights,
    /// By state.
    features: Vec<Feature>,
    crowd: Crowd,
    memory: Memory,
    /// The states that look like each state.
    alike: Vec<[u32; 2]>,
    /// By frame, where each boid is.
    places: Vec<Places>,
    dwell: usize,
    fps: f64,
    shelf: Shelf,
    /// How far plans look ahead; to the end, when absent.
    horizon: Option<Horizon>,
    boids: &'a [BoidTrack],
    /// Of each individual, in a loop.
    ends: Vec<Ends>,
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
        let dwell = params
            .dwell_frames
            .map_or(library.clip_frames, |frames| frames as usize)
            .max(1);
        let horizon = params.matching.horizon_frames;
        Planner {
            features,
            alike: crowd.alike(&trellis),
            places: (0..n_frames).map(place).collect(),
            crowd,
            memory: Memory::new(params.matching.w_p, fps),
            horizon: horizon.map(|n| Horizon::new(n as usize, &trellis, dwell)),
            dwell,
            trellis,
            weights,
            fps,
            shelf: Shelf::default(),
            boids,
            ends: Vec::new(),
        }
    }

    /// The plans of all boids, by id, the last frame of each played into the first of the heir it has.
    pub fn plan_loop(mut self, heirs: &[u32], progress: &dyn Progress) -> Result<Vec<Plan>, Error> {
        if self.places.len() <= self.dwell {
            return Err(Error::LoopDoesNotClose(self.places.len()));
        }
        let wanted = self.wanted();
        let mut settled = Settled::new(self.places.len());
        let open = self.paths(&wanted, &mut settled, progress)?;
        let firsts = self.firsts(&open, &wanted, heirs, progress)?;
        let next = heirs.iter().map(|&heir| firsts[heir as usize]);
        self.ends = (firsts.iter().zip(next))
            .map(|(&first, next)| Ends { first, next })
            .collect();
        self.plan(progress)
    }

    fn wanted(&self) -> Vec<Vec<Feature>> {
        (self.boids.par_iter())
            .map(|boid| self.weights.wanted(boid, self.fps))
            .collect()
    }

    /// The plans of all boids, by id, each the cheapest among those that it looks out for; meanwhile
    /// what each would cost alone.
    pub fn plan(&self, progress: &dyn Progress) -> Result<Vec<Plan>, Error> {
        progress.report("planning", 0.0);
        let wanted = self.wanted();
        let mut settled = Settled::new(self.places.len());
        let (paths, bounds) = rayon::join(
            || self.paths(&wanted, &mut settled, progress),
            || self.round(&wanted, 0, wanted.len()).least_costs(progress),
        );
        let (paths, bounds) = (paths?, bounds?);
        Ok((paths.par_iter().enumerate())
            .map(|(id, found)| self.costed(found, &wanted[id], bounds[id]))
            .collect())
    }

    /// The paths of all boids, by id, round after round; each round is settled before the next.
    fn paths(
        &self,
        wanted: &[Vec<Feature>],
        settled: &mut Settled,
        progress: &dyn Progress,
    ) -> Result<Vec<Found>, Error> {
        let mut paths = Vec::with_capacity(wanted.len());
        while paths.len() < wanted.len() {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let first = paths.len();
            let n_watched = self.crowd.n_watched(first);
            let alike = |id: &usize| self.crowd.n_watched(*id) == n_watched;
            let end = first + (first..wanted.len()).take_while(alike).count();
            let round = self.round(wanted, first, end).paths(settled)?;
            for found in &round {
                settled.push(self.film_of(&found.path), &self.alike);
            }
            paths.extend(round);
            progress.report("planning", paths.len() as f64 / wanted.len() as f64);
        }
        Ok(paths)
    }

    fn round<'b>(&'b self, wanted: &'b [Vec<Feature>], first: usize, end: usize) -> Round<'b> {
        let wanted = &wanted[first..end];
        Round {
            planner: self,
            first,
            wanted,
        }
    }

    fn film(&self) -> Film<'_> {
        Film {
            trellis: &self.trellis,
            n_frames: self.places.len() + usize::from(!self.ends.is_empty()),
            dwell: self.dwell,
            cpu: Level::detect(),
            shelf: &self.shelf,
        }
    }

    /// The plan with its cost in parts, summed anew from the states; what is left of the path's cost is
    /// the crowd's.
    fn costed(&self, found: &Found, wanted: &[Feature], lower_bound: u32) -> Plan {
        let path = &found.path;
        let (mut heading, mut speed, mut alone) = (0, 0, 0);
        let states = self.film_of(path);
        for (&wanted, &state) in wanted.iter().zip(states) {
            let feature = self.features[state as usize];
            let [h, s] = self.weights.of_state(wanted, feature);
            heading += h;
            speed += s;
            alone += self.weights.total(wanted, feature);
        }
        let transition = self.transition_cost(path);
        let rad = |turns: u32| rounded(f64::from(turns) / Turns::PER_RAD, 6);
        Plan {
            shown: states
                .iter()
                .filter_map(|&state| self.trellis.shown(state as usize))
                .collect(),
            cost: PlanCost {
                total: rad(found.cost()),
                heading: rad(heading),
                speed: rad(speed),
                transition: rad(transition),
                crowd: rad(path.cost - alone - transition),
                repetition: rad(found.repetition),
                lower_bound: rad(lower_bound),
                gap: rad(found.cost() - found.least),
                exact: found.cost() == found.least,
            },
        }
    }

    /// A path that is the cheapest but for its repeats.
    fn found(&self, path: Path) -> Found {
        Found {
            repetition: self.memory.cost_of(self.film_of(&path)),
            least: path.cost,
            path,
        }
    }

    /// What a path costs among those settled, its repeats aside, turns.
    fn cost_among(&self, id: usize, wanted: &[Feature], settled: &Settled, path: &Path) -> u32 {
        let n_watched = self.crowd.n_watched(id);
        let mut cost = self.transition_cost(path);
        for (t, &state) in self.film_of(path).iter().enumerate() {
            let places = &self.places[t];
            let of_one = |other: usize| {
                let [first, end] = self.alike[settled.at(t)[other] as usize];
                let is_alike = (first..end).contains(&state);
                is_alike.then(|| self.crowd.cost_at(places.of(id), places.of(other)))
            };
            let crowd: u32 = (0..n_watched).filter_map(of_one).sum();
            let alone = (self.weights).total(wanted[t], self.features[state as usize]);
            cost += (alone + crowd).min(CEILING - 1);
        }
        cost
    }

    /// What a path shows in the film.
    fn film_of<'b>(&self, path: &'b Path) -> &'b [u32] {
        &path.states[..self.places.len()]
    }

    /// What a path's jumps cost, turns, with that after the last frame of a loop.
    fn transition_cost(&self, path: &Path) -> u32 {
        let steps = path.states.windows(2);
        let jumps = steps.filter(|step| step[1] != step[0] + 1);
        jumps.map(|step| self.jump_cost(step[0], step[1])).sum()
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
