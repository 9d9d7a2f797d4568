//! The exact plan: for each individual the cheapest path through the trellis (ALGORITHMS.md 6),
//! by dynamic programming over frames with `LANES` individuals side by side.
//!
//! After a jump at least `dwell` frames are played; only the end of the plan may cut that run short.
//! A jump is thus an edge of `dwell` frames, whose forced costs come from prefix sums along the
//! diagonal (they wrap; differences are right). Ties go to continuing, then to the smaller state.
//! What led where is kept as one bit a state and one winner a jump target; above a budget the film
//! is cut into segments, each played again from its checkpoint.

use super::trellis::Trellis;

/// No path leads here. Costs of a whole plan stay below (at most 10 000 frames of less than 2^17, and
/// a jump of less than 2^16 each), and what is added to it along a film stays below 2^32.
pub(super) const UNREACHED: u32 = 1 << 31;

/// Memory for what led where, before the film is cut into segments.
const TRACE_BUDGET_BYTES: usize = 128 << 20;

/// The cheapest way through the trellis for one individual.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// The state shown at each output frame.
    pub states: Vec<u32>,
    /// Its cost, turns.
    pub cost: u32,
}

/// The cheapest paths of `LANES` individuals, each exactly. `row(t, out)` fills in what showing each
/// state at frame `t` costs each individual, turns below 2^17. `None` when no path is long enough.
pub fn cheapest_paths<const LANES: usize>(
    trellis: &Trellis,
    n_frames: usize,
    dwell: usize,
    row: impl Fn(usize, &mut [[u32; LANES]]),
) -> Option<[Path; LANES]> {
    let segment = segment_frames(trellis, n_frames, LANES, TRACE_BUDGET_BYTES);
    cheapest_paths_by_segments(trellis, n_frames, dwell, segment, row)
}

/// As `cheapest_paths`, keeping what led where for `segment` frames at a time.
pub(super) fn cheapest_paths_by_segments<const LANES: usize>(
    trellis: &Trellis,
    n_frames: usize,
    dwell: usize,
    segment: usize,
    row: impl Fn(usize, &mut [[u32; LANES]]),
) -> Option<[Path; LANES]> {
    assert!(n_frames > 0 && dwell > 0 && segment > 0, "nothing to plan");
    if trellis.n_states() == 0 {
        return None;
    }
    let mut column = Column::start(trellis, dwell, &row);
    let mut trace = Trace::default();
    let mut checkpoints = Vec::new();
    let starts: Vec<usize> = (1..n_frames).step_by(segment).collect();
    for &start in &starts {
        checkpoints.push(column.clone());
        let end = (start + segment).min(n_frames);
        trace.restart(start);
        for t in start..end {
            column.advance(trellis, t, &row, &mut trace);
        }
    }
    let mut walks = Vec::with_capacity(LANES);
    for lane in 0..LANES {
        walks.push(column.cheapest_end(trellis, n_frames, lane)?);
    }
    for (segment_idx, &start) in starts.iter().enumerate().rev() {
        if segment_idx + 1 < starts.len() {
            column = checkpoints.swap_remove(segment_idx);
            trace.restart(start);
            for t in start..starts[segment_idx + 1] {
                column.advance(trellis, t, &row, &mut trace);
            }
        }
        for (lane, walk) in walks.iter_mut().enumerate() {
            walk.back_to(start, trellis, dwell, &trace, lane);
        }
    }
    let paths: Vec<Path> = walks.into_iter().map(Walk::finish).collect();
    paths.try_into().ok()
}

/// Every state's cheapest cost at every frame, for one individual: what the certificate checks.
pub fn potentials(
    trellis: &Trellis,
    n_frames: usize,
    dwell: usize,
    row: impl Fn(usize, &mut [[u32; 1]]),
) -> Vec<Vec<u32>> {
    let mut column = Column::start(trellis, dwell, &row);
    let mut trace = Trace::default();
    let mut columns = vec![column.costs.iter().map(|lane| lane[0]).collect()];
    for t in 1..n_frames {
        trace.restart(t);
        column.advance(trellis, t, &row, &mut trace);
        columns.push(column.costs.iter().map(|lane| lane[0]).collect());
    }
    columns
}

fn segment_frames(trellis: &Trellis, n_frames: usize, lanes: usize, budget: usize) -> usize {
    let frame_bytes = trellis.n_states() + trellis.targets().len() * lanes * 2;
    if frame_bytes * n_frames <= budget {
        n_frames
    } else {
        n_frames.isqrt() + 1
    }
}

/// The state of the recursion after one frame.
#[derive(Clone)]
struct Column<const LANES: usize> {
    dwell: usize,
    /// V: cheapest cost of being free in each state.
    costs: Vec<[u32; LANES]>,
    before: Vec<[u32; LANES]>,
    /// Sums of the costs of continuing, modulo 2^32.
    sums: Vec<[u32; LANES]>,
    /// What this frame's row says.
    row: Vec<[u32; LANES]>,
    /// `landed[(t mod dwell) * n_targets + k]`: cheapest cost of landing on target k at t, less the
    /// sum before it.
    landed: Vec<[u32; LANES]>,
}

impl<const LANES: usize> Column<LANES> {
    fn start(
        trellis: &Trellis,
        dwell: usize,
        row: &impl Fn(usize, &mut [[u32; LANES]]),
    ) -> Column<LANES> {
        let n_states = trellis.n_states();
        let mut column = Column {
            dwell,
            costs: vec![[0; LANES]; n_states],
            before: vec![[UNREACHED; LANES]; n_states],
            sums: vec![[0; LANES]; n_states],
            row: vec![[0; LANES]; n_states],
            landed: vec![[UNREACHED; LANES]; trellis.targets().len() * dwell],
        };
        row(0, &mut column.row);
        column.costs.copy_from_slice(&column.row);
        column.sums.copy_from_slice(&column.row);
        column.close_barriers(trellis);
        column
    }

    fn advance(
        &mut self,
        trellis: &Trellis,
        t: usize,
        row: &impl Fn(usize, &mut [[u32; LANES]]),
        trace: &mut Trace<LANES>,
    ) {
        row(t, &mut self.row);
        std::mem::swap(&mut self.costs, &mut self.before);
        self.land(trellis, t, trace);
        self.go_on();
        self.close_barriers(trellis);
        self.arrive(trellis, t, trace);
    }

    /// The cheapest jump to each target.
    fn land(&mut self, trellis: &Trellis, t: usize, trace: &mut Trace<LANES>) {
        let n_targets = trellis.targets().len();
        let landed = &mut self.landed[t % self.dwell * n_targets..][..n_targets];
        for (k, (landed, &target)) in landed.iter_mut().zip(trellis.targets()).enumerate() {
            let mut best = [UNREACHED; LANES];
            let mut winner = [0u16; LANES];
            for (idx, &(source, cost)) in trellis.sources(k).iter().enumerate() {
                let from = &self.before[source as usize];
                for lane in 0..LANES {
                    let through = from[lane] + cost;
                    let better = through < best[lane];
                    best[lane] = if better { through } else { best[lane] };
                    winner[lane] = if better { idx as u16 } else { winner[lane] };
                }
            }
            let sums = &self.sums[target as usize - 1];
            for lane in 0..LANES {
                landed[lane] = best[lane].wrapping_sub(sums[lane]);
            }
            trace.winners.push(winner);
        }
    }

    /// Every state from the one before it.
    fn go_on(&mut self) {
        let n = self.costs.len();
        let from = &self.before[..n - 1];
        for ((to, from), row) in self.costs[1..].iter_mut().zip(from).zip(&self.row[1..]) {
            for lane in 0..LANES {
                to[lane] = from[lane] + row[lane];
            }
        }
        for at in (1..n).rev() {
            for lane in 0..LANES {
                self.sums[at][lane] = self.sums[at - 1][lane].wrapping_add(self.row[at][lane]);
            }
        }
    }

    fn close_barriers(&mut self, trellis: &Trellis) {
        for &at in trellis.barriers() {
            self.costs[at as usize] = [UNREACHED; LANES];
            self.sums[at as usize] = [0; LANES];
        }
    }

    /// Whoever landed `dwell - 1` frames ago is free again.
    fn arrive(&mut self, trellis: &Trellis, t: usize, trace: &mut Trace<LANES>) {
        let n_states = self.costs.len();
        let from = trace.continued.len();
        trace.continued.resize(from + n_states, u8::MAX);
        let Some(landed_at) = (t + 1).checked_sub(self.dwell).filter(|&at| at > 0) else {
            return;
        };
        let n_targets = trellis.targets().len();
        let landed = &self.landed[landed_at % self.dwell * n_targets..][..n_targets];
        for (landed, &target) in landed.iter().zip(trellis.targets()) {
            if !trellis.continues(target as usize, self.dwell - 1) {
                continue;
            }
            let arrival = target as usize + self.dwell - 1;
            let cost = &mut self.costs[arrival];
            let mut continued = u8::MAX;
            for lane in 0..LANES {
                let through = landed[lane].wrapping_add(self.sums[arrival][lane]);
                if through < cost[lane] {
                    cost[lane] = through;
                    continued &= !(1 << lane);
                }
            }
            trace.continued[from + arrival] = continued;
        }
    }

    /// The cheapest place to be at the last frame: free, or in a run that the end cuts short.
    fn cheapest_end(&self, trellis: &Trellis, n_frames: usize, lane: usize) -> Option<Walk> {
        let last = n_frames - 1;
        let mut best = (UNREACHED, Back::Free { at: 0, t: 0 });
        for (at, cost) in self.costs.iter().enumerate() {
            if cost[lane] < best.0 {
                best = (cost[lane], Back::Free { at, t: last });
            }
        }
        let n_targets = trellis.targets().len();
        for t in (n_frames + 1).saturating_sub(self.dwell).max(1)..n_frames {
            for (k, &target) in trellis.targets().iter().enumerate() {
                let at = target as usize + last - t;
                if trellis.continues(target as usize, last - t) {
                    let landed = self.landed[t % self.dwell * n_targets + k][lane];
                    let cost = landed.wrapping_add(self.sums[at][lane]);
                    if cost < best.0 {
                        best = (cost, Back::Landed { k, t });
                    }
                }
            }
        }
        (best.0 < UNREACHED).then(|| Walk::from_end(trellis, n_frames, best))
    }
}

/// What led where, for some frames in a row.
#[derive(Default)]
struct Trace<const LANES: usize> {
    first: usize,
    /// Bit `lane` of `[t - first][state]`: came by continuing.
    continued: Vec<u8>,
    /// `[t - first][k]`: which of the sources of target k.
    winners: Vec<[u16; LANES]>,
}

impl<const LANES: usize> Trace<LANES> {
    fn restart(&mut self, first: usize) {
        self.first = first;
        self.continued.clear();
        self.winners.clear();
    }
}

/// Where a walk back stands.
#[derive(Clone, Copy)]
enum Back {
    /// Free in state `at` at frame `t`.
    Free { at: usize, t: usize },
    /// Just landed on target `k` at frame `t`.
    Landed { k: usize, t: usize },
}

/// A path read backward.
struct Walk {
    path: Path,
    back: Back,
}

impl Walk {
    fn from_end(trellis: &Trellis, n_frames: usize, (cost, back): (u32, Back)) -> Walk {
        let mut states = vec![0; n_frames];
        if let Back::Landed { k, t } = back {
            lay_run(&mut states[t..], trellis.targets()[k]);
        }
        Walk {
            path: Path { states, cost },
            back,
        }
    }

    /// Goes on until what led here lies before frame `start`.
    fn back_to<const LANES: usize>(
        &mut self,
        start: usize,
        trellis: &Trellis,
        dwell: usize,
        trace: &Trace<LANES>,
        lane: usize,
    ) {
        let n_targets = trellis.targets().len();
        loop {
            match self.back {
                Back::Free { at, t } if t >= start => {
                    let bits = trace.continued[(t - trace.first) * trellis.n_states() + at];
                    if bits >> lane & 1 == 1 {
                        self.path.states[t] = at as u32;
                        self.back = Back::Free {
                            at: at - 1,
                            t: t - 1,
                        };
                    } else {
                        let (target, t) = ((at + 1 - dwell) as u32, t + 1 - dwell);
                        lay_run(&mut self.path.states[t..t + dwell], target);
                        let k = trellis.targets().partition_point(|&other| other < target);
                        self.back = Back::Landed { k, t };
                    }
                }
                Back::Landed { k, t } if t >= start => {
                    let winner = trace.winners[(t - trace.first) * n_targets + k][lane];
                    let at = trellis.sources(k)[usize::from(winner)].0 as usize;
                    self.back = Back::Free { at, t: t - 1 };
                }
                _ => return,
            }
        }
    }

    fn finish(mut self) -> Path {
        if let Back::Free { at, t } = self.back {
            self.path.states[t] = at as u32;
        }
        self.path
    }
}

fn lay_run(states: &mut [u32], target: u32) {
    for (state, shown) in states.iter_mut().zip(target..) {
        *state = shown;
    }
}

#[cfg(test)]
mod tests;
