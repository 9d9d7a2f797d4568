//! Builds the playback graph: the successors of each frame, restricted so that playback never ends
//! (docs/explanation/algorithms.md, "Transitions and playback"). Okabe et al., section 3.3, claim that
//! patches can always be joined. That claim is false.
//!
//! The states are pairs of frame and mirror side. A frame is followed by the next frame if both can be shown,
//! and by the targets of its jumps. Similar clips match frame by frame, so a jump lies in the middle of the
//! clips. A pair (i, j) with h = f div 2 gives the jumps from i + h - 1 to j + h and from j + h - 1 to i + h.
//!
//! The graph is symmetric under mirroring. The largest strongly connected component therefore contains both
//! sides of all its frames, or it has a mirrored twin with the same frames. In both cases its frames describe
//! it fully: any edge between two of them stays inside the component or its twin.

use std::collections::BTreeSet;

use crate::library::{Jump, Patch, Playback, Transition};

/// Returns the jumps that the transitions allow, and the largest component in which playback never ends.
///
/// `shown` is true for each frame that can be shown. Ties between components go to the one with the smallest
/// frame. A frame without a path back to itself is not a component.
pub fn playback(transitions: &[Transition], shown: &[bool], clip_frames: usize) -> Playback {
    let mut jumps: Vec<Jump> = transitions
        .iter()
        .flat_map(|transition| jumps_of(transition, clip_frames))
        .filter(|jump| is_shown(shown, jump.from) && is_shown(shown, jump.to))
        .collect();
    jumps.sort_unstable_by_key(|jump| (jump.from, jump.to, jump.mirrored, jump.cost));
    jumps.dedup_by_key(|jump| (jump.from, jump.to, jump.mirrored));
    let component = largest_component(&Graph::new(&jumps, shown), shown.len());
    let inside = |frame: u32| component.binary_search(&frame).is_ok();
    jumps.retain(|jump| inside(jump.from) && inside(jump.to));
    jumps.sort_unstable();
    Playback { jumps, component }
}

/// Returns the patches: maximal runs of component frames without a jump inside, each with its successors.
///
/// A run ends after a frame from which a jump leaves and before a frame at which a jump arrives. It also ends
/// at a gap in the component. Playback leaves a patch only at its end and enters it only at its start, so
/// `next` lists all successors.
pub fn patches(playback: &Playback) -> Vec<Patch> {
    let jump_sources: BTreeSet<u32> = playback.jumps.iter().map(|jump| jump.from).collect();
    let jump_targets: BTreeSet<u32> = playback.jumps.iter().map(|jump| jump.to).collect();
    let mut patches: Vec<Patch> = Vec::new();
    for &frame in &playback.component {
        match patches.last_mut() {
            Some(patch)
                if patch.frames.end == frame
                    && !jump_targets.contains(&frame)
                    && !jump_sources.contains(&(frame - 1)) =>
            {
                patch.frames.end = frame + 1;
            }
            _ => patches.push(Patch {
                frames: frame..frame + 1,
                next: Vec::new(),
            }),
        }
    }
    let starts: Vec<u32> = patches.iter().map(|patch| patch.frames.start).collect();
    for patch in &mut patches {
        let last = patch.frames.end - 1;
        let first_jump = playback.jumps.partition_point(|jump| jump.from < last);
        let jumps = playback.jumps[first_jump..].iter();
        let targets = jumps
            .take_while(|jump| jump.from == last)
            .map(|jump| jump.to);
        let next: BTreeSet<u32> = std::iter::once(last + 1)
            .chain(targets)
            .filter_map(|frame| starts.binary_search(&frame).ok())
            .map(|patch_idx| patch_idx as u32)
            .collect();
        patch.next = next.into_iter().collect();
    }
    patches
}

fn jumps_of(transition: &Transition, clip_frames: usize) -> impl Iterator<Item = Jump> {
    let middle = (clip_frames / 2) as u32;
    let (i, j) = (transition.from + middle, transition.to + middle);
    let (cost, mirrored) = (transition.distance, transition.mirrored);
    [(i, j), (j, i)].into_iter().filter_map(move |(leave, to)| {
        Some(Jump {
            from: leave.checked_sub(1)?,
            to,
            cost,
            mirrored,
        })
    })
}

fn is_shown(shown: &[bool], frame: u32) -> bool {
    shown.get(frame as usize).copied().unwrap_or(false)
}

/// Successors of the states. State 2 * frame + side is a frame on one mirror side.
struct Graph {
    first: Vec<u32>,
    targets: Vec<u32>,
}

impl Graph {
    fn new(jumps: &[Jump], shown: &[bool]) -> Graph {
        let mut graph = Graph {
            first: vec![0],
            targets: Vec::new(),
        };
        let mut jumps = jumps.iter().peekable();
        for frame in 0..shown.len() as u32 {
            let mut of_frame = Vec::new();
            if is_shown(shown, frame) && is_shown(shown, frame + 1) {
                of_frame.push((frame + 1, 0));
            }
            while let Some(jump) = jumps.next_if(|jump| jump.from == frame) {
                of_frame.push((jump.to, u32::from(jump.mirrored)));
            }
            for side in 0..2 {
                let states = of_frame.iter().map(|&(to, flip)| 2 * to + (side ^ flip));
                graph.targets.extend(states);
                graph.first.push(graph.targets.len() as u32);
            }
        }
        graph
    }

    fn successors(&self, state: u32) -> &[u32] {
        let state = state as usize;
        &self.targets[self.first[state] as usize..self.first[state + 1] as usize]
    }
}

/// Returns the frames of the strongly connected component with the most frames, ascending.
fn largest_component(graph: &Graph, n_frames: usize) -> Vec<u32> {
    let mut best: Vec<u32> = Vec::new();
    for component in strong_components(graph, 2 * n_frames as u32) {
        let state = component[0];
        if component.len() == 1 && !graph.successors(state).contains(&state) {
            continue;
        }
        let mut frames: Vec<u32> = component.iter().map(|state| state / 2).collect();
        frames.sort_unstable();
        frames.dedup();
        let smaller_start = frames.len() == best.len() && frames[0] < best[0];
        if frames.len() > best.len() || smaller_start {
            best = frames;
        }
    }
    best
}

/// Returns every strongly connected component (Tarjan 1972), with an explicit stack instead of recursion. A
/// graph crate would need a copy of the graph in its own form.
fn strong_components(graph: &Graph, n_states: u32) -> Vec<Vec<u32>> {
    const UNVISITED: u32 = u32::MAX;
    let mut order = vec![UNVISITED; n_states as usize];
    let mut lowest = vec![0u32; n_states as usize];
    let mut is_on_stack = vec![false; n_states as usize];
    let (mut stack, mut path) = (Vec::new(), Vec::new());
    let (mut n_visited, mut components) = (0, Vec::new());
    for root in 0..n_states {
        if order[root as usize] != UNVISITED {
            continue;
        }
        path.push((root, 0));
        while let Some((state, edge)) = path.last_mut() {
            let s = *state as usize;
            if *edge == 0 {
                (order[s], lowest[s]) = (n_visited, n_visited);
                n_visited += 1;
                stack.push(*state);
                is_on_stack[s] = true;
            }
            let successor = graph.successors(*state).get(*edge).copied();
            *edge += 1;
            match successor {
                Some(next) if order[next as usize] == UNVISITED => path.push((next, 0)),
                Some(next) if is_on_stack[next as usize] => {
                    lowest[s] = lowest[s].min(order[next as usize]);
                }
                Some(_) => {}
                None => {
                    path.pop();
                    if let Some(&(parent, _)) = path.last() {
                        let parent = parent as usize;
                        lowest[parent] = lowest[parent].min(lowest[s]);
                    }
                    if lowest[s] == order[s] {
                        components.push(pop_component(&mut stack, &mut is_on_stack, s as u32));
                    }
                }
            }
        }
    }
    components
}

/// Pops the states from the top of the stack down to `root`.
fn pop_component(stack: &mut Vec<u32>, is_on_stack: &mut [bool], root: u32) -> Vec<u32> {
    let at = stack.iter().rposition(|&state| state == root);
    let component = stack.split_off(at.expect("a root lies on the stack"));
    for &state in &component {
        is_on_stack[state as usize] = false;
    }
    component
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn transition(from: u32, to: u32, mirrored: bool, distance: u64) -> Transition {
        Transition {
            from,
            to,
            mirrored,
            distance,
            heading_gap_rad: 0.0,
        }
    }

    fn jump(from: u32, to: u32, cost: u64) -> Jump {
        Jump {
            from,
            to,
            cost,
            mirrored: false,
        }
    }

    #[test]
    fn jumps_lie_in_the_middle_of_the_clips() {
        let playback = playback(&[transition(2, 10, false, 7)], &[true; 20], 4);
        // h = 2: frame 3 jumps to 12, and frame 11 to 4. Only the jump back closes a loop.
        assert_eq!(playback.component, (4..=11).collect::<Vec<u32>>());
        assert_eq!(playback.jumps, [jump(11, 4, 7)]);
    }

    #[test]
    fn clips_of_one_frame_follow_the_rule_of_schoedl() {
        let found = playback(
            &[transition(1, 5, false, 3), transition(0, 6, false, 3)],
            &[true; 9],
            1,
        );
        // The pair (0, 6) gives 5 -> 0 only: no frame comes before 0.
        assert_eq!(found.jumps, [jump(0, 5, 3), jump(4, 1, 3), jump(5, 0, 3)]);
    }

    #[test]
    fn frames_after_the_last_transition_and_before_the_first_are_left_out() {
        let pairs = [transition(5, 10, false, 1), transition(20, 25, false, 1)];
        let found = playback(&pairs, &[true; 30], 1);
        // The claim of Okabe et al. fails: no path leads back from 20 to a frame below. The earlier of two
        // equally long loops is kept.
        assert_eq!(found.component, [5, 6, 7, 8, 9]);
    }

    #[test]
    fn playback_never_crosses_a_frame_that_cannot_be_shown() {
        let mut shown = [true; 20];
        shown[7] = false;
        let found = playback(&[transition(4, 12, false, 1)], &shown, 2);
        assert_eq!(found, Playback::default());
    }

    #[test]
    fn the_cheapest_of_equal_jumps_is_kept() {
        let found = playback(
            &[transition(3, 3, true, 9), transition(3, 3, true, 5)],
            &[true; 9],
            4,
        );
        assert!(found.jumps.is_empty(), "4 -> 5 mirrored is no loop");
        let pairs = [transition(2, 6, false, 9), transition(2, 6, false, 5)];
        assert_eq!(playback(&pairs, &[true; 9], 2).jumps, [jump(6, 3, 5)]);
    }

    #[test]
    fn patches_end_at_jump_sources_and_begin_at_jump_targets() {
        let pairs = [transition(0, 6, false, 1), transition(3, 9, false, 1)];
        let found = playback(&pairs, &[true; 12], 2);
        let patches: Vec<_> = patches(&found)
            .into_iter()
            .map(|patch| (patch.frames, patch.next))
            .collect();
        // Jumps: 0 -> 7, 6 -> 1, 3 -> 10, 9 -> 4. Frames 0 and 10 are not on a cycle, frames 1..=9 are.
        assert_eq!(found.component, (1..=9).collect::<Vec<u32>>());
        assert_eq!(found.jumps, [jump(6, 1, 1), jump(9, 4, 1)]);
        assert_eq!(
            patches,
            [(1..4, vec![1]), (4..7, vec![0, 2]), (7..10, vec![1])]
        );
    }

    /// Generates up to 13 frames, some missing, and up to 5 pairs of clips of up to 4 frames.
    fn footage() -> impl Strategy<Value = (Vec<bool>, Vec<Transition>, usize)> {
        (2usize..14, 1usize..5).prop_flat_map(|(n, f)| {
            let pair = (0..n as u32, 0..n as u32, any::<bool>(), 1u64..9)
                .prop_map(|(a, b, mirrored, d)| transition(a.min(b), a.max(b), mirrored, d));
            let shown = proptest::collection::vec(proptest::bool::weighted(0.9), n);
            (shown, proptest::collection::vec(pair, 0..6), Just(f))
        })
    }

    /// Returns the successors of (frame, side), from the definition.
    fn after(state: (u32, bool), jumps: &[Jump], shown: &[bool]) -> Vec<(u32, bool)> {
        let (frame, side) = state;
        let continues = is_shown(shown, frame) && is_shown(shown, frame + 1);
        let mut states: Vec<_> = continues.then_some((frame + 1, side)).into_iter().collect();
        let leaving = jumps.iter().filter(|jump| jump.from == frame);
        states.extend(leaving.map(|jump| (jump.to, side ^ jump.mirrored)));
        states
    }

    /// Returns the frames of the largest set of mutually reachable states, by brute-force search.
    fn component_by_force(transitions: &[Transition], shown: &[bool], f: usize) -> Vec<u32> {
        let jumps: Vec<Jump> = transitions.iter().flat_map(|t| jumps_of(t, f)).collect();
        let jumps: Vec<Jump> = jumps
            .into_iter()
            .filter(|jump| is_shown(shown, jump.from) && is_shown(shown, jump.to))
            .collect();
        let reach = |start| {
            let mut reached = BTreeSet::new();
            let mut open = vec![start];
            while let Some(state) = open.pop() {
                let next = after(state, &jumps, shown).into_iter();
                open.extend(next.filter(|&state| reached.insert(state)));
            }
            reached
        };
        let n = shown.len() as u32;
        let states: Vec<_> = (0..n).flat_map(|k| [(k, false), (k, true)]).collect();
        let reached: Vec<BTreeSet<_>> = states.iter().map(|&state| reach(state)).collect();
        let mut best = BTreeSet::new();
        for (a, from_a) in states.iter().zip(&reached) {
            let back = states.iter().zip(&reached);
            let mutual = back.filter(|(b, from_b)| from_a.contains(b) && from_b.contains(a));
            let frames: BTreeSet<u32> = mutual.map(|(b, _)| b.0).collect();
            if frames.len() > best.len() {
                best = frames;
            }
        }
        best.into_iter().collect()
    }

    proptest! {
        #[test]
        fn the_component_equals_that_of_a_brute_force_search((shown, pairs, f) in footage()) {
            let found = playback(&pairs, &shown, f);
            prop_assert_eq!(found.component, component_by_force(&pairs, &shown, f));
        }

        #[test]
        fn playback_in_the_component_never_ends((shown, pairs, f) in footage()) {
            let found = playback(&pairs, &shown, f);
            for &frame in &found.component {
                let next = after((frame, false), &found.jumps, &shown);
                let inside = |frame: &u32| found.component.contains(frame);
                prop_assert!(next.iter().any(|(frame, _)| inside(frame)), "stuck at {frame}");
                prop_assert!(found.jumps.iter().all(|jump| inside(&jump.to)));
            }
        }

        #[test]
        fn patches_tile_the_component_and_each_can_be_followed((shown, pairs, f) in footage()) {
            let found = playback(&pairs, &shown, f);
            let patches = patches(&found);
            let frames: Vec<u32> = patches.iter().flat_map(|patch| patch.frames.clone()).collect();
            prop_assert_eq!(&frames, &found.component);
            for jump in &found.jumps {
                let leaves = |patch: &&Patch| patch.frames.end == jump.from + 1;
                let patch = patches.iter().find(leaves).expect("a jump leaves at an end");
                let enters = |&k: &u32| patches[k as usize].frames.start == jump.to;
                prop_assert!(patch.next.iter().any(enters));
            }
            prop_assert!(patches.iter().all(|patch| !patch.next.is_empty()));
        }
    }
}
