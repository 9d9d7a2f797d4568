//! The recursion, one block of frames at a time (docs/explanation/algorithms.md, "Planning").
//!
//! First the costs of playing on are carried from station to station (`front`). Then all jumps of the block
//! are taken (`landing`). Their costs are kept (`offers`) until the path may jump again, `dwell` frames
//! later. The same portable code is compiled with and without AVX2 and returns the same integers.

use super::front::{self, Chunk, Front, NO_LEAD, StationCosts};
use super::landing::Landing;
use super::offers::Offers;
use super::trace::Steps;
use super::{Block, FRAMES, PathSearch, StateCosts, UNREACHED, block};
#[cfg(target_arch = "x86_64")]
use crate::cpu::Level;
use crate::flock::plan::landings::Pass;

/// Number of stations whose costs are computed at a time, so that they stay in the nearest cache. Free
/// choice.
const CHUNK: usize = 64;

/// State of the recursion after a block.
#[derive(Clone)]
pub(super) struct Column {
    pass: Pass,
    dwell: usize,
    /// Number of frames.
    n_frames: usize,
    /// Number of frames in a block.
    width: usize,
    /// Clock of the next block. Clocks number the frames so that the last block is full. The first frame
    /// has the clock `opening`, which is below `width`.
    clock: usize,
    opening: usize,
    /// By station plus one. No path comes from entry 0.
    station_costs: Vec<StationCosts>,
    offers: Offers,
}

impl Column {
    /// Returns the state before the first of `n_frames` frames.
    pub(super) fn new(search: &PathSearch<'_>, pass: Pass, n_frames: usize) -> Column {
        let (n_states, width) = (search.trellis.n_states(), block::width(search.dwell));
        Column {
            pass,
            dwell: search.dwell,
            n_frames,
            width,
            clock: 0,
            opening: n_frames.next_multiple_of(width) - n_frames,
            station_costs: vec![StationCosts::UNREACHABLE; n_states + 1],
            offers: Offers::new(n_states, search.dwell, width),
        }
    }

    /// Returns the number of blocks still to be processed.
    pub(super) fn n_left(&self) -> usize {
        (self.opening + self.n_frames - self.clock) / self.width
    }

    /// Processes the next block.
    pub(super) fn advance<R: StateCosts>(
        &mut self,
        search: &PathSearch<'_>,
        state_costs: &mut R,
        steps: Steps<'_>,
    ) {
        self.advance_on::<R, true>(search, state_costs, steps);
    }

    /// Processes the next block without a trace.
    pub(super) fn advance_untraced<R: StateCosts>(
        &mut self,
        search: &PathSearch<'_>,
        state_costs: &mut R,
    ) {
        self.advance_on::<R, false>(search, state_costs, Steps::default());
    }

    fn advance_on<R: StateCosts, const TRACED: bool>(
        &mut self,
        search: &PathSearch<'_>,
        state_costs: &mut R,
        steps: Steps<'_>,
    ) {
        match search.cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                // SAFETY: the guard of this match arm checks for AVX2, the only requirement of the callee.
                unsafe {
                    self.advance_avx2::<R, TRACED>(search, state_costs, steps);
                }
            }
            _ => self.advance_with::<R, false, TRACED>(search, state_costs, steps),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_avx2<R: StateCosts, const TRACED: bool>(
        &mut self,
        search: &PathSearch<'_>,
        state_costs: &mut R,
        steps: Steps<'_>,
    ) {
        self.advance_with::<R, true, TRACED>(search, state_costs, steps);
    }

    #[inline(always)]
    fn advance_with<R: StateCosts, const AVX2: bool, const TRACED: bool>(
        &mut self,
        search: &PathSearch<'_>,
        state_costs: &mut R,
        steps: Steps<'_>,
    ) {
        self.play_on::<R, AVX2, TRACED>(search, state_costs, steps.wins);
        self.take_jumps::<AVX2, TRACED>(search, steps.ranks);
        self.clock += self.width;
    }

    /// Computes every station from the one before it, or from a landing if that is cheaper.
    #[inline(always)]
    fn play_on<R: StateCosts, const AVX2: bool, const TRACED: bool>(
        &mut self,
        search: &PathSearch<'_>,
        state_costs: &mut R,
        wins: &mut [u8],
    ) {
        let block = self.block(search);
        let opening = (self.clock == 0).then_some(self.opening);
        let mut front = Front::new(self.width, search.dwell, opening);
        let mut costs = [[0; FRAMES]; CHUNK];
        let mut scratch = [[NO_LEAD; FRAMES]; CHUNK];
        let mut discarded = [0; CHUNK];
        let run_lengths = search.trellis.run_lengths(self.pass).chunks(CHUNK);
        let station_costs = self.station_costs[1..].chunks_mut(CHUNK).zip(run_lengths);
        for (first, (station_costs, run_lengths)) in (0..).step_by(CHUNK).zip(station_costs) {
            let n = station_costs.len();
            state_costs.fill(&block, first, &mut costs[..n]);
            let chunk = Chunk {
                station_costs,
                run_lengths,
                offers: self
                    .offers
                    .ready(first..first + n, self.clock, &mut scratch[..n]),
                costs: &costs[..n],
                wins: if TRACED {
                    &mut wins[first..][..n]
                } else {
                    &mut discarded[..n]
                },
            };
            #[cfg(target_arch = "x86_64")]
            if AVX2 {
                #[expect(unsafe_code, reason = "the same, for AVX2")]
                // SAFETY: callers set `AVX2` only after checking for it.
                unsafe {
                    front.play_on_avx2::<TRACED>(chunk);
                }
                continue;
            }
            front.play_on(chunk);
        }
    }

    /// Takes the cheapest jump to each landing station.
    #[inline(always)]
    fn take_jumps<const AVX2: bool, const TRACED: bool>(
        &mut self,
        search: &PathSearch<'_>,
        ranks: &mut [[u16; FRAMES]],
    ) {
        let mut landing = Landing {
            station_costs: &self.station_costs,
            offers: self.offers.of_block(self.clock),
            ranks: ranks.iter_mut(),
        };
        for (n_jumps, stations, jumps) in search.trellis.landings(self.pass).groups() {
            // Most landing stations have few jumps. A constant length makes these loops faster.
            match n_jumps {
                1 => landing.process::<AVX2, TRACED>(stations, jumps.as_chunks::<1>().0),
                2 => landing.process::<AVX2, TRACED>(stations, jumps.as_chunks::<2>().0),
                3 => landing.process::<AVX2, TRACED>(stations, jumps.as_chunks::<3>().0),
                _ => landing.process::<AVX2, TRACED>(stations, jumps.chunks(n_jumps)),
            }
        }
    }

    fn block(&self, search: &PathSearch<'_>) -> Block {
        let age = |lane: usize| (self.clock + lane).saturating_sub(self.opening);
        let time = |lane| search.time(self.pass, age(lane).min(self.n_frames - 1));
        Block {
            pass: self.pass,
            cpu: search.cpu,
            n_states: self.station_costs.len() - 1,
            times: std::array::from_fn(time),
        }
    }

    /// Returns the clock of the next block.
    pub(super) fn clock(&self) -> usize {
        self.clock
    }

    /// Returns V, the least cost of paths that may jump, at the last frame processed, by station, in turns.
    pub(super) fn values(&self) -> impl Iterator<Item = u32> {
        let last = self.width - 1;
        let stations = self.station_costs[1..].iter();
        stations.map(move |costs_here| costs_here.values[last].min(UNREACHED))
    }

    /// Returns `[ago][station]`: the least cost, in turns, of paths to the last frame processed that landed
    /// `ago` frames before. The last row, `dwell - 1`, has the paths that landed at least that many frames
    /// before and may jump.
    pub(super) fn ends(&self, search: &PathSearch<'_>) -> Vec<Vec<u32>> {
        let run_lengths = search.trellis.run_lengths(self.pass);
        let last = self.width - 1;
        let sums: Vec<u32> = self.station_costs[1..]
            .iter()
            .map(|t| t.sums[last])
            .collect();
        let landed = |ago: usize| {
            let mut values = vec![UNREACHED; run_lengths.len()];
            // No path landed before the first frame.
            let Some(clock) = self.clock.checked_sub(ago + 2) else {
                return values;
            };
            let stations = run_lengths.iter().zip(&sums).skip(ago);
            let landings = values.iter_mut().skip(ago).zip(self.offers.after(clock));
            for ((to, lead), (&run_length, &sum)) in landings.zip(stations) {
                let value = front::value(lead, sum).min(UNREACHED);
                *to = if run_length as usize > ago {
                    value
                } else {
                    UNREACHED
                };
            }
            values
        };
        let mut ends: Vec<Vec<u32>> = (0..self.dwell - 1).map(landed).collect();
        ends.push(self.values().collect());
        ends
    }
}
