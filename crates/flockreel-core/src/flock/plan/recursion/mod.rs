//! Exact planning: the cheapest path through the trellis, by dynamic programming over frames
//! (docs/explanation/algorithms.md, "Planning").
//!
//! V is the least cost of a path that may jump. After a jump at least `dwell` frames are played; only the
//! beginning and the end of a plan may cut that run short. A landing, the arrival of a jump, therefore counts
//! in V `dwell` frames after the jump. Until then it is kept as a lead: its cost minus the running sum of the
//! costs along continuous playback, which is the same for all paths that play on side by side.

use std::ops::Range;

use super::segment::FORBIDDEN;
use super::trellis::Trellis;
use crate::cpu::Level;

/// Cost of a state that no path reaches, in turns. A plan of 10,000 frames stays below it if each frame costs
/// less than `CEILING` and each jump less than 2^16. Sums of this value and all costs of a film stay below 2^32.
pub const UNREACHED: u32 = i32::MAX as u32;
/// Upper limit, exclusive, of the cost of showing a state at a frame, in turns.
pub const CEILING: u32 = 1 << 17;
/// Memory for the values of one path, bytes. Beyond it they are computed again, segment after segment. Free
/// choice.
const BUDGET_BYTES: usize = 64 << 20;

/// Cheapest path of one individual through the trellis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// State shown at each output frame.
    pub states: Vec<u32>,
    /// Cost, in turns.
    pub cost: u32,
}

/// Costs of showing each state, for one individual, in turns. Costs from `CEILING` on count as `CEILING - 1`.
/// Barriers may have any cost.
pub trait StateCosts {
    /// Writes the costs of all states at a frame.
    fn fill(&self, t: usize, out: &mut [u32]);

    /// Returns the cost of a state at a frame.
    fn at(&self, t: usize, state: usize) -> u32;
}

/// Search for the cheapest path of a film.
#[derive(Clone, Copy, Debug)]
pub struct PathSearch<'a> {
    /// States and the jumps between them.
    pub trellis: &'a Trellis,
    /// Number of frames; more than `dwell` if `start` is given.
    pub n_frames: usize,
    /// Least number of frames between two jumps.
    pub dwell: usize,
    /// Cost of beginning with each state as if just jumped to, in turns. Without it any state may come first,
    /// and the first jump any time.
    pub start: Option<&'a [u32]>,
    /// State at the last frame, if it is given.
    pub end: Option<u32>,
    /// Vector instructions to use; this machine must have them.
    pub cpu: Level,
}

/// State of the recursion after a frame.
#[derive(Clone)]
struct Column {
    /// Number of frames so far.
    n_frames: usize,
    /// V by state.
    values: Vec<u32>,
    /// Running sum of the costs along continuous playback up to each state, modulo 2^32.
    sums: Vec<u32>,
    /// `[frame % dwell][target]`: lead of the best jump after that frame.
    leads: Vec<Vec<u32>>,
    /// State in which a landing at each target may jump again; a barrier if its run is too short.
    landed: Vec<u32>,
    /// V, sums and costs of the frame that is computed.
    next: [Vec<u32>; 3],
}

/// End of a path: its state at a frame. `landed` is the number of frames since the last landing, and the target
/// of that jump, if the path may not jump yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct End {
    cost: u32,
    state: usize,
    landed: Option<(usize, usize)>,
}

impl PathSearch<'_> {
    /// Returns the cheapest path, exactly. `None` if no path is long enough. `memory` is reused.
    pub fn cheapest_path(&self, costs: &impl StateCosts, memory: &mut Vec<u32>) -> Option<Path> {
        let row_bytes = size_of::<u32>() * self.trellis.n_states();
        let fits = row_bytes * self.n_frames <= BUDGET_BYTES;
        let segment = if fits {
            self.n_frames
        } else {
            self.n_frames.isqrt() + 1
        };
        self.cheapest_path_by_segments(costs, segment, memory)
    }

    /// Returns the cost of the cheapest path, in turns. `None` if no path is long enough.
    pub fn least_cost(&self, costs: &impl StateCosts) -> Option<u32> {
        let mut column = self.first_column();
        (0..self.n_frames).for_each(|_| self.advance(&mut column, costs));
        self.best_end(&column).map(|end| end.cost)
    }

    /// Returns, by state, the cost of the cheapest path that ends with it, in turns. `UNREACHED` if there is no
    /// such path.
    pub fn costs_to(&self, costs: &impl StateCosts) -> Vec<u32> {
        let mut column = self.first_column();
        (0..self.n_frames).for_each(|_| self.advance(&mut column, costs));
        let mut least = vec![UNREACHED; self.trellis.n_states()];
        for end in self.ends(&column) {
            least[end.state] = least[end.state].min(end.cost);
        }
        least
    }

    /// Returns the cheapest path and keeps V for `segment` frames at a time.
    fn cheapest_path_by_segments(
        &self,
        costs: &impl StateCosts,
        segment: usize,
        memory: &mut Vec<u32>,
    ) -> Option<Path> {
        let mut column = self.first_column();
        let mut checkpoints = Vec::new();
        for t in 0..self.n_frames {
            if t % segment == 0 {
                checkpoints.push(column.clone());
                memory.clear();
            }
            self.advance(&mut column, costs);
            memory.extend_from_slice(&column.values);
        }
        let end = self.best_end(&column)?;
        let mut trace = Trace {
            search: self,
            costs,
            checkpoints,
            segment,
            values: memory,
        };
        Some(Path {
            states: trace.back_from(end),
            cost: end.cost,
        })
    }

    fn first_column(&self) -> Column {
        let n = self.trellis.n_states();
        let landed = |&target: &u32| {
            let continues = self.trellis.continues(target as usize, self.dwell - 1);
            if continues {
                target + self.dwell as u32 - 1
            } else {
                0
            }
        };
        Column {
            landed: self.trellis.targets().iter().map(landed).collect(),
            n_frames: 0,
            values: vec![if self.start.is_some() { UNREACHED } else { 0 }; n],
            sums: vec![0; n],
            leads: vec![vec![UNREACHED; self.trellis.targets().len()]; self.dwell],
            next: std::array::from_fn(|_| vec![0; n]),
        }
    }

    /// Adds a frame to a column.
    fn advance(&self, column: &mut Column, costs: &impl StateCosts) {
        match self.cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                // SAFETY: the guard of this match arm checks for AVX2, the only requirement of the callee.
                unsafe {
                    self.advance_avx2(column, costs);
                }
            }
            _ => self.advance_portable(column, costs),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_avx2(&self, column: &mut Column, costs: &impl StateCosts) {
        self.advance_portable(column, costs);
    }

    #[inline(always)]
    fn advance_portable(&self, column: &mut Column, costs: &impl StateCosts) {
        let Column {
            n_frames,
            values,
            sums,
            leads,
            landed,
            next,
        } = column;
        let t = *n_frames;
        *n_frames += 1;
        if values.is_empty() {
            return;
        }
        let [next_values, next_sums, row] = next;
        costs.fill(t, row);
        // The first frame has no frame before it, so each state comes from itself.
        let [from, to] = if t == 0 { [0, 0] } else { [0, 1] };
        let before = values[from..].iter().zip(&sums[from..]);
        let after = next_values[to..].iter_mut().zip(&mut next_sums[to..]);
        for (((next_value, next_sum), &cost), (value, sum)) in after.zip(&row[to..]).zip(before) {
            let cost = cost.min(CEILING - 1);
            *next_value = value + cost;
            *next_sum = sum.wrapping_add(cost);
        }
        std::mem::swap(values, next_values);
        std::mem::swap(sums, next_sums);
        let leads = &mut leads[t % self.dwell];
        if t + 1 == self.dwell
            && let Some(start) = self.start
        {
            for (first, &cost) in start.iter().enumerate() {
                if cost < FORBIDDEN && self.trellis.continues(first, t) {
                    values[first + t] = values[first + t].min(cost + sums[first + t]);
                }
            }
        }
        if t >= self.dwell {
            for (&state, &lead) in landed.iter().zip(leads.iter()) {
                let state = state as usize;
                values[state] = values[state].min(lead.wrapping_add(sums[state]));
            }
        }
        self.trellis
            .barriers()
            .for_each(|barrier| values[barrier] = UNREACHED);
        for ((target, jumps), lead) in self.trellis.jumps().zip(leads) {
            let least = jumps.iter().fold(UNREACHED, |least, &(source, cost)| {
                least.min(values[source as usize] + cost)
            });
            // A barrier or another state precedes each target.
            *lead = least.wrapping_sub(sums[target as usize - 1]);
        }
    }

    /// Returns the cheapest end of the paths of a column.
    fn best_end(&self, column: &Column) -> Option<End> {
        let is_end = |end: &End| self.end.is_none_or(|state| end.state == state as usize);
        self.ends(column).filter(is_end).min()
    }

    /// Returns the ends of the cheapest paths of a column.
    fn ends(&self, column: &Column) -> impl Iterator<Item = End> {
        let free = column.values.iter().enumerate().map(|(state, &cost)| End {
            cost,
            state,
            landed: None,
        });
        let last = column.n_frames - 1;
        let landed = (0..(self.dwell - 1).min(last)).flat_map(move |ago| {
            let leads = &column.leads[(last - ago - 1) % self.dwell];
            let targets = self.trellis.targets().iter().zip(leads).enumerate();
            targets.filter_map(move |(k, (&target, lead))| {
                let state = target as usize + ago;
                self.trellis.continues(target as usize, ago).then(|| End {
                    cost: lead.wrapping_add(column.sums[state]),
                    state,
                    landed: Some((ago, k)),
                })
            })
        });
        free.chain(landed).filter(|end| end.cost < UNREACHED)
    }
}

/// Values of all frames, the last segment of which is in memory.
struct Trace<'a, C> {
    search: &'a PathSearch<'a>,
    costs: &'a C,
    /// State of the recursion before each segment, up to the one in memory.
    checkpoints: Vec<Column>,
    /// Number of frames of a segment.
    segment: usize,
    /// V by frame and state.
    values: &'a mut Vec<u32>,
}

impl<C: StateCosts> Trace<'_, C> {
    /// Returns the states of the path with an end.
    fn back_from(&mut self, end: End) -> Vec<u32> {
        let (trellis, dwell) = (self.search.trellis, self.search.dwell);
        let mut states = vec![0; self.search.n_frames];
        let (mut t, mut state, mut landed) = (self.search.n_frames - 1, end.state, end.landed);
        loop {
            states[t] = state as u32;
            if landed.is_none() && t > 0 && self.has_played_on(t, state) {
                (t, state) = (t - 1, state - 1);
                continue;
            }
            if landed.is_none() && t == 0 {
                return states;
            }
            // The path jumped `ago` frames before, or began there.
            let (ago, first) = match landed.take() {
                Some((ago, k)) => (ago, trellis.targets()[k] as usize),
                None => (dwell - 1, state + 1 - dwell),
            };
            let shown: Range<usize> = t - ago..t + 1;
            shown
                .zip(first as u32..)
                .for_each(|(t, shown)| states[t] = shown);
            if t == ago {
                return states;
            }
            t -= ago + 1;
            let values = self.row(t);
            let k = trellis
                .targets()
                .partition_point(|&target| (target as usize) < first);
            let jumps = trellis
                .sources(k)
                .iter()
                .map(|&(source, cost)| (values[source as usize] + cost, source));
            state = jumps.min().map_or(0, |(_, source)| source as usize);
        }
    }

    /// Returns whether the cheapest path to a state that may jump comes from the state before.
    fn has_played_on(&mut self, t: usize, state: usize) -> bool {
        let cost = self.costs.at(t, state).min(CEILING - 1);
        let now = self.row(t)[state];
        self.row(t - 1)[state - 1] + cost == now
    }

    /// Returns V by state at a frame. Frames are asked for from the last to the first.
    fn row(&mut self, t: usize) -> &[u32] {
        let n_states = self.search.trellis.n_states();
        while t < (self.checkpoints.len() - 1) * self.segment {
            self.checkpoints.pop();
            let mut column = self.checkpoints[self.checkpoints.len() - 1].clone();
            self.values.clear();
            for _ in 0..self.segment {
                self.search.advance(&mut column, self.costs);
                self.values.extend_from_slice(&column.values);
            }
        }
        let row = t - (self.checkpoints.len() - 1) * self.segment;
        &self.values[row * n_states..][..n_states]
    }
}

#[cfg(test)]
mod tests;
