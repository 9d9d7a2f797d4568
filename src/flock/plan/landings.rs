//! The jumps of a trellis as the recursion takes them (ALGORITHMS.md 6): for each state that one lands
//! on, where one comes from; once as time runs, and once against it.

/// Which way the frames of a plan are gone through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// As time runs.
    Ahead,
    /// From the last frame to the first.
    Back,
}

/// So many states are landed on side by side.
pub const GROUP: usize = 8;

/// The states landed on in groups of about equally many jumps. Where a state has fewer jumps than its
/// group, its last comes once more and once more; the last group is filled up with its last state.
#[derive(Clone, Debug, Default)]
pub struct Landings {
    groups: Vec<Group>,
    jumps: Vec<Jumps>,
    /// Where each state stands among all that are landed on; of no matter for others.
    order: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Group {
    states: [u32; GROUP],
    /// One past its last in `jumps`.
    end: usize,
}

/// A jump to each state of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jumps {
    /// Where they come from; those of one state rise from `Jumps` to `Jumps`.
    pub sources: [u32; GROUP],
    /// Turns.
    pub costs: [u32; GROUP],
}

impl Landings {
    /// From jumps (landing, source, cost), sorted, between states below `n_states`.
    pub fn new(n_states: usize, jumps: &[(u32, u32, u32)]) -> Landings {
        let inside = |state: u32| (state as usize) < n_states;
        let all_inside = jumps.iter().all(|jump| inside(jump.0) && inside(jump.1));
        assert!(all_inside, "a jump leads outside of the trellis");
        let mut into: Vec<&[(u32, u32, u32)]> = jumps.chunk_by(|a, b| a.0 == b.0).collect();
        into.sort_by_key(|into| into.len());
        let order = vec![0; n_states];
        let mut landings = Landings {
            order,
            ..Landings::default()
        };
        for (place, into) in (0..).zip(&into) {
            landings.order[into[0].0 as usize] = place;
        }
        for group in into.chunks(GROUP) {
            landings.add(group);
        }
        landings
    }

    fn add(&mut self, group: &[&[(u32, u32, u32)]]) {
        let into = |k: usize| group[k.min(group.len() - 1)];
        for rank in 0..into(GROUP).len() {
            let jump = |k: usize| into(k)[rank.min(into(k).len() - 1)];
            self.jumps.push(Jumps {
                sources: std::array::from_fn(|k| jump(k).1),
                costs: std::array::from_fn(|k| jump(k).2),
            });
        }
        self.groups.push(Group {
            states: std::array::from_fn(|k| into(k)[0].0),
            end: self.jumps.len(),
        });
    }

    /// Number of states, landed on or not; all that groups and jumps name are below.
    pub fn n_states(&self) -> usize {
        self.order.len()
    }

    /// Number of groups.
    pub fn n_groups(&self) -> usize {
        self.groups.len()
    }

    /// The states of each group and the jumps to them, groups of few jumps first.
    #[inline(always)]
    pub fn groups(&self) -> impl Iterator<Item = (&[u32; GROUP], &[Jumps])> {
        let mut start = 0;
        self.groups.iter().map(move |group| {
            let jumps = &self.jumps[start..group.end];
            start = group.end;
            (&group.states, jumps)
        })
    }

    /// Where a state landed on stands among all of them.
    pub fn order(&self, state: usize) -> usize {
        self.order[state] as usize
    }

    /// The source of jump number `rank` to the state that stands at `order`.
    pub fn source(&self, order: usize, rank: usize) -> usize {
        let before = (order / GROUP).checked_sub(1);
        let start = before.map_or(0, |before| self.groups[before].end);
        self.jumps[start + rank].sources[order % GROUP] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_with_few_jumps_come_first_and_keep_their_sources() {
        let mut jumps: Vec<(u32, u32, u32)> = (10..20).map(|state| (state, state - 9, 4)).collect();
        jumps.extend([(12, 4, 5), (12, 9, 6), (15, 8, 7)]);
        jumps.sort_unstable();
        let landings = Landings::new(20, &jumps);
        let groups: Vec<(&[u32; GROUP], &[Jumps])> = landings.groups().collect();
        assert_eq!(groups[0].0, &[10, 11, 13, 14, 16, 17, 18, 19]);
        assert_eq!(groups[1].0, &[15, 12, 12, 12, 12, 12, 12, 12]);
        assert_eq!(
            groups.iter().map(|group| group.1.len()).collect::<Vec<_>>(),
            [1, 3]
        );
        assert_eq!(groups[1].1[2].sources, [8, 9, 9, 9, 9, 9, 9, 9]);
        assert_eq!(groups[1].1[2].costs, [7, 6, 6, 6, 6, 6, 6, 6]);
        assert_eq!(
            [0, 1, 2].map(|rank| landings.source(landings.order(12), rank)),
            [3, 4, 9]
        );
        assert_eq!(landings.source(landings.order(19), 0), 10);
    }
}
