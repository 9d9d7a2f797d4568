//! Trellis: the states of playback, arranged for planning (docs/explanation/algorithms.md, "Planning").
//!
//! A state is a frame of the component on an allowed mirror side. States lie in runs of consecutive frames,
//! and jumps are sorted by their target. A barrier state precedes each run. No step leaves a barrier, so
//! playing on always leads from the state before.

use crate::library::{Jump, Playback};

/// Frame number of a barrier.
const NO_FRAME: u32 = u32::MAX;

/// States and the jumps between them.
#[derive(Clone, Debug)]
pub struct Trellis {
    frames: Vec<u32>,
    mirrored: Vec<bool>,
    /// (frame, state) of each state that is not mirrored, rising.
    unmirrored: Vec<(u32, u32)>,
    /// Number of states that are not mirrored, barriers included. The mirrored states follow in equal order.
    n_unmirrored: usize,
    /// Run to which each state belongs.
    runs: Vec<u32>,
    /// Barriers, rising.
    barriers: Vec<u32>,
    /// States at which jumps land, rising.
    targets: Vec<u32>,
    /// `sources[first_source[k]..first_source[k + 1]]` are the jumps to target k.
    first_source: Vec<u32>,
    /// (source state, cost in turns) of each jump, by target, then by source.
    sources: Vec<(u32, u32)>,
}

impl Trellis {
    /// Returns the trellis of a playback graph. With `mirror`, both sides of every frame are states.
    /// `cost_of` returns the cost of a jump, in turns.
    pub fn new(playback: &Playback, mirror: bool, cost_of: impl Fn(&Jump) -> u32) -> Trellis {
        let mut trellis = Trellis {
            frames: Vec::new(),
            mirrored: Vec::new(),
            unmirrored: Vec::new(),
            n_unmirrored: 0,
            runs: Vec::new(),
            barriers: Vec::new(),
            targets: Vec::new(),
            first_source: vec![0],
            sources: Vec::new(),
        };
        let sides: &[bool] = if mirror { &[false, true] } else { &[false] };
        for &side in sides {
            trellis.add_side(&playback.component, side);
        }
        let mut jumps: Vec<(u32, u32, u32)> = Vec::new();
        for jump in &playback.jumps {
            for &side in sides {
                let source = trellis.state(jump.from, side);
                let target = trellis.state(jump.to, side != jump.mirrored);
                if let (Some(source), Some(target)) = (source, target) {
                    jumps.push((target, source, cost_of(jump)));
                }
            }
        }
        trellis.add_jumps(jumps);
        trellis
    }

    /// Returns the number of states, barriers included.
    pub fn n_states(&self) -> usize {
        self.frames.len()
    }

    /// Returns the frame and mirror side of a state; `None` for a barrier.
    pub fn shown(&self, state: usize) -> Option<(u32, bool)> {
        let frame = self.frames[state];
        (frame != NO_FRAME).then_some((frame, self.mirrored[state]))
    }

    /// Returns the state that shows a frame on a mirror side, if there is one.
    pub fn state(&self, frame: u32, mirrored: bool) -> Option<u32> {
        let found = self
            .unmirrored
            .binary_search_by_key(&frame, |entry| entry.0);
        let state = self.unmirrored[found.ok()?].1 as usize;
        let state = if mirrored {
            state + self.n_unmirrored
        } else {
            state
        };
        (state < self.n_states()).then_some(state as u32)
    }

    /// Returns the states at which jumps land, rising.
    pub fn targets(&self) -> &[u32] {
        &self.targets
    }

    /// Returns the jumps to the `k`th target: (source state, cost in turns), sources rising.
    pub fn sources(&self, k: usize) -> &[(u32, u32)] {
        let range = self.first_source[k] as usize..self.first_source[k + 1] as usize;
        &self.sources[range]
    }

    /// Returns each target with the jumps to it: (source state, cost in turns).
    #[inline]
    pub fn jumps(&self) -> impl Iterator<Item = (u32, &[(u32, u32)])> {
        let ranges = self.first_source.windows(2);
        let jumps = ranges.map(|ends| &self.sources[ends[0] as usize..ends[1] as usize]);
        self.targets.iter().copied().zip(jumps)
    }

    /// Returns the cost of the jump from a state to another, in turns; 0 if there is none.
    pub fn jump_cost(&self, from: u32, to: u32) -> u32 {
        let k = self.targets.binary_search(&to);
        let sources = k.map_or(&[][..], |k| self.sources(k));
        let at = sources.binary_search_by_key(&from, |source| source.0);
        at.map_or(0, |at| sources[at].1)
    }

    /// Returns the barriers, rising.
    pub fn barriers(&self) -> impl Iterator<Item = usize> {
        self.barriers.iter().map(|&state| state as usize)
    }

    /// Returns whether playing on from `state` leads to `state + ahead` without a jump.
    pub fn continues(&self, state: usize, ahead: usize) -> bool {
        let end = state + ahead;
        self.frames[state] != NO_FRAME && self.runs.get(end) == Some(&self.runs[state])
    }

    fn add_side(&mut self, component: &[u32], side: bool) {
        let mut last = None;
        for &frame in component {
            if last.is_none_or(|last: u32| last + 1 != frame) {
                let run = self.runs.last().map_or(0, |run| run + 1);
                self.barriers.push(self.frames.len() as u32);
                self.frames.push(NO_FRAME);
                self.mirrored.push(side);
                self.runs.push(run);
            }
            if !side {
                self.unmirrored.push((frame, self.frames.len() as u32));
            }
            self.frames.push(frame);
            self.mirrored.push(side);
            self.runs.extend_from_within(self.runs.len() - 1..);
            last = Some(frame);
        }
        if !side {
            self.n_unmirrored = self.frames.len();
        }
    }

    fn add_jumps(&mut self, mut jumps: Vec<(u32, u32, u32)>) {
        jumps.sort_unstable();
        jumps.dedup_by_key(|jump| (jump.0, jump.1));
        for (target, source, cost) in jumps {
            if self.targets.last() != Some(&target) {
                self.targets.push(target);
                self.first_source.push(self.sources.len() as u32);
            }
            self.sources.push((source, cost));
            if let Some(end) = self.first_source.last_mut() {
                *end = self.sources.len() as u32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::Jump;

    fn playback() -> Playback {
        let jump = |from, to, mirrored| Jump {
            from,
            to,
            cost: 7,
            mirrored,
        };
        Playback {
            jumps: vec![jump(4, 11, false), jump(6, 4, true), jump(12, 4, false)],
            component: vec![4, 5, 6, 10, 11, 12],
        }
    }

    #[test]
    fn frames_and_states_map_to_each_other() {
        let trellis = Trellis::new(&playback(), true, |jump| jump.cost as u32);
        for side in [false, true] {
            for frame in 0..20 {
                let state = trellis.state(frame, side);
                assert_eq!(
                    state.is_some(),
                    playback().component.contains(&frame),
                    "{frame}"
                );
                if let Some(state) = state {
                    assert_eq!(trellis.shown(state as usize), Some((frame, side)));
                }
            }
        }
        assert_eq!(
            Trellis::new(&playback(), false, |jump| jump.cost as u32).state(4, true),
            None
        );
    }

    #[test]
    fn a_mirrored_jump_changes_sides_and_others_keep_them() {
        let trellis = Trellis::new(&playback(), true, |jump| jump.cost as u32);
        let at = |frame, side| {
            trellis
                .state(frame, side)
                .expect("a frame of the component")
        };
        let into = |state| {
            let k = trellis.targets().iter().position(|&t| t == state);
            trellis.sources(k.expect("a target"))
        };
        assert_eq!(into(at(11, true)), [(at(4, true), 7)]);
        assert_eq!(into(at(4, true)), [(at(6, false), 7), (at(12, true), 7)]);
    }

    #[test]
    fn runs_end_at_gaps_and_at_sides() {
        let trellis = Trellis::new(&playback(), true, |jump| jump.cost as u32);
        let at = |frame| trellis.state(frame, false).expect("a frame") as usize;
        assert!(trellis.continues(at(4), 2));
        assert!(!trellis.continues(at(4), 3));
        assert!(!trellis.continues(at(12), 1));
        let gap_of_one = Playback {
            component: vec![0, 2],
            ..playback()
        };
        let trellis = Trellis::new(&gap_of_one, false, |jump| jump.cost as u32);
        assert!(!trellis.continues(1, 2), "a barrier stands between");
        let trellis = Trellis::new(&playback(), true, |jump| jump.cost as u32);
        assert!(!trellis.continues(at(12), 2));
    }
}
