//! Finds transitions: pairs of similar clips, and the playback graph that they form
//! (docs/explanation/algorithms.md, "Transitions and playback"; Okabe et al., sections 3.2 and 3.3).
//!
//! A frame can be shown if its sprite is present and uncut and its heading is known. A clip is usable if all
//! its frames can be shown. Unmirrored pairs must be at least max(f, 0.5 s) apart: closer pairs are the same
//! moment. Mirrored pairs need no gap, because a clip differs from its own mirror image. Seen head-on it
//! differs little; a flip on the spot is then a useful transition.

mod gate;
mod joinable;
#[cfg(test)]
mod tests;

use crate::analysis::distance::{
    Cancelled, ClipPair, ComparedSprites, Distances, LocalMinima, Marks, Side,
};
use gate::Gate;
use joinable::Joinable;

use crate::analysis::{Error, Params, playback};
use crate::cpu::Level;
use crate::library::{Patch, Playback, Poses, Sprites, Transition};
use crate::progress::Progress;

/// Multiples of the natural step that are tried after `kappa` where the component is too small. Free choice.
const KAPPA_LADDER: [f64; 3] = [2.5, 3.0, 4.0];
/// Factor between further multiples. Free choice.
const KAPPA_GROWTH: f64 = 1.5;
/// Shortest sufficient component, seconds. Free choice.
const LEAST_COMPONENT_S: f64 = 2.0;
/// Smallest sufficient share of the frames that the largest multiple joins. Free choice.
const LEAST_SHARE: f64 = 0.75;
/// Smallest distance between the clips of an unmirrored pair, seconds. Free choice.
const LEAST_GAP_S: f64 = 0.5;

/// The transitions of a footage and the playback they allow.
#[derive(Clone, Debug, PartialEq)]
pub struct Connections {
    /// Clip length f, frames.
    pub clip_frames: usize,
    /// Distance below which (strictly) two clips are similar.
    pub epsilon: u64,
    /// Median of D(i, i+1) over the clips with all sprites present; the lower median for an even number, 0
    /// without clips.
    pub natural_step: u64,
    /// Multiple of the natural step that gave epsilon (rounded up); `None` if epsilon was given.
    pub kappa_used: Option<f64>,
    /// Number of unmirrored pairs i < j with D < epsilon that may be joined, before the selection of
    /// local minima.
    pub n_candidates: u64,
    /// Sorted by (from, to, mirrored).
    pub transitions: Vec<Transition>,
    /// The jumps, and the component in which playback never ends.
    pub playback: Playback,
    /// The runs of frames between jumps.
    pub patches: Vec<Patch>,
    /// Share of the footage's frames in the component, 0..=1.
    pub component_share: f64,
}

/// Compares all clips and joins similar ones.
///
/// A footage without similar moments is not an error: its component is empty. Fails when cancelled or when
/// the temporary storage is full. The result is the same at every instruction level and with any number of
/// threads.
pub fn connect(
    sprites: &Sprites,
    poses: &Poses,
    params: &Params,
    cpu: Level,
    progress: &dyn Progress,
) -> Result<Connections, Error> {
    let pixels = ComparedSprites::new(sprites, poses, params.planes)?;
    connect_compared(&pixels, (sprites, poses), params, cpu, progress)
}

/// Works like [`connect`], on sprites already laid out for comparison.
pub fn connect_compared(
    pixels: &ComparedSprites,
    (sprites, poses): (&Sprites, &Poses),
    params: &Params,
    cpu: Level,
    progress: &dyn Progress,
) -> Result<Connections, Error> {
    let clip_frames = params.clip_frames_at(poses.fps);
    let clips = Clips::new(sprites, poses, clip_frames);
    let clip = params.clip(clip_frames);
    let steps = natural_steps(pixels.steps(cpu), &clips, &clip.weights());
    let mut usable = Marks::none(clips.usable.len());
    usable.mark_where(&clips.usable, |&usable| usable);
    let search = Search {
        distances: Distances {
            pixels,
            clip,
            side: Side::Plain,
            cpu,
        },
        clips: &clips,
        gate: Gate::new(poses, clip_frames, params),
        usable,
        least_gap: clip_frames.max((LEAST_GAP_S * poses.fps).ceil() as usize),
    };
    let at = |rung: Rung| -> Result<Connections, Error> {
        let found = search.run(rung, params.mirror, progress);
        let found = found.map_err(|Cancelled| Error::Cancelled)?;
        Ok(found.connections(rung, &clips, steps.median))
    };
    strictest_enough(&rungs(params, steps), &clips, poses.fps, at)
}

/// Returns the connections of the strictest sufficient epsilon.
///
/// An epsilon is sufficient if its component lasts long enough and holds most of the frames that the widest
/// one joins. A wider epsilon gives more visible jumps, so it must add many playable frames.
fn strictest_enough(
    rungs: &[Rung],
    clips: &Clips,
    fps: f64,
    mut at: impl FnMut(Rung) -> Result<Connections, Error>,
) -> Result<Connections, Error> {
    let least = |n_frames: usize| (LEAST_SHARE * n_frames as f64).max(LEAST_COMPONENT_S * fps);
    let n_played = |playback: &Playback| playback.component.len() as f64;
    let (first, last) = (0, rungs.len() - 1);
    let strictest = at(rungs[first])?;
    let n_shown = clips.shown.iter().filter(|&&shown| shown).count();
    if last == first || n_played(&strictest.playback) >= least(n_shown) {
        return Ok(strictest);
    }
    let widest = at(rungs[last])?;
    // A local minimum at the widest epsilon is also one at every stricter epsilon above its distance.
    let is_enough = |rung: &Rung| {
        let nearer = widest
            .transitions
            .iter()
            .copied()
            .filter(|t| t.distance < rung.epsilon);
        let playback = clips.playback(&nearer.collect::<Vec<_>>());
        n_played(&playback) >= least(widest.playback.component.len())
    };
    match rungs.iter().position(is_enough) {
        Some(rung_idx) if rung_idx == first => Ok(strictest),
        Some(rung_idx) if rung_idx < last => at(rungs[rung_idx]),
        _ => Ok(widest),
    }
}

/// The frames that can be shown and the clips that can be used.
struct Clips {
    clip_frames: usize,
    shown: Vec<bool>,
    usable: Vec<bool>,
    all_present: Vec<bool>,
}

impl Clips {
    fn new(sprites: &Sprites, poses: &Poses, clip_frames: usize) -> Clips {
        let present: Vec<bool> = (0..sprites.n_frames())
            .map(|frame_idx| sprites.is_present(frame_idx))
            .collect();
        let shown: Vec<bool> = present
            .iter()
            .zip(&poses.frames)
            .map(|(&present, pose)| present && !pose.cut && pose.heading_rad.is_some())
            .collect();
        let whole = |frames: &[bool]| -> Vec<bool> {
            frames
                .windows(clip_frames)
                .map(|clip| clip.iter().all(|&frame| frame))
                .collect()
        };
        Clips {
            clip_frames,
            usable: whole(&shown),
            all_present: whole(&present),
            shown,
        }
    }

    fn playback(&self, transitions: &[Transition]) -> Playback {
        playback::playback(transitions, &self.shown, self.clip_frames)
    }
}

/// Change of the animal from one frame to the next: percentiles of D(i, i+1).
#[derive(Clone, Copy)]
struct NaturalSteps {
    median: u64,
    p99: u64,
}

fn natural_steps(steps: Vec<u64>, clips: &Clips, weights: &[u64]) -> NaturalSteps {
    let mut of_clips: Vec<u64> = steps
        .windows(clips.clip_frames)
        .zip(clips.all_present.windows(2))
        .filter(|(_, present)| present[0] && present[1])
        .map(|(steps, _)| steps.iter().zip(weights).map(|(d, w)| d * w).sum())
        .collect();
    of_clips.sort_unstable();
    let at = |percent: usize| {
        let rank = of_clips.len().saturating_sub(1) * percent / 100;
        of_clips.get(rank).copied().unwrap_or(0)
    };
    NaturalSteps {
        median: at(50),
        p99: at(99),
    }
}

/// A candidate for epsilon, with the kappa that gave it.
#[derive(Clone, Copy)]
struct Rung {
    kappa: Option<f64>,
    epsilon: u64,
}

/// Returns the candidates for epsilon, the strictest first.
///
/// An animal that rests most of the time has a natural step near 0. The candidates then grow up to the 99th
/// percentile of its steps, the change while it moves.
fn rungs(params: &Params, steps: NaturalSteps) -> Vec<Rung> {
    if let Some(epsilon) = params.epsilon {
        return vec![Rung {
            kappa: None,
            epsilon,
        }];
    }
    let liveliest = steps.p99 as f64 / steps.median.max(1) as f64;
    let highest = KAPPA_LADDER[KAPPA_LADDER.len() - 1].max(params.kappa);
    let growing = std::iter::successors(Some(highest), |kappa| Some(KAPPA_GROWTH * kappa)).skip(1);
    std::iter::once(params.kappa)
        .chain(KAPPA_LADDER.into_iter().filter(|&k| k > params.kappa))
        .chain(growing.take_while(|&kappa| kappa < liveliest))
        .chain((liveliest > highest).then_some(liveliest))
        .map(|kappa| Rung {
            kappa: Some(kappa),
            // D is an integer, so D < x is equivalent to D < ceil(x).
            epsilon: (kappa * steps.median as f64).ceil() as u64,
        })
        .collect()
}

/// The criteria that decide which pairs become transitions.
struct Search<'a> {
    distances: Distances<'a>,
    clips: &'a Clips,
    gate: Gate,
    /// The clips that can be used.
    usable: Marks,
    least_gap: usize,
}

/// The result of a search below one epsilon.
#[derive(Default)]
struct Found {
    transitions: Vec<Transition>,
    /// Number of pairs before the selection of local minima.
    n_candidates: u64,
}

impl Search<'_> {
    fn run(&self, rung: Rung, mirror: bool, progress: &dyn Progress) -> Result<Found, Cancelled> {
        let mut found = Found::default();
        self.one_side(Side::Plain, rung.epsilon, progress, &mut found)?;
        if mirror {
            self.one_side(Side::Mirrored, rung.epsilon, progress, &mut found)?;
        }
        let key = |t: &Transition| (t.from, t.to, t.mirrored);
        found.transitions.sort_unstable_by_key(key);
        Ok(found)
    }

    fn one_side(
        &self,
        side: Side,
        epsilon: u64,
        progress: &dyn Progress,
        found: &mut Found,
    ) -> Result<(), Cancelled> {
        let asked = self.joinable(side);
        let least_gap = asked.least_gap;
        let mut minima = LocalMinima::new(&self.clips.usable, least_gap, epsilon);
        let distances = Distances {
            side,
            ..self.distances
        };
        distances.for_each_row_below(epsilon, &asked, progress, |i, pairs| {
            found.count(i, pairs, &asked);
            let transitions = &mut found.transitions;
            minima.push(pairs, |pair| {
                transitions.extend(self.transition(pair, &asked))
            });
        })?;
        let transitions = &mut found.transitions;
        minima.finish(|pair| transitions.extend(self.transition(pair, &asked)));
        Ok(())
    }

    fn joinable(&self, side: Side) -> Joinable<'_> {
        let least_gap = match side {
            Side::Plain => self.least_gap,
            Side::Mirrored => 0,
        };
        Joinable {
            search: self,
            side,
            least_gap,
        }
    }

    /// Returns the transition of a local minimum, or `None` if the pair may not be joined.
    fn transition(&self, pair: ClipPair, asked: &Joinable<'_>) -> Option<Transition> {
        let mirrored = asked.side == Side::Mirrored;
        let heading_gap_rad = self.gate.pass(pair.from, pair.to, mirrored)?;
        Some(Transition {
            from: pair.from as u32,
            to: pair.to as u32,
            mirrored,
            distance: pair.distance,
            heading_gap_rad,
        })
    }
}

impl Found {
    /// Counts the similar pairs of a clip that may be joined.
    fn count(&mut self, i: usize, pairs: &[ClipPair], asked: &Joinable<'_>) {
        let later = pairs
            .iter()
            .map(|pair| pair.to)
            .filter(|j| j - i >= asked.least_gap);
        if asked.side == Side::Plain {
            self.n_candidates += later.filter(|&j| asked.holds(i, j)).count() as u64;
        }
    }

    /// Builds the playback graph of the transitions.
    fn connections(self, rung: Rung, clips: &Clips, natural_step: u64) -> Connections {
        let playback = clips.playback(&self.transitions);
        let n_frames = clips.shown.len();
        Connections {
            clip_frames: clips.clip_frames,
            epsilon: rung.epsilon,
            natural_step,
            kappa_used: rung.kappa,
            n_candidates: self.n_candidates,
            component_share: playback.component.len() as f64 / n_frames.max(1) as f64,
            patches: playback::patches(&playback),
            transitions: self.transitions,
            playback,
        }
    }
}
