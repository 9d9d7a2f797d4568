//! Which moments look alike: from the distances between clips to transitions and the playback
//! graph (ALGORITHMS.md 5; O 3.2 and 3.3).
//!
//! A frame can be shown when its sprite is present and uncut and its heading known; a clip can be
//! used when all its frames can be shown. Plain pairs must be max(f, 0.5 s) apart: nearer ones are
//! the same moment. Mirrored pairs need no such gap, because a clip is not its own mirror image:
//! where it nearly is, seen head-on, turning over on the spot is just what is wanted.

mod gate;
mod joinable;
#[cfg(test)]
mod tests;

use crate::analysis::distance::{
    Cancelled, ClipPair, ComparedSprites, Distances, Lists, LocalMinima, Marks, Side,
};
use gate::Gate;
use joinable::{Approximate, Joinable};

use crate::analysis::{Error, Params, playback};
use crate::cpu::Level;
use crate::library::{Patch, Playback, Poses, Sprites, Transition};
use crate::progress::Progress;

/// Larger multiples of the natural step, tried where the component holds too little.
const KAPPA_LADDER: [f64; 3] = [2.5, 3.0, 4.0];
/// Beyond them each multiple is so many times the one before.
const KAPPA_GROWTH: f64 = 1.5;
/// A component that lasts shorter than this is too little.
const LEAST_COMPONENT_S: f64 = 2.0;
/// So is one that holds less than this share of the frames that the largest multiple joins.
const LEAST_SHARE: f64 = 0.75;
/// Plain pairs of clips are at least this far apart.
const LEAST_GAP_S: f64 = 0.5;

/// What the distances say about a footage.
#[derive(Clone, Debug, PartialEq)]
pub struct Connections {
    /// f.
    pub clip_frames: usize,
    /// Clips nearer than this (strictly) are alike.
    pub epsilon: u64,
    /// The median of D(i, i+1) over clips whose sprites are all present, of an even number the
    /// lower one; 0 when there are none.
    pub natural_step: u64,
    /// The multiple of the natural step that epsilon is, rounded up; `None` when epsilon was given.
    pub kappa_used: Option<f64>,
    /// Pairs i < j of clips that may be joined and have D < epsilon, before only the nearest around are kept.
    pub n_candidates: u64,
    /// Share of such pairs that a search by lists finds, measured on the pairs of 256 clips, 0..=1; `None` where
    /// every pair was looked at.
    pub recall: Option<f64>,
    /// By (from, to, mirrored).
    pub transitions: Vec<Transition>,
    /// What may follow what.
    pub playback: Playback,
    /// The runs of sprites between jumps.
    pub patches: Vec<Patch>,
    /// Share of the footage's frames that lie in the component, 0..=1.
    pub component_share: f64,
}

/// Compares all clips and joins those alike.
///
/// A footage without any two moments alike is no error: its component is empty. Fails only when
/// cancelled. The result is the same at every level and with any number of threads.
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

/// As [`connect`], of sprites that are laid out for comparison already.
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
        approximate: params.approximate.then(|| {
            let lists = Lists::of(pixels, clip, params.mirror, cpu);
            Approximate::new(lists, clips.usable.len())
        }),
        least_gap: clip_frames.max((LEAST_GAP_S * poses.fps).ceil() as usize),
    };
    let at = |rung: Rung| -> Result<Connections, Error> {
        let found = search.run(rung, params.mirror, progress);
        let found = found.map_err(|Cancelled| Error::Cancelled)?;
        Ok(found.connections(rung, &clips, steps.median, params.approximate))
    };
    strictest_enough(&rungs(params, steps), &clips, poses.fps, at)
}

/// What the strictest epsilon joins whose component lasts long enough and holds most of what the widest joins: a
/// wider one costs jumps that are seen more, and is worth it only where much more can be played.
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
    // What is nearest around at the widest epsilon is so at every stricter one.
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

/// Which frames and clips can be used.
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

/// How much the animal changes from one frame to the next.
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

/// An epsilon to try, and the kappa that it comes from.
#[derive(Clone, Copy)]
struct Rung {
    kappa: Option<f64>,
    epsilon: u64,
}

/// The epsilons to try, the strictest first. An animal that rests most of the time has a natural step
/// of nearly nothing: for it they grow up to the 99th percentile of its steps, what it changes by
/// when it moves.
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
            // D is whole: D < kappa * step is D < the next whole number.
            epsilon: (kappa * steps.median as f64).ceil() as u64,
        })
        .collect()
}

/// All that decides which pairs become transitions.
struct Search<'a> {
    distances: Distances<'a>,
    clips: &'a Clips,
    gate: Gate,
    /// The clips that can be used.
    usable: Marks,
    least_gap: usize,
    approximate: Option<Approximate>,
}

/// What a search found below an epsilon.
#[derive(Default)]
struct Found {
    transitions: Vec<Transition>,
    /// Raw pairs.
    n_candidates: u64,
    /// Of the clips that an approximate search samples: pairs that are alike, and those of them that it compares.
    n_alike: u64,
    n_compared: u64,
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

    /// A local minimum, if it may be joined. Around a pair that is compared so is all that it competes with; what was
    /// looked at for that alone is none.
    fn transition(&self, pair: ClipPair, asked: &Joinable<'_>) -> Option<Transition> {
        let mirrored = asked.side == Side::Mirrored;
        let heading_gap_rad = self.gate.pass(pair.from, pair.to, mirrored)?;
        if !asked.is_compared(pair.from, pair.to) {
            return None;
        }
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
    /// Counts the pairs of a clip that are alike and may be joined.
    fn count(&mut self, i: usize, pairs: &[ClipPair], asked: &Joinable<'_>) {
        let later = pairs
            .iter()
            .map(|pair| pair.to)
            .filter(|j| j - i >= asked.least_gap);
        let joinable: Vec<usize> = later.filter(|&j| asked.holds(i, j)).collect();
        let n_compared = joinable
            .iter()
            .filter(|&&j| asked.is_compared(i, j))
            .count() as u64;
        if asked.side == Side::Plain {
            self.n_candidates += n_compared;
        }
        if let Some(approximate) = &asked.search.approximate
            && approximate.sampled[i]
        {
            self.n_alike += joinable.len() as u64;
            self.n_compared += n_compared;
        }
    }

    /// What these transitions make of the footage.
    fn connections(
        self,
        rung: Rung,
        clips: &Clips,
        natural_step: u64,
        is_approximate: bool,
    ) -> Connections {
        let playback = clips.playback(&self.transitions);
        let n_frames = clips.shown.len();
        Connections {
            clip_frames: clips.clip_frames,
            epsilon: rung.epsilon,
            natural_step,
            kappa_used: rung.kappa,
            n_candidates: self.n_candidates,
            recall: is_approximate.then(|| match self.n_alike {
                0 => 1.0,
                n_alike => self.n_compared as f64 / n_alike as f64,
            }),
            component_share: playback.component.len() as f64 / n_frames.max(1) as f64,
            patches: playback::patches(&playback),
            transitions: self.transitions,
            playback,
        }
    }
}
