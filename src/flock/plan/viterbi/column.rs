//! The recursion, one block of frames at a time (docs/explanation/algorithms.md, "Planning").
//!
//! First the costs of playing on are carried from station to station (`front`). Then all jumps of the block
//! are taken (`landing`). Their costs are kept (`offers`) until the path may jump again, `dwell` frames
//! later. The same portable code is compiled with and without AVX2 and returns the same integers.

use super::front::{self, Front, NO_LEAD, Stretch, Tally};
use super::landing::Landing;
use super::offers::Offers;
use super::walk::Steps;
use super::{Block, FRAMES, Film, Rows, UNREACHED, block};
#[cfg(target_arch = "x86_64")]
use crate::cpu::Level;
use crate::flock::plan::landings::Way;

/// Number of stations whose costs are computed at a time, so that they stay in the nearest cache. Free
/// choice.
const STRETCH: usize = 64;

/// State of the recursion after a block.
#[derive(Clone)]
pub(super) struct Column {
    way: Way,
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
    tallies: Vec<Tally>,
    offers: Offers,
}

impl Column {
    /// Returns the state before the first of `n_frames` frames.
    pub(super) fn new(film: &Film<'_>, way: Way, n_frames: usize) -> Column {
        let (n_states, width) = (film.trellis.n_states(), block::width(film.dwell));
        Column {
            way,
            dwell: film.dwell,
            n_frames,
            width,
            clock: 0,
            opening: n_frames.next_multiple_of(width) - n_frames,
            tallies: vec![Tally::NOWHERE; n_states + 1],
            offers: Offers::new(n_states, film.dwell, width),
        }
    }

    /// Returns the number of blocks still to be processed.
    pub(super) fn n_left(&self) -> usize {
        (self.opening + self.n_frames - self.clock) / self.width
    }

    /// Processes the next block.
    pub(super) fn advance<R: Rows>(&mut self, film: &Film<'_>, rows: &mut R, steps: Steps<'_>) {
        self.advance_on::<R, true>(film, rows, steps);
    }

    /// Processes the next block without a trace.
    pub(super) fn advance_untraced<R: Rows>(&mut self, film: &Film<'_>, rows: &mut R) {
        self.advance_on::<R, false>(film, rows, Steps::default());
    }

    fn advance_on<R: Rows, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        steps: Steps<'_>,
    ) {
        match film.cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                // SAFETY: the guard of this match arm checks for AVX2, the only requirement of the callee.
                unsafe {
                    self.advance_avx2::<R, TRACED>(film, rows, steps);
                }
            }
            _ => self.advance_with::<R, false, TRACED>(film, rows, steps),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_avx2<R: Rows, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        steps: Steps<'_>,
    ) {
        self.advance_with::<R, true, TRACED>(film, rows, steps);
    }

    #[inline(always)]
    fn advance_with<R: Rows, const AVX2: bool, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        steps: Steps<'_>,
    ) {
        self.go_on::<R, AVX2, TRACED>(film, rows, steps.wins);
        self.land::<AVX2, TRACED>(film, steps.ranks);
        self.clock += self.width;
    }

    /// Computes every station from the one before it, or from a landing if that is cheaper.
    #[inline(always)]
    fn go_on<R: Rows, const AVX2: bool, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        wins: &mut [u8],
    ) {
        let block = self.block(film);
        let opening = (self.clock == 0).then_some(self.opening);
        let mut front = Front::new(self.width, film.dwell, opening);
        let mut costs = [[0; FRAMES]; STRETCH];
        let mut scratch = [[NO_LEAD; FRAMES]; STRETCH];
        let mut forgotten = [0; STRETCH];
        let gone_through = film.trellis.gone_through(self.way).chunks(STRETCH);
        let tallies = self.tallies[1..].chunks_mut(STRETCH).zip(gone_through);
        for (first, (tallies, gone_through)) in (0..).step_by(STRETCH).zip(tallies) {
            let n = tallies.len();
            rows.fill(&block, first, &mut costs[..n]);
            let stretch = Stretch {
                tallies,
                gone_through,
                offers: (self.offers).of(first..first + n, self.clock, &mut scratch[..n]),
                costs: &costs[..n],
                wins: match TRACED {
                    true => &mut wins[first..][..n],
                    false => &mut forgotten[..n],
                },
            };
            #[cfg(target_arch = "x86_64")]
            if AVX2 {
                #[expect(unsafe_code, reason = "the same, for AVX2")]
                // SAFETY: callers set `AVX2` only after checking for it.
                unsafe {
                    front.go_on_avx2::<TRACED>(stretch);
                }
                continue;
            }
            front.go_on(stretch);
        }
    }

    /// Takes the cheapest jump to each landing station.
    #[inline(always)]
    fn land<const AVX2: bool, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        ranks: &mut [[u16; FRAMES]],
    ) {
        let mut landing = Landing {
            tallies: &self.tallies,
            offers: self.offers.block(self.clock),
            ranks: ranks.iter_mut(),
        };
        for (n_jumps, stations, jumps) in film.trellis.landings(self.way).groups() {
            // Most landing stations have few jumps. A constant length makes these loops faster.
            match n_jumps {
                1 => landing.some::<AVX2, TRACED>(stations, jumps.as_chunks::<1>().0),
                2 => landing.some::<AVX2, TRACED>(stations, jumps.as_chunks::<2>().0),
                3 => landing.some::<AVX2, TRACED>(stations, jumps.as_chunks::<3>().0),
                _ => landing.some::<AVX2, TRACED>(stations, jumps.chunks(n_jumps)),
            }
        }
    }

    fn block(&self, film: &Film<'_>) -> Block {
        let age = |lane: usize| (self.clock + lane).saturating_sub(self.opening);
        let time = |lane| film.time(self.way, age(lane).min(self.n_frames - 1));
        Block {
            way: self.way,
            cpu: film.cpu,
            n_states: self.tallies.len() - 1,
            times: std::array::from_fn(time),
        }
    }

    /// Returns the clock of the next block.
    pub(super) fn clock(&self) -> usize {
        self.clock
    }

    /// Returns the lanes of the last block that hold frames.
    pub(super) fn lanes(&self) -> std::ops::Range<usize> {
        let is_first = self.clock == self.width;
        (if is_first { self.opening } else { 0 })..self.width
    }

    /// Returns V, the least cost of paths that may jump, in a lane of the last block, by station, in turns.
    pub(super) fn values(&self, lane: usize) -> impl Iterator<Item = u32> {
        let stations = self.tallies[1..].iter();
        stations.map(move |tally| tally.values[lane].min(UNREACHED))
    }

    /// Returns `[ago][station]`: the least cost, in turns, of paths to the last frame processed that landed
    /// `ago` frames before. The last row, `dwell - 1`, has the paths that landed at least that many frames
    /// before and may jump.
    pub(super) fn ends(&self, film: &Film<'_>) -> Vec<Vec<u32>> {
        let gone_through = film.trellis.gone_through(self.way);
        let last = self.width - 1;
        let sums: Vec<u32> = self.tallies[1..].iter().map(|t| t.sums[last]).collect();
        let landed = |ago: usize| {
            let mut values = vec![UNREACHED; gone_through.len()];
            // No path landed before the first frame.
            let Some(clock) = self.clock.checked_sub(ago + 2) else {
                return values;
            };
            let stations = gone_through.iter().zip(&sums).skip(ago);
            let landings = values.iter_mut().skip(ago).zip(self.offers.after(clock));
            for ((to, lead), (&gone, &sum)) in landings.zip(stations) {
                let value = front::value(lead, sum).min(UNREACHED);
                *to = if gone as usize > ago {
                    value
                } else {
                    UNREACHED
                };
            }
            values
        };
        let mut ends: Vec<Vec<u32>> = (0..self.dwell - 1).map(landed).collect();
        ends.push(self.values(last).collect());
        ends
    }
}
