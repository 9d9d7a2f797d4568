//! Finds transitions: pairs of similar clips, and the playback graph that they form
//! (docs/explanation/algorithms.md, "Transitions and playback"; Okabe et al., sections 3.2 and 3.3).
//!
//! A frame can be shown if its sprite is present and uncut and its heading is known. A clip is usable if all
//! its frames can be shown. Unmirrored pairs must be at least max(f, 0.5 s) apart: closer pairs are the same
//! moment. Mirrored pairs need no gap, because a clip differs from its own mirror image. Seen head-on it
//! differs little; a flip on the spot is then a useful transition.

mod gate;
#[cfg(test)]
mod tests;

use gate::Gate;

use crate::analysis::similarity::distance::{
    Cancelled, ClipPair, ComparedSprites, Distances, LocalMinima, Marks, PairFilter, Side,
};
use crate::analysis::similarity::playback;
use crate::analysis::{Error, Params};
use crate::cpu::Level;
use crate::library::{Patch, Playback, Poses, Sprites, Transition};
use crate::progress::Progress;

/// Multiples of the natural step that are tried after `kappa` where the component is too small. Free choice.
const WIDER_KAPPAS: [f64; 3] = [2.5, 3.0, 4.0];
/// Factor between further multiples. Free choice.
const KAPPA_GROWTH: f64 = 1.5;
/// Shortest sufficient component, seconds. Free choice.
const MIN_COMPONENT_S: f64 = 2.0;
/// Smallest sufficient share of the frames that the largest multiple joins. Free choice.
const MIN_SHARE: f64 = 0.75;
/// Smallest distance between the clips of an unmirrored pair, seconds. Free choice.
const MIN_GAP_S: f64 = 0.5;

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
    connect_compared(&pixels, sprites, poses, params, cpu, progress)
}

/// Works like [`connect`], on sprites already laid out for comparison.
pub fn connect_compared(
    pixels: &ComparedSprites,
    sprites: &Sprites,
    poses: &Poses,
    params: &Params,
    cpu: Level,
    progress: &dyn Progress,
) -> Result<Connections, Error> {
    let clip_frames = params.clip_frames_at(poses.fps);
    let clips = Clips::new(sprites, poses, clip_frames);
    let clip = params.clip(clip_frames);
    let steps = natural_steps(&pixels.steps(cpu), &clips, &clip.weights());
    let gate = Gate::new(poses, clip_frames, params);
    let min_gap = clip_frames.max((MIN_GAP_S * poses.fps).ceil() as usize);
    let search_of = |side: Side, min_gap: usize| Search {
        distances: Distances {
            pixels,
            clip,
            side,
            cpu,
        },
        clips: &clips,
        gate: &gate,
        min_gap,
    };
    let mut searches = vec![search_of(Side::Plain, min_gap)];
    if params.mirror {
        searches.push(search_of(Side::Mirrored, 0));
    }
    let connections_below = |threshold: Threshold| -> Result<Connections, Error> {
        let mut found = Found::default();
        for search in &searches {
            let result = search.run(threshold.epsilon, progress, &mut found);
            result.map_err(|Cancelled| Error::Cancelled)?;
        }
        Ok(found.connections(threshold, &clips, steps.median))
    };
    strictest_sufficient(
        &thresholds(params, steps),
        &clips,
        poses.fps,
        connections_below,
    )
}

/// Returns the connections of the strictest sufficient threshold.
///
/// A threshold is sufficient if its component lasts long enough and holds most of the frames that the widest
/// one joins. A wider threshold gives more visible jumps, so it must add many playable frames.
fn strictest_sufficient(
    thresholds: &[Threshold],
    clips: &Clips,
    fps: f64,
    connections_below: impl Fn(Threshold) -> Result<Connections, Error>,
) -> Result<Connections, Error> {
    let min_played = |n_frames: usize| (MIN_SHARE * n_frames as f64).max(MIN_COMPONENT_S * fps);
    let n_played = |playback: &Playback| playback.component.len() as f64;
    let last = thresholds.len() - 1;
    let strictest = connections_below(thresholds[0])?;
    let n_shown = clips.shown.iter().filter(|&&shown| shown).count();
    if last == 0 || n_played(&strictest.playback) >= min_played(n_shown) {
        return Ok(strictest);
    }
    let widest = connections_below(thresholds[last])?;
    // A local minimum at the widest epsilon is also one at every stricter epsilon above its distance.
    let is_sufficient = |threshold: &Threshold| {
        let mut nearer = widest.transitions.clone();
        nearer.retain(|t| t.distance < threshold.epsilon);
        n_played(&clips.playback(&nearer)) >= min_played(widest.playback.component.len())
    };
    match thresholds.iter().position(is_sufficient) {
        Some(0) => Ok(strictest),
        Some(k) if k < last => connections_below(thresholds[k]),
        _ => Ok(widest),
    }
}

/// The frames that can be shown and the clips that can be used.
struct Clips {
    clip_frames: usize,
    shown: Vec<bool>,
    usable: Vec<bool>,
    /// Marks of the usable clips.
    usable_marks: Marks,
    all_present: Vec<bool>,
}

impl Clips {
    fn new(sprites: &Sprites, poses: &Poses, clip_frames: usize) -> Clips {
        let present: Vec<bool> = (0..sprites.n_frames())
            .map(|frame_idx| sprites.is_present(frame_idx))
            .collect();
        let shown: Vec<bool> = (present.iter().zip(&poses.frames))
            .map(|(&present, pose)| present && !pose.cut && pose.heading_rad.is_some())
            .collect();
        let whole = |frames: &[bool]| -> Vec<bool> {
            let clips = frames.windows(clip_frames);
            clips.map(|clip| clip.iter().all(|&frame| frame)).collect()
        };
        let usable = whole(&shown);
        let mut usable_marks = Marks::none(usable.len());
        usable_marks.mark_where(&usable, |&usable| usable);
        Clips {
            clip_frames,
            usable,
            usable_marks,
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

fn natural_steps(steps: &[u64], clips: &Clips, weights: &[u64]) -> NaturalSteps {
    let mut clip_steps: Vec<u64> = steps
        .windows(clips.clip_frames)
        .zip(clips.all_present.windows(2))
        .filter(|(_, present)| present[0] && present[1])
        .map(|(steps, _)| steps.iter().zip(weights).map(|(d, w)| d * w).sum())
        .collect();
    clip_steps.sort_unstable();
    let at = |percent: usize| {
        let rank = clip_steps.len().saturating_sub(1) * percent / 100;
        clip_steps.get(rank).copied().unwrap_or(0)
    };
    NaturalSteps {
        median: at(50),
        p99: at(99),
    }
}

/// A candidate for epsilon, with the kappa that gave it.
#[derive(Clone, Copy)]
struct Threshold {
    kappa: Option<f64>,
    epsilon: u64,
}

/// Returns the candidates for epsilon, the strictest first.
///
/// An animal that rests most of the time has a natural step near 0. The candidates then grow up to the 99th
/// percentile of its steps, the change while it moves.
fn thresholds(params: &Params, steps: NaturalSteps) -> Vec<Threshold> {
    if let Some(epsilon) = params.epsilon {
        return vec![Threshold {
            kappa: None,
            epsilon,
        }];
    }
    let p99_kappa = steps.p99 as f64 / steps.median.max(1) as f64;
    let widest = WIDER_KAPPAS[WIDER_KAPPAS.len() - 1].max(params.kappa);
    let growing = std::iter::successors(Some(widest), |kappa| Some(KAPPA_GROWTH * kappa)).skip(1);
    std::iter::once(params.kappa)
        .chain(WIDER_KAPPAS.into_iter().filter(|&k| k > params.kappa))
        .chain(growing.take_while(|&kappa| kappa < p99_kappa))
        .chain((p99_kappa > widest).then_some(p99_kappa))
        .map(|kappa| Threshold {
            kappa: Some(kappa),
            // D is an integer, so D < x is equivalent to D < ceil(x).
            epsilon: (kappa * steps.median as f64).ceil() as u64,
        })
        .collect()
}

/// The search for transitions among the plain or the mirrored pairs.
struct Search<'a> {
    distances: Distances<'a>,
    clips: &'a Clips,
    gate: &'a Gate,
    /// Smallest distance between the clips of a pair, clips.
    min_gap: usize,
}

/// The result of the searches below one epsilon.
#[derive(Default)]
struct Found {
    transitions: Vec<Transition>,
    /// Number of unmirrored pairs before the selection of local minima.
    n_candidates: u64,
}

impl Search<'_> {
    /// Adds the transitions below an epsilon.
    fn run(
        &self,
        epsilon: u64,
        progress: &dyn Progress,
        found: &mut Found,
    ) -> Result<(), Cancelled> {
        let mut minima = LocalMinima::new(&self.clips.usable, self.min_gap, epsilon);
        let on_row = |_: usize, pairs: &[ClipPair]| {
            if !self.is_mirrored() {
                let joinable = pairs.iter().filter(|pair| self.may_join(pair));
                found.n_candidates += joinable.count() as u64;
            }
            let transitions = &mut found.transitions;
            minima.push(pairs, |pair| transitions.extend(self.transition(pair)));
        };
        (self.distances).for_each_row_below(epsilon, self, progress, on_row)?;
        minima.finish(|pair| found.transitions.extend(self.transition(pair)));
        Ok(())
    }

    fn is_mirrored(&self) -> bool {
        self.distances.side == Side::Mirrored
    }

    /// Returns whether the clips of a pair may be joined, whatever their distance.
    fn may_join(&self, pair: &ClipPair) -> bool {
        let usable = &self.clips.usable;
        pair.to - pair.from >= self.min_gap
            && usable[pair.from]
            && usable[pair.to]
            && self.transition(*pair).is_some()
    }

    /// Returns the transition of a pair of usable clips, or `None` if the pair does not pass the gate.
    fn transition(&self, pair: ClipPair) -> Option<Transition> {
        let mirrored = self.is_mirrored();
        let heading_gap_rad = self.gate.passing_gap_rad(pair.from, pair.to, mirrored)?;
        Some(Transition {
            from: pair.from as u32,
            to: pair.to as u32,
            mirrored,
            distance: pair.distance,
            heading_gap_rad,
        })
    }
}

impl PairFilter for Search<'_> {
    fn mark(&self, i: usize, row: &mut Marks) {
        if self.clips.usable[i] {
            self.gate.mark_passing(i, self.is_mirrored(), row);
            row.unmark_first(self.min_gap);
            row.intersect(&self.clips.usable_marks, i);
        }
    }
}

impl Found {
    /// Builds the playback graph of the transitions.
    fn connections(
        mut self,
        threshold: Threshold,
        clips: &Clips,
        natural_step: u64,
    ) -> Connections {
        self.transitions
            .sort_unstable_by_key(|t| (t.from, t.to, t.mirrored));
        let playback = clips.playback(&self.transitions);
        let n_frames = clips.shown.len();
        Connections {
            clip_frames: clips.clip_frames,
            epsilon: threshold.epsilon,
            natural_step,
            kappa_used: threshold.kappa,
            n_candidates: self.n_candidates,
            component_share: playback.component.len() as f64 / n_frames.max(1) as f64,
            patches: playback::patches(&playback),
            transitions: self.transitions,
            playback,
        }
    }
}
