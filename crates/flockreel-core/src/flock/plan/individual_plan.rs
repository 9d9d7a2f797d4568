//! Plan of an individual and its cost, for a segment or a whole film.

use std::ops::AddAssign;

use super::Model;
use super::cost::Feature;
use crate::flock::individual::PlanCost;
use crate::geometry::{Turns, rounded};

/// Frames shown by one individual, and their cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// State shown at each frame.
    pub states: Vec<u32>,
    /// Cost of the plan.
    pub cost: CostParts,
}

impl Plan {
    /// Appends a later plan and adds its cost.
    pub fn append(&mut self, later: Plan) {
        self.states.extend(later.states);
        self.cost += later.cost;
    }
}

/// Cost of a plan in parts, in turns.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct CostParts {
    pub(super) heading: u64,
    pub(super) speed: u64,
    pub(super) transition: u64,
    pub(super) crowd: u64,
    pub(super) repetition: u64,
    pub(super) total: u64,
    pub(super) lower_bound: u64,
    /// Whether the plan weighs places, so that it is not the cheapest by the parts above.
    pub(super) weighs_places: bool,
}

impl AddAssign for CostParts {
    fn add_assign(&mut self, other: CostParts) {
        self.heading += other.heading;
        self.speed += other.speed;
        self.transition += other.transition;
        self.crowd += other.crowd;
        self.repetition += other.repetition;
        self.total += other.total;
        self.lower_bound += other.lower_bound;
        self.weighs_places |= other.weighs_places;
    }
}

impl CostParts {
    /// Returns the cost as files store it: in radians, rounded to 6 decimals.
    pub fn in_radians(&self) -> PlanCost {
        let rad = |turns: u64| rounded(turns as f64 / Turns::PER_RAD, 6);
        PlanCost {
            total: rad(self.total),
            heading: rad(self.heading),
            speed: rad(self.speed),
            transition: rad(self.transition),
            crowd: rad(self.crowd),
            repetition: rad(self.repetition),
            lower_bound: rad(self.lower_bound),
            exact: !self.weighs_places,
        }
    }
}

impl Model {
    /// Returns the cost of showing states after the one before, without crowd cost. The states were chosen by
    /// their places too.
    pub fn cost_of_walk(
        &self,
        wanted: &[Feature],
        before: Option<u32>,
        states: &[u32],
    ) -> CostParts {
        let mut cost = CostParts {
            weighs_places: true,
            ..CostParts::default()
        };
        for (&wanted, &state) in wanted.iter().zip(states) {
            let [heading, speed] = self.match_costs(wanted, state);
            cost.heading += u64::from(heading);
            cost.speed += u64::from(speed);
        }
        let befores = before.into_iter().chain(states.iter().copied());
        let afters = &states[usize::from(before.is_none()).min(states.len())..];
        for (from, &to) in befores.zip(afters).filter(|(from, to)| **to != from + 1) {
            let repetition = self.repetition_cost(from, to);
            cost.repetition += u64::from(repetition);
            cost.transition += u64::from(self.trellis.jump_cost(from, to) - repetition);
        }
        cost.total = cost.heading + cost.speed + cost.transition + cost.repetition;
        cost
    }
}
