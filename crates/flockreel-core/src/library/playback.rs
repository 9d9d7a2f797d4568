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
    pub fn without_dead_ends(&self, mirror: bool, dwell: usize) -> Playback {
        let mut jumps = self.jumps.clone();
        jumps.retain(|jump| mirror || !jump.mirrored);
        let n = self.component.len();
        let at = |frame: u32| self.component.binary_search(&frame).ok();
        loop {
            let mut leaves = vec![false; n];
            for from in jumps.iter().filter_map(|jump| at(jump.from)) {
                leaves[from] = true;
            }
            // For each frame: whether the rest of its run has a jump, and how many frames of the run follow.
            let mut n_ahead = vec![0; n];
            for k in (0..n.saturating_sub(1)).rev() {
                if self.component[k + 1] == self.component[k] + 1 {
                    leaves[k] |= leaves[k + 1];
                    n_ahead[k] = n_ahead[k + 1] + 1;
                }
            }
            let n_before = jumps.len();
            jumps.retain(|jump| {
                at(jump.to).is_some_and(|to| n_ahead[to] + 1 >= dwell && leaves[to + dwell - 1])
            });
            if jumps.len() == n_before {
                let component = self.component.clone();
                return Playback { jumps, component };
            }
        }
    }
}

#[cfg(test)]
mod tests {
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
}
