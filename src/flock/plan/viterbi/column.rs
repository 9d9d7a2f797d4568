//! The recursion itself, one frame at a time (ALGORITHMS.md 6).
//!
//! What continues stays in its place: state `s` at frame `t` lies at `(s - t) mod n`, so a frame adds
//! each state's cost to one sum along the diagonal, and only what jumps touches anything else. V is
//! kept as that sum and a lead over it, which changes where a run of `dwell` frames after a jump ends.
//! The same portable code is compiled once plainly and once for AVX2; results are the same integers.

use super::walk::{Back, Trace};
use super::{Film, Rows, UNREACHED};
use crate::cpu::Level;
use crate::flock::plan::trellis::Trellis;

/// The lead of a state that no path leads to. Sums stay below 2^31, so V fits 32 bits.
const NO_LEAD: i32 = UNREACHED as i32;
/// States whose costs are filled in at a time, so that they stay in the nearest cache.
const BLOCK: usize = 64;

/// The state of the recursion after one frame.
#[derive(Clone)]
pub(super) struct Column<const LANES: usize> {
    dwell: usize,
    /// V less the sum, by place.
    leads: Vec<[i32; LANES]>,
    /// Costs of continuing since the film began, by place.
    sums: Vec<[u32; LANES]>,
    /// V of each leaving state at the frame before.
    leaving: Vec<[u32; LANES]>,
    /// `landed[(t mod dwell) * n_targets + order]`: the lead of landing on a target at frame t.
    landed: Vec<[i32; LANES]>,
    /// The targets from which `dwell` frames can be played, rising: (order, state).
    arriving: Vec<(u32, u32)>,
}

/// The place of state 0 at frame `t`.
fn origin(t: usize, n: usize) -> usize {
    match t % n {
        0 => 0,
        gone => n - gone,
    }
}

fn place(state: usize, origin: usize, n: usize) -> usize {
    let place = state + origin;
    if place >= n { place - n } else { place }
}

impl<const LANES: usize> Column<LANES> {
    pub(super) fn start(
        trellis: &Trellis,
        dwell: usize,
        rows: &mut impl Rows<LANES>,
    ) -> Column<LANES> {
        let n_states = trellis.n_states();
        let n_targets = trellis.targets().len();
        let mut column = Column {
            dwell,
            leads: vec![[0; LANES]; n_states],
            sums: vec![[0; LANES]; n_states],
            leaving: vec![[0; LANES]; trellis.leaving().len()],
            landed: vec![[NO_LEAD; LANES]; n_targets * dwell],
            arriving: (trellis.targets().iter().enumerate())
                .filter(|(_, target)| trellis.continues(**target as usize, dwell - 1))
                .map(|(k, &target)| (trellis.order(k) as u32, target))
                .collect(),
        };
        column.go_on(0, rows);
        column.close_barriers(trellis, 0);
        column
    }

    /// Goes on to frame `t`.
    pub(super) fn advance<R: Rows<LANES>>(
        &mut self,
        film: &Film<'_>,
        t: usize,
        rows: &mut R,
        trace: &mut Trace<LANES>,
    ) {
        match film.cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                // SAFETY: the line above made sure of AVX2, which is all that the callee asks for.
                unsafe {
                    self.advance_avx2(film.trellis, t, rows, trace);
                }
            }
            _ => self.advance_anywhere(film.trellis, t, rows, trace),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_avx2<R: Rows<LANES>>(
        &mut self,
        trellis: &Trellis,
        t: usize,
        rows: &mut R,
        trace: &mut Trace<LANES>,
    ) {
        self.advance_anywhere(trellis, t, rows, trace);
    }

    #[inline(always)]
    fn advance_anywhere<R: Rows<LANES>>(
        &mut self,
        trellis: &Trellis,
        t: usize,
        rows: &mut R,
        trace: &mut Trace<LANES>,
    ) {
        self.leave(trellis, t - 1);
        self.land(trellis, t, trace);
        self.go_on(t, rows);
        self.close_barriers(trellis, t);
        self.arrive(trellis, t, trace);
    }

    /// V of each state that jumps leave.
    #[inline(always)]
    fn leave(&mut self, trellis: &Trellis, t: usize) {
        let n = self.leads.len();
        let origin = origin(t, n);
        for (v, &state) in self.leaving.iter_mut().zip(trellis.leaving()) {
            let at = place(state as usize, origin, n);
            for lane in 0..LANES {
                v[lane] = (self.leads[at][lane] as u32).wrapping_add(self.sums[at][lane]);
            }
        }
    }

    /// The cheapest jump to each target; in the air until `dwell` frames are played.
    #[inline(always)]
    fn land(&mut self, trellis: &Trellis, t: usize, trace: &mut Trace<LANES>) {
        let n = self.leads.len();
        let origin = origin(t, n);
        let n_targets = trellis.targets().len();
        let landed = &mut self.landed[t % self.dwell * n_targets..][..n_targets];
        let winners = trace.next_frame(n_targets);
        for ((landed, winner), (target, jumps)) in
            landed.iter_mut().zip(winners).zip(trellis.jumps())
        {
            let mut best = [UNREACHED; LANES];
            let mut rank_of_best = [0u32; LANES];
            for (rank, &(j, cost)) in (0u32..).zip(jumps) {
                let from = &self.leaving[j as usize];
                for lane in 0..LANES {
                    let through = from[lane] + cost;
                    let better = through < best[lane];
                    best[lane] = if better { through } else { best[lane] };
                    rank_of_best[lane] = if better { rank } else { rank_of_best[lane] };
                }
            }
            let sums = &self.sums[place(target, origin, n)];
            for lane in 0..LANES {
                landed[lane] = best[lane] as i32 - sums[lane] as i32;
                winner[lane] = rank_of_best[lane] as u16;
            }
        }
    }

    /// Every state from the one before it.
    #[inline(always)]
    fn go_on<R: Rows<LANES>>(&mut self, t: usize, rows: &mut R) {
        let n = self.sums.len();
        let (low, high) = self.sums.split_at_mut(origin(t, n));
        let mut first = 0;
        for block in high.chunks_mut(BLOCK).chain(low.chunks_mut(BLOCK)) {
            let mut row = [[0; LANES]; BLOCK];
            let row = &mut row[..block.len()];
            rows.fill(t, first, row);
            for (sum, cost) in block.iter_mut().zip(row) {
                for lane in 0..LANES {
                    sum[lane] += cost[lane];
                }
            }
            first += block.len();
        }
    }

    fn close_barriers(&mut self, trellis: &Trellis, t: usize) {
        let n = self.leads.len();
        for &at in trellis.barriers() {
            self.leads[place(at as usize, origin(t, n), n)] = [NO_LEAD; LANES];
        }
    }

    /// Whoever landed `dwell - 1` frames ago is free again.
    #[inline(always)]
    fn arrive(&mut self, trellis: &Trellis, t: usize, trace: &mut Trace<LANES>) {
        let Some(landed_at) = (t + 1).checked_sub(self.dwell).filter(|&at| at > 0) else {
            return;
        };
        let n = self.leads.len();
        let origin = origin(landed_at, n);
        let n_targets = trellis.targets().len();
        let landed = &self.landed[landed_at % self.dwell * n_targets..][..n_targets];
        let arrivals = trace.arrivals(self.arriving.len());
        let mut n_arrived = 0;
        for &(order, target) in &self.arriving {
            let new = &landed[order as usize];
            let lead = &mut self.leads[place(target as usize, origin, n)];
            let mut lanes = 0;
            for lane in 0..LANES {
                lanes |= u32::from(new[lane] < lead[lane]) << lane;
                lead[lane] = lead[lane].min(new[lane]);
            }
            // Without a branch: whether it is cheaper is hard to foresee.
            arrivals[n_arrived] = (target + self.dwell as u32 - 1, lanes as u8);
            n_arrived += usize::from(lanes != 0);
        }
        trace.keep(n_arrived);
    }

    /// V of every state at frame `t`, the last one advanced to, for one individual.
    pub(super) fn costs(&self, t: usize, lane: usize) -> impl Iterator<Item = u32> {
        let n = self.leads.len();
        let first = origin(t, n);
        (0..n).map(move |state| {
            let at = place(state, first, n);
            (self.leads[at][lane] as u32).wrapping_add(self.sums[at][lane])
        })
    }

    /// The cheapest place to be at the last frame: free, or in a run that the end cuts short.
    pub(super) fn cheapest_end(
        &self,
        trellis: &Trellis,
        n_frames: usize,
        lane: usize,
    ) -> Option<(u32, Back)> {
        let (last, n) = (n_frames - 1, self.leads.len());
        let mut best = (UNREACHED, Back::Free { at: 0, t: 0 });
        for (at, cost) in self.costs(last, lane).enumerate() {
            if cost < best.0 {
                best = (cost, Back::Free { at, t: last });
            }
        }
        let n_targets = trellis.targets().len();
        for t in (n_frames + 1).saturating_sub(self.dwell).max(1)..n_frames {
            let landed = &self.landed[t % self.dwell * n_targets..][..n_targets];
            for (k, &target) in trellis.targets().iter().enumerate() {
                let leads = landed[trellis.order(k)];
                if trellis.continues(target as usize, last - t) {
                    let sums = self.sums[place(target as usize, origin(t, n), n)];
                    let cost = (leads[lane] as u32).wrapping_add(sums[lane]);
                    if cost < best.0 {
                        best = (cost, Back::Landed { k, t });
                    }
                }
            }
        }
        (best.0 < UNREACHED).then_some(best)
    }
}
