//! The recursion itself, one frame at a time (ALGORITHMS.md 6).
//!
//! What continues stays in its place: state `s` lies at `s + origin`, and the origin goes one place a
//! frame, so a frame adds each state's cost to one sum along the diagonal. V is kept as that sum and a
//! lead over it, which a landing lowers at once; who may jump is told by the leads of `dwell - 1` frames
//! ago, which know nothing of later landings. The same portable code is compiled once plainly and once
//! for AVX2; results are the same integers.

use super::landing;
use super::walk::{Frame, Trace};
use super::{Film, Rows, UNREACHED};
#[cfg(target_arch = "x86_64")]
use crate::cpu::Level;
use crate::flock::plan::landings::{GROUP, Way};

/// The lead of a state that no path leads to. Sums stay below 2^31, so V fits 32 bits.
const NO_LEAD: i32 = UNREACHED as i32;
/// States whose costs are filled in at a time, so that they stay in the nearest cache.
const BLOCK: usize = 64;
/// Frames that the origin can go before all is moved back.
const ROOM: usize = 256;

/// The state of the recursion after one frame.
#[derive(Clone)]
pub(super) struct Column<const LANES: usize> {
    way: Way,
    dwell: usize,
    /// Frames gone since the first.
    age: usize,
    /// The place of state 0.
    origin: usize,
    /// `[age mod slots]`, by place: V less the sum, of the last `dwell` frames and at least two.
    leads: Vec<Vec<[i32; LANES]>>,
    /// Costs of continuing since the film began, by place.
    sums: Vec<[u32; LANES]>,
    /// V of each state that may jump, by state.
    values: Vec<[u32; LANES]>,
    /// V of each state just landed on, without its own cost, by state.
    landed: Vec<[u32; LANES]>,
    /// Costs of a block of states.
    row: [[u32; LANES]; BLOCK],
    /// States too soon in their runs to jump, by how soon: (states gone through, state).
    soon: Vec<(u32, u32)>,
}

impl<const LANES: usize> Column<LANES> {
    pub(super) fn start(film: &Film<'_>, way: Way, rows: &mut impl Rows<LANES>) -> Column<LANES> {
        let (n_states, dwell) = (film.trellis.n_states(), film.dwell);
        let gone = film.trellis.gone_through(way).iter().copied();
        let mut soon: Vec<(u32, u32)> = gone.zip(0..).filter(|s| (s.0 as usize) < dwell).collect();
        soon.sort_unstable();
        let mut column = Column {
            way,
            dwell,
            age: 0,
            origin: if way == Way::Ahead { ROOM } else { 0 },
            leads: vec![vec![[0; LANES]; n_states + ROOM]; dwell.max(2)],
            sums: vec![[0; LANES]; n_states + ROOM],
            values: vec![[UNREACHED; LANES]; n_states],
            landed: vec![[UNREACHED; LANES]; n_states],
            row: [[0; LANES]; BLOCK],
            soon,
        };
        column.close_barriers();
        column.pay(film.time(way, 0), rows);
        column
    }

    /// Goes on by a frame.
    pub(super) fn advance<R: Rows<LANES>>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        trace: &mut Trace<'_, LANES>,
    ) {
        self.advance_on::<R, true>(film, rows, trace.next_frame());
    }

    /// Goes on by a frame and keeps no way back.
    pub(super) fn advance_untraced<R: Rows<LANES>>(&mut self, film: &Film<'_>, rows: &mut R) {
        self.advance_on::<R, false>(film, rows, (&mut [], &mut []));
    }

    fn advance_on<R: Rows<LANES>, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        trace: Frame<'_, LANES>,
    ) {
        match film.cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                // SAFETY: the line above made sure of AVX2, which is all that the callee asks for.
                unsafe {
                    self.advance_avx2::<R, TRACED>(film, rows, trace);
                }
            }
            _ => self.advance_with::<R, false, TRACED>(film, rows, trace),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_avx2<R: Rows<LANES>, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        trace: Frame<'_, LANES>,
    ) {
        self.advance_with::<R, true, TRACED>(film, rows, trace);
    }

    #[inline(always)]
    fn advance_with<R: Rows<LANES>, const AVX2: bool, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        rows: &mut R,
        (ranks, wins): Frame<'_, LANES>,
    ) {
        self.land::<AVX2, TRACED>(film, ranks);
        self.slide();
        self.settle::<TRACED>(wins);
        self.close_barriers();
        self.pay(film.time(self.way, self.age), rows);
    }

    /// The cheapest jump to each state that jumps lead to.
    #[inline(always)]
    fn land<const AVX2: bool, const TRACED: bool>(
        &mut self,
        film: &Film<'_>,
        ranks: &mut [[u16; LANES]],
    ) {
        let landings = film.trellis.landings(self.way);
        let (values, n_states) = (&self.values[..], landings.n_states());
        assert_eq!(values.len(), n_states, "one trellis all along");
        let (mut ranks, mut nowhere) = (
            ranks.as_chunks_mut::<GROUP>().0.iter_mut(),
            [[0; LANES]; GROUP],
        );
        for (states, jumps) in landings.groups() {
            let ranks = match ranks.next() {
                Some(ranks) if TRACED => ranks,
                _ => &mut nowhere,
            };
            #[cfg(target_arch = "x86_64")]
            if AVX2 && LANES == 1 {
                let ranks = ranks.as_flattened_mut().try_into();
                let ranks = ranks.expect("one rank for each state");
                #[expect(unsafe_code, reason = "a kernel of AVX2 that looks at no bounds")]
                // SAFETY: landings name states below `n_states`, all of which have values; and who
                // says AVX2 has made sure of it.
                let landed = unsafe { landing::alone_avx2(jumps, values.as_flattened(), ranks) };
                for (&state, landed) in states.iter().zip(landed) {
                    self.landed[state as usize] = [landed; LANES];
                }
                continue;
            }
            #[expect(unsafe_code, reason = "a kernel that looks at no bounds")]
            // SAFETY: landings name states below `n_states`, all of which have values.
            let landed = unsafe { landing::lanes::<LANES, TRACED>(jumps, values, ranks) };
            for (&state, landed) in states.iter().zip(landed) {
                self.landed[state as usize] = landed;
            }
        }
    }

    /// Moves the origin by a place.
    fn slide(&mut self) {
        let n_states = self.values.len();
        let (end, other) = match self.way {
            Way::Ahead => (0, ROOM),
            Way::Back => (ROOM, 0),
        };
        if self.origin == end {
            let window = end..end + n_states;
            self.sums.copy_within(window.clone(), other);
            for leads in &mut self.leads {
                leads.copy_within(window.clone(), other);
            }
            self.origin = other;
        }
        let coming = match self.way {
            Way::Ahead => self.origin - 1,
            Way::Back => self.origin + n_states,
        };
        self.origin = match self.way {
            Way::Ahead => self.origin - 1,
            Way::Back => self.origin + 1,
        };
        self.sums[coming] = [0; LANES];
        let slot = self.slot(0);
        self.leads[slot][coming] = [NO_LEAD; LANES];
        self.age += 1;
    }

    /// Every state from the one before it, or from a landing where that is cheaper.
    #[inline(always)]
    fn settle<const TRACED: bool>(&mut self, wins: &mut [[u8; LANES]]) {
        let window = self.window();
        let slot = self.slot(0);
        let mut leads = std::mem::take(&mut self.leads[slot]);
        let before = self.leads[self.slot(1)][window.clone()].as_flattened();
        let sums = self.sums[window.clone()].as_flattened();
        let now = leads[window].as_flattened_mut().iter_mut();
        let offers = self.landed.as_flattened().iter().zip(sums);
        let places = now.zip(before).zip(offers);
        if TRACED {
            let wins = wins.as_flattened_mut().iter_mut();
            for (((now, &before), (&landed, &sum)), win) in places.zip(wins) {
                let lead = landed as i32 - sum as i32;
                *win = u8::from(lead < before);
                *now = lead.min(before);
            }
        } else {
            for ((now, &before), (&landed, &sum)) in places {
                *now = (landed as i32 - sum as i32).min(before);
            }
        }
        self.leads[slot] = leads;
    }

    fn close_barriers(&mut self) {
        let slot = self.slot(0);
        for &(gone, state) in &self.soon {
            if gone > 0 {
                break;
            }
            self.leads[slot][self.origin + state as usize] = [NO_LEAD; LANES];
        }
    }

    /// Adds what each state costs; then V of those that may jump.
    #[inline(always)]
    fn pay<R: Rows<LANES>>(&mut self, t: usize, rows: &mut R) {
        let window = self.window();
        let held = (self.dwell - 1).min(self.age);
        let leads = &self.leads[self.slot(held)][window.clone()];
        let blocks = self.sums[window].chunks_mut(BLOCK);
        let blocks = blocks
            .zip(leads.chunks(BLOCK))
            .zip(self.values.chunks_mut(BLOCK));
        for (first, ((sums, leads), values)) in (0..).step_by(BLOCK).zip(blocks) {
            let row = &mut self.row[..sums.len()];
            rows.fill(t, first, row);
            let sums = sums.as_flattened_mut().iter_mut().zip(row.as_flattened());
            let values = values.as_flattened_mut().iter_mut();
            for (((sum, &cost), &lead), value) in sums.zip(leads.as_flattened()).zip(values) {
                *sum += cost;
                *value = (lead as u32).wrapping_add(*sum);
            }
        }
        for &(gone, state) in &self.soon {
            if gone as usize > held {
                break;
            }
            self.values[state as usize] = [UNREACHED; LANES];
        }
    }

    fn window(&self) -> std::ops::Range<usize> {
        self.origin..self.origin + self.values.len()
    }

    /// Where the leads of so many frames ago are.
    fn slot(&self, ago: usize) -> usize {
        // No more is asked for than there are slots, which may be one more than frames gone.
        (self.age + self.leads.len() - ago) % self.leads.len()
    }

    /// V of every state that may jump, by state.
    pub(super) fn values(&self) -> &[[u32; LANES]] {
        &self.values
    }

    /// The least V of each state over paths whose last landing was at least `since - 1` frames ago, for
    /// one individual: `UNREACHED` or more where there is none. 1 <= since <= max(dwell, 2).
    pub(super) fn landed_since(
        &self,
        film: &Film<'_>,
        since: usize,
        lane: usize,
    ) -> impl Iterator<Item = u32> {
        let ago = (since - 1).min(self.age);
        let leads = &self.leads[self.slot(ago)][self.window()];
        let gone = film.trellis.gone_through(self.way).iter();
        let places = leads.iter().zip(&self.sums[self.window()]);
        places.zip(gone).map(move |((lead, sum), &gone)| {
            let cost = (lead[lane] as u32).wrapping_add(sum[lane]);
            if gone as usize > ago {
                cost.min(UNREACHED)
            } else {
                UNREACHED
            }
        })
    }
}
