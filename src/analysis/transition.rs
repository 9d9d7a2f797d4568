//! Which moments look alike: from the distances between clips to transitions and the playback
//! graph (ALGORITHMS.md 5; O 3.2 and 3.3).
//!
//! A frame can be shown when its sprite is present and uncut and its heading known; a clip can be
//! used when all its frames can be shown. Plain pairs must be max(f, 0.5 s) apart: nearer ones are
//! the same moment. Mirrored pairs need no such gap, because a clip is not its own mirror image:
//! where it nearly is, seen head-on, turning over on the spot is just what is wanted.

use crate::analysis::distance::{
    Cancelled, ClipPair, ComparedSprites, Distances, LocalMinima, Side,
};
use crate::analysis::gate::Gate;
use crate::analysis::{Error, Params, playback};
use crate::cpu::Level;
use crate::library::{Patch, Playback, Poses, Sprites, Transition};
use crate::progress::Progress;

/// Larger multiples of the natural step, tried while the component holds too little.
const KAPPA_LADDER: [f64; 3] = [2.5, 3.0, 4.0];
/// A component that lasts shorter than this is too little.
const LEAST_COMPONENT_S: f64 = 2.0;
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
    /// Pairs i < j of clips whose sprites are all present with D < epsilon, before any other test.
    pub n_candidates: u64,
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
    let clip_frames = params.clip_frames_at(poses.fps);
    let pixels = ComparedSprites::new(sprites, poses, params.planes);
    let clips = Clips::new(sprites, poses, clip_frames);
    let natural_step = natural_step(&pixels, &clips);
    let rungs = rungs(params, natural_step);
    let search = Search {
        distances: Distances {
            pixels: &pixels,
            clip_frames,
            side: Side::Plain,
            cpu,
        },
        clips: &clips,
        gate: Gate::new(poses, clip_frames, params),
        least_gap: clip_frames.max((LEAST_GAP_S * poses.fps).ceil() as usize),
    };
    let found = search
        .run(&rungs, params.mirror, progress)
        .map_err(|Cancelled| Error::Cancelled)?;
    Ok(choose(found, &rungs, &clips, natural_step, poses.fps))
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
}

/// How much the animal changes from one frame to the next.
fn natural_step(pixels: &ComparedSprites, clips: &Clips) -> u64 {
    let steps: Vec<u64> = (1..pixels.n_frames())
        .map(|frame_idx| pixels.sad(frame_idx - 1, frame_idx))
        .collect();
    let mut of_clips: Vec<u64> = steps
        .windows(clips.clip_frames)
        .zip(clips.all_present.windows(2))
        .filter(|(_, present)| present[0] && present[1])
        .map(|(steps, _)| steps.iter().sum())
        .collect();
    if of_clips.is_empty() {
        return 0;
    }
    let middle = (of_clips.len() - 1) / 2;
    *of_clips.select_nth_unstable(middle).1
}

/// An epsilon to try, and the kappa that it comes from.
struct Rung {
    kappa: Option<f64>,
    epsilon: u64,
}

fn rungs(params: &Params, natural_step: u64) -> Vec<Rung> {
    if let Some(epsilon) = params.epsilon {
        return vec![Rung {
            kappa: None,
            epsilon,
        }];
    }
    let larger = KAPPA_LADDER.into_iter().filter(|&k| k > params.kappa);
    std::iter::once(params.kappa)
        .chain(larger)
        .map(|kappa| Rung {
            kappa: Some(kappa),
            // D is whole: D < kappa * step is D < the next whole number.
            epsilon: (kappa * natural_step as f64).ceil() as u64,
        })
        .collect()
}

/// All that decides which pairs become transitions.
struct Search<'a> {
    distances: Distances<'a>,
    clips: &'a Clips,
    gate: Gate,
    least_gap: usize,
}

/// What a search found below the last rung's epsilon.
struct Found {
    transitions: Vec<Transition>,
    /// Raw pairs below each rung's epsilon.
    n_candidates: Vec<u64>,
}

impl Search<'_> {
    fn run(
        &self,
        rungs: &[Rung],
        mirror: bool,
        progress: &dyn Progress,
    ) -> Result<Found, Cancelled> {
        let mut found = Found {
            transitions: Vec::new(),
            n_candidates: vec![0; rungs.len()],
        };
        self.one_side(Side::Plain, rungs, progress, &mut found)?;
        if mirror {
            self.one_side(Side::Mirrored, rungs, progress, &mut found)?;
        }
        let key = |t: &Transition| (t.from, t.to, t.mirrored);
        found.transitions.sort_unstable_by_key(key);
        Ok(found)
    }

    fn one_side(
        &self,
        side: Side,
        rungs: &[Rung],
        progress: &dyn Progress,
        found: &mut Found,
    ) -> Result<(), Cancelled> {
        let limit = rungs.iter().map(|rung| rung.epsilon).max().unwrap_or(0);
        let mut minima = LocalMinima::new(&self.clips.usable, limit);
        let distances = Distances {
            side,
            ..self.distances
        };
        let Found {
            transitions,
            n_candidates,
        } = found;
        distances.for_each_row(progress, |i, row| {
            if side == Side::Plain && self.clips.all_present[i] {
                self.count(i, row, limit, rungs, n_candidates);
            }
            minima.push(row, |pair| transitions.extend(self.transition(pair, side)));
        })?;
        minima.finish(|pair| transitions.extend(self.transition(pair, side)));
        Ok(())
    }

    fn count(&self, i: usize, row: &[u64], limit: u64, rungs: &[Rung], n_candidates: &mut [u64]) {
        let others = row.iter().zip(&self.clips.all_present[i..]).skip(1);
        for (&distance, _) in others.filter(|(d, present)| **d < limit && **present) {
            for (n, rung) in n_candidates.iter_mut().zip(rungs) {
                *n += u64::from(distance < rung.epsilon);
            }
        }
    }

    fn transition(&self, pair: ClipPair, side: Side) -> Option<Transition> {
        let mirrored = side == Side::Mirrored;
        if !mirrored && pair.to - pair.from < self.least_gap {
            return None;
        }
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

/// The first rung whose component lasts long enough, else the last.
fn choose(found: Found, rungs: &[Rung], clips: &Clips, natural_step: u64, fps: f64) -> Connections {
    let n_frames = clips.shown.len();
    let mut chosen = None;
    for (rung, &n_candidates) in rungs.iter().zip(&found.n_candidates) {
        let alike = found.transitions.iter();
        let transitions: Vec<Transition> = alike
            .filter(|t| t.distance < rung.epsilon)
            .copied()
            .collect();
        let playback = playback::playback(&transitions, &clips.shown, clips.clip_frames);
        let long_enough = playback.component.len() as f64 >= LEAST_COMPONENT_S * fps;
        chosen = Some(Connections {
            clip_frames: clips.clip_frames,
            epsilon: rung.epsilon,
            natural_step,
            kappa_used: rung.kappa,
            n_candidates,
            component_share: playback.component.len() as f64 / n_frames.max(1) as f64,
            patches: playback::patches(&playback),
            transitions,
            playback,
        });
        if long_enough {
            break;
        }
    }
    chosen.expect("there is always a first rung")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::angle::mirrored_rad;
    use crate::library::{Pose, View};
    use crate::progress::Silent;
    use libm::{cos, sin};

    const FPS: f64 = 10.0;

    /// What the animal does in a frame: a phase of its stroke in 0..1, and its heading.
    type Moment = (f64, f64);

    /// A bright dot that circles about the middle of a 16 x 16 sprite by the phase of the stroke,
    /// left-right mirrored where the animal heads left. `None` where it was not found.
    fn film(moments: &[Option<Moment>]) -> (Sprites, Poses) {
        let mut sprites = Sprites::missing(16, 16, moments.len());
        for (frame_idx, moment) in moments.iter().enumerate() {
            let &Some((phase, heading_rad)) = moment else {
                continue;
            };
            let turn = std::f64::consts::TAU * phase;
            let side = cos(heading_rad).signum();
            let (dot_x, dot_y) = (side * 5.0 * cos(turn), 3.0 * sin(turn));
            let pixels = sprites.fill(frame_idx).as_chunks_mut::<4>().0;
            for (k, pixel) in pixels.iter_mut().enumerate() {
                let (x, y) = ((k % 16) as f64 - 7.5 - dot_x, (k / 16) as f64 - 7.5 - dot_y);
                let light = 250.0 * libm::exp(-(x * x + y * y) / 8.0);
                *pixel = [light as u8, light as u8, 20, 255];
            }
        }
        let pose = |moment: &Option<Moment>| Pose {
            heading_rad: moment.map(|(_, heading_rad)| heading_rad),
            ..Pose::default()
        };
        let poses = Poses {
            fps: FPS,
            image_size_px: [320, 240],
            view: View::Side,
            camera: None,
            animal: None,
            frames: moments.iter().map(pose).collect(),
        };
        (sprites, poses)
    }

    /// Strokes of 20 frames, all alike, at one heading.
    fn strokes(n_frames: usize, heading_rad: f64) -> Vec<Option<Moment>> {
        let phase = |k: usize| (k % 20) as f64 / 20.0;
        (0..n_frames)
            .map(|k| Some((phase(k), heading_rad)))
            .collect()
    }

    fn params() -> Params {
        Params {
            clip_frames: Some(4),
            ..Params::default()
        }
    }

    fn connections(moments: &[Option<Moment>], params: &Params) -> Connections {
        let (sprites, poses) = film(moments);
        connect(&sprites, &poses, params, Level::detect(), &Silent).expect("nobody cancels")
    }

    #[test]
    fn an_animal_that_repeats_its_stroke_may_jump_by_whole_strokes() {
        let found = connections(&strokes(61, 0.0), &params());
        assert!(found.natural_step > 0);
        assert_eq!(found.epsilon, 2 * found.natural_step);
        assert_eq!(found.kappa_used, Some(2.0));
        let plain = found.transitions.iter().filter(|t| !t.mirrored);
        let gaps: Vec<u32> = plain.map(|t| t.to - t.from).collect();
        assert!(
            !gaps.is_empty() && gaps.iter().all(|gap| gap % 20 == 0),
            "{gaps:?}"
        );
        assert!(found.component_share > 0.5, "{}", found.component_share);
        assert!(!found.patches.is_empty());
    }

    #[test]
    fn candidates_are_counted_before_any_other_test() {
        let still = vec![Some((0.0, 0.0)); 8];
        let params = Params {
            epsilon: Some(1),
            ..params()
        };
        let found = connections(&still, &params);
        // Five clips, all equal: ten pairs. They lie too near each other for a transition.
        assert_eq!((found.n_candidates, found.kappa_used), (10, None));
        assert!(
            found.transitions.iter().all(|t| t.mirrored),
            "{:?}",
            found.transitions
        );
    }

    #[test]
    fn epsilon_is_strict() {
        let with = |epsilon| {
            let params = Params {
                epsilon: Some(epsilon),
                mirror: false,
                ..params()
            };
            connections(&strokes(61, 0.0), &params).n_candidates
        };
        assert_eq!(with(0), 0);
        assert_ne!(with(1), 0);
    }

    #[test]
    fn clips_that_point_elsewhere_are_not_joined() {
        let mut moments = strokes(40, 0.0);
        moments.extend(strokes(40, 0.5));
        let found = connections(&moments, &params());
        assert!(!found.transitions.is_empty());
        for t in found.transitions.iter().filter(|t| !t.mirrored) {
            assert!(t.to <= 36 || t.from >= 37, "{t:?} joins two headings");
            assert!(t.heading_gap_rad < 15f64.to_radians());
        }
    }

    #[test]
    fn an_animal_that_swims_back_is_joined_to_its_mirror_image() {
        let mut moments = strokes(40, 0.2);
        moments.extend(strokes(40, mirrored_rad(0.2)));
        let found = connections(&moments, &params());
        let across = |t: &&Transition| t.mirrored && t.from <= 36 && t.to >= 40;
        let joined: Vec<_> = found.transitions.iter().filter(across).collect();
        assert!(
            joined
                .iter()
                .any(|t| t.distance == 0 && t.to - t.from == 40)
        );
        let papers = Params {
            mirror: false,
            ..params()
        };
        let plain = connections(&moments, &papers);
        assert!(plain.transitions.iter().all(|t| !t.mirrored));
    }

    #[test]
    fn no_clip_with_a_missing_cut_or_headless_frame_is_joined() {
        let (mut sprites, mut poses) = film(&strokes(100, 0.0));
        poses.frames[50].cut = true;
        poses.frames[70].heading_rad = None;
        let mut missing = strokes(100, 0.0);
        missing[25] = None;
        sprites = {
            let (with_gap, _) = film(&missing);
            assert!(!with_gap.is_present(25) && sprites.is_present(25));
            with_gap
        };
        let found = connect(&sprites, &poses, &params(), Level::Scalar, &Silent);
        let found = found.expect("nobody cancels");
        assert!(!found.transitions.is_empty());
        for t in &found.transitions {
            for clip in [t.from..t.from + 4, t.to..t.to + 4] {
                assert!([25, 50, 70].iter().all(|bad| !clip.contains(bad)), "{t:?}");
            }
        }
        assert!(
            [25, 50, 70]
                .iter()
                .all(|bad| !found.playback.component.contains(bad))
        );
    }

    #[test]
    fn epsilon_grows_while_the_component_is_short() {
        // Never the same twice: one stroke that takes longer than the footage.
        let moments: Vec<_> = (0..60).map(|k| Some((f64::from(k) / 70.0, 0.0))).collect();
        let found = connections(&moments, &params());
        assert_eq!(found.kappa_used, Some(4.0));
        assert_eq!(found.epsilon, 4 * found.natural_step);
        assert!(found.playback.component.len() < 20);
    }

    #[test]
    fn footage_shorter_than_a_clip_has_no_transitions() {
        let found = connections(&strokes(3, 0.0), &params());
        assert_eq!((found.natural_step, found.n_candidates), (0, 0));
        assert_eq!(found.playback, Playback::default());
    }

    #[test]
    fn every_level_finds_the_same_connections() {
        let (sprites, poses) = film(&strokes(70, 0.1));
        let at = |cpu| connect(&sprites, &poses, &params(), cpu, &Silent).expect("nobody cancels");
        let scalar = at(Level::Scalar);
        for cpu in Level::available() {
            assert_eq!(at(cpu), scalar, "{cpu:?}");
        }
    }
}
