//! Playback graph: transitions between similar clips, the jumps they allow, and the patches between jumps.
//! Source: Okabe et al., section 3.3; docs/explanation/algorithms.md, "Transitions and playback".

use std::ops::Range;

/// A pair of clips with similar appearance and heading. Playback may jump between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// First frame of one clip.
    pub from: u32,
    /// First frame of the other clip.
    pub to: u32,
    /// Whether the other clip was compared mirrored left-right.
    pub mirrored: bool,
    /// Distance D of the two clips.
    pub distance: u64,
    /// Difference of the clips' mean headings, radians, 0..=pi.
    pub heading_gap_rad: f64,
}

/// A step of playback other than frame -> frame + 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Jump {
    /// Last frame shown before the jump.
    pub from: u32,
    /// First frame shown after the jump.
    pub to: u32,
    /// Distance D of the two clips that the jump joins.
    pub cost: u64,
    /// Whether the jump changes the mirror side.
    pub mirrored: bool,
}

/// The playback graph over states (frame, mirror side). Its edges are frame -> frame + 1, at no cost, and the
/// jumps.
///
/// If there are mirrored jumps, both mirror sides of every frame are states; the graph looks the same from
/// either side. Playback uses only frames of the component, within which it never ends.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Playback {
    /// All jumps within the component, sorted, without duplicates of (from, to, mirrored).
    pub jumps: Vec<Jump>,
    /// Frames of the largest strongly connected component, in increasing order.
    pub component: Vec<u32>,
}

/// A run of sprites between two jump ends, and the patches that may follow it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Frames of the patch, `start..end`.
    pub frames: Range<u32>,
    /// Indices of the patches that may follow, in increasing order.
    pub next: Vec<u32>,
}

impl Playback {
    /// Returns the graph without the jumps after which playback would end. Successive jumps are at least
    /// `dwell` frames apart, and some runs are shorter than that. If `mirror` is false, the result has no
    /// mirrored jumps.
    ///
    /// A jump is kept if its run has another jump after the dwell. Removing one may end others, so every run is
    /// examined again when its last jump is gone. Each jump is removed once.
    pub fn without_dead_ends(&self, mirror: bool, dwell: usize) -> Playback {
        let mut jumps = self.jumps.clone();
        jumps.retain(|jump| mirror || !jump.mirrored);
        let at = |frame: u32| self.component.binary_search(&frame).ok();
        let run_end = self.run_ends();
        // For each jump: where it leaves, and where the next jump may leave.
        let from: Vec<Option<usize>> = jumps.iter().map(|jump| at(jump.from)).collect();
        let free = |jump: &Jump| {
            let to = at(jump.to)?;
            Some(to + dwell - 1).filter(|&free| free <= run_end[to])
        };
        let free: Vec<Option<usize>> = jumps.iter().map(free).collect();
        let mut n_leaving = vec![0; self.component.len()];
        from.iter().flatten().for_each(|&k| n_leaving[k] += 1);
        // The jumps to each run, by the end of the run. The last one is the first to be removed.
        let mut landing = vec![Vec::new(); self.component.len()];
        let mut by_free: Vec<usize> = (0..jumps.len()).collect();
        by_free.sort_by_key(|&idx| free[idx]);
        let (mut kept, mut gone) = (vec![true; jumps.len()], Vec::new());
        for idx in by_free {
            match free[idx] {
                Some(free) => landing[run_end[free]].push(idx),
                None => gone.push(idx),
            }
        }
        let mut last = run_end.clone();
        let mut examined: Vec<usize> = (0..run_end.len()).filter(|&k| run_end[k] == k).collect();
        loop {
            while let Some(end) = examined.pop() {
                let is_left = |k: usize| n_leaving[k] > 0;
                while !is_left(last[end]) && last[end] > 0 && run_end[last[end] - 1] == end {
                    last[end] -= 1;
                }
                let is_dead = |idx: &mut usize| {
                    free[*idx].is_none_or(|free| free > last[end]) || !is_left(last[end])
                };
                gone.extend(std::iter::from_fn(|| landing[end].pop_if(is_dead)));
            }
            let Some(idx) = gone.pop() else { break };
            kept[idx] = false;
            if let Some(from) = from[idx] {
                n_leaving[from] -= 1;
                examined.push(run_end[from]);
            }
        }
        let mut kept = kept.into_iter();
        jumps.retain(|_| kept.next() == Some(true));
        let component = self.component.clone();
        Playback { jumps, component }
    }

    /// Returns for each frame of the component the index of the last frame of its run.
    fn run_ends(&self) -> Vec<usize> {
        let n = self.component.len();
        let mut ends: Vec<usize> = (0..n).collect();
        for k in (0..n.saturating_sub(1)).rev() {
            if self.component[k + 1] == self.component[k] + 1 {
                ends[k] = ends[k + 1];
            }
        }
        ends
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn jump(from: u32, to: u32, mirrored: bool) -> Jump {
        Jump {
            from,
            to,
            cost: 1,
            mirrored,
        }
    }

    /// Returns the jumps that are left of a graph of three runs.
    fn left(mirror: bool, dwell: usize) -> Vec<(u32, u32)> {
        let playback = Playback {
            jumps: vec![
                jump(1, 12, false),
                jump(1, 20, false),
                jump(3, 10, false),
                jump(3, 10, true),
                jump(12, 0, false),
                jump(22, 3, false),
            ],
            component: (0..4).chain(10..13).chain(20..23).collect(),
        };
        let left = playback.without_dead_ends(mirror, dwell);
        assert_eq!(left.component, playback.component);
        left.jumps.iter().map(|jump| (jump.from, jump.to)).collect()
    }

    #[test]
    fn jumps_to_runs_that_end_before_the_next_jump_are_dropped() {
        let all = [(1, 12), (1, 20), (3, 10), (12, 0), (22, 3)];
        assert_eq!(left(false, 1), all);
        // Frames 12 and 3 end their runs. Without 22 -> 3 no jump leaves the run of 20.
        assert_eq!(left(false, 2), [(3, 10), (12, 0)]);
        assert_eq!(left(false, 4), []);
        assert_eq!(left(true, 2), [(3, 10), (3, 10), (12, 0)]);
    }

    /// Returns the jumps that are left, by the definition: a jump without another one after its dwell is removed, as
    /// often as there are jumps.
    fn left_by_definition(playback: &Playback, dwell: usize) -> Vec<Jump> {
        let mut jumps = playback.jumps.clone();
        for _ in 0..jumps.len() {
            let before = jumps.clone();
            let leaves = |frame: u32| before.iter().any(|jump| jump.from == frame);
            jumps.retain(|jump| {
                let run = (jump.to..).take_while(|frame| playback.component.contains(frame));
                run.skip(dwell - 1).any(leaves)
            });
        }
        jumps
    }

    proptest! {
        #[test]
        fn jumps_are_left_as_defined(
            component in prop::collection::btree_set(0u32..14, 1..14),
            ends in prop::collection::vec((0usize..14, 0usize..14), 0..9),
            dwell in 1usize..4,
        ) {
            let component: Vec<u32> = component.into_iter().collect();
            let frame = |k: usize| component[k % component.len()];
            let jumps = ends.iter().map(|&(from, to)| jump(frame(from), frame(to), false));
            let playback = Playback { jumps: jumps.collect(), component: component.clone() };
            let left = playback.without_dead_ends(true, dwell);
            prop_assert_eq!(left.jumps, left_by_definition(&playback, dwell));
        }
    }

    #[test]
    fn long_chain_of_dead_ends_is_removed_quickly() {
        // Each run of one frame has one jump to the next run, and the last has none.
        let n = 60_000;
        let jumps = (0..n - 1).map(|k| jump(2 * k, 2 * k + 2, false)).collect();
        let playback = Playback {
            jumps,
            component: (0..n).map(|k| 2 * k).collect(),
        };
        assert_eq!(playback.without_dead_ends(true, 1).jumps, []);
    }
}
