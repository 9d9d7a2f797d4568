//! What a plan costs, summed from what the files hold: J of ALGORITHMS.md 6, its parts, and whether the
//! file says the same. Costs are whole 65536ths of a circle; the file has them in radians, to 6 decimals.

use super::graph::Graph;
use super::steps::Taken;
use super::violation::Violation;
use crate::flock::Flock;
use crate::flock::follow::segments;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::flock::params::{Params, Position};
use crate::flock::plan::cost::{CEILING, Feature, Weights};
use crate::flock::plan::crowd::{Crowd, Lookalike};
use crate::flock::plan::segment::future_costs;
use crate::flock::plan::trellis::Trellis;
use crate::geometry::Turns;
use crate::library::Library;

/// How far from a whole number of turns 6 decimals of a radian may be.
const ROUNDING_TURNS: f64 = 0.02;

/// Nearer in the footage than this looks the same (ALGORITHMS.md 6, crowd).
const LOOKALIKE_S: f64 = 0.3;

/// A jump back by less costs for what it shows again.
const RETURN_S: f64 = 1.3;

/// What everything costs.
pub(super) struct Ledger<'a> {
    flock: &'a Flock,
    weights: Weights,
    crowd: Crowd,
    /// Names states as the price lists do, barriers included.
    trellis: Trellis,
    features: Vec<Feature>,
    /// Of each state of the graph, its name in the trellis.
    names: Vec<u32>,
    /// Of each individual, the names of what it shows.
    plans: Vec<Vec<u32>>,
    pub(super) dwell: usize,
    /// The first frame of each segment, and at the end the number of frames.
    pub(super) segments: Vec<usize>,
    /// Future cost of each state of the graph, turns; `None` for a state from which playback cannot continue.
    pub(super) future: Vec<Option<u64>>,
}

/// One individual's costs.
pub(super) struct Bill {
    /// What its boid wants at every frame.
    wanted: Vec<Feature>,
    /// Whom it should not look like.
    lookalikes: Vec<Vec<Lookalike>>,
    /// Cost of the jump to each frame, turns; 0 without a jump. The last entry is the jump from the end of a loop to its start.
    jumps: Vec<u64>,
    /// Cost of the plan, turns.
    pub(super) total: u64,
}

impl Bill {
    /// Cost of the jump to a frame, turns; 0 without a jump.
    pub(super) fn jump_at(&self, t: usize) -> u64 {
        self.jumps.get(t).copied().unwrap_or(0)
    }
}

impl<'a> Ledger<'a> {
    /// The prices of a flock that shows `plans`, states of the graph by individual.
    pub(super) fn new(
        library: &Library,
        flock: &'a Flock,
        graph: &Graph,
        plans: &[Vec<usize>],
    ) -> Ledger<'a> {
        let params = &flock.params;
        let weights = Weights::new(&params.matching, library);
        let dwell = dwell(library, params);
        let trellis = Trellis::new(
            &library.playback.without_dead_ends(params.mirror, dwell),
            params.mirror,
            |jump| weights.of_jump(jump),
        );
        let future = future_costs(&trellis, dwell);
        let length_px = library.stats.length_px.unwrap_or(1.0).max(1.0);
        let shown = graph.shown().iter();
        let names: Vec<u32> = shown
            .filter_map(|&(frame, side)| trellis.state(frame, side))
            .collect();
        let named = |plan: &Vec<usize>| plan.iter().map(|&state| names[state]).collect();
        Ledger {
            flock,
            crowd: Crowd::new(params.matching.w_c, library.poses.fps, length_px),
            features: weights.features(&trellis, &motion_of(library, &Lens::of(library, params))),
            plans: plans.iter().map(named).collect(),
            future: (names.iter())
                .map(|&name| future[name as usize].map(u64::from))
                .collect(),
            names,
            dwell,
            segments: match params.position {
                Position::Film => segments(
                    params.frames as usize,
                    params.matching.segment_frames,
                    flock.fps,
                ),
                _ => vec![0, params.frames as usize],
            },
            trellis,
            weights,
        }
    }

    /// Sums an individual's costs and compares them with what the file says.
    pub(super) fn bill(&self, id: usize, jumps: &[Taken]) -> Result<Bill, Violation> {
        let mut bill = Bill {
            wanted: self.wanted(id),
            lookalikes: self.lookalikes(id),
            jumps: vec![0; self.plans[id].len() + 1],
            total: 0,
        };
        let (mut heading, mut speed, mut crowd, mut total) = (0, 0, 0, 0);
        for jump in jumps {
            bill.jumps[jump.t] = jump.cost;
            total += jump.cost;
        }
        for (t, &name) in self.plans[id].iter().enumerate() {
            let [of_heading, of_speed] =
                (self.weights).of_state(bill.wanted[t], self.features[name as usize]);
            let of_crowd = self.crowd.cost_of(&self.trellis, &bill.lookalikes[t], name);
            heading += u64::from(of_heading);
            speed += u64::from(of_speed);
            let price = self.price(bill.wanted[t], name, of_crowd);
            crowd += price - self.price(bill.wanted[t], name, 0);
            total += price;
        }
        bill.total = total;
        let jumps_cost: u64 = jumps.iter().map(|jump| jump.cost).sum();
        let repetition: u64 = jumps.iter().map(|jump| self.repetition(jump)).sum();
        let said = &self.flock.individuals[id].cost;
        for (part, said, found) in [
            ("cost.heading", said.heading, heading),
            ("cost.speed", said.speed, speed),
            ("cost.transition", said.transition, jumps_cost - repetition),
            ("cost.crowd", said.crowd, crowd),
            ("cost.repetition", said.repetition, repetition),
            ("cost.total", said.total, total),
        ] {
            let said = whole(id, part, said)?;
            if said != found {
                return Err(Violation::Cost {
                    id,
                    part,
                    said,
                    found,
                });
            }
        }
        Ok(bill)
    }

    /// The features that a boid asks for at every frame. Turn rates are differences within one segment, as in the planner.
    fn wanted(&self, id: usize) -> Vec<Feature> {
        let boid = &self.flock.individuals[id].boid;
        let of = |segment: &[usize]| {
            let boid = boid.part(segment[0]..segment[1]);
            self.weights.wanted(&boid, self.flock.fps)
        };
        self.segments.windows(2).flat_map(of).collect()
    }

    /// A jump back by less than 1.3 s costs `w_p` for every frame that it goes back, at most 65535 turns.
    fn repetition(&self, jump: &Taken) -> u64 {
        let [from, to] = jump.ends;
        let n_again = (f64::from(from.0) + 1.0 - f64::from(to.0)).max(0.0);
        let is_return = from.1 == to.1 && n_again <= (RETURN_S * self.flock.fps).round();
        let turns = self.flock.params.matching.w_p * Turns::PER_RAD * n_again;
        if is_return {
            turns.round().min(65535.0) as u64
        } else {
            0
        }
    }

    /// What the file says no plan costs less than, crowd or not.
    pub(super) fn lower_bound(&self, id: usize) -> Result<u64, Violation> {
        whole(
            id,
            "cost.lower_bound",
            self.flock.individuals[id].cost.lower_bound,
        )
    }

    /// Cost of showing each state of the graph at frame `t`, turns. `in_flock` adds the costs of look-alikes.
    pub(super) fn row(&self, graph: &Graph, bill: &Bill, t: usize, in_flock: bool) -> Vec<u64> {
        let mut crowd = vec![0; self.names.len()];
        if in_flock {
            for near in &bill.lookalikes[t] {
                self.add_lookalike(graph, near, &mut crowd);
            }
        }
        let price = |(&name, crowd)| self.price(bill.wanted[t], name, crowd);
        self.names.iter().zip(crowd).map(price).collect()
    }

    /// Every state on the same side less than 0.3 s away looks like it.
    fn add_lookalike(&self, graph: &Graph, near: &Lookalike, crowd: &mut [u32]) {
        let Some((frame, side)) = self.trellis.shown(near.state as usize) else {
            return;
        };
        let alike = |gap: &u32| f64::from(*gap) < LOOKALIKE_S * self.flock.fps;
        for gap in (0..).take_while(alike) {
            let before = frame.checked_sub(gap).filter(|_| gap > 0);
            for frame in before.into_iter().chain([frame + gap]) {
                if let Some(state) = graph.state(frame, side) {
                    crowd[state] += near.cost;
                }
            }
        }
    }

    fn price(&self, wanted: Feature, name: u32, crowd: u32) -> u64 {
        let alone = self.weights.total(wanted, self.features[name as usize]);
        u64::from((alone + crowd).min(CEILING - 1))
    }

    fn lookalikes(&self, id: usize) -> Vec<Vec<Lookalike>> {
        let individuals = &self.flock.individuals;
        let others = || {
            let plans = self.plans[..self.crowd.n_watched(id)]
                .iter()
                .map(Vec::as_slice);
            individuals.iter().map(|other| &other.boid).zip(plans)
        };
        (0..self.plans[id].len())
            .map(|t| self.crowd.lookalikes(&individuals[id].boid, others(), t))
            .collect()
    }
}

/// Least frames between two jumps.
pub(super) fn dwell(library: &Library, params: &Params) -> usize {
    let usual = library.clip_frames;
    let frames = params.dwell_frames.map_or(usual, |frames| frames as usize);
    frames.max(1)
}

/// Radians of the file as turns.
fn whole(id: usize, part: &'static str, value: f64) -> Result<u64, Violation> {
    let turns = value * Turns::PER_RAD;
    let is_whole = turns >= -ROUNDING_TURNS && (turns - turns.round()).abs() <= ROUNDING_TURNS;
    match is_whole {
        true => Ok(turns.round().abs() as u64),
        false => Err(Violation::NotWhole { id, part, value }),
    }
}
