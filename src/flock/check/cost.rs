//! What a plan costs, summed from what the files hold: J of ALGORITHMS.md 6, its parts, and whether the
//! file says the same. Costs are whole 65536ths of a circle; the file has them in radians, to 6 decimals.

use super::graph::Graph;
use super::steps::Taken;
use super::violation::Violation;
use crate::flock::Flock;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::flock::plan::cost::{CEILING, Feature, Weights};
use crate::flock::plan::crowd::{Crowd, Lookalike};
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
}

/// One individual's costs.
pub(super) struct Bill {
    /// What its boid wants at every frame.
    wanted: Vec<Feature>,
    /// Whom it should not look like.
    lookalikes: Vec<Vec<Lookalike>>,
    /// What the plan has cost before each frame is shown, jumps to it included, and at the end.
    pub(super) before: Vec<u64>,
    /// What its repeats cost, turns; no part of `before`.
    pub(super) repetition: u64,
}

impl Bill {
    pub(super) fn total(&self) -> u64 {
        self.before.last().copied().unwrap_or(0) + self.repetition
    }

    /// Whether anyone is to be avoided at any time.
    pub(super) fn has_crowd(&self) -> bool {
        self.lookalikes.iter().any(|near| !near.is_empty())
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
        let trellis = Trellis::new(&library.playback, params.mirror, |_| 0);
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
            names,
            dwell: params
                .dwell_frames
                .map_or(library.clip_frames, |frames| frames as usize)
                .max(1),
            trellis,
            weights,
        }
    }

    /// Sums an individual's costs and compares them with what the file says.
    pub(super) fn bill(&self, id: usize, jumps: &[Taken]) -> Result<Bill, Violation> {
        let mut bill = Bill {
            wanted: self
                .weights
                .wanted(&self.flock.individuals[id].boid, self.flock.fps),
            lookalikes: self.lookalikes(id),
            before: vec![0],
            repetition: self.repetition(id),
        };
        let (mut heading, mut speed, mut crowd, mut total) = (0, 0, 0, 0);
        let mut jumps_left = jumps.iter().peekable();
        for (t, &name) in self.plans[id].iter().enumerate() {
            if let Some(jump) = jumps_left.next_if(|jump| jump.t == t) {
                total += jump.cost;
                bill.before[t] = total;
            }
            let [of_heading, of_speed] =
                (self.weights).of_state(bill.wanted[t], self.features[name as usize]);
            let of_crowd = self.crowd.cost_of(&self.trellis, &bill.lookalikes[t], name);
            heading += u64::from(of_heading);
            speed += u64::from(of_speed);
            let price = self.price(bill.wanted[t], name, of_crowd);
            crowd += price - self.price(bill.wanted[t], name, 0);
            total += price;
            bill.before.push(total);
        }
        if let (Some(jump), Some(before)) = (jumps_left.next(), bill.before.last_mut()) {
            // What follows the last frame of a loop.
            total += jump.cost;
            *before = total;
        }
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

    /// Every frame that shows what was shown less than 3 s before costs `w_p`.
    fn repetition(&self, id: usize) -> u64 {
        let plan = &self.plans[id];
        let span = (REPEAT_S * self.flock.fps).round() as usize;
        let is_repeat = |&t: &usize| plan[t.saturating_sub(span - 1)..t].contains(&plan[t]);
        let n_repeats = (0..plan.len()).filter(is_repeat).count() as u64;
        n_repeats * (self.flock.params.matching.w_p * Turns::PER_RAD).round() as u64
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

    /// What showing each state of the graph costs at frame `t`, turns, with the crowd or without.
    pub(super) fn row(&self, graph: &Graph, bill: &Bill, t: usize, with_crowd: bool) -> Vec<u64> {
        let mut crowd = vec![0; self.names.len()];
        if with_crowd {
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

/// Radians of the file as turns.
fn whole(id: usize, part: &'static str, value: f64) -> Result<u64, Violation> {
    let turns = value * Turns::PER_RAD;
    let is_whole = turns >= -ROUNDING_TURNS && (turns - turns.round()).abs() <= ROUNDING_TURNS;
    match is_whole {
        true => Ok(turns.round().abs() as u64),
        false => Err(Violation::NotWhole { id, part, value }),
    }
}
