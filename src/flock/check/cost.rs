//! Cost of a plan, summed from the contents of the files and compared with the cost in the file: J and its
//! parts (docs/explanation/algorithms.md, "Planning").
//!
//! Costs are whole turns (65536 to the circle). The file has them in radians, with 6 decimals.

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

/// Tolerance when a cost in radians with 6 decimals is converted to turns. Rounding to 6 decimals changes a
/// cost by at most 0.0053 turns.
const ROUNDING_TURNS: f64 = 0.02;

/// Source frames less than this time apart look alike, in seconds
/// (docs/explanation/algorithms.md, "Planning").
const LOOKALIKE_S: f64 = 0.3;

/// Longest jump back that costs extra for the frames it shows again, in seconds.
const RETURN_S: f64 = 1.3;

/// Costs of all states and jumps, for all plans of a flock.
pub(super) struct Ledger<'a> {
    flock: &'a Flock,
    weights: Weights,
    crowd: Crowd,
    /// Trellis of the planner. The cost functions use its state numbers, barriers included.
    trellis: Trellis,
    features: Vec<Feature>,
    /// By state of the graph: its number in the trellis.
    names: Vec<u32>,
    /// By individual and frame: the trellis state shown.
    plans: Vec<Vec<u32>>,
    pub(super) dwell: usize,
    /// First frame of each segment, and at the end the number of frames.
    pub(super) segments: Vec<usize>,
    /// Future cost by state of the graph, in turns; `None` for a state from which playback cannot continue.
    pub(super) future: Vec<Option<u64>>,
}

/// Costs of one individual's plan.
pub(super) struct Bill {
    /// Features that its boid asks for, by frame.
    wanted: Vec<Feature>,
    /// Neighbors that it should not look like, by frame.
    lookalikes: Vec<Vec<Lookalike>>,
    /// Cost of the jump to each frame, in turns; 0 without a jump. The last entry is the jump from the end
    /// of a loop to its start.
    jumps: Vec<u64>,
    /// Cost of the plan, in turns.
    pub(super) total: u64,
}

impl Bill {
    /// Returns the cost of the jump to a frame, in turns; 0 without a jump.
    pub(super) fn jump_at(&self, t: usize) -> u64 {
        self.jumps.get(t).copied().unwrap_or(0)
    }
}

impl<'a> Ledger<'a> {
    /// Returns the costs of a flock. `plans` holds the states of the graph that each individual shows.
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

    /// Sums the costs of an individual and compares them with the file.
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

    /// Returns the features that a boid asks for at every frame. Turn rates are differences within one
    /// segment, as in the planner.
    fn wanted(&self, id: usize) -> Vec<Feature> {
        let boid = &self.flock.individuals[id].boid;
        let of = |segment: &[usize]| {
            let boid = boid.part(segment[0]..segment[1]);
            self.weights.wanted(&boid, self.flock.fps)
        };
        self.segments.windows(2).flat_map(of).collect()
    }

    /// Returns the cost of a jump for the frames that it shows again, in turns, at most 65535. A jump back
    /// of at most 1.3 s costs `w_p` per frame.
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

    /// Returns the lower bound in the file, in turns.
    pub(super) fn lower_bound(&self, id: usize) -> Result<u64, Violation> {
        whole(
            id,
            "cost.lower_bound",
            self.flock.individuals[id].cost.lower_bound,
        )
    }

    /// Returns the cost of showing each state of the graph at frame `t`, in turns. `in_flock` adds the
    /// crowd cost.
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

    /// Adds the cost of a look-alike to every state on its mirror side less than 0.3 s away.
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

/// Returns the least number of frames between two jumps.
pub(super) fn dwell(library: &Library, params: &Params) -> usize {
    let usual = library.clip_frames;
    let frames = params.dwell_frames.map_or(usual, |frames| frames as usize);
    frames.max(1)
}

/// Converts a cost of the file from radians to turns. Fails if it is negative or not a whole number of
/// turns.
fn whole(id: usize, part: &'static str, value: f64) -> Result<u64, Violation> {
    let turns = value * Turns::PER_RAD;
    let is_whole = turns >= -ROUNDING_TURNS && (turns - turns.round()).abs() <= ROUNDING_TURNS;
    match is_whole {
        true => Ok(turns.round().abs() as u64),
        false => Err(Violation::NotWhole { id, part, value }),
    }
}
