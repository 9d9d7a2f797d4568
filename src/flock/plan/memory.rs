//! Against playing the same few frames over and over (ALGORITHMS.md 6, repetition): showing a state again
//! within 3 s costs, for every frame that does.
//!
//! What was shown before is no part of a state, so no recursion over states is exact about it. A plan that
//! repeats is made anew with what it repeats made dearer, up to three times, and the plan is kept that
//! costs least with its repetition. What the cheapest plan costs without it is a bound.

use std::collections::HashMap;

use crate::geometry::Turns;

/// Shown again sooner than this is a repeat.
const SPAN_S: f64 = 3.0;
/// How many times a plan that repeats is made anew.
pub const N_REPLANS: usize = 3;

/// What repeating costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Turns for every frame shown again.
    pub cost: u32,
    /// Shown again within so many frames is a repeat.
    pub span_frames: usize,
}

/// A frame shown again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repeat {
    /// The output frame.
    pub t: usize,
    /// When the same was shown last.
    pub before: usize,
}

/// What is dearer when, because it was shown too often.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raised {
    /// `[t]`: states, each as many times as it is raised by `cost`.
    by_frame: Vec<Vec<u32>>,
    /// Turns.
    pub cost: u32,
}

impl Memory {
    /// `w_p` in radians for each frame shown again.
    pub fn new(w_p: f64, fps: f64) -> Memory {
        Memory {
            cost: (w_p * Turns::PER_RAD).round() as u32,
            span_frames: (SPAN_S * fps).round() as usize,
        }
    }

    /// The frames of a plan that show what it showed less than 3 s before.
    ///
    /// Of 5, 6, 7, 5, 6 the last two are repeats, each of three frames before.
    pub fn repeats<State: std::hash::Hash + Eq + Copy>(&self, states: &[State]) -> Vec<Repeat> {
        let mut last = HashMap::new();
        let mut repeats = Vec::new();
        for (t, &state) in states.iter().enumerate() {
            if let Some(before) = last.insert(state, t)
                && t - before < self.span_frames
            {
                repeats.push(Repeat { t, before });
            }
        }
        repeats
    }

    /// What a plan's repeats cost, turns.
    pub fn cost_of<State: std::hash::Hash + Eq + Copy>(&self, states: &[State]) -> u32 {
        self.cost_after(&[], states, 0)
    }

    /// Cost of the repeats in `states`, turns, when `before` was shown before them. Repeats among the first `n_before` states are
    /// not counted.
    pub fn cost_after<State: std::hash::Hash + Eq + Copy>(
        &self,
        before: &[State],
        states: &[State],
        n_before: usize,
    ) -> u32 {
        if self.cost == 0 {
            return 0;
        }
        let repeats = self.repeats(&[before, states].concat());
        let is_new = |repeat: &&Repeat| repeat.t >= before.len() + n_before;
        self.cost * repeats.iter().filter(is_new).count() as u32
    }

    /// By state, the first frame at which showing it is no repeat of `shown`. Frame 0 is the frame of the last state of `shown`.
    pub fn repeated_until(&self, shown: &[u32], n_states: usize) -> Vec<u16> {
        let mut until = vec![0; n_states];
        for (ago, &state) in shown.iter().rev().enumerate() {
            let end = self
                .span_frames
                .saturating_sub(ago)
                .min(usize::from(u16::MAX));
            until[state as usize] = until[state as usize].max(end as u16);
        }
        until
    }

    /// Nothing is dearer yet.
    pub fn nothing_raised(&self, n_frames: usize) -> Raised {
        Raised {
            by_frame: vec![Vec::new(); n_frames],
            cost: self.cost,
        }
    }

    /// Raises what a plan repeats, from when it was shown first for 3 s.
    pub fn raise(&self, raised: &mut Raised, states: &[u32]) {
        for Repeat { t, before } in self.repeats(states) {
            let end = (before + self.span_frames).min(states.len());
            for dearer in &mut raised.by_frame[before + 1..end] {
                dearer.push(states[t]);
            }
        }
    }
}

impl Raised {
    /// The states that are dearer at frame `t`.
    pub fn at(&self, t: usize) -> &[u32] {
        &self.by_frame[t]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_shown_again_within_three_seconds_is_a_repeat_of_its_last_showing() {
        let memory = Memory::new(0.1, 1.0);
        let of = |t, before| Repeat { t, before };
        assert_eq!(
            memory.repeats(&[5, 6, 5, 6, 5]),
            [of(2, 0), of(3, 1), of(4, 2)]
        );
        assert_eq!(
            memory.repeats(&[5, 6, 7, 5, 6]),
            [],
            "three seconds are over"
        );
        let cost = (0.1 * Turns::PER_RAD).round() as u32;
        assert_eq!(memory.cost_of(&[5, 6, 5, 6, 5]), 3 * cost);
        assert_eq!(Memory::new(0.0, 1.0).cost_of(&[5, 6, 5]), 0);
    }

    #[test]
    fn what_is_repeated_is_dearer_after_its_first_showing_only() {
        let memory = Memory::new(0.1, 2.0);
        let mut raised = memory.nothing_raised(9);
        memory.raise(&mut raised, &[1, 2, 3, 8, 2, 3, 4, 5, 6]);
        let dearer: Vec<&[u32]> = (0..9).map(|t| raised.at(t)).collect();
        let [none, two, both]: [&[u32]; 3] = [&[], &[2], &[2, 3]];
        assert_eq!(
            dearer,
            [none, none, two, both, both, both, both, &[3], none]
        );
    }
}
