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

/// Shown again sooner than this is a repeat (ALGORITHMS.md 6, repetition).
const REPEAT_S: f64 = 3.0;

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
    /// Cost of the plan without its repeats, turns.
    total: u64,
    /// Cost of its repeats, turns.
    pub(super) repetition: u64,
}

impl Bill {
    pub(super) fn total(&self) -> u64 {
        self.total + self.repetition
    }

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
            |distance| weights.of_jump(distance, library.epsilon),
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
            repetition: self.repetition(id),
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
        let transition = jumps.iter().map(|jump| jump.cost).sum();
        let said = &self.flock.individuals[id].cost;
        for (part, said, found) in [
            ("cost.heading", said.heading, heading),
            ("cost.speed", said.speed, speed),
            ("cost.transition", said.transition, transition),
            ("cost.crowd", said.crowd, crowd),
            ("cost.repetition", said.repetition, bill.repetition),
            ("cost.total", said.total, total + bill.repetition),
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

    /// Every frame that shows what was shown less than 3 s before costs `w_p`.
    fn repetition(&self, id: usize) -> u64 {
        let plan = &self.plans[id];
        let span = (REPEAT_S * self.flock.fps).round() as usize;
        let is_repeat = |&t: &usize| plan[t.saturating_sub(span - 1)..t].contains(&plan[t]);
        let n_repeats = (0..plan.len()).filter(is_repeat).count() as u64;
        n_repeats * self.repeat_cost()
    }

    fn repeat_cost(&self) -> u64 {
        (self.flock.params.matching.w_p * Turns::PER_RAD).round() as u64
    }

    /// By how much the file says that a plan may be cheaper.
    pub(super) fn gap(&self, id: usize) -> Result<u64, Violation> {
        whole(id, "cost.gap", self.flock.individuals[id].cost.gap)
    }

    /// What the file says no plan costs less than, crowd or not.
    pub(super) fn lower_bound(&self, id: usize) -> Result<u64, Violation> {
        whole(
            id,
            "cost.lower_bound",
            self.flock.individuals[id].cost.lower_bound,
        )
    }

    pub(super) fn is_exact(&self, id: usize) -> bool {
        self.flock.individuals[id].cost.exact
    }

    /// Cost of showing each state of the graph at frame `t` of the segment that begins at frame `first`, turns. `in_flock` adds
    /// the costs of look-alikes and of repeating what was shown before the segment.
    pub(super) fn row(
        &self,
        graph: &Graph,
        (id, bill): (usize, &Bill),
        (first, t): (usize, usize),
        in_flock: bool,
    ) -> Vec<u64> {
        let mut crowd = vec![0; self.names.len()];
        if in_flock {
            for near in &bill.lookalikes[t] {
                self.add_lookalike(graph, near, &mut crowd);
            }
        }
        let span = (REPEAT_S * self.flock.fps).round() as usize;
        let from = (t + 1).saturating_sub(span).min(first);
        let shown = match in_flock && self.repeat_cost() > 0 {
            true => &self.plans[id][from..first],
            false => &[],
        };
        let price = |(&name, crowd)| {
            let repeat = if shown.contains(&name) {
                self.repeat_cost()
            } else {
                0
            };
            self.price(bill.wanted[t], name, crowd) + repeat
        };
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
