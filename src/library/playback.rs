//! What may follow what: transitions between like clips, the playback graph that they make, and the
//! patches between jumps (ALGORITHMS.md 5; O 3.3).

use std::ops::Range;

/// Two clips that look alike and point the same way: playback may jump between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// First frame of the one clip.
    pub from: u32,
    /// First frame of the other clip.
    pub to: u32,
    /// The other clip was compared left-right mirrored.
    pub mirrored: bool,
    /// D of the two clips.
    pub distance: u64,
    /// Difference of the clips' mean headings, 0..=pi.
    pub heading_gap_rad: f64,
}

/// One step of playback that is not frame -> frame + 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Jump {
    /// The last frame shown before the jump.
    pub from: u32,
    /// The frame shown next.
    pub to: u32,
    /// D of the clips that it joins.
    pub cost: u64,
    /// The jump changes the mirror side.
    pub mirrored: bool,
}

/// The playback graph over states (frame, mirror side): frame -> frame + 1 at no cost, and the jumps.
///
/// With mirrored jumps both sides of every frame are states; the graph is the same seen from either
/// side. Only frames of the component may be shown: within it playback never ends.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Playback {
    /// Every jump within the component, sorted, without repeats of (from, to, mirrored).
    pub jumps: Vec<Jump>,
    /// The frames of the largest strongly connected component, rising.
    pub component: Vec<u32>,
}

/// A run of sprites between two jump ends, and the patches that may follow it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Its frames, `start..end`.
    pub frames: Range<u32>,
    /// Indices of the patches that can be played after it, rising.
    pub next: Vec<u32>,
}

impl Playback {
    /// The same without jumps after which playback must end: two jumps are at least `dwell` frames apart, and some runs are
    /// shorter than that. Without `mirror` all jumps that change the side are left out.
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
            // Whether a jump lies ahead in the run, and how many frames of the run do.
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
