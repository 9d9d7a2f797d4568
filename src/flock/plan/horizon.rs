//! Plans that look only so far ahead, for films of any length and for live ones (ALGORITHMS.md 6, live and
//! endless).
//!
//! From where a plan has come to, the cheapest way over the next frames is found exactly; what comes after them
//! is told by what each state costs in the long run, F(s) = min over successors of (jump's cost + 0.995 F(s')),
//! the future cost of Schoedl et al. (Video Textures, 2000). The first ten frames of that way are kept, and
//! from there the same again. So memory is that of a horizon, and a film's later frames need not be
//! known. What the cheapest plan of all costs is told beside it by one pass that keeps nothing.

use super::circle::FORBIDDEN;
use super::trellis::Trellis;
use super::viterbi::{Block, FRAMES, Film, Rows};

/// Frames kept of each way found.
const COMMITTED: usize = 10;
/// What lies a frame later counts by so much less.
const DISCOUNT: f64 = 0.995;
/// Rounds in which the future cost settles; what has not by then is told a little too low.
const MOST_ROUNDS: usize = 256;
/// Horizons are doubled up to this where they led into a dead end; then the whole film is planned.
const MOST_FRAMES: usize = 4096;

/// How far plans look, and what they expect beyond.
#[derive(Clone, Debug)]
pub struct Horizon {
    n_frames: usize,
    /// F of every state, turns; `None` where playback ends.
    future: Vec<Option<u32>>,
}

/// Where a plan has come to: the state at the last frame kept, and for how many frames it must go on yet.
#[derive(Clone, Copy, Debug)]
struct Standing {
    state: u32,
    held: usize,
}

/// The costs of some frames of a film in a row.
#[derive(Clone)]
struct Window<'a, R> {
    rows: R,
    /// The film's frame that is the first of these, and how many there are.
    first: usize,
    n_frames: usize,
    from: Option<Standing>,
    /// What lies beyond; nothing at the end of the film.
    future: Option<&'a [Option<u32>]>,
}

impl Horizon {
    /// Plans look `n_frames` ahead, and at least so far that a run after a jump that is kept lies within.
    pub fn new(n_frames: usize, trellis: &Trellis, dwell: usize) -> Horizon {
        Horizon {
            n_frames: n_frames.max(COMMITTED + dwell + 1),
            future: future_costs(trellis, dwell),
        }
    }

    /// The states at every frame. `None` when no path is long enough.
    pub fn path(
        &self,
        film: &Film<'_>,
        rows: &(impl Rows + Clone + Send + Sync),
    ) -> Option<Vec<u32>> {
        let mut n_ahead = self.n_frames;
        while n_ahead < film.n_frames.min(MOST_FRAMES) {
            if let Some(path) = self.step_by_step(film, rows, n_ahead) {
                return Some(path);
            }
            n_ahead *= 2;
        }
        Some(film.cheapest_path(rows)?.states)
    }

    /// The same, `n_ahead` frames at a time; `None` where one of them comes to a dead end.
    fn step_by_step(
        &self,
        film: &Film<'_>,
        rows: &(impl Rows + Clone + Send + Sync),
        n_ahead: usize,
    ) -> Option<Vec<u32>> {
        let mut plan = Vec::new();
        let mut window = Window {
            rows: rows.clone(),
            first: 0,
            n_frames: n_ahead.min(film.n_frames),
            from: None,
            future: Some(&self.future),
        };
        loop {
            let is_last = window.first + window.n_frames == film.n_frames;
            window.future = (!is_last).then_some(&self.future);
            let ahead = Film {
                n_frames: window.n_frames,
                ..*film
            };
            let path = ahead.cheapest_path(&window)?;
            if !window.holds(&path.states) {
                return None;
            }
            let known = usize::from(window.from.is_some());
            let n_kept = if is_last {
                window.n_frames
            } else {
                COMMITTED + known
            };
            plan.extend(&path.states[known..n_kept]);
            if is_last {
                return Some(plan);
            }
            window.from = Some(Standing::after(&plan, film.dwell));
            // The last frame kept is the next window's first.
            window.first += n_kept - 1;
            window.n_frames = (n_ahead + 1).min(film.n_frames - window.first);
        }
    }
}

impl Standing {
    /// The last state of a plan, and for how many frames it must go on after that: a jump may come `dwell` frames
    /// after another. As elsewhere a plan may begin in the middle of a run.
    fn after(plan: &[u32], dwell: usize) -> Standing {
        let steps = plan.windows(2).rev();
        let since = 1 + steps.take_while(|step| step[1] == step[0] + 1).count();
        let is_free = since == plan.len() || since >= dwell;
        Standing {
            state: plan[plan.len() - 1],
            held: if is_free { 0 } else { dwell - since },
        }
    }
}

impl<R> Window<'_, R> {
    /// Whether a way begins as it must, and ends where it can go on.
    fn holds(&self, states: &[u32]) -> bool {
        let begins = self.from.is_none_or(|Standing { state, held }| {
            (0..=held.min(states.len() - 1)).all(|t| states[t] == state + t as u32)
        });
        let last = states[states.len() - 1] as usize;
        begins && self.future.is_none_or(|future| future[last].is_some())
    }
}

impl<R: Rows> Rows for Window<'_, R> {
    fn fill(&mut self, block: &Block, first: usize, out: &mut [[u32; FRAMES]]) {
        let in_film = Block {
            times: block.times.map(|t| self.first + t),
            ..*block
        };
        self.rows.fill(&in_film, first, out);
        for (lane, &t) in block.times.iter().enumerate() {
            // Where it stands, and where it has gone on to: between them there is but one way.
            let only = |from: Standing| match from.held.min(self.n_frames - 1) {
                held if t == 0 || t == held => Some(from.state as usize + t),
                _ => None,
            };
            if let Some(only) = self.from.and_then(only) {
                let others = (first..)
                    .zip(&mut *out)
                    .filter(|s| block.state(s.0) != only);
                others.for_each(|(_, out)| out[lane] += FORBIDDEN);
            }
            if let Some(future) = self.future.filter(|_| t + 1 == self.n_frames) {
                for (station, out) in (first..).zip(&mut *out) {
                    out[lane] += future[block.state(station)].unwrap_or(FORBIDDEN);
                }
            }
        }
    }
}

/// What playback costs from each state on, for ever: the jumps that it cannot do without, each at its price
/// and discounted by when it comes.
fn future_costs(trellis: &Trellis, dwell: usize) -> Vec<Option<u32>> {
    let after_dwell = (0..dwell).fold(1.0, |share, _| share * DISCOUNT);
    let mut future = vec![0.0f64; trellis.n_states()];
    for _ in 0..MOST_ROUNDS {
        let mut next = vec![f64::INFINITY; future.len()];
        for (k, &target) in trellis.targets().iter().enumerate() {
            let landed = target as usize;
            if !trellis.continues(landed, dwell - 1) {
                continue;
            }
            let later = after_dwell * future[landed + dwell - 1];
            for &(source, cost) in trellis.sources(k) {
                let through = f64::from(cost) + later;
                next[source as usize] = next[source as usize].min(through);
            }
        }
        for state in (0..next.len().saturating_sub(1)).rev() {
            if trellis.continues(state, 1) {
                next[state] = next[state].min(DISCOUNT * next[state + 1]);
            }
        }
        let settled = next == future;
        future = next;
        if settled {
            break;
        }
    }
    let most = f64::from(FORBIDDEN / 2);
    let whole = |cost: f64| cost.is_finite().then(|| cost.min(most).round() as u32);
    future.into_iter().map(whole).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Level;
    use crate::flock::plan::viterbi::Shelf;
    use crate::library::{Jump, Playback};
    use crate::random;

    /// 0 to 39, from whose end one jumps back to the start for 7, and from 20 to 2 for 50.
    fn trellis() -> Trellis {
        let jump = |from, to, cost| Jump {
            from,
            to,
            cost,
            mirrored: false,
        };
        let playback = Playback {
            jumps: vec![jump(20, 2, 50), jump(39, 0, 7)],
            component: (0..40).collect(),
        };
        Trellis::new(&playback, false, |d| d as u32)
    }

    fn film<'a>(trellis: &'a Trellis, shelf: &'a Shelf, n_frames: usize) -> Film<'a> {
        Film {
            trellis,
            n_frames,
            dwell: 4,
            cpu: Level::detect(),
            shelf,
        }
    }

    #[test]
    fn what_must_be_jumped_is_dearer_the_sooner_it_comes() {
        let trellis = trellis();
        let future = future_costs(&trellis, 4);
        let of = |frame| future[trellis.state(frame, false).expect("a state") as usize];
        assert!(of(39) > of(10) && of(10) > of(0), "{future:?}");
        // Forty frames for 7: about 7 / (1 - 0.995^40) at the jump.
        assert!((36..=42).contains(&of(39).expect("playback goes on")));
        assert_eq!(future[0], None, "nothing leaves a barrier");
    }

    #[test]
    fn with_costs_that_repeat_a_short_look_ahead_finds_the_cheapest_plan() {
        let (trellis, shelf) = (trellis(), Shelf::default());
        let film = film(&trellis, &shelf, 300);
        // Each state is wanted when its run of forty comes to it.
        let rows = |t: usize, state: usize| u32::from(state != t % 40 + 1) * 100;
        let found = Horizon::new(60, &trellis, 4).path(&film, &rows);
        let exact = film.cheapest_path(&rows).expect("a path");
        assert_eq!(found, Some(exact.states));
    }

    #[test]
    fn a_plan_of_any_horizon_can_be_played_and_a_longer_look_is_no_dearer_in_all() {
        let (trellis, shelf) = (trellis(), Shelf::default());
        let film = film(&trellis, &shelf, 250);
        let mut totals = [0u64; 3];
        for seed in 0..20 {
            let cost = move |t: usize, state: usize| {
                (random::bits(seed, &[t as u64 / 9, state as u64]) % 60) as u32
            };
            let exact = u64::from(film.cheapest_path(&cost).expect("a path").cost);
            for (total, n_frames) in totals.iter_mut().zip([15, 60, 250]) {
                let horizon = Horizon::new(n_frames, &trellis, 4);
                let plan = horizon.path(&film, &cost).expect("a path");
                let mut since = 4;
                let mut paid = u64::from(cost(0, plan[0] as usize));
                for t in 1..plan.len() {
                    paid += u64::from(cost(t, plan[t] as usize));
                    since += 1;
                    if plan[t] == plan[t - 1] + 1 && trellis.shown(plan[t] as usize).is_some() {
                        continue;
                    }
                    let k = trellis
                        .targets()
                        .binary_search(&plan[t])
                        .expect("a jump's target");
                    let jump = trellis
                        .sources(k)
                        .iter()
                        .find(|source| source.0 == plan[t - 1]);
                    paid += u64::from(jump.expect("a jump of the library").1);
                    assert!(
                        since > 4,
                        "seed {seed}: a jump at {t}, {since} after another"
                    );
                    since = 1;
                }
                assert_eq!(plan.len(), 250);
                assert!(paid >= exact, "seed {seed}: {paid} below {exact}");
                *total += paid - exact;
            }
        }
        assert_eq!(totals[2], 0, "the whole film is planned exactly");
        assert!(totals[1] <= totals[0], "{totals:?}");
    }
}
